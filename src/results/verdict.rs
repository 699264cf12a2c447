//! What to make of the chains on a world, and of a cell: did they find the truth, and may one
//! believe them?

use super::convergence::Diagnosis;
use crate::diagnostics::beta::regularised_beta;
use crate::diagnostics::interval::at_least;

/// The verdict on one world of a cell.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Verdict {
    /// The chains have converged, and their MAP topology is the truth.
    Recovered,
    /// The chains have converged; the truth is not known.
    ConvergedTruthUnknown,
    /// Some chain's MAP topology is the truth, though convergence is not shown.
    ByLuck,
    /// The chains have converged to a MAP topology that is not the truth.
    WrongMap,
    /// Convergence is not shown, and no chain found the truth, or it is not known.
    NotConverged,
    /// No chain ran to its end.
    Failed,
    /// No chain has been run yet.
    Missing,
}

impl Verdict {
    /// All, from the best to the worst.
    pub const ALL: [Self; 7] = [
        Self::Recovered,
        Self::ConvergedTruthUnknown,
        Self::ByLuck,
        Self::WrongMap,
        Self::NotConverged,
        Self::Failed,
        Self::Missing,
    ];

    /// In words.
    pub fn words(self) -> &'static str {
        match self {
            Self::Recovered => "recovered and converged",
            Self::ConvergedTruthUnknown => "converged, truth unknown",
            Self::ByLuck => "recovered by luck",
            Self::WrongMap => "converged to a wrong map",
            Self::NotConverged => "not converged",
            Self::Failed => "failed",
            Self::Missing => "missing",
        }
    }

    /// As the name of a column.
    pub fn name(self) -> &'static str {
        match self {
            Self::Recovered => "recovered_and_converged",
            Self::ConvergedTruthUnknown => "converged_truth_unknown",
            Self::ByLuck => "recovered_by_luck",
            Self::WrongMap => "wrong_map",
            Self::NotConverged => "not_converged",
            Self::Failed => "failed",
            Self::Missing => "missing",
        }
    }

    /// On one world, from its diagnosis, whether any of its chains found the truth, and how many
    /// chains failed.
    pub fn of_world(diagnosis: Option<&Diagnosis>, any_recovered: bool, n_failed: usize) -> Self {
        let Some(diagnosis) = diagnosis else {
            return if n_failed > 0 {
                Self::Failed
            } else {
                Self::Missing
            };
        };
        match (diagnosis.convergence.is_shown(), diagnosis.map_is_truth) {
            (true, Some(true)) => Self::Recovered,
            (true, Some(false)) => Self::WrongMap,
            (true, None) => Self::ConvergedTruthUnknown,
            (false, _) if any_recovered => Self::ByLuck,
            (false, _) => Self::NotConverged,
        }
    }
}

/// A good verdict on a cell is wrong about most worlds like these at most this often.
const LEVEL: f64 = 0.05;
/// Share of the worlds with converged chains that may have a wrong map for the others to be relied
/// on: a reader who has no truth sees only that chains converged, and takes a wrong map for a right
/// one.
const MOST_WRONG: f64 = 0.05;
/// Worlds beyond which [`WorldsByVerdict::to_settle`] looks no further.
const MOST_WORLDS: usize = 1000;

/// The verdict on a cell.
///
/// It is that of the most of its worlds, the worst of those that tie. A **good** one (recovered, or
/// converged with the truth unknown) tells the reader to rely on the cell, so it needs more: a
/// share of worlds above one half that chance does not explain, and hardly any converged world with
/// a wrong map. Without that the cell is [`CellVerdict::Undecided`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum CellVerdict {
    /// That of the most of its worlds; if it is a good one, then of most worlds like these.
    Of(Verdict),
    /// Most of its worlds are good, or as many as of any other verdict, but not enough of them to
    /// rely on.
    Undecided,
}

impl From<Verdict> for CellVerdict {
    fn from(verdict: Verdict) -> Self {
        Self::Of(verdict)
    }
}

