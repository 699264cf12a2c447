//! Values of other programs: arviz-stats for chains, scikit-learn for partitions.

use serde_json::Value;

use super::{golden, number};
use crate::diagnostics::chains::Chains;
use crate::diagnostics::ess::{Ess, ess_bulk, ess_mean, ess_of, ess_quantile, ess_sd, ess_tail};
use crate::diagnostics::mcse;
use crate::diagnostics::r_hat::{plain_r_hat, r_hat};
use crate::diagnostics::ranks::{folded, rank_normalised};
use crate::diagnostics::undefined::Undefined;

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
    let (mut n_compared, mut undefined) = (0, Vec::new());
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
                        "{name}, {key}: {found}, arviz {expected}"
                    );
                    n_compared += 1;
                }
                Err(reason) => {
                    undefined.push(format!("{name}: {key} is {} ({expected})", reason.name()))
                }
            }
        }
    }
    // All but these are compared; the number in brackets is what arviz gives for them.
    insta::assert_snapshot!(format!("{n_compared} compared\n{}", undefined.join("\n")));
}
