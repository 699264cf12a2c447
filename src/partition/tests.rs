//! Moves, counts and enumeration against small cases done by hand.

use super::*;
use crate::rng::Purpose;
use proptest::prelude::*;
use std::collections::HashSet;

fn check(partition: &Partition) {
    let n = partition.n_detections();
    let mut seen = vec![false; n];
    for (set_ix, members) in partition.sets().iter().enumerate() {
        assert!(!members.is_empty());
        for &i in members {
            assert!(!seen[i as usize], "detection {i} twice");
            seen[i as usize] = true;
            assert_eq!(partition.set_of()[i as usize] as usize, set_ix);
        }
        let place = partition.place[set_ix];
        if members.len() > 1 {
            assert_eq!(partition.non_singletons[place as usize] as usize, set_ix);
        } else {
            assert_eq!(place, ABSENT);
        }
    }
    assert!(seen.iter().all(|&s| s));
    let many = partition
        .sets()
        .iter()
        .filter(|members| members.len() > 1)
        .count();
    assert_eq!(many, partition.non_singletons().len());
    assert_eq!(
        partition.hash(),
        Partition::from_labels(partition.set_of()).hash()
    );
}

fn merge(partition: &Partition, a: u32, b: u32) -> Change {
    let mut change = Change::default();
    change.remove(a);
    change.remove(b);
    let members = change.add();
    members.extend_from_slice(&partition.sets()[a as usize]);
    members.extend_from_slice(&partition.sets()[b as usize]);
    change
}

#[test]
fn every_partition_once() {
    for n in 1..=8 {
        let all: Vec<Topology> = Partitions::of(n).collect();
        assert_eq!(Some(all.len() as u128), count::bell(n));
        let distinct: HashSet<_> = all.iter().collect();
        assert_eq!(distinct.len(), all.len());
        let hashes: HashSet<_> = all
            .iter()
            .map(|t| Partition::from_labels(t.labels()).hash())
            .collect();
        assert_eq!(hashes.len(), all.len());
    }
}

#[test]
fn labels_read_back() {
    let topology = Topology::canonical(&[7, 7, 2, 7, 0]);
    assert_eq!(topology.to_string(), "0,0,1,0,2");
    assert_eq!("0 0,1\n0, 2".parse::<Topology>().ok(), Some(topology));
    assert!("0,x".parse::<Topology>().is_err());
}

proptest! {
    #[test]
    fn canonical_labels_are_idempotent_and_blind_to_names(labels in prop::collection::vec(0_u32..9, 1..30)) {
        let topology = Topology::canonical(&labels);
        prop_assert_eq!(&Topology::canonical(topology.labels()), &topology);
        let renamed: Vec<u32> = labels.iter().map(|l| (l * 7 + 3) % 31).collect();
        prop_assert_eq!(&Topology::canonical(&renamed), &topology);
        prop_assert_eq!(Partition::from_labels(&labels).hash(), Partition::from_labels(&renamed).hash());
        prop_assert_eq!(Partition::from_labels(&labels).topology(), topology);
    }

    #[test]
    fn a_walk_of_merges_and_splits_keeps_every_index(n in 1_usize..24, seed in 0_u64..1000) {
        let mut rng = Purpose::new("test", seed).generator();
        let mut partition = Partition::random(n, &mut rng);
        let mut shadow: Vec<usize> = partition.sets().iter().map(Vec::len).collect();
        for _ in 0..60 {
            let mut change = Change::default();
            if rng.random_bool(0.5) && partition.n_sets() > 1 {
                let a = rng.random_range(0..partition.n_sets() as u32);
                let b = rng.random_range(0..partition.n_sets() as u32);
                if a == b { continue; }
                change = merge(&partition, a, b);
            } else if let Some(&set) = partition.non_singletons().first() {
                change.remove(set);
                let members = &partition.sets()[set as usize];
                let cut = rng.random_range(1..members.len());
                change.add().extend_from_slice(&members[..cut]);
                change.add().extend_from_slice(&members[cut..]);
            }
            let expected_sets = change.n_sets_after(partition.n_sets());
            let expected_many = partition.non_singletons_after(&change);
            partition.apply(&change, |from, to| {
                assert_eq!(from, shadow.len() - 1);
                shadow.swap_remove(to);
            });
            shadow.extend(change.added().iter().map(Vec::len));
            check(&partition);
            prop_assert_eq!(partition.n_sets(), expected_sets);
            prop_assert_eq!(partition.non_singletons().len(), expected_many);
            let sizes: Vec<usize> = partition.sets().iter().map(Vec::len).collect();
            prop_assert_eq!(&sizes, &shadow);
        }
    }

    #[test]
    fn a_merge_undoes_a_split(labels in prop::collection::vec(0_u32..4, 2..20)) {
        let start = Partition::from_labels(&labels);
        prop_assume!(!start.non_singletons().is_empty());
        let mut partition = start.clone();
        let set = partition.non_singletons()[0];
        let mut change = Change::default();
        change.remove(set);
        let members = partition.sets()[set as usize].clone();
        change.add().extend_from_slice(&members[..1]);
        change.add().extend_from_slice(&members[1..]);
        partition.apply(&change, |_, _| ());
        prop_assert_ne!(partition.hash(), start.hash());
        let last = partition.n_sets() as u32 - 1;
        let change = merge(&partition, last, last - 1);
        partition.apply(&change, |_, _| ());
        prop_assert_eq!(partition.hash(), start.hash());
        prop_assert_eq!(partition.topology(), start.topology());
    }
}
