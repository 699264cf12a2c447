//! Whose fault the wrong maps are, in words and as a part of the report.

use super::section::{Block, Entry, Section, Table};
use super::{Material, figures, words};
use crate::results::sensitivity::{Attribution, attribution};
use crate::results::{Answer, Fault, Faults};

/// "12 of 20 chains end at a wrong map: 8 the model’s, 4 the sampler’s".
pub(super) fn counts(faults: Faults) -> String {
    let chains = words::counted(faults.n_all(), "chain");
    if faults.n_failures() == 0 {
        return format!("none of {chains} ends at a wrong map");
    }
    let parts = Fault::ALL.into_iter().filter(|fault| faults.n(*fault) > 0);
    let parts: Vec<String> = parts
        .map(|fault| format!("{} {}", words::thousands(faults.n(fault)), fault.words()))
        .collect();
    let n = words::thousands(faults.n_failures());
    format!("{n} of {chains} end at a wrong map: {}", parts.join(", "))
}

/// What to change where most wrong maps are of one fault.
pub(super) fn what_now(faults: Faults) -> &'static str {
    let is_most = |fault: Fault| 2 * faults.n(fault) > faults.n_failures();
    if is_most(Fault::Model) {
        " Change the model: a better sampler would end at wrong maps too."
    } else if is_most(Fault::Sampler) {
        " Change the sampler, or lengthen its chains: the model is fine."
    } else if is_most(Fault::Arithmetic) {
        " Use arithmetic = \"log\": the model is fine."
    } else {
        ""
    }
}

/// What [`split`] gives, as a heading.
pub(super) const SPLIT: &str = "wrong maps: model’s / sampler’s / undecided";

/// "8 / 4 / 0": wrong maps of the model, of the sampler and its arithmetic, and undecided ones.
pub(super) fn split(faults: Option<Faults>) -> String {
    faults.map_or_else(words::dash, |own| {
        let of_sampler = own.n(Fault::Sampler) + own.n(Fault::Arithmetic);
        let (of_model, undecided) = (own.n(Fault::Model), own.n(Fault::Undecided));
        format!("{of_model} / {of_sampler} / {undecided}")
    })
}

/// "Of what the six settings change in the recovery rate, 71 % is the model’s, …".
pub(super) fn of_sensitivity(material: Material<'_>) -> Option<String> {
    let found = &material.results.sensitivity;
    let all = found.attributions();
    let shares = attribution::shares(&all)?;
    let parts = Fault::ALL
        .into_iter()
        .zip(shares)
        .filter(|(_, share)| *share > 0.0);
    let parts: Vec<String> = parts
        .map(|(fault, share)| format!("{} is {}", words::percent(Some(share)), fault.words()))
        .collect();
    Some(format!(
        "Of what {} in the recovery rate, {}.",
        match all.len() {
            1 => "the one setting changes".to_owned(),
            n => format!("the {n} settings change"),
        },
        parts.join(", ")
    ))
}

/// The part of the report: the counts, what each setting changes, and the picture.
pub(super) fn section(material: Material<'_>) -> Option<Section> {
    let faults = material.results.faults()?;
    let posteriors = &material.results.posteriors;
    let n_with = |is: fn(Answer) -> bool| {
        let known = posteriors.iter().filter_map(|own| own.answer);
        known.filter(|answer| is(*answer)).count()
    };
    let mut blocks = vec![Block::Text(format!(
        "A map is wrong if it is not the truth. The posterior says whose fault that is. Cells that differ only in settings of the sampler share one. {} were asked for: the exact \
         one of few detections, otherwise by chains of the reference sampler. {} have the truth as \
         their MAP topology, {} prefer another map, and {} are undecided, because the reference \
         chains have not converged or two maps are about as probable. {}.",
        words::counted(posteriors.len(), "posterior"),
        n_with(|answer| answer == Answer::Truth),
        n_with(|answer| answer == Answer::OtherMap),
        n_with(|answer| matches!(answer, Answer::Undecided(_))),
        capital(&counts(faults)),
    ))];
    blocks.extend(of_sensitivity(material).map(|sentence| {
        let how = "Counted are the absolute differences between the levels furthest apart, summed \
                   over the settings.";
        Block::Text(format!("{sentence} {how}"))
    }));
    blocks.extend(by_factor(material).map(Block::Table));
    blocks.extend(figures::faults(material).map(Block::from));
    Some(Section {
        id: "faults".into(),
        title: "Whose fault are the wrong maps?".to_owned(),
        blocks,
    })
}

fn capital(text: &str) -> String {
    let mut chars = text.chars();
    let first = chars.next().map(|c| c.to_uppercase().to_string());
    first.unwrap_or_default() + chars.as_str()
}

/// What each setting changes in recovery, by fault.
fn by_factor(material: Material<'_>) -> Option<Table> {
    let found = &material.results.sensitivity;
    let all = found.attributions();
    let signed = |share: f64| {
        // Not "−0".
        let text = format!("{:+.0}\u{a0}points", (100.0 * share).round() + 0.0);
        text.replace('-', "−")
    };
    let row = |own: &Attribution| -> Vec<Entry> {
        let factor = &found.factors[own.factor];
        let levels = format!("{} → {}", factor.labels[own.from], factor.labels[own.to]);
        let mut row = vec![
            factor.key.label().into(),
            levels.into(),
            Entry::strong(signed(own.recovery)),
        ];
        row.extend(own.by_fault.map(|share| Entry::from(signed(share))));
        row
    };
    let head = ["setting", "levels furthest apart", "recovery changes by"];
    let by_fault = Fault::ALL.map(|fault| format!("of it {}", fault.words()));
    (!all.is_empty()).then(|| Table {
        head: head
            .map(str::to_owned)
            .into_iter()
            .chain(by_fault)
            .collect(),
        rows: all.iter().map(row).collect(),
    })
}
