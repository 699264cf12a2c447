//! Properties that hold for any draws and any partitions.

use proptest::collection::vec;
use proptest::prelude::*;

use super::random_posterior;
use crate::diagnostics::agreement::adjusted_rand_index;
use crate::diagnostics::chains::{Chains, Stretch};
use crate::diagnostics::co_clustering::co_clustering;
use crate::diagnostics::credible_ball::credible_ball;
use crate::diagnostics::ess::{ess_bulk, ess_mean};
use crate::diagnostics::information::{VMeasure, conditional_entropies, variation_of_information};
use crate::diagnostics::loss::Loss;
use crate::diagnostics::mass::number_holding;
use crate::diagnostics::mcse;
use crate::diagnostics::pair_counts::PairCounts;
use crate::diagnostics::point_estimate::{mean_loss, point_estimate};
use crate::diagnostics::r_hat::{nested_r_hat, r_hat};
use crate::diagnostics::ranks::Ordered;
use crate::diagnostics::topology_distance::{hellinger, total_variation};
use crate::diagnostics::topology_ess::topology_ess;
use crate::diagnostics::unseen_mass::unseen_mass;
use crate::partition::Topology;

const LOSSES: [Loss; 2] = [Loss::Binder, Loss::VariationOfInformation];

/// Chains of whole numbers in stretches, cut to one length.
fn stretches() -> impl Strategy<Value = Vec<Vec<Stretch>>> {
    let chain = vec((0_u8..6, 1_u64..5), 30..60);
    vec(chain, 2..5).prop_map(|chains| {
        let cut = |chain: &Vec<(u8, u64)>| {
            let draws = chain
                .iter()
                .flat_map(|(value, n)| (0..*n).map(|_| (f64::from(*value), 1)));
            draws.take(30).collect()
        };
        chains.iter().map(cut).collect()
    })
}

fn topologies(n_topologies: usize) -> impl Strategy<Value = Vec<Topology>> {
    (1_usize..12).prop_flat_map(move |n| {
        vec(vec(0_u8..5, n), n_topologies).prop_map(|all| {
            all.iter()
                .map(|labels| Topology::canonical(labels))
                .collect()
        })
    })
}

fn close(a: f64, b: f64) -> bool {
    (a - b).abs() <= 1e-9 * a.abs().max(b.abs())
}

