//! Properties that hold for any draws and any partitions.
