//! The table of convergence: one row for each world of each cell, its chains pooled.
//!
//! Every number that may be undefined has a column `…_state` beside it: `defined`, or in a word why
//! not (`constant`, `stuck-disagree`, `too-rare`, `too-short`, `too-few`, `not-finite`, `different-maps`, `atom`,
//! `not-judged`, `nothing-judged`, or `no-chain` where none ran to its end). An empty number never stands without its word.

use super::Table;
use super::rows::Builder;
use crate::diagnostics::undefined::Undefined;
use crate::results::convergence::{CoClusteringDifference, Diagnosis, Distance, QuantityDiagnosis};
use crate::results::{Answer, Judged, Starts, SweepResults, WorldResult};
use crate::sweep::Sweep;

type Measured = Result<f64, &'static str>;
type Quantity = fn(&Diagnosis) -> &QuantityDiagnosis;

fn measured(b: &mut Builder<'_, &WorldResult>, name: &str, value: impl Fn(&Diagnosis) -> Measured) {
    let of = |row: &&WorldResult| row.diagnosis.as_ref().map_or(Err("no-chain"), &value);
    b.numbers(name, |row| of(row).ok());
    b.texts(&format!("{name}_state"), |row| {
        Some(of(row).err().unwrap_or("defined").to_owned())
    });
}

/// The worst number of what the verdict rests on, or the first reason why there is none.
fn worst(
    diagnosis: &Diagnosis,
    value: fn(&Judged) -> Result<f64, Undefined>,
    of_two: fn(f64, f64) -> f64,
) -> Measured {
    let values: Result<Vec<f64>, Undefined> = diagnosis.judged.iter().map(value).collect();
    let values = values.map_err(|reason| reason.name())?;
    values.into_iter().reduce(of_two).ok_or("nothing-judged")
}

/// What a posterior prefers, in a word.
pub(super) fn answer_word(answer: Answer) -> &'static str {
    match answer {
        Answer::Truth => "truth",
        Answer::OtherMap => "other-map",
        Answer::Undecided(_) => "undecided",
    }
}

