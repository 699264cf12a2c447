//! The posterior on detections of known truth, beside plain clusterings.

use super::sample::pooled;
use super::{JobError, Watch};
use crate::dataset::DataSet;
use crate::results::evaluation::{Evaluated, evaluate as score};
use crate::run::ExactTables;
use crate::settings::{Settings, Value};
use crate::tune::rule::ModelKind;
use crate::tune::{Request, tune};

/// Samples one data set and scores what was found against its truth; with `tunes`, σ_o, σ_t, radius
/// and height are those that its likelihood recommends, and not those of the settings. `None` if
/// the watch stopped it.
///
/// # Errors
/// As [`sample`](super::sample); data that cannot be tuned on, or of which no truth is known.
pub fn evaluate(
    name: &str,
    data: &DataSet,
    mut settings: Settings,
    tunes: bool,
    watch: &Watch<'_>,
) -> Result<Option<Evaluated>, JobError> {
    settings.check_together()?;
    if tunes {
        let request = Request {
            model: match settings.text("model") {
                "covariance" => ModelKind::Covariance,
                _ => ModelKind::Metric,
            },
            sensor_noise_m: None,
            simulate: false,
            seed: settings.count("seed"),
        };
        let found = tune(&data.detections, &request);
        let found = found.map_err(|error| JobError::Refused(format!("{name}: {error}")))?;
        for (name, value) in found.settings.named() {
            settings.set(name, &Value::Number(value))?;
        }
    }
    let settings = settings.naming_sampler(data.detections.len());
    let Some(sampled) = pooled(data, settings, &ExactTables::new(), watch)? else {
        return Ok(None);
    };
    let scored = score(name, data, &sampled.result).ok_or_else(|| {
        JobError::Refused(format!(
            "{name}: got no detection of known landmark, expected some; add the column landmark, \
             or use ptm sample"
        ))
    })?;
    Ok(Some(scored))
}
