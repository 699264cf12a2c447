//! Where text leaves the program: standard output and standard error.
//!
//! What a message repeats of labels, paths and headers may hold control characters, which would
//! command the reader's terminal. They leave as `\u{1b}` and the like. A standard error that cannot
//! be written (a full disk, a closed pipe) changes nothing of what the program does. Whoever closes
//! standard output, as `head` does, has read enough; any other failure there is reported when the
//! work is done.

use std::borrow::Cow;
use std::io::{Error, ErrorKind, IsTerminal, Write};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// A line to standard output.
macro_rules! outln {
    ($($words:tt)*) => { $crate::cli::terminal::output(&(format!($($words)*) + "\n")) };
}
/// Text to standard output.
macro_rules! out {
    ($($words:tt)*) => { $crate::cli::terminal::output(&format!($($words)*)) };
}
/// A line to standard error.
macro_rules! errln {
    ($($words:tt)*) => { $crate::cli::terminal::error_line(&format!($($words)*)) };
}

/// What has become of standard output.
enum State {
    Open,
    /// Nobody reads it any more.
    Closed,
    /// It could not be written.
    Failed(Error),
}

static STATE: Mutex<State> = Mutex::new(State::Open);

fn state() -> MutexGuard<'static, State> {
    STATE.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Columns of lines where nobody looks at a terminal: more than any table has, and still no line of
/// a megabyte for many detections.
const PIPE_COLUMNS: usize = 1000;

/// Columns that a line to standard output may have: those of the terminal, or many in a pipe.
pub fn width() -> usize {
    if !std::io::stdout().is_terminal() {
        return PIPE_COLUMNS;
    }
    let size = terminal_size::terminal_size();
    size.map_or(80, |(width, _)| usize::from(width.0).max(20))
}

/// Writes text to standard output.
pub fn output(text: &str) {
    let mut state = state();
    if !matches!(*state, State::Open) {
        return;
    }
    let mut place = std::io::stdout().lock();
    let written = place.write_all(shown(text).as_bytes());
    match written.and_then(|()| place.flush()) {
        Ok(()) => {}
        Err(error) if error.kind() == ErrorKind::BrokenPipe => *state = State::Closed,
        Err(error) => *state = State::Failed(error),
    }
}

/// Why something could not be written to standard output, if that was not its reader's wish.
pub fn output_failure() -> Option<Error> {
    match std::mem::replace(&mut *state(), State::Closed) {
        State::Failed(error) => Some(error),
        State::Open | State::Closed => None,
    }
}

/// Writes a line to standard error, at once and whole, so that lines of several processes do not
/// mix.
pub fn error_line(text: &str) {
    let line = format!("{}\n", shown(text));
    let _ = std::io::stderr().lock().write_all(line.as_bytes());
}

/// A text without characters that command a terminal or turn the order of others round.
fn shown(text: &str) -> Cow<'_, str> {
    replaced(text, |c| c.escape_default().to_string())
}

/// JSON without such characters: they stand only in its strings, where they may be escaped.
pub fn shown_json(text: &str) -> Cow<'_, str> {
    replaced(text, |c| format!("\\u{:04x}", u32::from(c)))
}

fn replaced(text: &str, escaped: impl Fn(char) -> String) -> Cow<'_, str> {
    if !text.contains(commands) {
        return Cow::Borrowed(text);
    }
    let mut shown = String::with_capacity(text.len() + 16);
    for c in text.chars() {
        if commands(c) {
            shown.push_str(&escaped(c));
        } else {
            shown.push(c);
        }
    }
    Cow::Owned(shown)
}

/// Controls of C0 and C1 but for tab and line feed, line separators, and what sets the direction of
/// text.
fn commands(c: char) -> bool {
    match c {
        '\n' | '\t' => false,
        '\u{61c}' | '\u{200e}' | '\u{200f}' => true,
        '\u{2028}'..='\u{202e}' | '\u{2066}'..='\u{2069}' => true,
        _ => c.is_control(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_commands_a_terminal_leaves_as_text() {
        let raw = "a\u{1b}[2J\u{9b}31m\u{7f}\r\u{202e}b\tü\n";
        assert_eq!(shown(raw), "a\\u{1b}[2J\\u{9b}31m\\u{7f}\\r\\u{202e}b\tü\n");
        assert!(matches!(shown("σₒ 1\n"), Cow::Borrowed(_)));
    }

    #[test]
    fn escaped_json_reads_back_the_same() {
        let value = serde_json::json!({"a\u{9b}": "\u{1b}\u{7f}\u{202e}ü"});
        let text = value.to_string();
        let shown = shown_json(&text);
        assert!(!shown.contains(commands), "{shown}");
        assert_eq!(
            serde_json::from_str::<serde_json::Value>(&shown).expect("JSON"),
            value
        );
    }
}
