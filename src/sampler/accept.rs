//! The acceptance rule (source report, algorithm 1), apart from every proposal.
//!
//! Accept if u < π(T')/π(T) · q(T|T')/q(T'|T), u uniform on (0, 1].

use std::fmt;
use std::str::FromStr;

/// In which arithmetic a posterior value is held.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Arithmetic {
    /// In logarithms. Correct.
    Log,
    /// **Incorrect**, as in the source report's program: the value itself is held as a double, which
    /// is 0 below e^−745. A current value of 0 makes the posterior ratio 1, whatever is proposed;
    /// a proposed value of 0 makes it 0. So a chain among topologies whose values underflow walks at
    /// random: that is what panels (b), (f) and (g) of the report's Fig. 7 show.
    Linear,
}

/// A posterior value, by its logarithm with and without the constants that `Log` may drop.
#[derive(Clone, Copy, Debug)]
pub struct Value {
    ln_target: f64,
    ln_constant: f64,
}

impl Value {
    /// From ln P(T) + ln Ẑ(T) and N·ln(π/a).
    pub fn new(ln_target: f64, ln_constant: f64) -> Self {
        Self {
            ln_target,
            ln_constant,
        }
    }

    /// The value as the source report's program holds it.
    pub fn linear(self) -> f64 {
        libm::exp(self.ln_constant + self.ln_target)
    }
}

/// What decides: u, uniform on (0, 1], with its logarithm.
#[derive(Clone, Copy, Debug)]
pub struct Threshold {
    u: f64,
    ln_u: f64,
}

impl Threshold {
    /// From u in (0, 1].
    pub fn new(u: f64) -> Self {
        Self {
            u,
            ln_u: libm::log(u),
        }
    }
}

impl Arithmetic {
    /// Whether the proposed value is accepted. A NaN never is.
    pub fn accepts(
        self,
        threshold: Threshold,
        current: Value,
        proposed: Value,
        ln_proposal_ratio: f64,
    ) -> bool {
        let Threshold { u, ln_u } = threshold;
        match self {
            Self::Log => ln_u < (proposed.ln_target - current.ln_target) + ln_proposal_ratio,
            Self::Linear => {
                let (now, then) = (current.linear(), proposed.linear());
                let ratio = if now == 0.0 { 1.0 } else { then / now };
                u < ratio * libm::exp(ln_proposal_ratio)
            }
        }
    }
}

/// A proposal on its way through the acceptance rule.
pub(super) struct Trial {
    pub(super) arithmetic: Arithmetic,
    pub(super) threshold: Threshold,
    pub(super) current: Value,
    pub(super) ln_constant: f64,
    pub(super) ln_prior: f64,
    pub(super) ln_bound: f64,
    pub(super) ln_ratio: f64,
}

impl Trial {
    /// Whether the proposal is accepted if ln of the mean over its draws is `ln_mean`.
    pub(super) fn accepts(&self, ln_mean: f64) -> bool {
        let ln_target = self.ln_prior + (self.ln_bound + ln_mean);
        let proposed = Value::new(ln_target, self.ln_constant);
        self.arithmetic
            .accepts(self.threshold, self.current, proposed, self.ln_ratio)
    }
}

impl fmt::Display for Arithmetic {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Log => "log",
            Self::Linear => "linear",
        })
    }
}

impl FromStr for Arithmetic {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "log" => Ok(Self::Log),
            "linear" => Ok(Self::Linear),
            _ => Err("log, or linear (incorrect: the report's underflowing program)".to_owned()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn accepts(arithmetic: Arithmetic, u: f64, now: f64, then: f64, ln_q: f64) -> bool {
        arithmetic.accepts(
            Threshold::new(u),
            Value::new(now, 0.0),
            Value::new(then, 0.0),
            ln_q,
        )
    }

    #[test]
    fn forced_accepts_and_rejects() {
        for arithmetic in [Arithmetic::Log, Arithmetic::Linear] {
            assert!(accepts(arithmetic, 1.0, -5.0, -4.0, 0.0));
            assert!(accepts(arithmetic, 0.5, -5.0, -5.0, 0.0));
            assert!(!accepts(arithmetic, 1e-3, -5.0, -15.0, 0.0));
            assert!(accepts(arithmetic, 1e-3, -5.0, -15.0, 9.0));
            assert!(!accepts(arithmetic, 1e-9, -5.0, -5.0, f64::NEG_INFINITY));
        }
    }

    #[test]
    fn no_infinity_makes_a_nan_that_accepts() {
        let inf = f64::INFINITY;
        for (now, then, ln_q) in [
            (-inf, -inf, 0.0),
            (f64::NAN, 0.0, 0.0),
            (0.0, f64::NAN, 0.0),
            (0.0, inf, -inf),
        ] {
            assert!(
                !accepts(Arithmetic::Log, 1e-300, now, then, ln_q),
                "{now} {then} {ln_q}"
            );
        }
        assert!(!accepts(Arithmetic::Linear, 1e-300, 800.0, 900.0, 0.0));
    }

    #[test]
    fn linear_arithmetic_underflows_as_the_report_does() {
        // In logs a drop by 100 is hopeless and a rise by 100 is certain.
        assert!(!accepts(Arithmetic::Log, 0.5, -800.0, -900.0, 0.0));
        // Both values are 0: the ratio counts as 1.
        assert!(accepts(Arithmetic::Linear, 0.5, -800.0, -900.0, 0.0));
        assert!(accepts(Arithmetic::Linear, 0.5, -800.0, -100.0, 0.0));
        assert!(!accepts(Arithmetic::Linear, 0.5, -100.0, -800.0, 0.0));
        // The constants count: they decide what underflows.
        let value = |ln_target| Value::new(ln_target, 200.0);
        assert!(!Arithmetic::Linear.accepts(
            Threshold::new(0.5),
            value(-800.0),
            value(-900.0),
            0.0
        ));
    }
}
