//! As much of Markdown as the tests of the documents need: blocks, links, anchors, and the sentences of a page.

use std::collections::{BTreeMap, BTreeSet};

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    Prose,
    Cell,
    Heading,
}

/// A paragraph, a list item, a heading or one cell of a table: Markdown on one line.
pub struct Block {
    pub line: usize,
    pub kind: Kind,
    pub text: String,
}

/// The blocks of a page, without code, comments and generated tables.
pub fn blocks(text: &str) -> Vec<Block> {
    let mut found: Vec<Block> = Vec::new();
    let mut fence: Option<String> = None;
    let mut in_comment = false;
    let mut generated = false;
    // Whether the next plain line belongs to the last block.
    let mut open = false;
    for (line, raw) in text.lines().enumerate() {
        let line = line + 1;
        let trimmed = raw.trim();
        if let Some(marks) = &fence {
            if trimmed.starts_with(marks.as_str()) {
                fence = None;
            }
            continue;
        }
        if in_comment {
            in_comment = !trimmed.contains("-->");
            continue;
        }
        if trimmed.starts_with("```") || trimmed.starts_with("~~~") {
            fence = Some(trimmed.chars().take(3).collect());
            open = false;
            continue;
        }
        if trimmed.starts_with("<!--") {
            in_comment = !trimmed.contains("-->");
            open = false;
            continue;
        }
        // The table of keys at the end of docs/sweep.md is printed by the program.
        generated |= trimmed == "### `[data]`";
        if generated {
            continue;
        }
        if trimmed.is_empty() {
            open = false;
            continue;
        }
        if raw.starts_with("    ") && !open {
            continue; // indented code
        }
        if trimmed.starts_with('#') {
            let text = trimmed.trim_start_matches('#').trim().to_owned();
            found.push(Block {
                line,
                kind: Kind::Heading,
                text,
            });
            open = false;
            continue;
        }
        if trimmed.starts_with('|') {
            for cell in cells(trimmed) {
                if cell.chars().any(char::is_alphanumeric) {
                    found.push(Block {
                        line,
                        kind: Kind::Cell,
                        text: cell,
                    });
                }
            }
            open = false;
            continue;
        }
        let item = list_item(trimmed);
        let content = item.unwrap_or(trimmed.trim_start_matches("> "));
        if open && item.is_none() {
            let last = found.last_mut().expect("a block is open");
            last.text.push(' ');
            last.text.push_str(content);
        } else {
            found.push(Block {
                line,
                kind: Kind::Prose,
                text: content.to_owned(),
            });
            open = true;
        }
    }
    found
}

/// The text of a list item.
fn list_item(line: &str) -> Option<&str> {
    if let Some(rest) = line.strip_prefix("- ").or_else(|| line.strip_prefix("* ")) {
        return Some(rest);
    }
    let digits = line.chars().take_while(char::is_ascii_digit).count();
    if digits == 0 || digits > 2 {
        return None;
    }
    line[digits..].strip_prefix(". ")
}

/// The cells of a row of a table. A `|` in code or behind a backslash does not end one.
fn cells(row: &str) -> Vec<String> {
    let mut all = vec![String::new()];
    let (mut in_code, mut escaped) = (false, false);
    for sign in row.chars() {
        if sign == '`' {
            in_code = !in_code;
        }
        if sign == '|' && !escaped && !in_code {
            all.push(String::new());
        } else if let Some(last) = all.last_mut() {
            last.push(sign);
        }
        escaped = sign == '\\';
    }
    all.into_iter().map(|cell| cell.trim().to_owned()).collect()
}

/// A link or picture of a page.
pub struct Link {
    pub target: String,
    /// Of the whole link in the block's text, in bytes.
    pub start: usize,
    pub end: usize,
    pub text: String,
    pub is_picture: bool,
}

/// The inline links of a block; those inside code are none.
pub fn links(text: &str) -> Vec<Link> {
    let bytes = text.as_bytes();
    let mut found = Vec::new();
    let mut in_code = false;
    let mut i = 0;
    while i < bytes.len() {
        match bytes[i] {
            b'`' => in_code = !in_code,
            b'[' if !in_code => {
                if let Some(link) = link_at(text, i) {
                    // A picture may itself be the text of a link.
                    found.extend(links(&link.text).into_iter().map(|inner| Link {
                        start: inner.start + i + 1,
                        end: inner.end + i + 1,
                        ..inner
                    }));
                    i = link.end;
                    found.push(link);
                    continue;
                }
            }
            _ => {}
        }
        i += 1;
    }
    found
}

