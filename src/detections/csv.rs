//! The detections CSV.
