//! Effects, contrasts and interactions of responses made up so that the answer is known.

use super::*;
use crate::results::Fault;
use crate::settings::Value;

fn sweep(design: &str) -> Sweep {
    let text = format!("[data]\nreplicates = 4\n[run]\nseed = 3\n{design}");
    Sweep::parse(&text, "a.toml", "a", None).expect("a good sweep")
}

const GRID: &str =
    "[design]\nkind = 'grid'\n[design.factors]\nsigma_o = [1, 2, 4]\nsigma_t = [1, 2]\n";

fn number(sweep: &Sweep, cell: usize, name: &str) -> f64 {
    match sweep.cells[cell].settings.get(name) {
        Value::Number(number) => *number,
        other => panic!("{name}: {other}"),
    }
}

/// M as a function of the cell and the world; everything converged, nothing missing.
fn of(sweep: &Sweep, value: impl Fn(usize, usize) -> Option<f64>) -> Sensitivity {
    let row = |cell| (0..4).map(|world| value(cell, world)).collect();
    let values = ResponseValues {
        response: Response::NSets,
        by_cell: (0..sweep.cells.len()).map(row).collect(),
        n_units: 4,
    };
    let gate = Gate {
        n_cells: 1,
        n_judged: 4,
        n_converged: 3,
        n_planned: 8,
        ..Gate::default()
    };
    Sensitivity::of(sweep, &[values], &vec![gate; sweep.cells.len()])
}

#[test]
fn a_level_holds_its_cells() {
    let levels = levels::factor_levels(&sweep(GRID));
    let n_cells = |factor: usize, n: usize| -> Vec<usize> {
        (0..n).map(|level| levels[factor].n_cells(level)).collect()
    };
    assert_eq!(n_cells(0, 4), [2, 2, 2, 0]);
    assert_eq!(n_cells(1, 2), [3, 3]);
}

fn contrast(found: &Sensitivity, factor: usize, from: usize, to: usize) -> &Contrast {
    let is_it = |row: &&Contrast| (row.factor, row.from, row.to) == (factor, from, to);
    found.contrasts.iter().find(is_it).expect("a contrast")
}

/// Worlds as different as can be do not blur a difference that each of them shows.
#[test]
fn contrasts_are_paired_by_world() {
    let sweep = sweep(GRID);
    let world = [0.0, 100.0, -50.0, 7.0];
    let jitter = [0.1, -0.1, 0.05, -0.05];
    let found = of(&sweep, |cell, w| {
        let sigma_o = number(&sweep, cell, "sigma_o");
        Some(3.0 * sigma_o + world[w] + jitter[w] * sigma_o)
    });
    let own = contrast(&found, 0, 0, 2);
    let estimate = own.estimate.expect("a difference");
    assert!((estimate.mean - 9.0).abs() < 1e-12 && estimate.n == 4);
    let interval = estimate.interval.expect("an interval");
    // Differences 9 + 3 jitter: standard deviation 0.2739, t = 3.182, √4.
    assert!(
        (interval.high - 9.0 - 3.182_446_3 * 0.273_861_3 / 2.0).abs() < 1e-5,
        "{interval:?}"
    );
    // The level itself is as uncertain as the worlds are.
    let level = found.curve(Response::NSets, 0)[2].estimate.expect("a mean");
    assert!(level.interval.expect("an interval").high > level.mean + 50.0);
    // σₜ has no effect, in every world.
    let none = contrast(&found, 1, 0, 1);
    assert_eq!(
        none.estimate.map(|e| (e.mean, e.interval, e.p_value)),
        Some((0.0, None, Some(1.0)))
    );
    // Holm over the three contrasts of σₒ and the one of σₜ; the one that is clearest times four.
    let smallest = found
        .contrasts
        .iter()
        .filter_map(|row| row.estimate?.p_value)
        .fold(1.0, f64::min);
    let adjusted = found
        .contrasts
        .iter()
        .filter_map(|row| row.p_holm)
        .fold(1.0, f64::min);
    assert!((adjusted - 4.0 * smallest).abs() < 1e-15 && adjusted < 0.05);
    let strongest: Vec<usize> = found
        .strongest(Response::NSets)
        .iter()
        .map(|row| row.factor)
        .collect();
    assert_eq!(strongest, [0, 1]);
}

