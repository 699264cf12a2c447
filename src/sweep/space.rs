//! A setting's place in the unit interval: what a sampled design turns its points into.
//!
//! A range maps u ∈ [0, 1] to low + u (high − low), or on a logarithmic scale to low (high/low)^u, rounded to four
//! digits; a whole number gets an equal share of u (of ln u) for each of its values. Listed levels have an
//! equal share each.

use crate::settings::{Key, Kind, Value};

/// Digits that values of a range are rounded to: more would say nothing in a table.
const DIGITS: i32 = 4;

/// A factor of a sampled design.
#[derive(Clone)]
pub struct Axis {
    /// The setting.
    pub key: &'static Key,
    /// Its values.
    pub spread: Spread,
}

impl std::fmt::Debug for Axis {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}: {:?}", self.key.name, self.spread)
    }
}

/// The values of an axis.
#[derive(Clone, Debug, PartialEq)]
pub enum Spread {
    /// From low to high.
    Range {
        /// The least value.
        low: f64,
        /// The largest value.
        high: f64,
        /// Whether equal steps of u are equal ratios.
        log: bool,
    },
    /// These.
    Levels(Vec<Value>),
}

impl Axis {
    fn is_whole(&self) -> bool {
        matches!(self.key.kind, Kind::Count(_) | Kind::CountUpTo(..))
    }

    /// The ends of the scale that u runs along: half a step further out for whole numbers.
    fn ends(&self, low: f64, high: f64, log: bool) -> (f64, f64) {
        let out = if self.is_whole() { 0.5 } else { 0.0 };
        let scale = |x: f64| if log { libm::log(x) } else { x };
        (scale(low - out), scale(high + out))
    }

    /// The value at u ∈ [0, 1].
    pub fn at(&self, u: f64) -> Value {
        match &self.spread {
            Spread::Levels(levels) => {
                let place = (u * levels.len() as f64) as usize;
                levels[place.min(levels.len() - 1)].clone()
            }
            Spread::Range { low, high, log } => {
                let (from, to) = self.ends(*low, *high, *log);
                let x = from + u * (to - from);
                let x = if *log { libm::exp(x) } else { x };
                if self.is_whole() {
                    return Value::Count(x.round().clamp(*low, *high) as u64);
                }
                Value::Number(rounded(x).clamp(*low, *high))
            }
        }
    }

    /// Where a value lies, from 0 to 1; the middle of its share for a level or a whole number.
    pub fn place(&self, value: &Value) -> Option<f64> {
        match &self.spread {
            Spread::Levels(levels) => {
                let place = levels.iter().position(|level| level == value)?;
                Some((place as f64 + 0.5) / levels.len() as f64)
            }
            Spread::Range { low, high, log } => {
                let x = match value {
                    Value::Count(count) => *count as f64,
                    Value::Number(number) => *number,
                    Value::Text(_) => return None,
                };
                let (from, to) = self.ends(*low, *high, *log);
                let x = if *log { libm::log(x) } else { x };
                Some(((x - from) / (to - from)).clamp(0.0, 1.0))
            }
        }
    }

    /// How many bins a response curve has along the axis: its levels, or at most `most` of a range.
    pub fn n_bins(&self, most: usize) -> usize {
        match &self.spread {
            Spread::Levels(levels) => levels.len(),
            Spread::Range { low, high, .. } if self.is_whole() => {
                most.min((high - low) as usize + 1)
            }
            Spread::Range { .. } => most,
        }
    }

    /// The bin of a value among `n` of equal shares.
    pub fn bin(&self, value: &Value, n: usize) -> Option<usize> {
        let place = self.place(value)?;
        Some(((place * n as f64) as usize).min(n - 1))
    }

    /// What is in a bin, in words: "3.2–10" or a level.
    pub fn bin_label(&self, bin: usize, n: usize) -> String {
        match &self.spread {
            Spread::Levels(levels) => levels[bin].to_string(),
            Spread::Range { low, high, log } => {
                let (from, to) = self.ends(*low, *high, *log);
                let edge = |k: usize| {
                    let x = from + (to - from) * k as f64 / n as f64;
                    if *log { libm::exp(x) } else { x }
                };
                if self.is_whole() {
                    let first = edge(bin).ceil().max(*low);
                    let last = (edge(bin + 1).ceil() - 1.0).min(*high);
                    return if first >= last {
                        format!("{first}")
                    } else {
                        format!("{first}–{last}")
                    };
                }
                let short = |x: f64| digits(x, 2);
                format!("{}–{}", short(edge(bin)), short(edge(bin + 1)))
            }
        }
    }
}

fn rounded(x: f64) -> f64 {
    digits(x, DIGITS)
}

/// x to so many digits. By way of its decimal form, so that the double is the nearest to those digits.
fn digits(x: f64, n: i32) -> f64 {
    format!("{x:.*e}", (n - 1) as usize).parse().unwrap_or(x)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::settings::KEYS;

    fn axis(name: &str, spread: Spread) -> Axis {
        let key = KEYS.iter().find(|key| key.name == name).expect("a key");
        Axis { key, spread }
    }

    fn range(name: &str, low: f64, high: f64, log: bool) -> Axis {
        axis(name, Spread::Range { low, high, log })
    }

    #[test]
    fn ends_and_middle_of_a_range() {
        let linear = range("sigma_o", 1.0, 3.0, false);
        assert_eq!(
            [0.0, 0.5, 1.0].map(|u| linear.at(u)),
            [1.0, 2.0, 3.0].map(Value::Number)
        );
        let log = range("sigma_o", 0.1, 10.0, true);
        assert_eq!(
            [0.0, 0.5, 1.0].map(|u| log.at(u)),
            [0.1, 1.0, 10.0].map(Value::Number)
        );
        assert_eq!(log.at(0.123), Value::Number(0.1762));
        assert!((log.place(&Value::Number(1.0)).expect("a place") - 0.5).abs() < 1e-12);
        assert_eq!(log.bin_label(1, 4), "0.32–1");
    }

    #[test]
    fn whole_numbers_and_levels_have_equal_shares() {
        let whole = range("importance_samples", 1.0, 4.0, false);
        let levels = axis(
            "init",
            Spread::Levels(
                ["a", "b", "c", "d"]
                    .map(|s| Value::Text(s.to_owned()))
                    .to_vec(),
            ),
        );
        for axis in [whole, levels] {
            let mut counts = std::collections::BTreeMap::new();
            for k in 0..4000 {
                let value = axis.at((f64::from(k) + 0.5) / 4000.0);
                assert_eq!(axis.bin(&value, 4), Some(k as usize / 1000));
                *counts.entry(value.to_string()).or_insert(0) += 1;
            }
            assert!(counts.values().all(|count| *count == 1000), "{counts:?}");
        }
    }

    #[test]
    fn every_value_lies_in_the_bin_of_its_place() {
        let axis = range("importance_samples", 1.0, 100.0, true);
        let n = axis.n_bins(6);
        let mut last = 0;
        for count in 1..=100 {
            let bin = axis.bin(&Value::Count(count), n).expect("a bin");
            assert!(bin == last || bin == last + 1, "{count}");
            last = bin;
        }
        assert_eq!((n, last), (6, 5));
        assert_eq!(range("importance_samples", 1.0, 4.0, true).n_bins(6), 4);
    }
}
