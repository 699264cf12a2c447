//! `docs/verdicts.md` and its picture.

use std::fmt::Write as _;

use topometric::figure::effects::Interval;
use topometric::figure::response_curves::{Curve, CurvePanel, ResponseCurves};

use super::mapped;
use super::rates::{Share, share, words};
use super::study::{FIRST_MAPPED, RULES, Row, SAMPLERS};
use super::target::Kind;

/// Of the verdicts "converged", those that are false.
pub fn n_false(rows: &[Row], rule: usize, of: impl Fn(&Row) -> bool) -> Option<Share> {
    let counted = |row: &Row| !row.led_on && of(row) && row.shown[rule];
    share(rows, counted, |row| row.off)
}

/// Of the runs that are long enough, those whose verdict is withheld.
pub fn withheld(rows: &[Row], rule: usize, of: impl Fn(&Row) -> bool) -> Option<Share> {
    let counted = |row: &Row| !row.led_on && of(row) && row.long;
    share(rows, counted, |row| !row.shown[rule])
}

pub fn page(rows: &[Row], kinds: &[(Kind, bool)], lengths: &[u64]) -> String {
    let n = kinds.len();
    let of_kind = |kind: Kind| kinds.iter().filter(|own| own.0 == kind).count();
    let made: Vec<String> = Kind::ALL
        .iter()
        .map(|kind| format!("{} {}", of_kind(*kind), kind.words()))
        .collect();
    let n_covariance = kinds.iter().filter(|own| own.1).count();
    let mut text = format!(
        "# How often a verdict is wrong\n\n\
         Written by `just verdicts`. `ptm` says of chains that they have converged. This page measures \
         how often that is false, and how often it is withheld from chains that are long enough.\n\n\
         **Targets.** {n} posteriors that are known: {}. Those with at most eight detections are \
         enumerated. On a ring of 6 to 20 detections every rotation of a topology has the same \
         probability, so that frequencies which differ are wrong. {n_covariance} have the covariance model; \
         priors are uniform, Poisson and Dirichlet process.\n\n\
         **Runs.** Three samplers: the source report's (`fresh`, blind split-merge), the default one \
         (`common` on so few detections), and `explicit` on the metric model. Chains make {} to {} \
         proposals. The first two chains of four are judged, and all four. They start apart, and from \
         singletons alone. Each chain sends out four probes.\n\n\
         **False.** The verdict is \"converged\", and a pooled probability is off by more than \
         max(.05, 4 √(p(1−p)/(100 C))), with C chains: four standard errors at the least ESS that the rule \
         asks for. That is asked of each pair of detections, and of each topology of mass .05 or more.\n\n\
         **Withheld.** The verdict is not \"converged\", though the chains are ten times as long as this \
         sampler needs on this target. That is 100 autocorrelation times of its slowest event, with no \
         single chain off at that length or a larger one.\n\n\
         Shares in per cent, with 95 % intervals from resampled targets (where none is bad, up to three \
         over the number of targets), and the number of verdicts that they are of. These are rates of the \
         rule alone: for few detections `ptm` compares with the exact posterior instead, so that a false \
         verdict in the sense above cannot occur.\n\n\
         ![False and withheld verdicts by the length of the chains](verdicts.png)\n\n",
        made.join(", "),
        lengths[0],
        lengths[lengths.len() - 1]
    );
    for (rule, name) in RULES.iter().enumerate().take(FIRST_MAPPED) {
        let _ = write!(text, "## {name}\n\n{}\n\n", about(rule));
        by_sampler(&mut text, rows, rule);
    }
    mapped::section(&mut text, rows, n);
    by_length(&mut text, rows, lengths);
    led_on(&mut text, rows, lengths);
    by_kind(&mut text, rows);
    text
}

fn about(rule: usize) -> &'static str {
    match rule {
        0 => "The rule that `ptm` uses: [convergence.md](convergence.md).",
        1 => {
            "R-hat and ESS of M and ln target, tails included, and the distance between the chains' \
             topologies; or 95 % of every chain at one topology. Used before this rule."
        }
        _ => "What one would say without looking at the topology.",
    }
}

