//! What `ptm import` says of detections: scales, errors, alignment.

use crate::detections::Detections;
use crate::diagnostics::consistency::{Nees, differences_between_visits, errors_against, nees};
use crate::evidence::Alignment;
use crate::import::Recording;
use crate::tune::scales::Scales;

/// What alignment found.
pub(super) fn print_alignment(found: &Alignment) {
    outln!(
        "aligned: moved by {:.2} m (root mean square); drift known to {:.2} m per axis, before to {:.2} m; own errors {:.2} \
         times what is stated",
        found.moved_m,
        found.drift_left_m,
        found.drift_before_m,
        found.noise_factor
    );
    outln!(
        "aligned: {} landmarks; Rand index {:.2} with the truth is expected of them",
        found.n_sets,
        found.expected_rand_index
    );
    for doubt in &found.doubts {
        outln!("DOUBT: {doubt}");
    }
}

/// Distances to compare with each other.
pub(super) fn print_scales(scales: &Scales) {
    let metres = |value: Option<f64>| value.map_or_else(|| "–".to_owned(), |m| format!("{m:.2} m"));
    outln!(
        "scales: nearest other {}, stated precision {}, extent {:.1} m",
        metres(scales.nearest_m),
        metres(scales.precision_m),
        scales.extent_m
    );
}

/// How honest the covariances are, as far as the recording can tell.
pub(super) fn print_errors(recording: &Recording, detections: &Detections) {
    let places_m = recording.stops.first().and_then(|first| {
        let truth = recording.truth.as_ref()?;
        truth.landmarks_in_frame_m(first.time_s, recording.start)
    });
    let errors = places_m.and_then(|places_m| nees(&errors_against(detections, &places_m)));
    outln!(
        "against true places: {}",
        nees_words(
            errors,
            detections.len(),
            "unknown, the recording has none at its start"
        )
    );
    let differences = nees(&differences_between_visits(detections));
    outln!(
        "between visits of one landmark: {}",
        nees_words(
            differences,
            detections.len(),
            "unknown, no landmark was detected twice"
        )
    );
}

/// NEES beside what it would be if covariances are honest.
pub(super) fn nees_words(errors: Option<Nees>, n_detections: usize, none: &str) -> String {
    match errors {
        None => none.to_owned(),
        Some(nees) => format!(
            "NEES mean {:.2} (honest: 2), median {:.2} (1.39), {:.0} % within 95 %; error {:.2} m; \
             {} of {n_detections} detections",
            nees.mean,
            nees.median,
            100.0 * nees.within_95,
            nees.rms_m,
            nees.n
        ),
    }
}
