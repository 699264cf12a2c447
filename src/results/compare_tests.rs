//! Comparisons of tables made up so that the answer is known.

use super::*;
use crate::rng::Purpose;
use rand::RngExt;
use rand_distr::{Distribution, StandardNormal};

/// Cells that differ in `sigma_o`; `chain` gives (recovered, acceptance) by cell, world and chain.
fn tables(
    n_cells: usize,
    n_worlds: u64,
    n_chains: u64,
    mut chain: impl FnMut(usize, u64) -> (bool, f64),
) -> SweepTables {
    let cells = (0..n_cells).map(|cell| {
        let worlds = (1..=n_worlds).map(|number| {
            let chains = (1..=n_chains).map(|own| {
                let (recovered, acceptance) = chain(cell, number);
                ChainRow {
                    chain: own,
                    recovered: Some(recovered),
                    acceptance: Some(acceptance),
                    n_sets: Some(8.0),
                }
            });
            let world = ObservedWorld {
                data: format!("x,y\n{number},0\n"),
                chains: chains.collect(),
                ess: Some(100.0),
                ..ObservedWorld::default()
            };
            (number, world)
        });
        let settings = [
            ("sigma_o", cell.to_string()),
            ("estimator", "fresh".to_owned()),
        ];
        ObservedCell {
            id: format!("c{:03}", cell + 1),
            settings: settings
                .map(|(name, value)| (name.to_owned(), value))
                .into(),
            worlds: worlds.collect(),
        }
    });
    SweepTables {
        cells: cells.collect(),
    }
}

#[test]
fn a_sweep_does_not_differ_from_itself() {
    let own = tables(3, 4, 2, |cell, world| (cell == 1, 0.1 * world as f64));
    let found = compare(&own, &own, 0.05).expect("compatible");
    assert!(!found.differs && found.settings_that_differ.is_empty());
    assert_eq!(
        (found.n_identical, found.n_worlds, found.units),
        (3, 4, "worlds")
    );
    assert!(
        found
            .overall
            .iter()
            .all(|row| row.difference == 0.0 && row.p_value == Some(1.0))
    );
}

/// Only one cell of twenty changes: all of its ten chains lose the truth.
#[test]
fn a_cell_that_changes_is_found_and_named() {
    let a = tables(20, 5, 2, |_, world| (true, 0.1 * world as f64));
    let mut b = tables(20, 5, 2, |cell, world| (cell != 7, 0.1 * world as f64));
    for cell in &mut b.cells {
        cell.settings
            .insert("estimator".to_owned(), "common".to_owned());
    }
    let found = compare(&a, &b, 0.05).expect("compatible");
    assert!(found.differs);
    let names: Vec<(&str, Measure)> = (found.cells.iter())
        .flat_map(|cell| {
            cell.differences
                .iter()
                .map(move |row| (cell.a.as_str(), row))
        })
        .filter(|(_, row)| row.found)
        .map(|(name, row)| (name, row.measure))
        .collect();
    assert_eq!(names, [("c008", Measure::Recovery)]);
    let own = &found.cells[7].differences[0];
    assert_eq!(
        (own.a, own.b, own.difference, own.test),
        (1.0, 0.0, -1.0, "exact test over chains within worlds")
    );
    // Five worlds agree: 0.05^(1/4) of all do at least, and the rest may differ by anything.
    let (low, high) = own.interval.expect("an interval");
    assert!(low == -1.0 && (high - 0.054_258).abs() < 1e-5, "{high}");
    // 2/6⁵ a cell, the smallest of 80 tests.
    assert!((own.p_adjusted.expect("a test") - 80.0 * 2.0 / 7776.0).abs() < 1e-12);
    assert_eq!(found.n_identical, 19);
    assert_eq!(found.settings_that_differ["estimator"], ["fresh", "common"]);
}

/// Half of the level is for the means over all cells: with Holm's p between half of it and all of
/// it nothing is found.
#[test]
fn the_level_is_shared_between_the_means_and_the_cells() {
    // Acceptance alone varies: its three other measures agree, with p = 1.
    let of = |shift: f64| {
        tables(1, 4, 1, move |_, world| {
            (true, 0.5 + shift * (1.0 + 0.3 * (world as f64 - 2.5)))
        })
    };
    let found = compare(&of(0.0), &of(0.1), 0.05).expect("compatible");
    let own = found
        .overall
        .iter()
        .find(|row| row.measure == Measure::Acceptance);
    let p = own.and_then(|row| row.p_adjusted).expect("a test");
    // Differences 0.055, 0.085, 0.115, 0.145: t = 0.1 / (0.03873 / 2) = 5.164 with 3 degrees of
    // freedom, p = 0.01409, times 4.
    assert!((p - 0.0563).abs() < 1e-3, "{p}");
    for (level, is_found) in [(1.9 * p, false), (2.1 * p, true)] {
        let found = compare(&of(0.0), &of(0.1), level).expect("compatible");
        let own = found
            .overall
            .iter()
            .find(|row| row.measure == Measure::Acceptance);
        assert_eq!(own.map(|row| row.found), Some(is_found), "{level}");
        // The one cell has the same p-values.
        assert_eq!(found.differs, is_found, "{level}");
    }
}