#[test]
fn an_interaction_is_what_is_left_of_rows_and_columns() {
    let sweep = sweep(GRID);
    let noise = |cell: usize, w: usize| 0.01 * (((7 * cell + 3 * w) % 5) as f64 - 2.0);
    let additive = of(&sweep, |cell, w| {
        Some(
            number(&sweep, cell, "sigma_o")
                + 10.0 * number(&sweep, cell, "sigma_t")
                + noise(cell, w),
        )
    });
    assert!(additive.clear_interactions(Response::NSets).is_empty());
    let product = of(&sweep, |cell, w| {
        Some(number(&sweep, cell, "sigma_o") * number(&sweep, cell, "sigma_t") + noise(cell, w))
    });
    // (x − x̄)(y − ȳ) with x̄ = 7/3, ȳ = 3/2: at (4, 2) it is 5/6.
    let clear = product.clear_interactions(Response::NSets);
    let corner = clear
        .iter()
        .find(|row| row.levels == (2, 1))
        .expect("it is clear");
    assert!((corner.interaction.expect("it").mean - 5.0 / 6.0).abs() < 0.02);
    assert_eq!(
        (
            product.pairs.len(),
            corner.gate.n_planned,
            corner.gate.n_converged
        ),
        (6, 8, 3)
    );
}

#[test]
fn a_missing_value_leaves_its_world_out_of_the_difference() {
    let sweep = sweep(GRID);
    let found = of(&sweep, |cell, w| {
        let missing = w == 1 && number(&sweep, cell, "sigma_o") == 4.0;
        (!missing).then(|| number(&sweep, cell, "sigma_o") + w as f64 * w as f64)
    });
    let n = |from, to| {
        contrast(&found, 0, from, to)
            .estimate
            .expect("a difference")
            .n
    };
    assert_eq!((n(0, 1), n(0, 2)), (4, 3));
    // Without the pairing the mean over worlds 0, 2, 3 less that over all would be off.
    assert_eq!(
        contrast(&found, 0, 0, 2).estimate.map(|e| e.mean),
        Some(3.0)
    );
}

#[test]
fn round_a_baseline_a_level_is_compared_with_the_baseline() {
    let text = GRID.replace("'grid'", "'one-at-a-time'");
    let sweep = sweep(&text);
    // Baseline (1, 1), then σₒ = 2 and 4, then σₜ = 2.
    assert_eq!(sweep.cells.len(), 4);
    let found = of(&sweep, |cell, w| Some(cell as f64 * 10.0 + w as f64));
    assert!(found.pairs.is_empty() && found.round_baseline);
    let mean = |factor, from, to| contrast(&found, factor, from, to).estimate.map(|e| e.mean);
    assert_eq!((mean(0, 0, 2), mean(1, 0, 1)), (Some(20.0), Some(30.0)));
    assert_eq!(found.curve(Response::NSets, 1)[0].gate.n_cells, 1);
}

/// Bins of a sampled design hold different points: the interval counts that too.
#[test]
fn a_sampled_design_has_bins_whose_points_count() {
    let text = "[design]\nkind = 'latin-hypercube'\npoints = 40\n[design.factors]\n\
                sigma_o = { low = 1, high = 3 }\nsigma_t = { low = 1, high = 5 }\n";
    let sweep = sweep(text);
    // All worlds agree to the last digit, but σₜ differs from point to point.
    let found = of(&sweep, |cell, _| {
        Some(number(&sweep, cell, "sigma_o") + number(&sweep, cell, "sigma_t"))
    });
    assert_eq!((found.factors[0].labels.len(), found.is_sampled), (5, true));
    assert_eq!(found.factors[0].labels[0], "1–1.4");
    for own in found.curve(Response::NSets, 0) {
        assert_eq!(own.gate.n_cells, 8, "{own:?}");
        let interval = own.estimate.and_then(|e| e.interval).expect("an interval");
        // Eight points of a uniform law of width 4: standard error 0.41, ± 2.36 of it or so.
        assert!(
            (0.8..4.0).contains(&(interval.high - interval.low)),
            "{interval:?}"
        );
    }
    assert!(found.pairs.iter().all(|row| row.interaction.is_none()));
}

