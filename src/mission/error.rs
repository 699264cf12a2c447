//! Why a mission cannot be solved.

use thiserror::Error;

/// What is wrong with a recording.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum MissionError {
    /// No sighting at all.
    #[error(
        "no sighting of a landmark is left, expected at least one; widen --from, --until or \
         --max-range"
    )]
    NothingSeen,
    /// Odometry whose covariance is not positive definite.
    #[error(
        "stop {stop}: the error of the odometry is not positive definite; correct the recording"
    )]
    Odometry {
        /// The number of the stop, from 0.
        stop: usize,
    },
    /// A sighting whose covariance is not positive definite.
    #[error("pose {pose}: the error of a sighting is not positive definite; correct the recording")]
    Sighting {
        /// The number of the pose, from 0.
        pose: usize,
    },
    /// Poses that could not be optimised.
    #[error(
        "the poses cannot be optimised, as the information of odometry and sightings is singular \
         in double precision; check the units of both and their noise"
    )]
    Diverged,
}
