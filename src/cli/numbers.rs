//! Flags that are numbers: read as settings are, with messages that say what was got and expected.

use crate::settings::numbers::{advice, finite, whole};

/// A whole number from `least` to `most`.
pub fn count<T>(least: u64, most: u64) -> impl Fn(&str) -> Result<T, String> + Clone
where
    T: TryFrom<u64>,
{
    move |text| {
        let number = whole(text).filter(|number| (least..=most).contains(number));
        let range = match (least, most) {
            (0, u64::MAX) => String::new(),
            (least, u64::MAX) => format!(" >= {least}"),
            _ => format!(" from {least} to {most}"),
        };
        number
            .and_then(|number| T::try_from(number).ok())
            .ok_or_else(|| format!("expected a whole number{range}{}", advice(text)))
    }
}

/// A number above 0.
pub fn positive(text: &str) -> Result<f64, String> {
    finite(text)
        .filter(|number| *number > 0.0)
        .ok_or_else(|| format!("expected a number > 0{}", advice(text)))
}

/// A number.
pub fn number(text: &str) -> Result<f64, String> {
    finite(text).ok_or_else(|| format!("expected a number{}", advice(text)))
}

/// "1,032,000": a count as people write it.
pub fn grouped(n: u64) -> String {
    let digits = n.to_string();
    let mut words = String::new();
    for (place, digit) in digits.chars().enumerate() {
        if place > 0 && (digits.len() - place).is_multiple_of(3) {
            words.push(',');
        }
        words.push(digit);
    }
    words
}
