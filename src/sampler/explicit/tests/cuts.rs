//! Cuts: the measure of lines, and the law by which sets are cut and joined.

use std::collections::BTreeMap;

use super::super::lines::{Line, Parting};
use super::balance::each;
use super::*;

fn measure(first: &[[f64; 2]], second: &[[f64; 2]]) -> Option<f64> {
    let [first, second] = [first, second].map(|set| set.iter().copied());
    Parting::default().measure(first, second)
}

/// ∫ (least b·u − largest a·u)⁺ over all directions u, by the midpoint rule.
fn by_quadrature(first: &[[f64; 2]], second: &[[f64; 2]]) -> f64 {
    let n = 100_000;
    let step = std::f64::consts::TAU / f64::from(n);
    let gap = |k: i32| {
        let (sin, cos) = (step * (f64::from(k) + 0.5)).sin_cos();
        let along = |p: &[f64; 2]| cos * p[0] + sin * p[1];
        let most = first.iter().map(along).fold(f64::NEG_INFINITY, f64::max);
        let least = second.iter().map(along).fold(f64::INFINITY, f64::min);
        (least - most).max(0.0)
    };
    (0..n).map(gap).sum::<f64>() * step
}

#[test]
fn the_measure_of_parting_lines_is_that_of_their_directions_and_places() {
    let [o, x, y] = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]];
    // Two points, as far as they are apart; three on a line; one between two others.
    assert_eq!(measure(&[o], &[[3.0, 4.0]]), Some(10.0));
    assert_eq!(measure(&[o, x], &[[3.0, 0.0]]), Some(4.0));
    assert_eq!(measure(&[o, [3.0, 0.0]], &[x]), None);
    // The same place; hulls that cross; a point on an edge.
    assert_eq!(measure(&[o, x], &[x]), None);
    assert_eq!(measure(&[o, [1.0, 1.0]], &[x, y]), None);
    assert_eq!(measure(&[x, y], &[[0.5, 0.5]]), None);
    let mut rng = rng(41);
    let mut n_parted = 0;
    for round in 0..300 {
        let mut draw = |n: usize, shift: f64| -> Vec<[f64; 2]> {
            (0..n)
                .map(|_| [rng.uniform() + shift, 2.0 * rng.uniform()])
                .collect()
        };
        let first = draw(1 + round % 4, 0.0);
        let second = draw(1 + round % 7, 0.004 * round as f64);
        let expected = by_quadrature(&first, &second);
        let got = measure(&first, &second);
        n_parted += usize::from(got.is_some());
        assert!((got.unwrap_or(0.0) - expected).abs() < 1e-6 * (1.0 + expected));
        let back = measure(&second, &first);
        assert!((got.unwrap_or(0.0) - back.unwrap_or(0.0)).abs() < 1e-12);
    }
    assert!((150..300).contains(&n_parted), "{n_parted}");
}

/// Lines through a segment part the other points as often as their measure says.
#[test]
fn lines_across_a_segment_are_uniform() {
    let points = CROWD_M;
    let (from, to) = (points[0], points[3]);
    let length = square_distance(from, to).sqrt();
    let mut rng = rng(42);
    let (mut counts, n) = (BTreeMap::new(), 200_000);
    for _ in 0..n {
        let line = Line::across(from, to, &mut rng);
        assert!(line.is_beyond(to) && !line.is_beyond(from));
        let beyond = points.map(|point| line.is_beyond(point));
        *counts.entry(beyond).or_insert(0.0) += 1.0;
    }
    let mut total = 0.0;
    for (beyond, count) in counts {
        let side = |wanted: bool| -> Vec<[f64; 2]> {
            let own = points.iter().zip(beyond).filter(|own| own.1 == wanted);
            own.map(|own| *own.0).collect()
        };
        let p = measure(&side(false), &side(true)).expect("a line") / (2.0 * length);
        let (expected, sd) = (p * f64::from(n), (p * f64::from(n)).sqrt());
        assert!(
            (count - expected).abs() < 5.0 * sd + 3.0,
            "{beyond:?}: {count} {expected}"
        );
        total += p;
    }
    // Those that were never drawn have little between them.
    assert!((total - 1.0).abs() < 1e-3, "{total}");
}

