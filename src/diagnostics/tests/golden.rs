//! Values of other programs: arviz-stats for chains, scikit-learn for partitions.

use std::collections::BTreeMap;

use serde_json::Value;

use super::{golden, number};
use crate::diagnostics::agreement::adjusted_rand_index;
use crate::diagnostics::chains::Chains;
use crate::diagnostics::ess::{Ess, ess_bulk, ess_mean, ess_of, ess_quantile, ess_sd, ess_tail};
use crate::diagnostics::information::{VMeasure, variation_of_information};
use crate::diagnostics::mcse;
use crate::diagnostics::pair_counts::PairCounts;
use crate::diagnostics::r_hat::{nested_r_hat, plain_r_hat, r_hat};
use crate::diagnostics::ranks::{folded, rank_normalised};
use crate::diagnostics::undefined::Undefined;
use crate::partition::Topology;

/// The autocovariances there come from a Fourier transform, here from sums.
const TOLERANCE: f64 = 1e-10;

fn numbers(value: &Value) -> Vec<f64> {
    value
        .as_array()
        .expect("a list")
        .iter()
        .map(number)
        .collect()
}

fn close(found: f64, expected: f64) -> bool {
    (found - expected).abs() <= TOLERANCE * expected.abs()
}

/// Every diagnostic of a case, under the name that it has in the file.
fn all_of(chains: &Chains) -> Vec<(String, Result<f64, Undefined>)> {
    let size = |ess: Result<Ess, Undefined>| ess.map(|ess| ess.ess);
    // Not offered: it has no use beyond its R-hat. Compared for the sake of its pieces.
    let ess_folded = |chains: &Chains| {
        let halves = folded(&chains.split());
        halves
            .standstill()
            .map_or_else(|| ess_of(&rank_normalised(&halves)), Err)
    };
    let mut found = vec![
        ("ess_bulk".to_owned(), size(ess_bulk(chains))),
        ("ess_mean".to_owned(), size(ess_mean(chains))),
        ("ess_sd".to_owned(), size(ess_sd(chains))),
        ("ess_identity".to_owned(), size(ess_of(chains))),
        ("ess_folded".to_owned(), size(ess_folded(chains))),
        ("ess_tail".to_owned(), size(ess_tail(chains).value())),
        ("ess_median".to_owned(), size(ess_quantile(chains, 0.5))),
        ("mcse_mean".to_owned(), mcse::mean(chains).map(|e| e.mcse)),
        (
            "mcse_sd".to_owned(),
            mcse::standard_deviation(chains).map(|e| e.mcse),
        ),
        (
            "mcse_median".to_owned(),
            mcse::quantile(chains, 0.5).map(|e| e.mcse),
        ),
    ];
    for p in ["0.05", "0.25", "0.95"] {
        let level = p.parse().expect("a number");
        found.push((
            format!("ess_quantile_{p}"),
            size(ess_quantile(chains, level)),
        ));
        let error = mcse::quantile(chains, level).map(|e| e.mcse);
        found.push((format!("mcse_quantile_{p}"), error));
    }
    if chains.n_chains() >= 4 {
        // Chains in turn from two starts.
        let starts: Vec<usize> = (0..chains.n_chains()).map(|chain| chain % 2).collect();
        let nested = nested_r_hat(chains, &starts);
        let folded = nested.and_then(|r| r.folded);
        found.push(("nested_r_hat_bulk".to_owned(), nested.map(|r| r.bulk)));
        found.push(("nested_r_hat_folded".to_owned(), folded));
    }
    if chains.n_chains() > 1 {
        let r_hat = r_hat(chains);
        found.extend([
            ("r_hat".to_owned(), r_hat.map(|r| r.value())),
            ("r_hat_bulk".to_owned(), r_hat.map(|r| r.bulk)),
            ("r_hat_folded".to_owned(), r_hat.and_then(|r| r.folded)),
            ("r_hat_split".to_owned(), plain_r_hat(&chains.split())),
            ("r_hat_identity".to_owned(), plain_r_hat(chains)),
        ]);
    }
    found
}

