//! Numbers as people write them: how they are read, how a message repeats them, and what to write
//! instead.

use crate::excerpt::{OF_A_VALUE, excerpt};

/// A whole number in decimal or scientific notation: `10000`, `1e4`, `2.5e3`, `7.0`. Read digit by
/// digit, so that no digit of a large number is lost. `None` if it is not whole or above 2⁶⁴ − 1.
pub fn whole(text: &str) -> Option<u64> {
    let text = text.strip_prefix('+').unwrap_or(text);
    let (mantissa, exponent) = text.split_once(['e', 'E']).unwrap_or((text, "0"));
    let (integral, fraction) = mantissa.split_once('.').unwrap_or((mantissa, ""));
    let digits = format!("{integral}{fraction}");
    if digits.is_empty() || !digits.bytes().all(|byte| byte.is_ascii_digit()) {
        return None;
    }
    let exponent: i64 = exponent.parse().ok()?;
    let significant = digits.trim_end_matches('0');
    let n_zeros = (digits.len() - significant.len()) as i64 - fraction.len() as i64;
    let significant = significant.trim_start_matches('0');
    if significant.is_empty() {
        return Some(0);
    }
    let n_zeros = u32::try_from(exponent.saturating_add(n_zeros)).ok()?;
    let scale = 10_u64.checked_pow(n_zeros)?;
    significant.parse::<u64>().ok()?.checked_mul(scale)
}

/// A finite number.
pub fn finite(text: &str) -> Option<f64> {
    text.parse().ok().filter(|number: &f64| number.is_finite())
}

/// A text as a message repeats it: as it was written if it resembles a number, in quotes otherwise.
pub fn repeated(text: &str) -> String {
    let is_plain = text.chars().all(|c| c.is_ascii_graphic() && c != '"');
    let resembles = text.contains(|c: char| c.is_ascii_digit()) || text.parse::<f64>().is_ok();
    if is_plain && resembles {
        excerpt(text, OF_A_VALUE)
    } else {
        format!("{:?}", excerpt(text, OF_A_VALUE))
    }
}

/// "; write 1000" or the like, if the text would be a number but for how it is written; nothing
/// otherwise.
pub fn advice(text: &str) -> String {
    let is_number = |text: &str| finite(text).is_some();
    if is_number(text) {
        return String::new();
    }
    let bare = text.trim();
    let without = |separators: &[char]| bare.replace(separators, "");
    if is_number(bare) {
        return format!("; write {bare} without spaces");
    }
    let is_grouped = |separator: char| {
        let mut groups = bare.trim_start_matches(['+', '-']).split(separator);
        let first = groups.next().unwrap_or_default();
        (1..=3).contains(&first.len())
            && groups.all(|group| {
                group
                    .split('.')
                    .next()
                    .is_some_and(|whole| whole.len() == 3)
            })
    };
    if is_number(&without(&['_', ' ', '\''])) {
        return format!("; write {}", without(&['_', ' ', '\'']));
    }
    if bare.contains(',') && is_number(&without(&[','])) {
        let as_point = bare.replace(',', ".");
        return match (is_number(&as_point), is_grouped(',')) {
            (true, false) => format!("; write {as_point} with a decimal point"),
            (true, true) => format!(
                "; write {} or, with a decimal point, {as_point}",
                without(&[','])
            ),
            (false, _) => format!("; write {}", without(&[','])),
        };
    }
    match bare.parse::<f64>() {
        Ok(number) if number.is_infinite() && bare.contains(|c: char| c.is_ascii_digit()) => {
            "; no number may be above 1.8e308".to_owned()
        }
        Ok(_) => "; it has to be finite".to_owned(),
        Err(_) => String::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whole_numbers_in_either_notation() {
        let good = [
            ("0", 0),
            ("007", 7),
            ("+3", 3),
            ("1e4", 10_000),
            ("1E+4", 10_000),
            ("2.5e3", 2500),
            ("7.0", 7),
            ("5000e-3", 5),
            (".5e1", 5),
            ("0e99", 0),
            ("18446744073709551615", u64::MAX),
            ("1.8446744073709551615e19", u64::MAX),
            ("9007199254740993.0", 9_007_199_254_740_993),
        ];
        for (text, number) in good {
            assert_eq!(whole(text), Some(number), "{text}");
        }
        for text in [
            "",
            ".",
            "e4",
            "-1",
            "1e",
            "1e4.5",
            "2.5",
            "1e-1",
            "1_000",
            " 3 ",
            "1e20",
            "0x10",
            "18446744073709551616",
            "1e9223372036854775807",
            "1e99999999999999999999",
            "nan",
            "inf",
            "++1",
            "1e4e4",
            "١",
        ] {
            assert_eq!(whole(text), None, "{text}");
        }
    }

    #[test]
    fn messages_repeat_what_was_written_and_say_what_to_write() {
        for (text, got, what_to_do) in [
            ("1e4.5", "1e4.5", ""),
            ("2.50", "2.50", ""),
            ("1_000", "1_000", "; write 1000"),
            ("1'000", "1'000", "; write 1000"),
            ("1 000", "\"1 000\"", "; write 1000"),
            ("1,5", "1,5", "; write 1.5 with a decimal point"),
            (
                "1,000",
                "1,000",
                "; write 1000 or, with a decimal point, 1.000",
            ),
            ("1,000,000", "1,000,000", "; write 1000000"),
            ("1,000.5", "1,000.5", "; write 1000.5"),
            (" 3 ", "\" 3 \"", "; write 3 without spaces"),
            ("1e400", "1e400", "; no number may be above 1.8e308"),
            ("nan", "nan", "; it has to be finite"),
            ("-inf", "-inf", "; it has to be finite"),
            ("three", "\"three\"", ""),
            ("", "\"\"", ""),
            ("3\u{1b}[2J", "\"3\\u{1b}[2J\"", ""),
        ] {
            assert_eq!(
                (&*repeated(text), &*advice(text)),
                (got, what_to_do),
                "{text}"
            );
        }
    }
}
