//! Why an estimate is not there: every state has a name for tables and a sentence for people.

/// Fewer changes of value than this, and how fast the series forgets cannot be told. The two rates
/// of a two-state chain are each known to about 1/√k after k departures, so that with ten changes,
/// five each way, its autocorrelation time is known to about a factor of 1.5.
pub const FEWEST_CHANGES: u64 = 10;

/// What stands in the place of an estimate that is undefined.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum Undefined {
    /// Every chain has the same value all the time.
    #[error("constant: the value is {value} throughout")]
    Constant {
        /// That value.
        value: f64,
    },
    /// Every chain stands still, but not all at the same value: R-hat would be infinite.
    #[error(
        "stuck-disagree: each of {n_chains} (half-)chains stands still, between {low} and {high}"
    )]
    StuckDisagree {
        /// Chains, or halves of chains where they are split.
        n_chains: usize,
        /// Smallest value.
        low: f64,
        /// Largest value.
        high: f64,
    },
    /// The value changes so seldom that its autocorrelation is not known.
    #[error(
        "too-rare: the value changed {n_changes} times in all chains, at least {fewest} are needed"
    )]
    TooRare {
        /// Changes seen.
        n_changes: u64,
        /// Changes needed.
        fewest: u64,
    },
    /// There are too few draws.
    #[error("too-short: {n} draws, at least {fewest} are needed")]
    TooShort {
        /// Draws at hand, in a chain where chains are the input.
        n: u64,
        /// Draws needed.
        fewest: u64,
    },
    /// There are too few chains, superchains or states to compare.
    #[error("too-few: {n} to compare, at least {fewest} are needed")]
    TooFew {
        /// At hand.
        n: usize,
        /// Needed.
        fewest: usize,
    },
    /// Distances to different topologies are no one quantity.
    #[error("different-maps: the chains have different MAP topologies to be distant from")]
    DifferentMaps,
    /// The verdict does not rest on it.
    #[error(
        "not-judged: the verdict does not rest on this, and it would read as speaking against it"
    )]
    NotJudged,
    /// A quantile in the middle of many equal draws, so that it marks no tail.
    #[error("atom: {share:.2} of the draws are not beyond the quantile at {nominal}")]
    Atom {
        /// Share of the draws at or below the quantile.
        share: f64,
        /// What it would be without ties.
        nominal: f64,
    },
    /// Some values are infinite or not a number.
    #[error("not-finite: {n} draws have no finite value")]
    NotFinite {
        /// How many draws.
        n: u64,
    },
}

impl Undefined {
    /// One word, for tables: `constant`, `stuck-disagree`, `too-rare`, `too-short`, `too-few`,
    /// `not-finite`, `different-maps`, `not-judged` or `atom`. `Display` gives the sentence.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Constant { .. } => "constant",
            Self::StuckDisagree { .. } => "stuck-disagree",
            Self::TooRare { .. } => "too-rare",
            Self::TooShort { .. } => "too-short",
            Self::TooFew { .. } => "too-few",
            Self::NotFinite { .. } => "not-finite",
            Self::DifferentMaps => "different-maps",
            Self::NotJudged => "not-judged",
            Self::Atom { .. } => "atom",
        }
    }

    /// Whether it says that chains disagree.
    pub fn is_disagreement(&self) -> bool {
        matches!(self, Self::StuckDisagree { .. } | Self::DifferentMaps)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sentence_starts_with_the_name() {
        let all = [
            Undefined::Constant { value: 3.0 },
            Undefined::StuckDisagree {
                n_chains: 2,
                low: 3.0,
                high: 5.0,
            },
            Undefined::TooRare {
                n_changes: 3,
                fewest: FEWEST_CHANGES,
            },
            Undefined::TooShort { n: 3, fewest: 4 },
            Undefined::TooFew { n: 1, fewest: 2 },
            Undefined::NotFinite { n: 1 },
            Undefined::DifferentMaps,
            Undefined::NotJudged,
            Undefined::Atom {
                share: 0.7,
                nominal: 0.95,
            },
        ];
        for reason in all {
            assert!(
                reason
                    .to_string()
                    .starts_with(&format!("{}: ", reason.name()))
            );
        }
    }
}
