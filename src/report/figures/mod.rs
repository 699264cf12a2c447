//! From results to figures: which numbers go where.

mod agreement;
mod all_cells;
mod effects;
mod faults;
mod labels;
mod leading;
mod maps;
mod mission;
mod multiples;
mod reliability;
mod rows;
mod sensitivity;
mod timing;
mod traces;
mod worlds;

pub use labels::labels_figure;
pub use maps::map_figure;
pub(super) use mission::DOUBTFUL;
pub use mission::mission_figure;
pub use reliability::reliability_figure;
pub use rows::sample_figure;
pub use worlds::simulation_figure;

pub(super) use agreement::chains;
pub(super) use all_cells::run_status;
pub(super) use effects::{effect, effects, pair_recovery};
pub(super) use faults::faults;
pub(super) use leading::{indices_alone, main_curves, main_effects, screening_plane};
pub(super) use multiples::interactions;
pub(super) use rows::{cell, cell_map, side_by_side};
pub(super) use sensitivity::{curves, indices};
pub(super) use timing::{ess_against_cost, ess_by_level};
pub(super) use traces::by_init as traces_by_init;
pub(super) use worlds::worlds;

use super::{Figure, Material, words};
use crate::figure::style::{Colour, STATUS};
use crate::results::CellVerdict;
use crate::sweep::Factor;

/// What every cell did, in the order in which it is read.
pub(super) fn every_cell(material: Material<'_>) -> Vec<Figure> {
    let recovery = all_cells::all_cells(material, "recovery", "Recovery rate", |cell| {
        cell.recovery.map(|r| r.rate)
    });
    let acceptance = all_cells::all_cells(material, "acceptance", "Acceptance rate", |cell| {
        cell.acceptance_rate
    });
    [
        multiples::recovery(material),
        multiples::nested_loop(material),
        recovery,
        acceptance,
    ]
    .into_iter()
    .flatten()
    .collect()
}

/// The colour that a verdict has in figures and pages.
pub(super) fn verdict_colour(verdict: impl Into<CellVerdict>) -> Colour {
    STATUS[verdict.into().place()]
}

/// The levels of a factor as figures write them; [`level_key`] says what letters stand for.
fn level_names(factor: &Factor) -> Vec<String> {
    short_labels(factor.levels.iter().map(words::level).collect())
}

/// Labels of more characters, as those of mixes of moves, would be cut in most figures.
const LONGEST_LABEL: usize = 24;

/// The labels, or a letter for each if one of them is too long to be read under a point.
fn short_labels(labels: Vec<String>) -> Vec<String> {
    if labels
        .iter()
        .all(|label| label.chars().count() <= LONGEST_LABEL)
    {
        return labels;
    }
    (0..labels.len()).map(letter).collect()
}

/// A to Z, then A2 to Z2, and so on.
fn letter(place: usize) -> String {
    let (letter, round) = (char::from(b'A' + (place % 26) as u8), place / 26 + 1);
    if round == 1 {
        letter.to_string()
    } else {
        format!("{letter}{round}")
    }
}

/// For a caption: what the letters of these factors stand for; nothing where levels are written out.
fn level_key<'a>(factors: impl IntoIterator<Item = &'a Factor>) -> String {
    let of = |factor: &Factor| {
        let full: Vec<String> = factor.levels.iter().map(words::level).collect();
        label_key(factor.key.label(), &full)
    };
    factors.into_iter().map(of).collect()
}

/// As [`level_key`], of the labels of one factor.
fn label_key(name: &str, labels: &[String]) -> String {
    let short = short_labels(labels.to_vec());
    if short == labels {
        return String::new();
    }
    let pairs = short.iter().zip(labels);
    let pairs: Vec<String> = pairs
        .map(|(short, full)| format!("{short} = {full}"))
        .collect();
    format!(" {name}: {}.", pairs.join("; "))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::settings::{KEYS, Value};

    fn factor(name: &str, levels: &[&str]) -> Factor {
        let key = KEYS.iter().find(|key| key.name == name).expect("a key");
        let levels = levels.iter().map(|level| Value::Text((*level).to_owned()));
        Factor {
            key,
            levels: levels.collect(),
        }
    }

    #[test]
    fn long_levels_are_letters_with_a_key() {
        let long = "split-merge=0.1,reassign=0.4,anchors=0.4,refresh=0.1";
        let moves = factor("moves", &["anchors=0.9,refresh=0.1", long]);
        assert_eq!(level_names(&moves), ["A", "B"]);
        let init = factor("init", &["singletons", "one-cluster"]);
        assert_eq!(level_names(&init), ["singletons", "one-cluster"]);
        assert_eq!(
            level_key([&init, &moves]),
            format!(" moves: A = anchors=0.9,refresh=0.1; B = {long}.")
        );
        assert_eq!(level_key([&init]), "");
        assert_eq!([0, 25, 26, 53].map(letter), ["A", "Z", "A2", "B3"]);
    }
}
