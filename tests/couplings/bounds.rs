//! The bound of couplings against posteriors that are enumerated: it is never below the distance.
//!
//! On each target chains run from a start, and so do pairs of coupled chains. The bound is a mean over
//! pairs and the distance is that of counted topologies to the table, so both are estimates. They may
//! contradict by chance as far as a null explains, at a level that all comparisons share:
//!
//! - the distance of counts is above that of the law by ½ Σ √(q(1 − q)/n) on average and by another
//!   √(ln(1/α)/2n) with probability α at most (McDiarmid 1989);
//! - a mean of n terms ≥ 0 is below its expectation by √(2 E[x²] ln(1/α)/n) with probability α at most
//!   (Maurer 2003);
//! - the table has an error of its own.

use std::collections::HashMap;

use rayon::prelude::*;
use topometric::chain::{self, Meeting, Observer, Pair, Start};
use topometric::diagnostics::coupling::total_variation;
use topometric::model::{Model, Prior};
use topometric::partition::Topology;
use topometric::rng::Purpose;
use topometric::sampler::{SamplerSettings, State, StepInfo};
use topometric::settings::Settings;

#[path = "../common/oracle.rs"]
mod oracle;
use crate::verdicts::target::{Known, Target};

/// Of each target and start.
const N_PAIRS: u64 = 500;
const N_CHAINS: u64 = 5000;
/// Pairs that look how long a meeting takes, and steps after which any pair is given up.
const N_PILOTS: u64 = 40;
const LONGEST: u64 = 10_000;
/// Chains go no further than this, where meetings take longer too.
const MOST_STEPS: u64 = 200;
/// Targets of `just verdicts` that are looked at; rings are not enumerated.
const N_TARGETS: u64 = 24;
/// Of a false alarm in the whole test.
const LEVEL: f64 = 0.01;

/// A posterior with its table, and how far that may be off.
struct Enumerated {
    name: String,
    model: Model,
    prior: Prior,
    table: HashMap<Topology, f64>,
    table_error: f64,
}

fn targets() -> Vec<Enumerated> {
    let cases = [
        ("m1", oracle::m1()),
        ("m3", oracle::m3()),
        ("c1", oracle::c1()),
    ];
    let of_case = |(name, own): (&str, oracle::Oracle)| Enumerated {
        name: format!("oracle {name}"),
        model: own.model,
        prior: Prior::Uniform,
        table: own.probabilities,
        // As its README states, twice.
        table_error: 0.0012,
    };
    let of_target = |number: u64| {
        let target = Target::new(number)?;
        let settings = target.with(&[]);
        let model = target.data.model(&settings).unwrap();
        let Known::Table(rows) = target.known else {
            return None;
        };
        Some(Enumerated {
            name: format!("target {number}, {}", target.kind.words()),
            model,
            prior: settings.prior(),
            table: rows.into_iter().collect(),
            table_error: 0.01,
        })
    };
    let numbered: Vec<Enumerated> = (0..N_TARGETS)
        .into_par_iter()
        .filter_map(of_target)
        .collect();
    cases.map(of_case).into_iter().chain(numbered).collect()
}

/// The topology of a chain after so many steps.
struct At<'a> {
    steps: &'a [u64],
    found: Vec<Topology>,
}

impl Observer for At<'_> {
    fn start(&mut self, state: &State) {
        self.look(0, state);
    }

    fn step(&mut self, step: u64, state: &State, _: &StepInfo) {
        self.look(step + 1, state);
    }
}

impl At<'_> {
    fn look(&mut self, step: u64, state: &State) {
        if self.steps.contains(&step) {
            self.found.push(state.partition().topology());
        }
    }
}

/// One comparison: the bound and its uncertainty, the distance and its own.
struct Compared {
    what: String,
    bound: f64,
    mean_square: f64,
    distance: f64,
    by_chance: f64,
    table_error: f64,
}

impl Compared {
    /// The distance less what chance explains on average.
    fn least(&self) -> f64 {
        self.distance - self.by_chance - self.table_error
    }

    /// How far it is above the bound, less what the null allows; negative is fine.
    fn excess(&self, level: f64) -> f64 {
        let surprise = (1.0 / level).ln();
        let of_bound = (2.0 * self.mean_square * surprise / N_PAIRS as f64).sqrt();
        self.least() - self.bound - of_bound - (surprise / (2 * N_CHAINS) as f64).sqrt()
    }
}

fn sampler(n_detections: usize) -> SamplerSettings {
    let mut settings = Settings::default();
    settings.set_text("estimator", "explicit").unwrap();
    settings.sampler(n_detections)
}

/// When each pair met; `None` if it did not within `most` steps.
fn meetings(pair: &Pair<'_>, n: u64, most: u64, purpose: &Purpose) -> Vec<Option<u64>> {
    let meet = |number: u64| {
        let purpose = purpose.clone().number("pair", number);
        match pair.meet(most, &purpose, &|| false) {
            Meeting::Met(step) => Some(step),
            Meeting::Apart(_) | Meeting::Stopped => None,
        }
    };
    (0..n).into_par_iter().map(meet).collect()
}