/// One row per cell and world.
pub fn convergence_table(sweep: &Sweep, results: &SweepResults) -> Table {
    let mut b = Builder::new(results.worlds.iter().collect::<Vec<&WorldResult>>(), sweep);
    fn of<T>(value: impl Fn(&Diagnosis) -> Option<T>) -> impl Fn(&&WorldResult) -> Option<T> {
        move |row| row.diagnosis.as_ref().and_then(&value)
    }
    b.cell_columns(|row| row.cell, false);
    b.counts("world", |row| Some(row.replicate + 1));
    b.texts("verdict", |row| Some(row.verdict.words().to_owned()));
    b.texts("convergence", |row| {
        let diagnosis = row.diagnosis.as_ref();
        Some(
            diagnosis
                .map_or("no-chain", |d| d.convergence.name())
                .to_owned(),
        )
    });
    b.texts("doubts", |row| {
        let doubts = match &row.diagnosis {
            None => return Some("no-chain".to_owned()),
            Some(diagnosis) if diagnosis.convergence.is_shown() => return Some("none".to_owned()),
            Some(diagnosis) => diagnosis.convergence.doubts(),
        };
        let words: Vec<String> = doubts.iter().map(|doubt| doubt.word()).collect();
        Some(words.join("; "))
    });
    b.counts("n_chains_planned", |row| Some(row.n_planned as u64));
    b.counts("n_chains_failed", |row| Some(row.n_failed as u64));
    b.counts("n_chains_missing", |row| Some(row.n_missing as u64));
    b.counts("first_proposal", of(|d| Some(d.first_step)));
    b.counts("n_proposals", of(|d| Some(d.n_steps)));
    b.counts("stride", of(|d| Some(d.stride)));
    let quantities: [(&str, Quantity); 4] = [
        ("n_sets", |d| &d.n_sets),
        ("ln_target", |d| &d.ln_target),
        ("at_map", |d| &d.at_map),
        ("map_distance", |d| &d.map_distance),
    ];
    for (name, quantity) in quantities {
        let mut column = |what: &str, value: fn(&QuantityDiagnosis) -> Measured| {
            measured(&mut b, &format!("{name}_{what}"), |d| value(quantity(d)));
        };
        column("r_hat", |q| q.r_hat.map_err(|reason| reason.name()));
        column("ess_bulk", |q| q.ess_bulk.map_err(|reason| reason.name()));
        column("ess_tail", |q| q.ess_tail.map_err(|reason| reason.name()));
        column("autocorrelation_time", |q| {
            q.autocorrelation_time.map_err(|reason| reason.name())
        });
        column("mean", |q| q.mean.map_err(|reason| reason.name()));
        column("mcse", |q| q.mcse.map_err(|reason| reason.name()));
    }
    b.counts(
        "n_initial_topologies",
        of(|d| Some(d.n_initial_topologies as u64)),
    );
    b.counts("n_probes", of(|d| Some(d.probes.n as u64)));
    b.counts("n_probes_came", of(|d| Some(d.probes.n_came as u64)));
    b.counts(
        "n_coupled",
        of(|d| Some(d.coupled.as_ref()?.n_pairs as u64)),
    );
    b.counts(
        "n_coupled_met",
        of(|d| Some(d.coupled.as_ref()?.n_met as u64)),
    );
    let bound = |d: &Diagnosis| d.coupled.as_ref()?.after_burn_in;
    b.numbers("coupled_distance", of(move |d| Some(bound(d)?.value)));
    b.numbers("coupled_distance_se", of(move |d| Some(bound(d)?.se)));
    b.counts("coupled_until_near", of(|d| d.coupled.as_ref()?.until_near));
    b.counts("n_judged", of(|d| Some(d.judged.len() as u64)));
    measured(&mut b, "judged_r_hat", |d| {
        worst(d, |own| own.r_hat, |a, b| a.max(b))
    });
    measured(&mut b, "judged_ess", |d| {
        worst(d, |own| own.ess, |a, b| a.min(b))
    });
    b.counts("n_starts", |row| Some(row.starts.n_starts as u64));
    type Column = (&'static str, fn(&Starts) -> Measured);
    let nested: [Column; 2] = [
        ("nested_r_hat_n_sets", |s| {
            s.n_sets.map_err(|reason| reason.name())
        }),
        ("nested_r_hat_ln_target", |s| {
            s.ln_target.map_err(|reason| reason.name())
        }),
    ];
    for (name, of) in nested {
        b.numbers(name, |row| of(&row.starts).ok());
        b.texts(&format!("{name}_state"), |row| {
            Some(of(&row.starts).err().unwrap_or("defined").to_owned())
        });
    }
    b.numbers("ess_topologies", of(|d| Some(d.ess_topologies)));
    let distance = |value: fn(&Distance) -> f64| {
        move |d: &Diagnosis| {
            let found = d.topologies.as_ref().map_err(|reason| reason.name());
            found.map(|found| value(&found.total_variation))
        }
    };
    measured(&mut b, "topology_distance", distance(|d| d.largest));
    measured(&mut b, "topology_distance_null_95", distance(|d| d.null_95));
    measured(&mut b, "topology_distance_p", distance(|d| d.p_value));
    let difference = |value: fn(&CoClusteringDifference) -> f64| {
        move |d: &Diagnosis| {
            let found = d.co_clustering.as_ref().map_err(|reason| reason.name());
            found.map(value)
        }
    };
    measured(&mut b, "co_clustering_largest", difference(|d| d.largest));
    measured(&mut b, "co_clustering_se", difference(|d| d.standard_error));
    measured(&mut b, "co_clustering_mean", difference(|d| d.mean));
    measured(&mut b, "unseen_mass", |d| {
        d.unseen
            .map(|found| found.mass)
            .map_err(|reason| reason.name())
    });
    measured(&mut b, "unseen_mass_se", |d| {
        let found = d.unseen.map_err(|reason| reason.name())?;
        found.standard_error.ok_or("none-seen-once-or-twice")
    });
    measured(&mut b, "n_topologies_95", |d| {
        d.n_holding
            .map(|found| found.n as f64)
            .map_err(|reason| reason.name())
    });
    measured(&mut b, "n_topologies_95_low", |d| {
        d.n_holding
            .map(|found| found.low as f64)
            .map_err(|reason| reason.name())
    });
    measured(&mut b, "n_topologies_95_high", |d| {
        let found = d.n_holding.map_err(|reason| reason.name())?;
        found
            .high
            .map(|high| high as f64)
            .ok_or("beyond-those-seen")
    });
    b.counts("posterior", |row| Some(row.posterior? as u64 + 1));
    b.texts("posterior_prefers", |row| {
        Some(answer_word(row.answer?).to_owned())
    });
    b.texts("map_labels", of(|d| Some(d.map_labels.clone())));
    b.texts("map_is_truth", |row| {
        let Some(diagnosis) = &row.diagnosis else {
            return Some("no-chain".to_owned());
        };
        let word = match diagnosis.map_is_truth {
            Some(true) => "yes",
            Some(false) => "no",
            None => "unknown",
        };
        Some(word.to_owned())
    });
    b.table
}
