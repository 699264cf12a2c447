//! The recovery rate of a cell: the share of worlds, or of chains, that recover the truth.
//!
//! The unit is the world, never the draw: chains on one world share its noise, and draws of one
//! chain share everything. A world's outcome is the share of its chains that recover.

use rand::Rng;

use super::interval::{Interval, bootstrap_mean, wilson};

/// How an interval was had.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum IntervalKind {
    /// Wilson on the number of worlds: every world's chains agree.
    WilsonWorlds,
    /// Percentile bootstrap over worlds.
    BootstrapWorlds,
    /// Student's law over worlds, each the mean of many cells.
    StudentWorlds,
    /// Wilson on the number of chains of the one data set: says how surely the sampler recovers on
    /// these data, and nothing of other data.
    SamplerOnly,
    /// Too few outcomes for an interval.
    None,
}

impl IntervalKind {
    /// In words, for tables and captions.
    pub fn words(self) -> &'static str {
        match self {
            Self::WilsonWorlds => "Wilson over worlds",
            Self::BootstrapWorlds => "bootstrap over worlds",
            Self::StudentWorlds => "Student over worlds",
            Self::SamplerOnly => "sampler only (Wilson over chains)",
            Self::None => "no interval",
        }
    }
}

/// A rate with its interval.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rate {
    /// The mean over worlds.
    pub rate: f64,
    /// Its 95 % interval.
    pub interval: Option<Interval>,
    /// How the interval was had.
    pub kind: IntervalKind,
    /// Number of units: worlds, or chains if there is one data set only.
    pub n: usize,
}

/// From the outcomes of the chains of every world; worlds without outcomes do not count. `None`
/// without any outcome. `many_worlds`: whether the worlds are replicates of a
/// simulation; otherwise there is one data set, and the units are its chains.
pub fn recovery_rate(worlds: &[Vec<bool>], many_worlds: bool, rng: &mut impl Rng) -> Option<Rate> {
    let worlds: Vec<&Vec<bool>> = worlds
        .iter()
        .filter(|outcomes| !outcomes.is_empty())
        .collect();
    let share =
        |outcomes: &[bool]| outcomes.iter().filter(|&&o| o).count() as f64 / outcomes.len() as f64;
    let shares: Vec<f64> = worlds.iter().map(|outcomes| share(outcomes)).collect();
    if shares.is_empty() {
        return None;
    }
    if !many_worlds {
        let rate = shares.iter().sum::<f64>() / shares.len() as f64;
        let outcomes: Vec<bool> = worlds
            .iter()
            .flat_map(|outcomes| outcomes.iter().copied())
            .collect();
        let successes = outcomes.iter().filter(|&&o| o).count() as u64;
        let interval = wilson(successes as f64, outcomes.len() as u64);
        return Some(Rate {
            rate,
            interval,
            kind: IntervalKind::SamplerOnly,
            n: outcomes.len(),
        });
    }
    let n = shares.len();
    let rate = shares.iter().sum::<f64>() / n as f64;
    // Where every world has the same share a bootstrap would see no spread; Wilson on the number of
    // worlds errs on the wide side, as no law on [0, 1] of that mean varies more than 0s and 1s.
    let all_equal = shares.iter().all(|share| *share == shares[0]);
    if all_equal || shares.iter().all(|&s| s == 0.0 || s == 1.0) {
        let interval = wilson(rate * n as f64, n as u64);
        return Some(Rate {
            rate,
            interval,
            kind: IntervalKind::WilsonWorlds,
            n,
        });
    }
    let interval = bootstrap_mean(&shares, rng);
    let kind = if interval.is_some() {
        IntervalKind::BootstrapWorlds
    } else {
        IntervalKind::None
    };
    Some(Rate {
        rate,
        interval,
        kind,
        n,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rng::Purpose;

    #[test]
    fn the_unit_is_the_world() {
        let mut rng = Purpose::new("test", 1).generator();
        let agree =
            recovery_rate(&[vec![true; 50], vec![false; 50]], true, &mut rng).expect("outcomes");
        assert_eq!(
            (agree.rate, agree.kind, agree.n),
            (0.5, IntervalKind::WilsonWorlds, 2)
        );
        // A hundred chains say no more than two worlds.
        assert_eq!(agree.interval, wilson(1.0, 2));
        let differ = recovery_rate(&[vec![true, false], vec![true; 2], vec![]], true, &mut rng);
        let differ = differ.expect("outcomes");
        assert_eq!(
            (differ.rate, differ.kind, differ.n),
            (0.75, IntervalKind::BootstrapWorlds, 2)
        );
        let lone = recovery_rate(&[vec![true, false]], true, &mut rng).expect("outcomes");
        assert_eq!(lone.interval, wilson(0.5, 1));
        let csv = recovery_rate(&[vec![true; 4]], false, &mut rng).expect("outcomes");
        assert_eq!(
            (csv.kind, csv.n, csv.interval),
            (IntervalKind::SamplerOnly, 4, wilson(4.0, 4))
        );
        let halves = vec![vec![true, false]; 5];
        let halves = recovery_rate(&halves, true, &mut rng).expect("outcomes");
        assert_eq!(
            (halves.rate, halves.kind),
            (0.5, IntervalKind::WilsonWorlds)
        );
        assert_eq!(halves.interval, wilson(2.5, 5));
        assert_eq!(recovery_rate(&[], true, &mut rng), None);
    }
}
