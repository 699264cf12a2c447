//! The runs: every target by every sampler, from starts apart and from one start, from too short to long.

use std::sync::atomic::AtomicBool;

use topometric::diagnostics::chains::{Chains, Stretch};
use topometric::diagnostics::ess::{ess_bulk, ess_tail};
use topometric::diagnostics::r_hat::r_hat;
use topometric::diagnostics::undefined::Undefined;
use topometric::results::diagnose;
use topometric::results::sample::judgement;
use topometric::rng::{Generator, Purpose};
use topometric::run::{ChainOutcome, ExactTables, Judge, Looks, SampledChain, sample_chains};

use super::proximity::{Draws, psrf};
use super::target::Target;
use super::truth::{Event, events, is_off};

/// A sampler, by its settings.
pub struct Sampler {
    pub name: &'static str,
    pub settings: &'static [(&'static str, &'static str)],
}

pub const SAMPLERS: [Sampler; 3] = [
    Sampler {
        name: "the source report's",
        settings: &[("estimator", "fresh"), ("moves", "split-merge=1")],
    },
    Sampler {
        name: "the default",
        settings: &[],
    },
    // For the metric model alone.
    Sampler {
        name: "explicit",
        settings: &[("estimator", "explicit")],
    },
];

/// Proposals of each chain.
pub const LENGTHS: [u64; 6] = [300, 1000, 3000, 10_000, 30_000, 100_000];
/// Only every so many-th target is run at the largest length, which costs as much as all others.
const EVERY_LONGEST: u64 = 5;

/// The verdicts on one run of one target.
#[derive(Clone, Copy, Debug)]
pub struct Row {
    pub target: u64,
    pub sampler: usize,
    /// Whether the chains started apart.
    pub apart: bool,
    pub n_chains: usize,
    pub n_steps: u64,
    /// Verdicts of each rule, in the order of [`RULES`].
    pub shown: [bool; N_RULES],
    /// Whether a probability is off.
    pub off: bool,
    /// Whether the chains are at least ten times as long as this sampler needs on this target.
    pub long: bool,
    /// Whether the chains were led on until they had converged, and not asked for this length.
    pub led_on: bool,
}

/// The rules that are compared.
pub const RULES: [&str; N_RULES] = [
    "topologies, pairs and probes",
    "the rule before (M, ln target, topology distance)",
    "R-hat and ESS of M and ln target",
    "PSRF of the Hamming distance to a draw",
    "PSRF of the VI to a draw",
    "PSRF of the way along a tour",
    "R-hat and ESS of the Hamming distance to a draw",
    "R-hat and ESS of the VI to a draw",
    "R-hat and ESS of the way along a tour",
];
/// Rules, those of genMCMCDiag's maps last.
pub const N_RULES: usize = 9;
/// The first rule of one of genMCMCDiag's maps.
pub const FIRST_MAPPED: usize = 3;
/// Below this PSRF its users take chains as converged (Brooks & Gelman 1998).
const MAX_PSRF: f64 = 1.1;

/// One length of one sampler and start: four chains, and what single ones say of the mixing.
struct Run {
    n_steps: u64,
    singles: Vec<Vec<Event>>,
    judged: Vec<(usize, [bool; N_RULES], bool)>,
}

/// Where chains start, and whether that is apart.
const STARTS: [(&str, bool); 2] = [("apart", true), ("singletons", false)];

/// All runs of a target by one sampler.
pub fn study(target: &Target, sampler: usize, lengths: &[u64]) -> Vec<Row> {
    if SAMPLERS[sampler].name == "explicit" && target.is_covariance() {
        return Vec::new();
    }
    let lengths = lengths
        .iter()
        .filter(|length| **length < LENGTHS[5] || target.number.is_multiple_of(EVERY_LONGEST));
    let lengths: Vec<u64> = lengths.copied().collect();
    let of_start = |init: &str| -> Vec<Run> {
        lengths
            .iter()
            .map(|n_steps| run(target, sampler, init, *n_steps))
            .collect()
    };
    let runs = STARTS.map(|(init, apart)| (of_start(init), apart));
    let enough = long_enough(&runs, &lengths);
    let mut rows = Vec::new();
    for (runs, apart) in &runs {
        for run in runs {
            for &(n_chains, shown, off) in &run.judged {
                rows.push(Row {
                    target: target.number,

                    sampler,
                    apart: *apart,
                    n_chains,
                    n_steps: run.n_steps,
                    shown,
                    off,
                    long: enough.is_some_and(|least| run.n_steps >= 10 * least),
                    led_on: false,
                });
            }
        }
    }
    let longest = lengths.iter().max().copied().unwrap_or(0);
    for (init, apart) in STARTS {
        rows.push(led_on(
            target,
            sampler,
            (init, apart),
            (lengths[0], longest),
        ));
    }
    rows
}