impl CellVerdict {
    /// All, from the best to the worst.
    pub const ALL: [Self; 8] = [
        Self::Of(Verdict::Recovered),
        Self::Of(Verdict::ConvergedTruthUnknown),
        Self::Undecided,
        Self::Of(Verdict::ByLuck),
        Self::Of(Verdict::WrongMap),
        Self::Of(Verdict::NotConverged),
        Self::Of(Verdict::Failed),
        Self::Of(Verdict::Missing),
    ];

    /// In words.
    pub fn words(self) -> &'static str {
        match self {
            Self::Of(verdict) => verdict.words(),
            Self::Undecided => "undecided",
        }
    }

    /// Its place in [`CellVerdict::ALL`].
    pub fn place(self) -> usize {
        let place = Self::ALL.iter().position(|known| *known == self);
        place.expect("all verdicts are there")
    }
}

/// How many worlds of a cell have each verdict.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct WorldsByVerdict {
    /// In the order of [`Verdict::ALL`].
    counts: [usize; Verdict::ALL.len()],
    /// Whether the one world is all that there is: recorded detections, a simulation of one world,
    /// or one without noise.
    pub is_only_world: bool,
}

/// What would turn an undecided cell into one to rely on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ToSettle {
    /// More worlds that suffice if all of them are good.
    pub at_best: usize,
    /// Worlds in all that suffice at the share seen so far; `None` if that is one half at most, or
    /// more than 1,000 are needed.
    pub in_all: Option<usize>,
}

impl WorldsByVerdict {
    /// Counts them.
    pub fn new(worlds: &[Verdict], is_only_world: bool) -> Self {
        let count = |verdict: Verdict| worlds.iter().filter(|own| **own == verdict).count();
        Self {
            counts: Verdict::ALL.map(count),
            is_only_world,
        }
    }

    /// Counts the worlds of other cells in, which are then no longer of one cell.
    pub fn add(&mut self, others: &Self) {
        for (count, n) in self.counts.iter_mut().zip(others.counts) {
            *count += n;
        }
    }

    /// Share of the judged worlds that are recovered and on which the chains converged; `None`
    /// without any.
    pub fn recovered_share(&self) -> Option<f64> {
        let n = self.n_judged();
        (n > 0).then(|| self.n(Verdict::Recovered) as f64 / n as f64)
    }

    /// Worlds of a verdict.
    pub fn n(&self, verdict: Verdict) -> usize {
        self.counts[verdict as usize]
    }

    /// All worlds.
    pub fn n_all(&self) -> usize {
        self.counts.iter().sum()
    }

    /// Worlds that were run: all but those missing.
    pub fn n_run(&self) -> usize {
        self.n_all() - self.n(Verdict::Missing)
    }

    /// Worlds with at least one chain that ran to its end.
    pub fn n_judged(&self) -> usize {
        self.n_run() - self.n(Verdict::Failed)
    }

    /// Worlds on which the chains are shown to have converged.
    pub fn n_converged(&self) -> usize {
        [
            Verdict::Recovered,
            Verdict::ConvergedTruthUnknown,
            Verdict::WrongMap,
        ]
        .map(|verdict| self.n(verdict))
        .iter()
        .sum()
    }

    /// The verdict of the most worlds, the worst of those that tie; missing without worlds.
    pub fn most(&self) -> Verdict {
        let most = Verdict::ALL.into_iter().max_by_key(|own| self.n(*own));
        most.filter(|own| self.n(*own) > 0)
            .unwrap_or(Verdict::Missing)
    }

    /// The verdict on the cell.
    pub fn verdict(&self) -> CellVerdict {
        let most = self.most();
        let is_good = matches!(most, Verdict::Recovered | Verdict::ConvergedTruthUnknown);
        let is_relied_on = || {
            self.is_only_world
                || (suffice(self.n(most), self.n_run()) && !self.has_too_many_wrong_maps())
        };
        if is_good && !is_relied_on() {
            CellVerdict::Undecided
        } else {
            CellVerdict::Of(most)
        }
    }