type Class = (&'static str, fn(&Row) -> bool);
const CLASSES: [Class; 4] = [
    ("two chains apart", |row| row.apart && row.n_chains == 2),
    ("four chains apart", |row| row.apart && row.n_chains == 4),
    ("two from one start", |row| !row.apart && row.n_chains == 2),
    ("four from one start", |row| !row.apart && row.n_chains == 4),
];

fn by_sampler(text: &mut String, rows: &[Row], rule: usize) {
    text.push_str("| sampler | chains | false, % | withheld, % |\n|---|---|---|---|\n");
    for (sampler, own) in SAMPLERS.iter().enumerate() {
        for (name, is_of) in CLASSES {
            let of = |row: &Row| row.sampler == sampler && is_of(row);
            let _ = writeln!(
                text,
                "| {} | {name} | {} | {} |",
                own.name,
                words(n_false(rows, rule, of)),
                words(withheld(rows, rule, of))
            );
        }
    }
    text.push('\n');
}

fn by_length(text: &mut String, rows: &[Row], lengths: &[u64]) {
    let _ = write!(
        text,
        "## By length\n\nThe rule of `ptm`, all samplers and all starts: two chains, four chains; and beside it \
         R-hat and ESS of M and ln target, four chains. Where few runs are called converged, as at 300 \
         proposals, their share of false ones is not known well.\n\n\
         | proposals | false: two | false: four | withheld: two | withheld: four | false: R-hat, four |\n\
         |---|---|---|---|---|---|\n"
    );
    for &n_steps in lengths {
        let of = |n: usize| move |row: &Row| row.n_steps == n_steps && row.n_chains == n;
        let _ = writeln!(
            text,
            "| {n_steps} | {} | {} | {} | {} | {} |",
            words(n_false(rows, 0, of(2))),
            words(n_false(rows, 0, of(4))),
            words(withheld(rows, 0, of(2))),
            words(withheld(rows, 0, of(4))),
            words(n_false(rows, 2, of(4)))
        );
    }
    text.push('\n');
}

/// Looking often and stopping at a good moment costs error rate: how much.
fn led_on(text: &mut String, rows: &[Row], lengths: &[u64]) {
    let _ = write!(
        text,
        "## Until converged\n\nFour chains that are led on (`until = \"converged\"`): looked at after {} proposals, twice as \
         many, and so on, until the rule of `ptm` calls them converged, for the last time after {}.\n\n\
         | sampler | start | converged, % | false, % of those |\n|---|---|---|---|\n",
        lengths[0],
        lengths[lengths.len() - 1]
    );
    for (sampler, own) in SAMPLERS.iter().enumerate() {
        for (name, apart) in [("apart", true), ("one start", false)] {
            let of = |row: &Row| row.led_on && row.sampler == sampler && row.apart == apart;
            let _ = writeln!(
                text,
                "| {} | {name} | {} | {} |",
                own.name,
                words(share(rows, of, |row| row.shown[0])),
                words(share(rows, |row| of(row) && row.shown[0], |row| row.off))
            );
        }
    }
    text.push('\n');
}

fn by_kind(text: &mut String, rows: &[Row]) {
    text.push_str(
        "## By kind of target\n\nFour chains.\n\n| target | false | withheld | false: before | \
         false: R-hat |\n|---|---|---|---|---|\n",
    );
    for kind in Kind::ALL {
        let of = |row: &Row| row.n_chains == 4 && Kind::ALL[(row.target % 5) as usize] == kind;
        let _ = writeln!(
            text,
            "| {} | {} | {} | {} | {} |",
            kind.words(),
            words(n_false(rows, 0, of)),
            words(withheld(rows, 0, of)),
            words(n_false(rows, 1, of)),
            words(n_false(rows, 2, of))
        );
    }
}

/// The rules that the first picture compares.
pub const RULES_OF_FIGURE: [usize; 3] = [0, 1, 2];

/// Shares by length, for four chains from starts apart.
pub fn figure(rows: &[Row], lengths: &[u64], rules: &[usize]) -> Vec<u8> {
    let curve = |rule: usize, of_rule: &dyn Fn(usize, u64) -> Option<Share>| Curve {
        name: RULES[rule].to_owned(),
        points: lengths
            .iter()
            .map(|length| of_rule(rule, *length).map(interval))
            .collect(),
    };
    let of = |length: u64| move |row: &Row| row.apart && row.n_chains == 4 && row.n_steps == length;
    let falsely = |rule: usize, length: u64| n_false(rows, rule, of(length));
    let missed = |rule: usize, length: u64| withheld(rows, rule, of(length));
    let panel = |name: &str, of_rule: &dyn Fn(usize, u64) -> Option<Share>| CurvePanel {
        name: name.to_owned(),
        levels: lengths.iter().map(ToString::to_string).collect(),
        by: "rule".to_owned(),
        curves: rules.iter().map(|rule| curve(*rule, of_rule)).collect(),
        best: None,
    };
    ResponseCurves {
        title: "Verdicts on four chains from starts apart, by proposals a chain".to_owned(),
        panels: vec![
            panel("false, of those shown", &falsely),
            panel("withheld, of chains long enough", &missed),
        ],
        value_name: "share of verdicts".to_owned(),
        range: (0.0, 1.0),
        percent: true,
    }
    .page(1600, 900)
    .png()
}

fn interval(share: Share) -> Interval {
    Interval {
        low: share.low,
        estimate: share.value,
        high: share.high,
    }
}
