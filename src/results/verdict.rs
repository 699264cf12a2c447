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
/// Share of the worlds with converged chains that may have a wrong map for the others to be relied on: a reader who has no
/// truth sees only that chains converged, and takes a wrong map for a right one.
const MOST_WRONG: f64 = 0.05;
/// Worlds beyond which [`WorldsByVerdict::to_settle`] looks no further.
const MOST_WORLDS: usize = 1000;

/// The verdict on a cell.
///
/// It is that of the most of its worlds, the worst of those that tie. A **good** one (recovered, or converged with the truth unknown)
/// tells the reader to rely on the cell, so it needs more: a share of worlds above one half that chance does not explain, and
/// hardly any converged world with a wrong map. Without that the cell is [`CellVerdict::Undecided`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum CellVerdict {
    /// That of the most of its worlds; if it is a good one, then of most worlds like these.
    Of(Verdict),
    /// Most of its worlds are good, or as many as of any other verdict, but not enough of them to rely on.
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
    /// Whether the one world is all that there is: recorded detections, a simulation of one world, or one without noise.
    pub is_only_world: bool,
}

/// What would turn an undecided cell into one to rely on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ToSettle {
    /// More worlds that suffice if all of them are good.
    pub at_best: usize,
    /// Worlds in all that suffice at the share seen so far; `None` if that is one half at most, or more than 1,000 are needed.
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

    /// Share of the judged worlds that are recovered and on which the chains converged; `None` without any.
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
        let is_relied_on = self.is_only_world
            || (suffice(self.n(most), self.n_run()) && !self.has_too_many_wrong_maps());
        if is_good && !is_relied_on {
            CellVerdict::Undecided
        } else {
            CellVerdict::Of(most)
        }
    }

    /// Whether more than 1 in 20 of the worlds whose chains converged have a wrong map.
    pub fn has_too_many_wrong_maps(&self) -> bool {
        self.n(Verdict::WrongMap) as f64 > MOST_WRONG * self.n_converged() as f64
    }

    /// The share of worlds like these that have this verdict is above this, at 95 %: the lower bound of Clopper & Pearson.
    pub fn share_at_least(&self, verdict: Verdict) -> f64 {
        at_least(self.n(verdict) as f64, self.n_run() as f64, LEVEL)
    }

    /// How many more worlds of its most frequent verdict an undecided cell needs. Wrong maps are left aside.
    pub fn to_settle(&self) -> ToSettle {
        let (good, n) = (self.n(self.most()), self.n_run());
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
        let n_all = self.n_all();
        let worlds = match (n_all, self.is_only_world) {
            (1, true) => "one data set".to_owned(),
            (1, false) => "1 world".to_owned(),
            (n, _) => format!("{n} worlds"),
        };
        let mut known: Vec<Verdict> = Verdict::ALL.to_vec();
        known.retain(|verdict| self.n(*verdict) > 0);
        known.sort_by_key(|verdict| std::cmp::Reverse(self.n(*verdict)));
        match known.as_slice() {
            [] => "no world".to_owned(),
            [only] if n_all == 1 => format!("{worlds} {}", only.words()),
            [only] => format!("all {worlds} {}", only.words()),
            [first, others @ ..] => {
                let others = others.iter();
                let others =
                    others.map(|verdict| format!(", {} {}", self.n(*verdict), verdict.words()));
                format!(
                    "{} of {worlds} {}{}",
                    self.n(*first),
                    first.words(),
                    others.collect::<String>()
                )
            }
        }
    }
}

/// Whether so many worlds of n are more than chance gives where at most half of all worlds are good: the exact binomial
/// test, P(X ≥ good | n, ½) ≤ 5 %. 5 of 5, 7 of 8, 9 of 10, 15 of 20 and 26 of 40 are enough.
fn suffice(good: usize, n: usize) -> bool {
    if good == 0 {
        return false;
    }
    let half_or_less = regularised_beta(good as f64, (n - good) as f64 + 1.0, 0.5);
    half_or_less <= LEVEL
}

#[cfg(test)]
mod tests {
    use super::*;
    use Verdict::{ByLuck, Failed, Missing, NotConverged, Recovered, WrongMap};

    fn of(counts: &[(Verdict, usize)]) -> WorldsByVerdict {
        let worlds: Vec<Verdict> = (counts.iter())
            .flat_map(|(verdict, n)| vec![*verdict; *n])
            .collect();
        WorldsByVerdict::new(&worlds, false)
    }

    #[test]
    fn a_cell_has_the_verdict_of_most_of_its_worlds_and_the_worst_of_a_tie() {
        let verdict = |counts: &[(Verdict, usize)]| of(counts).verdict();
        assert_eq!(
            verdict(&[(Recovered, 2), (NotConverged, 3)]),
            NotConverged.into()
        );
        assert_eq!(verdict(&[(Recovered, 1), (ByLuck, 1)]), ByLuck.into());
        assert_eq!(verdict(&[(Failed, 1), (NotConverged, 1)]), Failed.into());
        assert_eq!(verdict(&[]), Missing.into());
    }

