//! Draws in JSON.

use serde_json::Value;

use super::Collector;
use crate::input::{InputError, Source};
use crate::partition::Topology;

/// More bytes of JSON than this are a gigabyte once they are read.
const MAX_BYTES: usize = 64 << 20;

const EXPECTED: &str = "labels as an array chain × draw × item";

pub(super) fn read(source: Source<'_>, collector: &mut Collector) -> Result<(), InputError> {
    let place = source.place(None);
    let refuse = |got: String, expected: &str, change: &str| -> InputError {
        crate::input::Content {
            place: place.clone(),
            got,
            expected: expected.to_owned(),
            change: change.to_owned(),
        }
        .into()
    };
    let text = source.read_lossy()?;
    if text.len() > MAX_BYTES {
        let got = format!("{} MiB of JSON", text.len() >> 20);
        return Err(refuse(got, "at most 64 MiB", "write it as CSV or Parquet"));
    }
    let whole: Value = serde_json::from_str(&text)
        .map_err(|error| refuse(format!("no JSON ({error})"), EXPECTED, "correct the file"))?;
    let named = |value: &Value| value.get("labels").cloned();
    let labels = match &whole {
        Value::Object(keys) => named(&whole).or_else(|| named(keys.get("posterior")?)),
        _ => Some(whole),
    };
    let Some(labels) = labels.filter(|labels| depth(labels) > 1) else {
        let got = "JSON without such an array".to_owned();
        let change = "write it as labels, or give the Parquet of ptm sample --trace";
        return Err(refuse(got, EXPECTED, change));
    };
    let chains = if depth(&labels) == 2 {
        vec![labels]
    } else {
        match labels {
            Value::Array(chains) => chains,
            _ => Vec::new(),
        }
    };
    let is_one = chains.len() == 1;
    for (number, chain) in chains.iter().enumerate() {
        let name = if is_one {
            String::new()
        } else {
            (number + 1).to_string()
        };
        let draws = chain.as_array().map_or(&[][..], Vec::as_slice);
        for (place, draw) in draws.iter().enumerate() {
            let place = format!("draw {} of chain {}", place + 1, number + 1);
            let Some(topology) = topology(draw) else {
                let got = format!("{place} that is no list of numbers or names");
                return Err(refuse(got, "one label for each item", "correct the draw"));
            };
            collector.push(&name, &topology, (1, 0.0)).map_err(|own| {
                refuse(
                    format!("{place} with {}", own.got),
                    &own.expected,
                    own.change,
                )
            })?;
        }
    }
    Ok(())
}

/// Arrays in arrays.
fn depth(value: &Value) -> usize {
    match value {
        Value::Array(items) => 1 + items.first().map_or(0, depth),
        _ => 0,
    }
}

fn topology(draw: &Value) -> Option<Topology> {
    let label = |value: &Value| match value {
        Value::Number(number) => {
            let text = number.to_string();
            Some(text.strip_suffix(".0").map_or(text.clone(), str::to_owned))
        }
        Value::String(text) => Some(text.clone()),
        _ => None,
    };
    let labels: Option<Vec<String>> = draw.as_array()?.iter().map(label).collect();
    let labels = labels?;
    let labels: Vec<&str> = labels.iter().map(String::as_str).collect();
    Some(Topology::canonical(&labels))
}