    /// Whether more than 1 in 20 of the worlds whose chains converged have a wrong map.
    pub fn has_too_many_wrong_maps(&self) -> bool {
        self.n(Verdict::WrongMap) as f64 > MOST_WRONG * self.n_converged() as f64
    }

    /// The share of worlds like these that have this verdict is above this, at 95 %: the lower
    /// bound of Clopper & Pearson.
    pub fn share_at_least(&self, verdict: Verdict) -> f64 {
        at_least(self.n(verdict) as f64, self.n_run() as f64, LEVEL)
    }

    /// How many more worlds of its most frequent verdict an undecided cell needs. Wrong maps are
    /// left aside.
    pub fn to_settle(&self) -> ToSettle {
        // Worlds that were not run say nothing, even where they are the most.
        let (good, n) = match self.most() {
            Verdict::Missing => (0, 0),
            most => (self.n(most), self.n_run()),
        };
        let enough = |more: &usize| suffice(good + more, n + more);
        let share = good as f64 / n as f64;
        // 1e-9: a share of whole numbers gives its own number back.
        let at_share = |n: &usize| suffice((share * *n as f64 + 1e-9) as usize, *n);
        ToSettle {
            at_best: (0..).find(enough).unwrap_or(0),
            in_all: (n..=MOST_WORLDS).find(at_share),
        }
    }

    /// "3 of 5 worlds recovered and converged, 2 not converged": the most frequent first.
    pub fn split(&self) -> String {
        self.split_of(Some(self.most()))
    }

    /// "not converged: 3 of 5 worlds, 2 recovered and converged": the verdict never stands without
    /// the worlds that it is of.
    pub fn verdict_words(&self) -> String {
        let verdict = self.verdict();
        let split = match verdict {
            CellVerdict::Of(_) => self.split_of(None),
            CellVerdict::Undecided => self.split(),
        };
        format!("{}: {split}", verdict.words())
    }

    /// All worlds by verdict, that of the most first; `named`: with that verdict in words.
    fn split_of(&self, named: Option<Verdict>) -> String {
        let worlds = match (self.n_all(), self.is_only_world) {
            (1, true) => "the one data set".to_owned(),
            (1, false) => "1 world".to_owned(),
            (n, _) => format!("{n} worlds"),
        };
        let most = self.most();
        let first = match (self.n(most), self.n_all()) {
            (_, 0) => "no world".to_owned(),
            (_, 1) => worlds,
            (n, all) if n == all => format!("all {worlds}"),
            (n, _) => format!("{n} of {worlds}"),
        };
        let mut others: Vec<Verdict> = Verdict::ALL.to_vec();
        others.retain(|verdict| *verdict != most && self.n(*verdict) > 0);
        others.sort_by_key(|verdict| std::cmp::Reverse(self.n(*verdict)));
        let name = named.map(|verdict| format!(" {}", verdict.words()));
        let others = others.iter();
        let others = others.map(|verdict| format!(", {} {}", self.n(*verdict), verdict.words()));
        format!(
            "{first}{}{}",
            name.unwrap_or_default(),
            others.collect::<String>()
        )
    }
}

/// Whether so many worlds of n are more than chance gives where at most half of all worlds are
/// good: the exact binomial test, P(X ≥ good | n, ½) ≤ 5 %. 5 of 5, 7 of 8, 9 of 10, 15 of 20 and
/// 26 of 40 are enough.
fn suffice(good: usize, n: usize) -> bool {
    if good == 0 {
        return false;
    }
    let half_or_less = regularised_beta(good as f64, (n - good) as f64 + 1.0, 0.5);
    half_or_less <= LEVEL
}

#[cfg(test)]
#[path = "verdict_tests.rs"]
mod tests;
