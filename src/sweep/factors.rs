//! The factors of a design as a sweep file writes them: lists of levels, or ranges.

use super::error::SweepError;
use super::space::{Axis, Spread};
use super::values::Source;
use crate::settings::{Key, Kind, Value};

const SECTION: &str = "design.factors";

fn error(path: &str, what: String) -> SweepError {
    SweepError::Design {
        path: path.to_owned(),
        what,
    }
}

/// A list of levels, each named once.
pub(super) fn levels(
    key: &'static Key,
    given: &toml::Value,
    source: &Source<'_>,
) -> Result<Vec<Value>, SweepError> {
    let (name, path) = (key.name, source.path);
    let Some(levels) = given.as_array() else {
        let got = match given {
            toml::Value::Table(_) => "a range".to_owned(),
            other => format!("{} {other}", other.type_str()),
        };
        return Err(error(
            path,
            format!(
                "{name}: got {got}, expected a list of levels, as in [1, 2]; only sampled designs take ranges"
            ),
        ));
    };
    if levels.is_empty() {
        return Err(error(
            path,
            format!("{name}: got no level, expected a list of at least one"),
        ));
    }
    let mut checked = Vec::new();
    for (index, level) in levels.iter().enumerate() {
        let place = format!("{SECTION}.{name}.{index}");
        let value = source.checked(key, level, SECTION, &place)?;
        if checked.contains(&value) {
            return Err(error(
                path,
                format!("{name}: got the level {value} twice; name each once"),
            ));
        }
        checked.push(value);
    }
    Ok(checked)
}

/// A factor of a sampled design: levels, or `{ low, high, scale }`.
pub(super) fn axis(
    key: &'static Key,
    given: &toml::Value,
    source: &Source<'_>,
) -> Result<Axis, SweepError> {
    let (name, path) = (key.name, source.path);
    let Some(range) = given.as_table() else {
        let mut levels = levels(key, given, source)?;
        levels.sort_by(Value::compare);
        return Ok(Axis {
            key,
            spread: Spread::Levels(levels),
        });
    };
    if let Kind::Text(_) = key.kind {
        return Err(error(
            path,
            format!("{name}: got a range, expected a list of levels: it is no number"),
        ));
    }
    if let Some(other) = range
        .keys()
        .find(|k| !["low", "high", "scale"].contains(&k.as_str()))
    {
        return Err(error(
            path,
            format!("{name}: got {other:?} in a range, expected low, high and perhaps scale"),
        ));
    }
    let end = |which: &str| {
        let Some(value) = range.get(which) else {
            return Err(error(
                path,
                format!("{name}: a range needs {which}, as in {{ low = 1, high = 10 }}"),
            ));
        };
        let place = format!("{SECTION}.{name}.{which}");
        let written = source.number(value, &place);
        match source.checked(key, value, SECTION, &place)? {
            Value::Count(count) => Ok((count as f64, written)),
            Value::Number(number) => Ok((number, written)),
            Value::Text(text) => Err(error(
                path,
                format!("{name}: got {text:?}, expected a number"),
            )),
        }
    };
    let ((low, low_written), (high, high_written)) = (end("low")?, end("high")?);
    if low >= high {
        return Err(error(
            path,
            format!(
                "{name}: got low {low_written} and high {high_written}, expected low below high"
            ),
        ));
    }
    let log = match range.get("scale").map(|scale| scale.as_str()) {
        None | Some(Some("linear")) => false,
        Some(Some("log")) if low > 0.0 => true,
        Some(Some("log")) => {
            return Err(error(
                path,
                format!(
                    "{name}: got low {low_written} on a log scale, expected more than 0; raise it, or use scale = \"linear\""
                ),
            ));
        }
        Some(_) => {
            return Err(error(
                path,
                format!(
                    "{name}: got scale {}, expected \"linear\" or \"log\"",
                    range["scale"]
                ),
            ));
        }
    };
    Ok(Axis {
        key,
        spread: Spread::Range { low, high, log },
    })
}