#[test]
fn what_is_not_the_same_is_refused_with_the_reason() {
    let a = tables(3, 2, 1, |_, _| (true, 0.5));
    let refusal = |b: &SweepTables| compare(&a, b, 0.05).err().map_or_else(String::new, |e| e.0);
    let mut apart = tables(1, 2, 1, |_, _| (true, 0.5));
    apart.cells[0]
        .settings
        .insert("sigma_o".to_owned(), "7".to_owned());
    assert_eq!(
        refusal(&apart),
        "got no cell in common among 3 of A (c001 is sigma_o 0) and 1 of B (c001 is sigma_o 7), \
         expected at least one; give both a cell of the same settings"
    );
    let mut moved = a.clone();
    if let Some(world) = moved.cells[1].worlds.get_mut(&2) {
        world.data.push('7');
    }
    assert!(
        refusal(&moved)
            .starts_with("cell c002 of A and c002 of B: got different detections on world 2")
    );
    let mut none = a.clone();
    none.cells[0].worlds.clear();
    assert!(refusal(&none).contains("no world in common"));
}

/// Of grids that overlap in part the common cells are compared, and the others counted; levels have
/// their own differences.
#[test]
fn grids_that_overlap_in_part_are_compared_where_they_do() {
    let a = tables(3, 4, 1, |cell, _| (cell != 1, 0.5));
    let b = tables(2, 4, 1, |_, _| (true, 0.5));
    let found = compare(&a, &b, 0.05).expect("compatible");
    assert_eq!((found.cells.len(), found.n_alone), (2, [1, 0]));
    let back = compare(&b, &a, 0.05).expect("compatible");
    assert_eq!((back.cells.len(), back.n_alone), (2, [0, 1]));
    let levels: Vec<(&str, f64)> = (found.by_level.iter())
        .map(|row| (row.level.as_str(), row.difference.difference))
        .collect();
    assert_eq!(levels, [("0", 0.0), ("1", 1.0)]);
    assert!(
        found
            .by_level
            .iter()
            .all(|row| row.setting == "sigma_o" && row.n_cells == 1)
    );
}

/// Cells keep their settings when others come or go in another order, and extra worlds are left out.
#[test]
fn cells_are_matched_by_their_settings() {
    let a = tables(3, 2, 1, |cell, _| (cell == 0, 0.1 * cell as f64));
    let mut b = tables(3, 4, 1, |cell, _| (cell == 0, 0.1 * cell as f64));
    b.cells.reverse();
    let found = compare(&a, &b, 0.05).expect("compatible");
    let names: Vec<_> = found
        .cells
        .iter()
        .map(|cell| (cell.a.as_str(), cell.b.as_str(), cell.identical))
        .collect();
    assert_eq!(
        names,
        [
            ("c001", "c001", true),
            ("c002", "c002", true),
            ("c003", "c003", true)
        ]
    );
    assert_eq!((found.n_worlds, found.n_chains), (2, [6, 12]));
}

#[test]
fn on_one_data_set_units_are_chain_numbers() {
    let noise = [0.01, -0.02, 0.0, 0.03, -0.01, 0.02];
    let of = |shift: f64| {
        let mut k = 0;
        tables(1, 1, 6, move |_, _| {
            k += 1;
            (
                true,
                0.2 + shift + noise[(k * 5 + usize::from(shift > 0.0)) % 6],
            )
        })
    };
    let found = compare(&of(0.0), &of(0.3), 0.05).expect("compatible");
    let own = found
        .overall
        .iter()
        .find(|row| row.measure == Measure::Acceptance);
    assert!(
        own.is_some_and(|row| row.found && row.n_units == 6 && (row.difference - 0.3).abs() < 0.02)
    );
    assert_eq!(found.units, "chain numbers");
}

/// Of 400 pairs of sweeps that differ by chance alone, with worlds and cells that differ much, at most one in
/// twenty may be told apart: 20 and five binomial standard errors, 22.
#[test]
fn chance_is_found_at_most_as_often_as_the_level_says() {
    let mut rng = Purpose::new("test", 9).generator();
    let mut n_found = 0;
    for _ in 0..400 {
        let mut draw = |cell: usize, world: u64| {
            let p = 0.1 + 0.2 * world as f64;
            let noise: f64 = StandardNormal.sample(&mut rng);
            (
                rng.random::<f64>() < p,
                0.1 * cell as f64 + 0.05 * world as f64 + 0.01 * noise,
            )
        };
        let a = tables(6, 4, 3, &mut draw);
        let b = tables(6, 4, 3, &mut draw);
        n_found += usize::from(compare(&a, &b, 0.05).expect("compatible").differs);
    }
    assert!(n_found <= 42, "{n_found}");
    assert!(
        n_found > 0,
        "a test that never finds anything tests nothing"
    );
}
