//! Groups: the law by which they leave and join.

use super::super::group::ln_leaves;
use super::balance::each;
use super::*;
use crate::model::moments::Moments;

/// The probabilities of all leaving groups of a set sum to what they should, groups come by them,
/// and leaving and joining are each other's way back.
#[test]
fn groups_leave_and_join_by_one_law() {
    let mut n_checks = [0; 2];
    each(|_, _, explicit, state, rng| {
        for round in 0..200 {
            wander(explicit, state, rng);
            let size = 2 + round % 2;
            explicit.change.clear();
            let leaves = round % 4 < 2;
            let ln_ratio = if leaves {
                explicit.group_leaves(state, size, rng)
            } else {
                explicit.group_joins(state, size, rng)
            };
            let Some(ln_ratio) = ln_ratio else {
                continue;
            };
            // Where both parts are of one size either may be the group: the way back is that of the
            // same group.
            let group = |change: &Change, state: &State, leaves: bool| {
                let mut group = if leaves {
                    change.added()[0].clone()
                } else {
                    state.partition.sets()[change.removed()[0] as usize].clone()
                };
                group.sort_unstable();
                group
            };
            let change = explicit.change.clone();
            let moved = group(&change, state, leaves);
            let mut after = state.clone();
            let nobody = std::iter::empty();
            placement::commit(
                &explicit.laws,
                &mut after,
                &change,
                nobody,
                &mut explicit.joint,
            );
            // The same move back: draw until the same topology comes out.
            let target = state.partition.hash();
            for _ in 0..2000 {
                explicit.change.clear();
                let back = if leaves {
                    explicit.group_joins(&after, size, rng)
                } else {
                    explicit.group_leaves(&after, size, rng)
                };
                let Some(back) = back else {
                    continue;
                };
                let mut there = after.partition.clone();
                there.apply(&explicit.change, |_, _| ());
                let same = group(&explicit.change, &after, !leaves) == moved;
                if there.hash() == target && same {
                    assert!((back + ln_ratio).abs() < 1e-9, "{back} {ln_ratio}");
                    n_checks[usize::from(leaves)] += 1;
                    break;
                }
            }
        }
    });
    assert!(n_checks.iter().all(|&n| n > 100), "{n_checks:?}");
    let model = crowd(PenaltyShape::Quadratic);
    let explicit = Explicit::new(&model, Prior::Uniform, 2);
    let members = [0, 1, 2, 3, 5];
    let mean_m = Moments::of(members.iter().map(|&i| explicit.laws.z_m(i))).mean_m;
    for size in [2, 3] {
        let mut total = 0.0;
        for code in 0..32_u32 {
            if code.count_ones() == size {
                let group: Vec<u32> = (0..5)
                    .filter(|bit| code >> bit & 1 == 1)
                    .map(|bit| members[bit])
                    .collect();
                total += ln_leaves(&explicit.laws, &members, mean_m, &group).exp();
            }
        }
        // The first is in this set with probability 5/6.
        assert!((total - 5.0 / 6.0).abs() < 1e-12, "{size}: {total}");
    }
}

/// How often each pair leaves a set is what `ln_leaves` says.
#[test]
fn groups_are_drawn_by_their_probability() {
    let model = crowd(PenaltyShape::Quadratic);
    let mut explicit = Explicit::new(&model, Prior::Uniform, 2);
    let state = start(&model, Prior::Uniform, &[0; 6]);
    let mut rng = rng(4);
    let mean_m = state.placement().sums[0].z.mean_m;
    let members = state.partition.sets()[0].clone();
    for size in [2, 3] {
        let n_draws = 60_000;
        let mut counts = std::collections::BTreeMap::new();
        for _ in 0..n_draws {
            explicit.change.clear();
            if explicit.group_leaves(&state, size, &mut rng).is_some() {
                let mut group = explicit.change.added()[0].clone();
                group.sort_unstable();
                *counts.entry(group).or_insert(0.0) += 1.0;
            }
        }
        assert!(counts.len() >= 10);
        for (group, count) in counts {
            let p = ln_leaves(&explicit.laws, &members, mean_m, &group).exp();
            let expected = p * f64::from(n_draws);
            assert!(
                (count - expected).abs() < 5.0 * expected.sqrt() + 3.0,
                "{group:?}"
            );
        }
    }
}
