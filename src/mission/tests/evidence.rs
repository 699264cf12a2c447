//! The evidence of partitions, fresh and after any changes, against dense algebra.

use super::*;

#[test]
fn evidence_is_that_of_dense_algebra() {
    let graph = crowded();
    let all = all_partitions(&graph);
    let offset = ln_integral(&graph, &all[0]) - state(&graph, &all[0], 3.0).now.ln_evidence;
    for labels in &all {
        let dense = ln_integral(&graph, labels);
        let found = state(&graph, labels, 3.0).now.ln_evidence + offset;
        assert!((found - dense).abs() < 1e-9, "{labels:?}: {found} {dense}");
    }
}

#[test]
fn changes_lead_to_what_a_fresh_state_has() {
    let graph = crowded();
    let mut changed = state(&graph, &[0, 1, 0, 1, 0, 2, 3], 3.0);
    // Out of a landmark, into another, a whole one joined, and the middle of it out again.
    for (block, target) in [
        (vec![3], None),
        (vec![2, 4], None),
        (vec![3], Some(0)),
        (vec![2, 4], Some(1)),
        (vec![4], None),
    ] {
        let placing = changed
            .exact_placing(&block)
            .expect("a block of one landmark");
        let ln_before = changed.ln_target();
        let target = target.map(|s: usize| changed.now.labels[s] as usize);
        let weight = |wanted: Option<usize>| {
            let found = placing.targets.iter().find(|(b, _)| Some(*b) == wanted);
            found.map_or(0.0, |(_, weight)| *weight)
        };
        let expected = weight(target) - weight(placing.now());
        changed.place(&block, &placing, target);
        let ratio = changed.ln_target() - ln_before;
        assert!(
            (ratio - expected).abs() < 1e-9,
            "{block:?}: {ratio} {expected}"
        );
        let mut fresh = changed.clone();
        fresh.refresh().expect("positive definite");
        assert!((changed.now.ln_evidence - fresh.now.ln_evidence).abs() < 1e-9);
        for a in 0..changed.n_landmarks() {
            for b in 0..changed.n_landmarks() {
                let (x, y) = (changed.now.joint.block(a, b), fresh.now.joint.block(a, b));
                assert!(x.iter().zip(y).all(|(x, y)| (x - y).abs() < 1e-9));
            }
            let (x, y) = (changed.now.joint.mean_m[a], fresh.now.joint.mean_m[a]);
            assert!(x.iter().zip(y).all(|(x, y)| (x - y).abs() < 1e-9));
        }
    }
}
