//! Whose fault is it that a chain failed, that its MAP topology is not the truth?
//!
//! The posterior decides, by the reference chains or the exact posterior
//! ([`Posterior`](super::Posterior)):
//!
//! 1. It prefers another map: the **model**'s, whatever the chain did besides. The best sampler in
//!    the best arithmetic would have failed as well.
//! 2. It has the truth as its MAP topology, and the chain walked at random, because most of its
//!    proposals were made from a posterior value that had underflowed to 0: **arithmetic**.
//! 3. It has the truth as its MAP topology: the **sampler**'s. The chain did not get there.
//! 4. What it prefers is not known: **undecided**.
//!
//! A few proposals at 0, on the way from a bad start, spoil no chain that left them behind: less
//! than [`MOST_AT_ZERO`] of them is not arithmetic.

use super::posterior::Answer;
use crate::run::ChainOutcome;

/// Share of its proposals that a chain may make from a value of 0 before it is a random walk.
const MOST_AT_ZERO: f64 = 0.5;

/// Whose fault a failure is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Fault {
    /// The posterior itself prefers another map.
    Model,
    /// The posterior has the truth as its MAP topology, and the chain did not get there.
    Sampler,
    /// As the sampler's, and the chain stood at posterior values that underflowed to 0.
    Arithmetic,
    /// What the posterior prefers is not known.
    Undecided,
}

impl Fault {
    /// All, in the order of reports.
    pub const ALL: [Self; 4] = [
        Self::Model,
        Self::Sampler,
        Self::Arithmetic,
        Self::Undecided,
    ];

    /// One word, for tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Model => "model",
            Self::Sampler => "sampler",
            Self::Arithmetic => "arithmetic",
            Self::Undecided => "undecided",
        }
    }

    /// In sentences, after a number of failures.
    pub fn words(self) -> &'static str {
        match self {
            Self::Model => "the model’s",
            Self::Sampler => "the sampler’s",
            Self::Arithmetic => "underflow",
            Self::Undecided => "undecided",
        }
    }

    /// What it says of the posterior.
    pub fn meaning(self) -> &'static str {
        match self {
            Self::Model => "the model’s: the posterior prefers another map",
            Self::Sampler => "the sampler’s: the posterior has the truth",
            Self::Arithmetic => "underflow: a random walk, and the posterior has the truth",
            Self::Undecided => "undecided: what the posterior prefers is not known",
        }
    }

    /// Of a chain that failed, by what its posterior says.
    fn of_failure(outcome: &ChainOutcome, answer: Answer) -> Self {
        match answer {
            Answer::OtherMap => Self::Model,
            Answer::Truth if walks_at_random(outcome) => Self::Arithmetic,
            Answer::Truth => Self::Sampler,
            Answer::Undecided(_) => Self::Undecided,
        }
    }
}

/// A chain whose posterior was asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sorted {
    /// Its MAP topology is the truth.
    Recovered,
    /// It is not.
    Failed(Fault),
}

impl Sorted {
    /// By what the posterior says; `None` if no truth is known.
    pub fn of_chain(outcome: &ChainOutcome, answer: Answer) -> Option<Self> {
        Some(if outcome.recovered? {
            Self::Recovered
        } else {
            Self::Failed(Fault::of_failure(outcome, answer))
        })
    }
}

/// Whether a chain accepted whatever came, because most proposals were made from a value of 0.
pub(super) fn walks_at_random(outcome: &ChainOutcome) -> bool {
    outcome
        .underflow_share
        .is_some_and(|share| share > MOST_AT_ZERO)
}

/// How many chains failed for which fault, and how many recovered the truth.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Faults {
    /// In the order of [`Fault::ALL`].
    counts: [usize; Fault::ALL.len()],
    /// Chains that recovered the truth.
    pub n_recovered: usize,
}

impl Faults {
    /// Counts them; `None` without any.
    pub fn of(chains: impl Iterator<Item = Sorted>) -> Option<Self> {
        let mut faults = Self::default();
        for sorted in chains {
            match sorted {
                Sorted::Recovered => faults.n_recovered += 1,
                Sorted::Failed(fault) => faults.counts[fault as usize] += 1,
            }
        }
        (faults.n_all() > 0).then_some(faults)
    }

    /// Counts the chains of another in.
    pub fn add(&mut self, other: &Self) {
        for (count, n) in self.counts.iter_mut().zip(other.counts) {
            *count += n;
        }
        self.n_recovered += other.n_recovered;
    }

    /// Failures of one fault.
    pub fn n(&self, fault: Fault) -> usize {
        self.counts[fault as usize]
    }

    /// All failures.
    pub fn n_failures(&self) -> usize {
        self.counts.iter().sum()
    }

    /// Chains sorted, those that recovered too.
    pub fn n_all(&self) -> usize {
        self.n_failures() + self.n_recovered
    }
}

#[cfg(test)]
mod tests {
    use super::super::convergence::tests::chain;
    use super::super::posterior::Unanswered;
    use super::*;

    fn failed(underflow_share: Option<f64>) -> ChainOutcome {
        let mut own = chain(&[5; 100], 0, 1);
        assert_eq!(own.recovered, Some(false));
        own.underflow_share = underflow_share;
        own
    }

    #[test]
    fn each_kind_is_sorted_by_what_the_posterior_says() {
        let undecided = Answer::Undecided(Unanswered::NotConverged);
        let of = |share, answer| Sorted::of_chain(&failed(share), answer);
        let fault = |fault| Some(Sorted::Failed(fault));
        assert_eq!(of(None, Answer::OtherMap), fault(Fault::Model));
        assert_eq!(of(None, Answer::Truth), fault(Fault::Sampler));
        assert_eq!(of(Some(0.9), Answer::Truth), fault(Fault::Arithmetic));
        assert_eq!(of(None, undecided), fault(Fault::Undecided));
    }

    /// Where a chain underflows and the posterior prefers another map, sound arithmetic would not
    /// help.
    #[test]
    fn underflow_hides_no_fault_of_the_model_and_decides_nothing() {
        let of = |answer| Fault::of_failure(&failed(Some(1.0)), answer);
        assert_eq!(of(Answer::OtherMap), Fault::Model);
        assert_eq!(of(Answer::Undecided(Unanswered::Tie)), Fault::Undecided);
    }

    #[test]
    fn a_few_proposals_at_zero_are_no_random_walk() {
        let of = |share| Fault::of_failure(&failed(Some(share)), Answer::Truth);
        assert_eq!([0.0, 0.02, 0.5].map(of), [Fault::Sampler; 3]);
        assert_eq!(of(0.51), Fault::Arithmetic);
    }

    #[test]
    fn what_recovered_or_has_no_truth_is_no_failure() {
        let mut own = chain(&[0; 100], 0, 1);
        let of = |own: &ChainOutcome| Sorted::of_chain(own, Answer::OtherMap);
        assert_eq!(of(&own), Some(Sorted::Recovered));
        own.recovered = None;
        assert_eq!(of(&own), None);
    }
}