proptest! {
    #[test]
    fn ranks_see_no_increasing_transform(chains in stretches()) {
        let chains = Chains::new(&chains).expect("thirty draws each");
        let bent = chains.map(|x| (x - 2.0).powi(3));
        let (before, after) = (r_hat(&chains), r_hat(&bent));
        prop_assert_eq!(before.map(|r| r.bulk).ok(), after.map(|r| r.bulk).ok());
        prop_assert_eq!(ess_bulk(&chains).ok(), ess_bulk(&bent).ok());
        // Upside down and to another scale; powers of two, so that ties stay ties.
        let turned = chains.map(|x| 8.0 - 2.0 * x);
        if let (Ok(before), Ok(after)) = (before, r_hat(&turned)) {
            prop_assert!(close(before.value(), after.value()));
        }
    }

    #[test]
    fn the_order_of_chains_is_of_no_meaning(chains in stretches()) {
        let mut turned = chains.clone();
        turned.reverse();
        let (chains, turned) = (Chains::new(&chains).expect("draws"), Chains::new(&turned).expect("draws"));
        if let (Ok(a), Ok(b)) = (r_hat(&chains), r_hat(&turned)) {
            prop_assert!(close(a.value(), b.value()));
        }
        if let (Ok(a), Ok(b)) = (ess_mean(&chains), ess_mean(&turned)) {
            prop_assert!(close(a.ess, b.ess));
        }
    }

    #[test]
    fn how_a_series_is_cut_into_stretches_is_of_no_meaning(chains in stretches()) {
        let single = Chains::new(&chains).expect("draws");
        let merged: Vec<Vec<Stretch>> = single.iter().map(<[Stretch]>::to_vec).collect();
        prop_assert_eq!(&Chains::new(&merged).expect("draws"), &single);
        let draws: Vec<Vec<f64>> = chains.iter().map(|c| c.iter().map(|s| s.0).collect()).collect();
        let mut sorted = draws.concat();
        sorted.sort_unstable_by(f64::total_cmp);
        let ordered = Ordered::new(&single);
        for (place, value) in sorted.iter().enumerate() {
            prop_assert_eq!(ordered.at(place as u64), *value);
        }
        prop_assert!((single.mean() - sorted.iter().sum::<f64>() / sorted.len() as f64).abs() < 1e-12);
    }

    #[test]
    fn sizes_and_errors_are_in_range(chains in stretches()) {
        let chains = Chains::new(&chains).expect("draws");
        let n = chains.n_total() as f64;
        if let Ok(ess) = ess_mean(&chains) {
            prop_assert!(ess.ess > 0.0 && ess.ess <= n * n.log10() * (1.0 + 1e-12));
            prop_assert!(ess.relative_error > 0.0 && ess.window <= chains.n_draws());
        }
        for estimate in [mcse::mean(&chains), mcse::standard_deviation(&chains), mcse::quantile(&chains, 0.3)].into_iter().flatten() {
            prop_assert!(estimate.mcse >= 0.0 && estimate.value.is_finite());
        }
    }

    #[test]
    fn nested_r_hat_is_at_least_one_and_knows_starts_by_their_names_only(chains in stretches()) {
        let n = chains.len();
        let chains = Chains::new(&chains).expect("draws");
        let starts: Vec<usize> = (0..n).map(|c| c % 2).collect();
        let renamed: Vec<usize> = starts.iter().map(|s| 7 - s).collect();
        if let (Ok(a), Ok(b)) = (nested_r_hat(&chains, &starts), nested_r_hat(&chains, &renamed)) {
            prop_assert!(a.value() >= 1.0 && close(a.value(), b.value()));
        }
    }

    #[test]
    fn agreement_is_symmetric_and_in_range(pair in topologies(2)) {
        let [a, b] = &pair[..] else { unreachable!("two topologies") };
        let n = a.labels().len() as f64;
        let (forth, back) = (adjusted_rand_index(a, b).expect("some"), adjusted_rand_index(b, a).expect("some"));
        prop_assert!(close(forth, back) && forth <= 1.0);
        prop_assert_eq!(forth == 1.0, a == b);
        let information = variation_of_information(a, b).expect("some");
        prop_assert!(close(information, variation_of_information(b, a).expect("some")));
        prop_assert!(information >= 0.0 && information <= n.ln() + 1e-12);
        prop_assert_eq!(information == 0.0, a == b);
        let (forth, back) = (VMeasure::new(a, b).expect("some"), VMeasure::new(b, a).expect("some"));
        prop_assert!((forth.homogeneity - back.completeness).abs() < 1e-12);
        prop_assert!((forth.completeness - back.homogeneity).abs() < 1e-12);
        for share in [forth.homogeneity, forth.completeness, forth.v_measure()] {
            prop_assert!((0.0..=1.0).contains(&share));
        }
        let (pairs, other) = (PairCounts::new(a, b), PairCounts::new(b, a));
        prop_assert_eq!((pairs.precision(), pairs.recall()), (other.recall(), other.precision()));
        let all = pairs.both + pairs.only_found + pairs.only_truth + pairs.neither;
        prop_assert_eq!(all as f64, n * (n - 1.0) / 2.0);
        for loss in LOSSES {
            prop_assert_eq!(loss.distance(a, b) == 0.0, a == b);
        }
    }

    #[test]
    fn the_order_of_detections_is_of_no_meaning(pair in topologies(2)) {
        let n = pair[0].labels().len();
        let turned: Vec<usize> = (0..n).rev().collect();
        let of = |a: &Topology, b: &Topology| [
            adjusted_rand_index(a, b).expect("some"),
            variation_of_information(a, b).expect("some"),
            VMeasure::new(a, b).expect("some").v_measure(),
        ];
        let before = of(&pair[0], &pair[1]);
        let after = of(&pair[0].restricted_to(&turned), &pair[1].restricted_to(&turned));
        for (before, after) in before.into_iter().zip(after) {
            prop_assert!((before - after).abs() < 1e-12);
        }
    }

    #[test]
    fn distances_are_metrics(all in topologies(3)) {
        for loss in LOSSES {
            let d = |a: usize, b: usize| loss.distance(&all[a], &all[b]);
            prop_assert!(d(0, 2) <= d(0, 1) + d(1, 2) + 1e-12);
        }
    }

    #[test]
    fn a_refinement_tells_all_of_what_it_refines(pair in topologies(2)) {
        let both: Vec<(u32, u32)> = pair[0].labels().iter().copied().zip(pair[1].labels().iter().copied()).collect();
        let meet = Topology::canonical(&both);
        prop_assert_eq!(conditional_entropies(&pair[0], &meet).expect("some").0, 0.0);
        prop_assert_eq!(VMeasure::new(&pair[0], &meet).expect("some").homogeneity, 1.0);
    }

    #[test]
    fn laws_are_apart_by_as_much_as_they_can_be(weights in vec((0_u32..100, 0_u32..100), 2..20)) {
        let total = |of: fn(&(u32, u32)) -> u32| f64::from(weights.iter().map(of).sum::<u32>().max(1));
        let (sum_p, sum_q) = (total(|w| w.0), total(|w| w.1));
        let p: Vec<f64> = weights.iter().map(|w| f64::from(w.0) / sum_p).collect();
        let q: Vec<f64> = weights.iter().map(|w| f64::from(w.1) / sum_q).collect();
        prop_assume!(weights.iter().any(|w| w.0 > 0) && weights.iter().any(|w| w.1 > 0));
        let (variation, hellinger) = (total_variation(&p, &q), hellinger(&p, &q));
        prop_assert!(hellinger * hellinger <= variation + 1e-12);
        prop_assert!(variation <= 2_f64.sqrt() * hellinger + 1e-12);
        prop_assert!(variation <= 1.0 + 1e-12 && hellinger <= 1.0 + 1e-12);
    }

    #[test]
    fn names_of_topologies_are_of_no_meaning(chain in vec((0_u32..6, 1_u64..9), 40..80)) {
        let renamed: Vec<(u32, u64)> = chain.iter().map(|(k, n)| (90 - 7 * k, *n)).collect();
        if let (Ok(a), Ok(b)) = (topology_ess(&chain), topology_ess(&renamed)) {
            prop_assert!(close(a.ess, b.ess));
        }
    }

    #[test]
    fn counts_give_shares(counts in vec(0_u64..20, 2..30), level in 0.05_f64..0.9) {
        prop_assume!(counts.iter().sum::<u64>() > 1);
        let unseen = unseen_mass(&counts).expect("draws");
        prop_assert!((0.0..=1.0).contains(&unseen.mass));
        let (less, more) = (number_holding(&counts, level, 100.0).expect("draws"), number_holding(&counts, level + 0.05, 100.0).expect("draws"));
        prop_assert!(less.low <= less.n && less.n <= less.high.unwrap_or(less.n_seen) && less.n <= more.n);
        prop_assert!(more.n <= more.n_seen);
    }

    #[test]
    fn balls_hold_their_level_and_grow_with_it(seed in 0_u64..500, level in 0.1_f64..0.9) {
        let rows = random_posterior(8, 15, seed);
        let matrix = co_clustering(&rows).expect("counts");
        for loss in LOSSES {
            let centre = point_estimate(&rows, &matrix, loss, 50.0).expect("counts");
            prop_assert!(centre.expected_loss <= mean_loss(&rows[0].topology, &rows, loss).mean + 1e-12);
            let small = credible_ball(&centre.topology, &rows, loss, level, 50.0).expect("counts");
            let large = credible_ball(&centre.topology, &rows, loss, level + 0.1, 50.0).expect("counts");
            prop_assert!(small.mass >= level && small.radius <= large.radius && small.mass <= large.mass);
            prop_assert!(small.radius_interval.0 <= small.radius);
            for edge in small.horizontal.iter().chain(&small.upper).chain(&small.lower) {
                prop_assert!(loss.distance(&centre.topology, edge) <= small.radius * (1.0 + 1e-9));
            }
        }
    }
}
