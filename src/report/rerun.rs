//! The commands that run a cell again by itself, for a shell in the report's folder.

use super::{Material, data_file, detections_file};
use crate::settings::Section;
use crate::sweep::Cell;

/// All worlds and chains of the cell, with the identities that they have in the sweep.
pub(super) fn cell_alone(material: Material<'_>, cell: &Cell) -> String {
    let data = if material.sweep.is_simulated() {
        String::new()
    } else {
        format!(" --data {}", data_file(0))
    };
    format!(
        "ptm sweep sweep.toml{data} --cell {id} --out {id}-again",
        id = cell.id
    )
}

/// The cell's first world.
pub(super) fn first_world(material: Material<'_>, cell: usize) -> Option<String> {
    let data = detections_file(material, cell)?;
    let cell = &material.sweep.cells[cell];
    let mut command = format!("ptm sample {data}");
    for (key, value) in cell.settings.iter() {
        let is_flag = matches!(
            key.section,
            Section::Model | Section::Sampler | Section::Run
        ) && !matches!(key.name, "exact_up_to" | "reference");
        if is_flag && *value != (key.default)() {
            command.push_str(&format!(
                " --{} {}",
                key.flag(),
                shell_word(&value.to_string())
            ));
        }
    }
    Some(command)
}

fn shell_word(text: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "-_.,:=/".contains(c);
    if !text.is_empty() && text.chars().all(plain) {
        text.to_owned()
    } else {
        format!("'{}'", text.replace('\'', "'\\''"))
    }
}