#[test]
fn chain_diagnostics_are_those_of_arviz() {
    let (mut n_compared, mut undefined) = (0, BTreeMap::new());
    for case in golden("chains")["cases"].as_array().expect("cases") {
        let name = case["name"].as_str().expect("a name");
        let draws: Vec<Vec<f64>> = case["chains"]
            .as_array()
            .expect("chains")
            .iter()
            .map(numbers)
            .collect();
        let chains = Chains::from_draws(&draws).expect("at least four draws");
        for (key, found) in all_of(&chains) {
            let expected = number(&case["values"][&key]);
            match found {
                Ok(found) => {
                    assert!(
                        close(found, expected),
                        "{name}, {key}: {found}, stored {expected}"
                    );
                    n_compared += 1;
                }
                Err(reason) => {
                    let state = format!("{name}, {}", reason.name());
                    let keys: &mut Vec<String> = undefined.entry(state).or_default();
                    keys.push(format!("{key} {expected:.1}"));
                }
            }
        }
    }
    // All but these are compared; beside each is what arviz gives for it.
    let lines: Vec<String> = undefined
        .iter()
        .map(|(state, keys)| format!("{state}: {}", keys.join(", ")))
        .collect();
    insta::assert_snapshot!(lines.join("\n"), @"
    ar1-0.9-1-chain, too-rare: ess_tail 13.5, ess_quantile_0.05 13.5, mcse_quantile_0.05 1.4
    constant, constant: ess_bulk 100.0, ess_mean 100.0, ess_sd 100.0, ess_identity 100.0, ess_folded 100.0, ess_tail 100.0, ess_median 100.0, mcse_mean 0.0, mcse_sd NaN, mcse_median 0.0, ess_quantile_0.05 100.0, mcse_quantile_0.05 0.0, ess_quantile_0.25 100.0, mcse_quantile_0.25 0.0, ess_quantile_0.95 100.0, mcse_quantile_0.95 0.0, r_hat NaN, r_hat_bulk NaN, r_hat_folded NaN, r_hat_split NaN, r_hat_identity NaN
    indicator-common, constant: ess_quantile_0.95 1200.0, mcse_quantile_0.95 0.0
    indicator-uncommon, constant: ess_quantile_0.95 1600.0, mcse_quantile_0.95 0.0
    integers-3-chains-odd-length, constant: ess_quantile_0.95 996.0, mcse_quantile_0.95 0.0
    integers-4-chains, constant: ess_quantile_0.95 2000.0, mcse_quantile_0.95 0.0
    normal-2-chains-of-9, too-rare: ess_tail 19.3, ess_median 19.3, mcse_median 0.2, ess_quantile_0.05 19.3, mcse_quantile_0.05 0.5, ess_quantile_0.25 19.3, mcse_quantile_0.25 0.2, ess_quantile_0.95 19.3, mcse_quantile_0.95 0.2
    stuck-and-disagree, constant: ess_folded 100.0, ess_quantile_0.95 100.0, mcse_quantile_0.95 0.0
    stuck-and-disagree, stuck-disagree: ess_bulk 2.3, ess_mean 2.3, ess_sd 100.0, ess_identity 1.1, ess_tail 2.3, ess_median 2.3, mcse_mean 0.7, mcse_sd 0.0, mcse_median 1.0, ess_quantile_0.05 2.3, mcse_quantile_0.05 0.0, ess_quantile_0.25 2.3, mcse_quantile_0.25 1.0, r_hat inf, r_hat_bulk inf, r_hat_folded NaN, r_hat_split inf, r_hat_identity inf
    ");
    assert_eq!(n_compared, 414);
}

#[test]
fn agreement_of_partitions_is_that_of_scikit_learn() {
    let cases = golden("partitions");
    let cases = cases["cases"].as_array().expect("cases");
    assert_eq!(cases.len(), 13);
    for case in cases {
        let topology = |key: &str| {
            let labels: Vec<i64> = case[key]
                .as_array()
                .expect("labels")
                .iter()
                .filter_map(Value::as_i64)
                .collect();
            Topology::canonical(&labels)
        };
        let (truth, found) = (topology("truth"), topology("found"));
        let v_measure = VMeasure::new(&truth, &found).expect("detections");
        for (key, value) in [
            (
                "adjusted_rand_index",
                adjusted_rand_index(&truth, &found).expect("detections"),
            ),
            (
                "variation_of_information",
                variation_of_information(&truth, &found).expect("detections"),
            ),
            ("homogeneity", v_measure.homogeneity),
            ("completeness", v_measure.completeness),
            ("v_measure", v_measure.v_measure()),
        ] {
            let expected = number(&case[key]);
            assert!(
                (value - expected).abs() < 1e-13,
                "{}, {key}: {value}, {expected}",
                case["name"]
            );
        }
        let pairs = PairCounts::new(&truth, &found);
        // There, every pair is counted in both orders.
        let counts = [
            pairs.neither,
            pairs.only_found,
            pairs.only_truth,
            pairs.both,
        ]
        .map(|n| 2 * n);
        let table: Vec<u64> = case["pair_confusion"]
            .as_array()
            .expect("rows")
            .iter()
            .flat_map(|row| {
                row.as_array()
                    .expect("a row")
                    .iter()
                    .filter_map(Value::as_u64)
            })
            .collect();
        assert_eq!(counts.as_slice(), table, "{}", case["name"]);
    }
}