/// Four chains that are led on from the first length to the last, until they have converged.
fn led_on(
    target: &Target,
    sampler: usize,
    (init, apart): (&str, bool),
    (first, longest): (u64, u64),
) -> Row {
    let (first, longest) = (first.to_string(), longest.to_string());
    let more = [
        ("samples", first.as_str()),
        ("max_samples", &longest),
        ("until", "converged"),
    ];
    let chains = chains(target, sampler, init, &more);
    let outcomes: Vec<&ChainOutcome> = chains.iter().map(|chain| &chain.outcome).collect();
    let n_chains = chains.len();
    let mut rng = references(target, sampler, init, 0);
    Row {
        target: target.number,
        sampler,
        apart,
        n_chains,
        n_steps: outcomes[0].n_steps,
        shown: verdicts(&chains, &mut rng),
        off: is_off(&events(target, &outcomes), n_chains),
        long: false,
        led_on: true,
    }
}

/// Four chains of a sampler, with more settings.
fn chains(
    target: &Target,
    sampler: usize,
    init: &str,
    more: &[(&'static str, &str)],
) -> Vec<SampledChain> {
    let mut all = SAMPLERS[sampler].settings.to_vec();
    all.extend([("init", init), ("exact_up_to", "0"), ("chains", "4")]);
    all.extend(more);
    let settings = target.with(&all);
    let judging: (Judge<'_>, Looks<'_>) = (&judgement, &|_, _| ());
    let (tables, stop) = (ExactTables::new(), AtomicBool::new(false));
    let chains = sample_chains(&target.data, &settings, &tables, judging, &stop).expect("chains");
    chains.expect("nobody stops them")
}

/// What takes a draw as the reference of genMCMCDiag's distances, in chains of this length.
fn references(target: &Target, sampler: usize, init: &str, n_steps: u64) -> Generator {
    let purpose = Purpose::new("reference draws", target.number).text("init", init);
    let purpose = purpose.number("sampler", sampler as u64);
    purpose.number("steps", n_steps).generator()
}

fn run(target: &Target, sampler: usize, init: &str, n_steps: u64) -> Run {
    let samples = n_steps.to_string();
    let chains = chains(target, sampler, init, &[("samples", &samples)]);
    let outcomes: Vec<&ChainOutcome> = chains.iter().map(|chain| &chain.outcome).collect();
    let mut rng = references(target, sampler, init, n_steps);
    let judged = [2, 4].map(|n_chains| {
        let off = is_off(&events(target, &outcomes[..n_chains]), n_chains);
        (n_chains, verdicts(&chains[..n_chains], &mut rng), off)
    });
    Run {
        n_steps,
        singles: outcomes.iter().map(|own| events(target, &[own])).collect(),
        judged: judged.to_vec(),
    }
}

/// The least length that is enough: 100 times the largest autocorrelation time of a material event, and
/// such that no single chain is off from there on. `None` if the longest is not enough.
///
/// The time is measured against the posterior: the mean square error of a share of n draws is
/// p(1 − p) τ/n.
fn long_enough(runs: &[(Vec<Run>, bool)], lengths: &[u64]) -> Option<u64> {
    let singles = |place: usize| {
        runs.iter()
            .flat_map(move |(runs, _)| runs[place].singles.iter())
    };
    let longest = lengths.len() - 1;
    let n = singles(longest).count() as f64;
    let n_events = singles(longest).map(Vec::len).min()?;
    let mean_square = |event: usize| -> f64 {
        singles(longest)
            .filter_map(|own| own[event].relative_square())
            .sum::<f64>()
            / n
    };
    let worst = (0..n_events).map(mean_square).fold(0.0, f64::max);
    let time = worst * lengths[longest] as f64;
    let is_fine = |place: &usize| singles(*place).all(|own| !is_off(own, 1));
    let first = (0..lengths.len()).rev().take_while(is_fine).last()?;
    Some(lengths[first].max((100.0 * time).ceil() as u64))
}

fn verdicts(sampled: &[SampledChain], references: &mut Generator) -> [bool; N_RULES] {
    let chains: Vec<&ChainOutcome> = sampled.iter().map(|chain| &chain.outcome).collect();
    let mut rng = Purpose::new("verdicts", 1).generator();
    let found = diagnose(&chains, &mut rng).expect("chains");
    let first = found.first_step;
    let of = |value: &dyn Fn(&ChainOutcome) -> Vec<Stretch>| {
        Chains::new(&chains.iter().map(|chain| value(chain)).collect::<Vec<_>>())
    };
    let n_sets = of(&|chain| {
        let series = &chain.series;
        series
            .stretches(&series.n_sets, first)
            .map(|(m, n)| (f64::from(m), n))
            .collect()
    });
    let ln_target = of(&|chain| {
        let series = &chain.series;
        series.stretches(&series.ln_target, first).collect()
    });
    let scalars = [n_sets, ln_target];
    let least = 100.0 * chains.len() as f64;
    let pass = scalars.iter().all(|own| passes(own, least));
    let constant = scalars.iter().all(|own| {
        matches!(
            own.as_ref().map(Chains::standstill),
            Ok(Some(Undefined::Constant { .. })) | Err(_)
        )
    });
    let topologies = found.topologies.as_ref();
    let apart = topologies.map_or(true, |own| own.total_variation.p_value < 0.01);
    let rests = |chain: &&ChainOutcome| {
        let map = chain
            .top
            .first()
            .filter(|top| top.labels == found.map_labels);
        let map = map.filter(|top| top.frequency >= 0.95);
        map.is_some() && chain.journey.arrival > 0
    };
    let before = chains.iter().all(rests) || (pass && !constant && !apart);
    let [first, second, third, fourth, fifth, sixth] =
        mapped_verdicts(sampled, found.first_step, references);
    let ours = found.by_rule.is_shown();
    [
        ours, before, pass, first, second, third, fourth, fifth, sixth,
    ]
}

/// Of genMCMCDiag's maps from step `first_step` on: PSRF alone, then R-hat and ESS, of each.
fn mapped_verdicts(
    chains: &[SampledChain],
    first_step: u64,
    references: &mut Generator,
) -> [bool; N_RULES - FIRST_MAPPED] {
    let traces: Vec<_> = chains.iter().map(|chain| &chain.trace).collect();
    let draws = Draws::new(&traces, first_step);
    let reference = draws.one_of_them(references);
    let maps = [
        draws.hamming_to(reference),
        draws.information_to(reference),
        draws.way(),
    ];
    let least = 100.0 * chains.len() as f64;
    let [hamming, information, way] = maps.each_ref().map(has_small_psrf);
    let [a, b, c] = maps.each_ref().map(|map| passes(map, least));
    [hamming, information, way, a, b, c]
}

/// PSRF below 1.1; a constant passes, as it does for R-hat.
fn has_small_psrf(chains: &Result<Chains, Undefined>) -> bool {
    chains
        .as_ref()
        .is_ok_and(|chains| match chains.standstill() {
            Some(reason) => matches!(reason, Undefined::Constant { .. }),
            None => psrf(chains) < MAX_PSRF,
        })
}

/// R-hat at most 1.01 and enough effective draws in bulk and tails; a constant passes.
fn passes(chains: &Result<Chains, Undefined>, least: f64) -> bool {
    let Ok(chains) = chains else { return false };
    if let Some(reason) = chains.standstill() {
        return matches!(reason, Undefined::Constant { .. });
    }
    let enough = |ess: Result<f64, Undefined>| match ess {
        Ok(ess) => ess >= least,
        Err(Undefined::Constant { .. }) => true,
        Err(_) => false,
    };
    r_hat(chains).is_ok_and(|found| found.value() <= 1.01)
        && enough(ess_bulk(chains).map(|own| own.ess))
        && enough(ess_tail(chains).value().map(|own| own.ess))
}
