//! The JSON Schema of a sweep file, made from the table of settings: what an editor needs to
//! complete keys, show their help and mark a slip while it is typed.
//!
//! It says of each value what can be said of it alone. What a reader of the file checks besides,
//! such as settings that do not go together, is left to `ptm plan`.

use serde_json::{Map, Value as Json, json};

use super::sampled::Sampling;
use crate::settings::{KEYS, Key, Kind, Section, Value};

/// The schema (draft 2020-12).
pub fn schema() -> Json {
    let mut properties = Map::new();
    let text = |words: &str| json!({ "type": "string", "description": words });
    properties.insert(
        "title".into(),
        text("One line that says what the sweep asks."),
    );
    properties.insert("description".into(), text("A paragraph for the report."));
    let needs = "Where to get the detections that the sweep is for; it then runs with --data only.";
    properties.insert("needs_data".into(), text(needs));
    let cells = "Ids of the cells that are run; all of them if there is none.";
    let only = json!({ "type": "array", "items": { "type": "string" }, "description": cells });
    properties.insert("only_cells".into(), only);
    for section in Section::ALL {
        let keys = KEYS.iter().filter(|key| key.section == section);
        let of_section = table(keys.map(|key| (key.name, described(key))));
        properties.insert(section.name().into(), of_section);
    }
    properties.insert("design".into(), design());
    json!({
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "A sweep file of ptm",
        "type": "object",
        "properties": properties,
        "required": ["design"],
        "additionalProperties": false,
    })
}

/// A table with these keys and no others.
fn table(keys: impl Iterator<Item = (&'static str, Json)>) -> Json {
    let properties: Map<String, Json> = keys.map(|(name, own)| (name.to_owned(), own)).collect();
    json!({ "type": "object", "properties": properties, "additionalProperties": false })
}

/// What one value may be.
fn value(key: &Key) -> Json {
    match key.kind {
        Kind::Positive => json!({ "type": "number", "exclusiveMinimum": 0 }),
        Kind::NonNegative => json!({ "type": "number", "minimum": 0 }),
        Kind::OpenUnit => json!({ "type": "number", "exclusiveMinimum": 0, "exclusiveMaximum": 1 }),
        Kind::Rate => json!({ "type": "number", "minimum": 0, "exclusiveMaximum": 1 }),
        // 1e4 is a float of TOML, and whole.
        Kind::Count(least) => json!({ "type": "number", "multipleOf": 1, "minimum": least }),
        Kind::CountUpTo(least, most) => {
            json!({ "type": "number", "multipleOf": 1, "minimum": least, "maximum": most })
        }
        // As in burn_in = 1000.
        Kind::Text(_) => json!({ "type": ["string", "number"] }),
    }
}

/// The same with the help and the default of its key.
fn described(key: &Key) -> Json {
    let mut own = value(key);
    let unit = if key.unit.is_empty() {
        String::new()
    } else {
        format!(", {}", key.unit)
    };
    own["description"] = format!("{}{unit}", key.help).into();
    own["default"] = match (key.default)() {
        Value::Count(count) => count.into(),
        Value::Number(number) => number.into(),
        Value::Text(text) => text.into(),
    };
    own
}

fn design() -> Json {
    let factors = || KEYS.iter().filter(|key| key.is_factor);
    let levels = |key: &Key| {
        let list = json!({ "type": "array", "items": value(key), "minItems": 1 });
        let number = || json!({ "type": "number" });
        let range = json!({
            "type": "object",
            "properties": { "low": number(), "high": number(), "scale": { "type": "string" } },
            "required": ["low", "high"],
            "additionalProperties": false,
        });
        json!({ "anyOf": [list, range], "description": key.help })
    };
    let words = ["label", "variant", "note"].map(|name| (name, json!({ "type": "string" })));
    let overrides = factors().map(|key| (key.name, described(key)));
    let cell = table(words.into_iter().chain(overrides));
    let sampled = Sampling::ALL.map(Sampling::name);
    let kinds: Vec<&str> = ["grid", "one-at-a-time", "list"]
        .into_iter()
        .chain(sampled)
        .collect();
    let amount = |words: &str| json!({ "type": "integer", "minimum": 2, "description": words });
    json!({
        "type": "object",
        "properties": {
            "kind": { "enum": kinds, "description": "How cells are laid out." },
            "points": amount("Points of a sampled design."),
            "trajectories": amount("Trajectories of a Morris design."),
            "factors": table(factors().map(|key| (key.name, levels(key)))),
            "cells": { "type": "array", "items": cell },
        },
        "required": ["kind"],
        "additionalProperties": false,
    })
}