/// The comparisons of one target and start; a reason if its pairs do not meet.
fn compared(target: &Enumerated, start: &Start) -> Result<Vec<Compared>, String> {
    let n_detections = target.model.n_detections();
    let settings = sampler(n_detections);
    let name = format!("{}, {start:?}", target.name);
    let purpose = Purpose::new("bounds test", 1).text("of", &name);
    let mut pair = Pair {
        model: &target.model,
        prior: target.prior,
        settings: &settings,
        start,
        lag: 20,
    };
    let pilots = meetings(
        &pair,
        N_PILOTS,
        LONGEST,
        &purpose.clone().text("use", "pilots"),
    );
    let mut met: Vec<u64> = pilots.iter().flatten().copied().collect();
    if met.len() < pilots.len() {
        let (n, of) = (met.len(), pilots.len());
        return Err(format!(
            "{name}: {n} of {of} pairs met within {LONGEST} steps"
        ));
    }
    met.sort_unstable();
    let usual = met[met.len() / 2];
    pair.lag = usual.max(20);
    let met = meetings(
        &pair,
        N_PAIRS,
        LONGEST,
        &purpose.clone().text("use", "pairs"),
    );
    // A pair that was given up counts as met there, which makes the bound smaller than it is.
    let met: Vec<u64> = met.into_iter().map(|met| met.unwrap_or(LONGEST)).collect();
    let furthest = usual.min(MOST_STEPS);
    let parts = [16, 8, 4, 2, 1].map(|part| furthest / part);
    let mut steps = [&[0][..], &parts[..]].concat();
    steps.dedup();
    let run = |number: u64| {
        let purpose = purpose
            .clone()
            .text("use", "chains")
            .number("chain", number);
        let mut at = At {
            steps: &steps,
            found: Vec::new(),
        };
        chain::run(
            &target.model,
            target.prior,
            &settings,
            start,
            furthest,
            &purpose,
            &mut at,
        );
        at.found
    };
    let found: Vec<Vec<Topology>> = (0..N_CHAINS).into_par_iter().map(run).collect();
    let of_step = |(place, &t): (usize, &u64)| {
        let mut counts: HashMap<&Topology, u64> = HashMap::new();
        for own in &found {
            *counts.entry(&own[place]).or_default() += 1;
        }
        let (mut distance, mut by_chance) = (0.0, 0.0);
        for (topology, probability) in &target.table {
            let share = counts.get(topology).copied().unwrap_or(0) as f64 / N_CHAINS as f64;
            distance += (share - probability).abs() / 2.0;
            by_chance += (share * (1.0 - share) / N_CHAINS as f64).sqrt() / 2.0;
        }
        let terms = met
            .iter()
            .map(|met| met.saturating_sub(pair.lag + t).div_ceil(pair.lag));
        let squares = terms.map(|term| (term * term) as f64);
        Compared {
            what: format!("{name}, {t} steps"),
            bound: total_variation(&met, pair.lag, t).value,
            // With none seen, as if one had been.
            mean_square: (squares.sum::<f64>() + 1.0) / N_PAIRS as f64,
            distance,
            by_chance,
            table_error: target.table_error,
        }
    };
    Ok(steps.iter().enumerate().map(of_step).collect())
}

/// `just couplings`: minutes on two cores.
#[test]
#[ignore = "minutes"]
#[allow(clippy::print_stderr, reason = "a skipped target must be named")]
fn the_bound_is_never_below_the_distance_on_enumerable_targets() {
    let targets = targets();
    let mut all = Vec::new();
    for target in &targets {
        for start in [Start::Singletons, Start::OneCluster] {
            match compared(target, &start) {
                Ok(found) => all.extend(found),
                Err(reason) => eprintln!("SKIPPED: {reason}"),
            }
        }
    }
    let n_far = all.iter().filter(|own| own.distance > 0.1).count();
    let tight = all.iter().filter(|own| own.least() > 0.1);
    let tight = tight.map(|own| (own.bound / own.least(), own.what.as_str()));
    let tightest = tight.min_by(|a, b| a.0.total_cmp(&b.0)).unwrap();
    let n_below = all.iter().filter(|own| own.bound < own.least()).count();
    eprintln!(
        "{} comparisons on {} targets; {n_far} distances above .1; the least bound is {:.2} times the \
         distance ({}); below it in {n_below}",
        all.len(),
        targets.len(),
        tightest.0,
        tightest.1
    );
    // Each comparison has two estimates.
    let level = LEVEL / (2 * all.len()) as f64;
    for own in &all {
        let excess = own.excess(level);
        assert!(
            excess <= 0.0,
            "{}: bound {}, distance {} (by chance {}), {excess} too far",
            own.what,
            own.bound,
            own.distance,
            own.by_chance
        );
    }
    assert!(all.len() > 150 && n_far > 30, "{} and {n_far}", all.len());
}
