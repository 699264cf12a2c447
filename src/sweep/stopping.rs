//! The stopping rule: worlds are added to a cell until its recovery rate is known well enough.
//!
//! Every cell begins with `replicates` worlds. A cell whose rate is not known to ± `rate_error` yet is given more, in
//! rounds of
//!
//! ```text
//! n₀ = replicates,    n_{k+1} = min(n_k + ⌈n_k / 2⌉, max_replicates),
//! ```
//!
//! so that no cell has more than half again what it needs, and few looks are taken. What the error is and when a cell
//! is done is judged where its chains are known, in `run`.

use crate::settings::{Key, SettingError, Settings};

/// Probability of missing the rate at either end of its interval.
const EACH_END: f64 = 0.025;
/// No rate is known worse than this.
const NOTHING: f64 = 0.5;

/// A rule that adds worlds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stopping {
    /// Half the width of the rate's 95 % interval, at which a cell is done.
    pub error: f64,
    /// Worlds that no cell goes beyond.
    pub most: u64,
}

impl Stopping {
    /// The rule of these settings, if they have one.
    pub fn of(settings: &Settings) -> Option<Self> {
        let error = settings.number("rate_error");
        (error > 0.0).then(|| Self {
            error,
            most: settings.count("max_replicates"),
        })
    }

    /// Whether a setting says how many worlds there may be and nothing of what they are.
    pub fn is_of_rule(key: &Key) -> bool {
        matches!(key.name, "rate_error" | "max_replicates")
    }

    /// Worlds after a round of `n`; `None` if there are no more to be had.
    pub fn next(self, n: u64) -> Option<u64> {
        (n < self.most).then(|| (n + n.div_ceil(2)).min(self.most))
    }

    /// `one_data_set`: whether the data are one CSV, which there are no more of.
    ///
    /// # Errors
    /// A rule that is half there, that has nothing to add or nothing to do, or that cannot be met.
    pub(super) fn check(settings: &Settings, one_data_set: bool) -> Result<(), SettingError> {
        let replicates = settings.count("replicates");
        let (error, most) = (
            settings.number("rate_error"),
            settings.count("max_replicates"),
        );
        let bad = |name: &str, got: String, expected: String| {
            let name = name.to_owned();
            Err(SettingError::Bad {
                name,
                got,
                expected,
            })
        };
        let Some(rule) = Self::of(settings) else {
            return match most {
                0 => Ok(()),
                _ => bad(
                    "max_replicates",
                    format!("{most} without rate_error"),
                    "rate_error too, as in rate_error = 0.1, or only replicates".to_owned(),
                ),
            };
        };
        if one_data_set {
            return bad(
                "rate_error",
                format!("{error} with detections"),
                "a simulated world: there are no more worlds of recorded detections; leave it out and raise chains"
                    .to_owned(),
            );
        }
        if error >= NOTHING {
            return bad(
                "rate_error",
                error.to_string(),
                format!(
                    "less than {NOTHING}: every rate is known to ± {NOTHING} before anything is run"
                ),
            );
        }
        if most <= replicates {
            let got = match most {
                0 => "none".to_owned(),
                most => most.to_string(),
            };
            return bad(
                "max_replicates",
                format!("{got} with rate_error {error}"),
                format!(
                    "more worlds than replicates ({replicates}), the most that a cell may take"
                ),
            );
        }
        let least = least_error(most * settings.count("chains"));
        if rule.error < least {
            return bad(
                "rate_error",
                format!("{error} with max_replicates {most}"),
                format!(
                    "at least {:.4}, what so many worlds leave at best; raise max_replicates",
                    (least * 1e4).ceil() / 1e4
                ),
            );
        }
        Ok(())
    }
}

/// The error of a rate of 0 or 1 in n independent trials, (1 − 0.025^(1/n)) / 2; every other is
/// larger.
fn least_error(n: u64) -> f64 {
    (1.0 - libm::pow(EACH_END, 1.0 / n as f64)) / 2.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnostics::rate;

    fn settings(of: &[(&str, &str)]) -> Settings {
        let mut settings = Settings::default();
        for (name, value) in of {
            settings.set_text(name, value).expect("a good value");
        }
        settings
    }

    #[test]
    fn rounds_grow_by_half_up_to_the_cap() {
        let rule = Stopping {
            error: 0.1,
            most: 40,
        };
        let rounds =
            |first| std::iter::successors(Some(first), |n| rule.next(*n)).collect::<Vec<u64>>();
        assert_eq!(rounds(5), [5, 8, 12, 18, 27, 40]);
        assert_eq!(rounds(1), [1, 2, 3, 5, 8, 12, 18, 27, 40]);
        assert_eq!(rounds(39), [39, 40]);
        assert_eq!(rounds(40), [40]);
    }

    #[test]
    fn the_least_error_is_that_of_the_rates() {
        for n in [1_u32, 7, 40, 1000] {
            let (own, theirs) = (least_error(u64::from(n)), rate::least_error(f64::from(n)));
            assert!((own / theirs - 1.0).abs() < 1e-12, "{own} {theirs}");
        }
    }

    #[test]
    fn a_rule_that_makes_no_sense_is_refused_in_a_line() {
        let refused = |of: &[(&str, &str)], one| {
            Stopping::check(&settings(of), one).map_err(|error| error.to_string())
        };
        let with = |error, most| {
            [
                ("replicates", "5"),
                ("rate_error", error),
                ("max_replicates", most),
            ]
        };
        assert_eq!(refused(&with("0", "0"), true), Ok(()));
        assert_eq!(refused(&with("0.1", "40"), false), Ok(()));
        let cases = [
            (
                with("0", "40"),
                false,
                "max_replicates: got 40 without rate_error, expected rate_error too, as in rate_error = 0.1, or only \
                 replicates",
            ),
            (
                with("0.1", "0"),
                false,
                "max_replicates: got none with rate_error 0.1, expected more worlds than replicates (5), the most \
                 that a cell may take",
            ),
            (
                with("0.1", "5"),
                false,
                "max_replicates: got 5 with rate_error 0.1, expected more worlds than replicates (5), the most that \
                 a cell may take",
            ),
            (
                with("0.5", "40"),
                false,
                "rate_error: got 0.5, expected less than 0.5: every rate is known to ± 0.5 before anything is run",
            ),
            // Four chains on each of 40 worlds: (1 − 0.025^(1/160)) / 2 = 0.01140.
            (
                with("0.01", "40"),
                false,
                "rate_error: got 0.01 with max_replicates 40, expected at least 0.0114, what so many worlds leave at \
                 best; raise max_replicates",
            ),
            (
                with("0.1", "40"),
                true,
                "rate_error: got 0.1 with detections, expected a simulated world: there are no more worlds of \
                 recorded detections; leave it out and raise chains",
            ),
        ];
        for (of, one, expected) in cases {
            assert_eq!(refused(&of, one), Err(expected.to_owned()));
        }
    }
}
