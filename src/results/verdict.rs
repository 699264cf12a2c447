//! What to make of the chains on a world, and of a cell: did they find the truth, and may one
//! believe them?

use super::convergence::Diagnosis;

/// The verdict on one world of a cell, or on a cell: that of most of its worlds.
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

    /// The verdict of the most worlds, the worst of those that tie; `None` without worlds.
    pub fn of_cell(worlds: &[Self]) -> Option<Self> {
        let count = |verdict: Self| worlds.iter().filter(|world| **world == verdict).count();
        let most = Self::ALL
            .into_iter()
            .max_by_key(|verdict| count(*verdict))?;
        (count(most) > 0).then_some(most)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cell_has_the_verdict_of_most_of_its_worlds_and_the_worst_of_a_tie() {
        use Verdict::{ByLuck, Failed, NotConverged, Recovered};
        assert_eq!(
            Verdict::of_cell(&[Recovered, ByLuck, Recovered]),
            Some(Recovered)
        );
        assert_eq!(Verdict::of_cell(&[Recovered, ByLuck]), Some(ByLuck));
        assert_eq!(Verdict::of_cell(&[Failed, NotConverged]), Some(Failed));
        assert_eq!(Verdict::of_cell(&[]), None);
    }

    #[test]
    fn a_world_without_chains_is_failed_or_missing() {
        assert_eq!(Verdict::of_world(None, false, 2), Verdict::Failed);
        assert_eq!(Verdict::of_world(None, false, 0), Verdict::Missing);
    }
}
