//! The table of posteriors: one row for each model and world that cells asked the reference sampler
//! for.

use super::convergence::answer_word;
use super::{Table, Values};
use crate::results::{Answer, Posterior, SweepResults};
use crate::run::{AskedPosterior, Plan, PosteriorTopology};
use crate::settings::{Section, Value};
use crate::sweep::Sweep;

/// One row per posterior; `None` if none was asked for.
pub fn posteriors_table(sweep: &Sweep, plan: &Plan, results: &SweepResults) -> Option<Table> {
    let rows: Vec<(&AskedPosterior, &Posterior)> =
        plan.posteriors().iter().zip(&results.posteriors).collect();
    if rows.is_empty() {
        return None;
    }
    let mut table = Table::default();
    type Row<'a> = (&'a AskedPosterior, &'a Posterior);
    let texts = |value: &dyn Fn(Row<'_>) -> Option<String>| {
        Values::Texts(rows.iter().map(|row| value(*row)).collect())
    };
    let counts = |value: &dyn Fn(Row<'_>) -> Option<u64>| {
        Values::Counts(rows.iter().map(|row| value(*row)).collect())
    };
    let numbers = |value: &dyn Fn(Row<'_>) -> Option<f64>| {
        Values::Numbers(rows.iter().map(|row| value(*row)).collect())
    };
    let places = (1..=rows.len() as u64).map(Some);
    table.push("posterior", Values::Counts(places.collect()));
    table.push("data", counts(&|(asked, _)| Some(asked.data as u64 + 1)));
    table.push(
        "cells",
        texts(&|(asked, _)| {
            let ids = asked
                .cells
                .iter()
                .map(|&cell| sweep.cells[cell].id.as_str());
            Some(ids.collect::<Vec<_>>().join(" "))
        }),
    );
    for (key, default) in sweep
        .base
        .iter()
        .filter(|(key, _)| key.section == Section::Model)
    {
        let value = |(asked, _): Row<'_>| asked.settings.get(key.name).clone();
        let column = match default {
            Value::Number(_) => numbers(&|row| match value(row) {
                Value::Number(number) => Some(number),
                _ => None,
            }),
            _ => texts(&|row| Some(value(row).to_string())),
        };
        table.push(key.name, column);
    }
    table.push(
        "n_chains_planned",
        counts(&|(_, own)| Some(own.n_planned as u64)),
    );
    table.push(
        "n_chains_failed",
        counts(&|(_, own)| Some(own.n_failed as u64)),
    );
    table.push(
        "n_chains_missing",
        counts(&|(_, own)| Some(own.n_missing as u64)),
    );
    table.push("reason", texts(&|(_, own)| own.failure.clone()));
    table.push(
        "answered_by",
        texts(&|(_, own)| {
            let by = match (own.is_exact, own.n_planned) {
                (true, _) => "exact",
                (false, 0) => "nothing",
                (false, _) => "reference chains",
            };
            Some(by.to_owned())
        }),
    );
    table.push(
        "convergence",
        texts(&|(_, own)| {
            let found = own.diagnosis.as_ref().map(|found| found.convergence.name());
            Some(found.unwrap_or("no-chain").to_owned())
        }),
    );
    table.push(
        "doubts",
        texts(&|(_, own)| {
            let doubts = own.diagnosis.as_ref()?.convergence.doubts();
            let words: Vec<String> = doubts.iter().map(|doubt| doubt.word()).collect();
            (!words.is_empty()).then(|| words.join("; "))
        }),
    );
    table.push(
        "prefers",
        texts(&|(_, own)| Some(answer_word(own.answer?).to_owned())),
    );
    table.push(
        "undecided_because",
        texts(&|(_, own)| match own.answer? {
            Answer::Undecided(why) => Some(why.name().to_owned()),
            Answer::Truth | Answer::OtherMap => None,
        }),
    );
    fn likeliest(own: &Posterior) -> Option<&PosteriorTopology> {
        own.topologies.first()
    }
    table.push(
        "map_labels",
        texts(&|(_, own)| Some(likeliest(own)?.labels.clone())),
    );
    table.push(
        "map_n_sets",
        counts(&|(_, own)| Some(likeliest(own)?.n_sets)),
    );
    table.push(
        "map_probability",
        numbers(&|(_, own)| Some(likeliest(own)?.probability)),
    );
    table.push(
        "truth_probability",
        numbers(&|(_, own)| {
            let truth = own.topologies.iter().find(|top| top.is_truth == Some(true));
            Some(truth?.probability)
        }),
    );
    Some(table)
}