/// Every change comes as often as its ratio says: q(T'|T)/q(T|T') of what is counted in both
/// directions, for one set into two, two into one and two into two.
#[test]
fn cuts_and_joins_come_as_often_as_their_ratio_says() {
    for model in [
        crowd(PenaltyShape::Quadratic),
        crowd_of_ellipses(PenaltyShape::Quadratic),
    ] {
        let mut explicit = Explicit::new(&model, Prior::Uniform, 2);
        let mut rng = rng(43);
        let n_draws = 60_000;
        let mut from = |labels: &[u32]| {
            let state = start(&model, Prior::Uniform, labels);
            let mut counts: BTreeMap<Vec<u32>, f64> = BTreeMap::new();
            let mut ratios: BTreeMap<Vec<u32>, Vec<f64>> = BTreeMap::new();
            for _ in 0..n_draws {
                explicit.change.clear();
                let Some(ln_ratio) = explicit.cut_or_join(&state, &mut rng) else {
                    continue;
                };
                let mut there = state.partition.clone();
                there.apply(&explicit.change, |_, _| ());
                let labels = there.topology().labels().to_vec();
                *counts.entry(labels.clone()).or_default() += 1.0;
                ratios.entry(labels).or_default().push(ln_ratio);
            }
            (counts, ratios)
        };
        let starts = [[0, 0, 0, 0, 0, 0], [0, 0, 1, 1, 0, 1], [0, 0, 1, 1, 2, 2]];
        let mut n_checks = [0; 2];
        for labels in starts {
            let (there, ratios) = from(&labels);
            for (target, count) in there.iter().filter(|own| *own.1 > 1000.0) {
                // A pair of anchors has a ratio of its own; the mean of exp over what is proposed
                // is q(T|T')/q(T'|T) of the whole move.
                let own = &ratios[target];
                let mean = own.iter().map(|ln| ln.exp()).sum::<f64>() / own.len() as f64;
                let (back, _) = from(target);
                let back = back.get(labels.as_slice()).copied().unwrap_or(0.0);
                let got = back / count;
                let sd = got * (1.0 / back + 1.0 / count).sqrt();
                assert!(
                    (got - mean).abs() < 5.0 * sd,
                    "{labels:?} {target:?}: {got} {mean}"
                );
                let n_sets = |labels: &[u32]| labels.iter().max().copied();
                n_checks[usize::from(n_sets(target) == n_sets(&labels))] += 1;
            }
        }
        assert!(n_checks[0] > 10 && n_checks[1] > 2, "{n_checks:?}");
    }
}

/// The way back of a cut or a join has the inverse of its ratio.
#[test]
fn cuts_and_joins_are_each_others_way_back() {
    let mut n_checks = [0; 3];
    each(|_, _, explicit, state, rng| {
        for _ in 0..100 {
            wander(explicit, state, rng);
            explicit.change.clear();
            let Some(ln_ratio) = explicit.cut_or_join(state, rng) else {
                continue;
            };
            let change = explicit.change.clone();
            let mut after = state.clone();
            let nobody = std::iter::empty();
            placement::commit(
                &explicit.laws,
                &mut after,
                &change,
                nobody,
                &mut explicit.joint,
            );
            let target = state.partition.hash();
            // Anchors that part the same sets on both sides have one ratio: draw until it comes.
            let found = (0..4000).any(|_| {
                explicit.change.clear();
                let Some(back) = explicit.cut_or_join(&after, rng) else {
                    return false;
                };
                let mut there = after.partition.clone();
                there.apply(&explicit.change, |_, _| ());
                there.hash() == target && (back + ln_ratio).abs() < 1e-9
            });
            let kind = match [change.removed().len(), change.added().len()] {
                [1, 2] => 0,
                [2, 1] => 1,
                _ => 2,
            };
            n_checks[kind] += usize::from(found);
        }
    });
    assert!(n_checks.iter().all(|&n| n > 100), "{n_checks:?}");
}

/// Detections at one place, or without neighbours, are never cut apart.
#[test]
fn what_no_line_parts_stays() {
    let penalty = penalty(PenaltyShape::Quadratic, 1.2, 3.0);
    let [here, far] = [[1.0, 1.0], [90.0, 90.0]];
    for positions_m in [vec![here; 3], vec![here, far], vec![here]] {
        let model = MetricModel::new(&positions_m, 0.5, 0.6, penalty).into();
        let mut explicit = Explicit::new(&model, Prior::Uniform, 2);
        for labels in [[0, 0, 0], [0, 1, 0]] {
            let mut state = start(&model, Prior::Uniform, &labels[..positions_m.len()]);
            let mut rng = rng(44);
            for _ in 0..200 {
                let info = explicit.cut(&mut state, &mut rng);
                assert_eq!(info.outcome, Outcome::Impossible);
            }
        }
    }
}