    /// Of a cell that recovers 60 % of its worlds, or the most of them by a plurality, nothing is to be relied on.
    #[test]
    fn a_good_verdict_needs_more_than_a_plurality() {
        for (good, others) in [(3, 2), (2, 1), (4, 1), (2, 0), (4, 0), (6, 2), (25, 15)] {
            let own = of(&[(Recovered, good), (NotConverged, others)]);
            assert_eq!(own.verdict(), CellVerdict::Undecided, "{good} {others}");
            assert!(own.share_at_least(Recovered) < 0.5);
        }
        let plurality = of(&[
            (Recovered, 2),
            (ByLuck, 1),
            (WrongMap, 1),
            (NotConverged, 1),
        ]);
        assert_eq!(plurality.verdict(), CellVerdict::Undecided);
        // The numbers that the documents name, and one less.
        for (good, n) in [(5, 5), (7, 8), (9, 10), (15, 20), (26, 40)] {
            let own = |good| of(&[(Recovered, good), (NotConverged, n - good)]);
            assert_eq!(own(good).verdict(), Recovered.into(), "{good} of {n}");
            assert!(own(good).share_at_least(Recovered) > 0.5);
            assert_eq!(own(good - 1).verdict(), CellVerdict::Undecided);
        }
        // A world that was not run says nothing; one that failed was not recovered.
        assert_eq!(
            of(&[(Recovered, 5), (Missing, 4)]).verdict(),
            Recovered.into()
        );
        assert_eq!(
            of(&[(Recovered, 5), (Failed, 2)]).verdict(),
            CellVerdict::Undecided
        );
    }

    /// Converged chains are what a reader without truth goes by.
    #[test]
    fn wrong_maps_take_the_trust_from_the_right_ones() {
        let own = of(&[(Recovered, 17), (WrongMap, 3)]);
        assert_eq!(own.verdict(), CellVerdict::Undecided);
        assert_eq!(
            of(&[(Recovered, 18), (WrongMap, 1)]).verdict(),
            CellVerdict::Undecided
        );
        assert_eq!(
            of(&[(Recovered, 19), (WrongMap, 1)]).verdict(),
            Recovered.into()
        );
        // Worlds without convergence do not hide wrong maps.
        let own = of(&[(Recovered, 18), (WrongMap, 1), (NotConverged, 5)]);
        assert_eq!(own.verdict(), CellVerdict::Undecided);
    }

    /// There is nothing to generalise to.
    #[test]
    fn the_only_world_has_its_own_verdict() {
        let only = WorldsByVerdict::new(&[Recovered], true);
        assert_eq!(only.verdict(), Recovered.into());
        assert_eq!(only.split(), "one data set recovered and converged");
        let one_of_many = WorldsByVerdict::new(&[Recovered], false);
        assert_eq!(one_of_many.verdict(), CellVerdict::Undecided);
        assert_eq!(one_of_many.split(), "1 world recovered and converged");
    }

    #[test]
    fn the_split_has_all_worlds() {
        let own = of(&[(NotConverged, 2), (Recovered, 3)]);
        assert_eq!(
            own.split(),
            "3 of 5 worlds recovered and converged, 2 not converged"
        );
        assert_eq!(of(&[(ByLuck, 4)]).split(), "all 4 worlds recovered by luck");
        assert_eq!(of(&[]).split(), "no world");
    }

    /// By the table of `suffice`: 3 of 3 need two more (5 of 5); 4 of 5 need three (7 of 8), and at 80 % ten worlds are too few
    /// (8 of 10: 0.055), eleven (8) too, twelve (9: 0.073) and thirteen (10: 0.046) are enough.
    #[test]
    fn more_worlds_that_would_settle_it() {
        let own = of(&[(Recovered, 3)]);
        assert_eq!(
            own.to_settle(),
            ToSettle {
                at_best: 2,
                in_all: Some(5)
            }
        );
        let own = of(&[(Recovered, 4), (NotConverged, 1)]);
        assert_eq!(
            own.to_settle(),
            ToSettle {
                at_best: 3,
                in_all: Some(13)
            }
        );
        // Of half, or of a plurality, more of the same do not help.
        let own = of(&[(Recovered, 2), (ByLuck, 1), (WrongMap, 1)]);
        assert_eq!(own.to_settle().in_all, None);
        assert_eq!(own.to_settle().at_best, 7);
    }

    /// Exact: at most half of all worlds are good; how often is a cell relied on? Whatever the number of worlds up to 60.
    #[test]
    fn a_cell_is_relied_on_wrongly_in_at_most_one_of_twenty() {
        let ln_factorial = |n: usize| libm::lgamma(n as f64 + 1.0);
        let half = |n: usize, k: usize| {
            let ln_choose = ln_factorial(n) - ln_factorial(k) - ln_factorial(n - k);
            libm::exp(ln_choose - n as f64 * std::f64::consts::LN_2)
        };
        for n in 1..=60 {
            let relied_on: f64 = (0..=n)
                .filter(|k| {
                    let own = of(&[(Recovered, *k), (NotConverged, n - k)]);
                    own.verdict() == Recovered.into()
                })
                .map(|k| half(n, k))
                .sum();
            assert!(relied_on <= 0.05, "{n}: {relied_on}");
            assert_eq!(relied_on > 0.0, n >= 5, "{n}");
        }
    }

    #[test]
    fn a_world_without_chains_is_failed_or_missing() {
        assert_eq!(Verdict::of_world(None, false, 2), Verdict::Failed);
        assert_eq!(Verdict::of_world(None, false, 0), Verdict::Missing);
    }

    #[test]
    fn places_are_those_of_the_list() {
        for (place, verdict) in CellVerdict::ALL.into_iter().enumerate() {
            assert_eq!(verdict.place(), place);
        }
    }
}
