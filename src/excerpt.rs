//! What a message repeats of a file or a flag: enough to recognise it, however long it was.

/// Characters of a value that a message repeats.
pub const OF_A_VALUE: usize = 80;
/// Characters of what another library said.
const OF_A_MESSAGE: usize = 400;

/// The text, or its beginning and its length if it has more than `most` characters.
pub fn excerpt(text: &str, most: usize) -> String {
    match text.char_indices().nth(most) {
        None => text.to_owned(),
        Some((end, _)) => format!("{}… ({} characters)", &text[..end], text.chars().count()),
    }
}

/// What another library said of a file, on one line: it repeats what it found there, ends of lines and all.
pub fn message(text: &str) -> String {
    excerpt(&text.replace(char::is_control, " "), OF_A_MESSAGE)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_message_is_one_line() {
        assert_eq!(message("got `a\n\u{1b}[2J`"), "got `a  [2J`");
        assert!(message(&"é\n".repeat(1000)).chars().count() < 450);
    }

    #[test]
    fn long_texts_are_cut_between_characters() {
        assert_eq!(excerpt("σₒ", 2), "σₒ");
        assert_eq!(excerpt("σₒσ", 2), "σₒ… (3 characters)");
        assert_eq!(excerpt("", 0), "");
    }
}