/// The link whose `[` is at `start`.
fn link_at(text: &str, start: usize) -> Option<Link> {
    let bytes = text.as_bytes();
    let (mut depth, mut close) = (0_usize, None);
    for (i, byte) in bytes.iter().enumerate().skip(start) {
        match byte {
            b'[' => depth += 1,
            b']' => {
                depth -= 1;
                if depth == 0 {
                    close = Some(i);
                    break;
                }
            }
            _ => {}
        }
    }
    let close = close?;
    let inside = text[close + 1..].strip_prefix('(')?;
    let length = inside.find(')')?;
    let is_picture = start > 0 && bytes[start - 1] == b'!';
    Some(Link {
        target: inside[..length].trim().to_owned(),
        start: if is_picture { start - 1 } else { start },
        end: close + 1 + 1 + length + 1,
        text: text[start + 1..close].to_owned(),
        is_picture,
    })
}

/// What is read aloud of a block: the words of links, a word for each piece of code, no pictures.
pub fn spoken(text: &str) -> String {
    let mut plain = String::new();
    let mut from = 0;
    let mut all = links(text);
    all.sort_by_key(|link| (link.start, std::cmp::Reverse(link.end)));
    for link in all {
        if link.start < from {
            continue;
        }
        plain.push_str(&text[from..link.start]);
        if !link.is_picture {
            plain.push_str(&spoken(&link.text));
        }
        from = link.end;
    }
    plain.push_str(&text[from..]);
    let mut words = String::new();
    for (i, part) in plain.split('`').enumerate() {
        words.push_str(if i % 2 == 0 { part } else { "Code" });
    }
    words.replace("**", "").replace(['*', '_'], "")
}

/// The sentences of what is spoken. A colon at the end of a paragraph ends one.
pub fn sentences(text: &str) -> Vec<String> {
    const SHORT_FORMS: [&str; 9] = ["al", "eq", "eqs", "e.g", "i.e", "Fig", "vs", "no", "St"];
    let words: Vec<&str> = text.split_whitespace().collect();
    let mut found = Vec::new();
    let mut sentence: Vec<&str> = Vec::new();
    for (i, word) in words.iter().enumerate() {
        sentence.push(word);
        let bare = word.trim_end_matches(['"', '”', ')', '’', ']']);
        let ends = bare.ends_with(['.', '!', '?']);
        let stem = bare
            .trim_end_matches('.')
            .trim_start_matches(['(', '"', '“']);
        let is_short_form = SHORT_FORMS.contains(&stem)
            || (stem.chars().count() == 1 && stem.chars().all(|c| c.is_ascii_uppercase()));
        if ends && !(is_short_form && i + 1 < words.len()) {
            found.push(sentence.join(" "));
            sentence.clear();
        }
    }
    if !sentence.is_empty() {
        found.push(sentence.join(" "));
    }
    found
}

/// Words: what has a letter or a digit.
pub fn count(sentence: &str) -> usize {
    let is_word = |word: &&str| word.chars().any(char::is_alphanumeric);
    sentence.split_whitespace().filter(is_word).count()
}

/// The anchor of a heading, as forges and mdBook make it.
pub fn anchor(heading: &str) -> String {
    let mut text = String::new();
    let mut from = 0;
    for link in links(heading) {
        text.push_str(&heading[from..link.start]);
        text.push_str(&link.text);
        from = link.end;
    }
    text.push_str(&heading[from..]);
    let keep = |c: &char| c.is_alphanumeric() || *c == '_' || *c == '-' || *c == ' ';
    let lower = text.to_lowercase();
    lower
        .chars()
        .filter(keep)
        .map(|c| if c == ' ' { '-' } else { c })
        .collect()
}

pub fn anchors(page: &str) -> BTreeSet<String> {
    let mut seen: BTreeMap<String, usize> = BTreeMap::new();
    let mut found = BTreeSet::new();
    for heading in blocks(page)
        .into_iter()
        .filter(|block| block.kind == Kind::Heading)
    {
        let name = anchor(&heading.text);
        let again = seen.entry(name.clone()).or_default();
        found.insert(if *again == 0 {
            name.clone()
        } else {
            format!("{name}-{again}")
        });
        *again += 1;
    }
    found
}

/// A block with all blanked out that is no text of the page: code, pictures and the targets of links. Places stay
/// what they are.
pub fn visible(text: &str) -> String {
    let mut out = String::new();
    for (i, part) in text.split('`').enumerate() {
        if i > 0 {
            out.push('`');
        }
        if i % 2 == 0 {
            out.push_str(part);
        } else {
            out.extend(std::iter::repeat_n(' ', part.len()));
        }
    }
    for link in links(text) {
        let from = if link.is_picture {
            link.start
        } else {
            link.start + 1 + link.text.len()
        };
        out.replace_range(from..link.end, &" ".repeat(link.end - from));
    }
    out
}
