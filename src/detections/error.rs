//! What can be wrong with a detections file.