/// y = 2 u₁ + u₂² u₃: elementary effects and Sobol's indices by way of the designs' cells.
#[test]
fn designs_for_screening_and_indices_find_what_was_put_in() {
    let factors = "[design.factors]\nsigma_o = { low = 1, high = 2 }\nsigma_t = { low = 1, high = 2 }\n\
                   penalty_radius = { low = 1, high = 2 }\n";
    let u = |sweep: &Sweep, cell, name| number(sweep, cell, name) - 1.0;
    let y = |sweep: &Sweep, cell: usize| {
        let [a, b, c] = ["sigma_o", "sigma_t", "penalty_radius"].map(|name| u(sweep, cell, name));
        2.0 * a + b * b * c
    };
    let world = [0.0, 9.0, -4.0, 1.0];

    let morris = sweep(&format!(
        "[design]\nkind = 'morris'\ntrajectories = 20\n{factors}"
    ));
    let found = of(&morris, |cell, w| Some(y(&morris, cell) + world[w]));
    let Some(FactorIndices::Morris(by_response)) = found.indices.map(|own| own.by_response) else {
        panic!("elementary effects");
    };
    let own: Vec<_> = by_response[0]
        .1
        .iter()
        .filter_map(|own| own.screening)
        .collect();
    // Settings are rounded to four digits, and so are effects, over two thirds.
    assert!(
        (own[0].mu - 2.0).abs() < 1e-3 && own[0].sigma < 1e-3,
        "{:?}",
        own[0]
    );
    assert!(own[1].sigma > 0.2 && own[2].sigma > 0.2);
    assert!(
        own.iter()
            .all(|s| s.n_trajectories == 20 && s.exceeds_noise == Some(true))
    );

    let text = format!("[design]\nkind = 'sobol-indices'\npoints = 256\n{factors}");
    let indices = sweep(&text);
    let found = of(&indices, |cell, w| {
        // One base point of 256 has a world without a value.
        (cell != 9 || w != 2).then(|| y(&indices, cell) + world[w])
    });
    let Some(FactorIndices::Sobol(by_response)) = found.indices.map(|own| own.by_response) else {
        panic!("indices");
    };
    let (_, n_left_out, own) = &by_response[0];
    let own = own.as_ref().expect("indices");
    assert_eq!((*n_left_out, own.n_points), (1, 255));
    // V₁ = 4/12, V₂ = (4/45)/4, V₃ = (1/9)/12, V₂₃ = (4/45)(1/12).
    let parts = [1.0 / 3.0, 1.0 / 45.0, 1.0 / 108.0, 1.0 / 135.0];
    let all: f64 = parts.iter().sum();
    let expected = [
        (parts[0], parts[0]),
        (parts[1], parts[1] + parts[3]),
        (parts[2], parts[2] + parts[3]),
    ];
    for (i, (first, total)) in expected.into_iter().enumerate() {
        assert!(
            (own.first[i].value - first / all).abs() < 0.02,
            "{i}: {:?}",
            own.first[i]
        );
        assert!(
            (own.total[i].value - total / all).abs() < 0.02,
            "{i}: {:?}",
            own.total[i]
        );
    }
    assert!(
        own.variance_of_noise
            .is_some_and(|noise| noise.abs() < 1e-9)
    );
}

/// Recovery rises with σ_o, by fewer failures of the model and a few more of the sampler.
#[test]
fn a_difference_in_recovery_is_the_sum_of_what_each_fault_changes() {
    let sweep = sweep(GRID);
    let of_level = |response: Response, cell: usize| {
        let wide = number(&sweep, cell, "sigma_o") > 1.0;
        match response {
            Response::FaultOf(Fault::Model) => {
                if wide {
                    0.1
                } else {
                    0.7
                }
            }
            Response::FaultOf(Fault::Sampler) => {
                if wide {
                    0.3
                } else {
                    0.1
                }
            }
            Response::Recovery => {
                if wide {
                    0.6
                } else {
                    0.2
                }
            }
            _ => 0.0,
        }
    };
    let values = |responses: &[Response]| -> Vec<ResponseValues> {
        let of = |&response: &Response| {
            let row = |cell| vec![Some(of_level(response, cell)); 4];
            ResponseValues {
                response,
                by_cell: (0..sweep.cells.len()).map(row).collect(),
                n_units: 4,
            }
        };
        responses.iter().map(of).collect()
    };
    let gates = vec![Gate::default(); sweep.cells.len()];
    let all = [
        Response::Recovery,
        Response::FaultOf(Fault::Model),
        Response::FaultOf(Fault::Sampler),
    ];
    let found = Sensitivity::of(&sweep, &values(&all), &gates).attributions();
    let own = &found[0];
    assert_eq!((own.factor, own.from), (0, 0));
    let expected = [0.4, 0.6, -0.2, 0.0, 0.0];
    let parts = [&[own.recovery], own.by_fault.as_slice()].concat();
    for (part, expected) in parts.iter().zip(expected) {
        assert!((part - expected).abs() < 1e-12, "{own:?}");
    }
    let shares = attribution::shares(&found).expect("something changes");
    assert!((shares[0] - 0.75).abs() < 1e-12 && (shares[1] - 0.25).abs() < 1e-12);
    // Where some chains were not sorted the parts do not add up, and nothing is said.
    let some = Sensitivity::of(&sweep, &values(&all[..2]), &gates);
    assert!(some.attributions().is_empty());
}
