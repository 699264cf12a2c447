//! The README and the book read well: sentences are short, links lead somewhere, and each term of the
//! glossary is linked where a page first uses it.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

/// A page with its path from the root of the repository.
struct Page {
    path: String,
    text: String,
}

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// The README and every Markdown file below `docs/`.
fn pages() -> Vec<Page> {
    let mut paths = vec!["README.md".to_owned()];
    let folder = fs::read_dir(root().join("docs")).expect("docs/ is there");
    for entry in folder {
        let name = entry.expect("readable").file_name();
        let name = name.to_string_lossy();
        if name.ends_with(".md") {
            paths.push(format!("docs/{name}"));
        }
    }
    paths.sort();
    let read = |path: String| Page {
        text: fs::read_to_string(root().join(&path)).expect("UTF-8"),
        path,
    };
    paths.into_iter().map(read).collect()
}

/// Pages that a program writes: their words are in its source.
const GENERATED: [&str; 1] = ["docs/commands.md"];

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Prose,
    Cell,
    Heading,
}

/// A paragraph, a list item, a heading or one cell of a table: Markdown on one line.
struct Block {
    line: usize,
    kind: Kind,
    text: String,
}

/// The blocks of a page, without code, comments and generated tables.
fn blocks(text: &str) -> Vec<Block> {
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
struct Link {
    target: String,
    /// Of the whole link in the block's text, in bytes.
    start: usize,
    end: usize,
    text: String,
    is_picture: bool,
}

/// The inline links of a block; those inside code are none.
fn links(text: &str) -> Vec<Link> {
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
fn spoken(text: &str) -> String {
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
fn sentences(text: &str) -> Vec<String> {
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
fn count(sentence: &str) -> usize {
    let is_word = |word: &&str| word.chars().any(char::is_alphanumeric);
    sentence.split_whitespace().filter(is_word).count()
}

fn median(mut lengths: Vec<usize>) -> usize {
    lengths.sort_unstable();
    lengths.get(lengths.len() / 2).copied().unwrap_or_default()
}

/// At most 35 words in every sentence, also in the cells of tables; at most 18 in half of those in
/// paragraphs and lists. `PTM_WORDS=1` with `--nocapture` prints the median of every page.
#[test]
#[allow(clippy::print_stderr, reason = "numbers for those who write the book")]
fn sentences_are_short() {
    let mut all = Vec::new();
    let mut long = Vec::new();
    for page in pages() {
        if GENERATED.contains(&page.path.as_str()) || page.path == "docs/SUMMARY.md" {
            continue;
        }
        let mut of_page = Vec::new();
        for block in blocks(&page.text) {
            for sentence in sentences(&spoken(&block.text)) {
                let words = count(&sentence);
                if words > 35 {
                    long.push(format!(
                        "{}:{}: {words} words: {sentence}",
                        page.path, block.line
                    ));
                }
                if block.kind == Kind::Prose && words > 0 {
                    of_page.push(words);
                }
            }
        }
        if std::env::var_os("PTM_WORDS").is_some() {
            let (n, longest) = (of_page.len(), of_page.iter().max().copied());
            let middle = median(of_page.clone());
            eprintln!(
                "{:24} {n:4} sentences, median {middle}, longest {longest:?}",
                page.path
            );
        }
        assert!(
            of_page.is_empty() || median(of_page.clone()) <= 20,
            "{}",
            page.path
        );
        all.extend(of_page);
    }
    let n = all.len();
    assert!(n > 500, "only {n} sentences were found");
    let middle = median(all);
    if std::env::var_os("PTM_WORDS").is_some() {
        eprintln!(
            "all: {n} sentences, median {middle}, {} above 35 words",
            long.len()
        );
    }
    assert!(
        long.is_empty(),
        "{} sentences are too long:\n{}",
        long.len(),
        long.join("\n")
    );
    assert!(middle <= 18, "the median sentence has {middle} words");
}

/// Turns of phrase that readers stumbled over.
#[test]
fn no_sentence_has_to_be_read_twice() {
    const RIDDLES: [&str; 21] = [
        "lies deepest",
        "told from chance",
        "so-manyth",
        "so many ",
        "is had",
        "are had",
        "was had",
        "were had",
        "can be had",
        "be had,",
        "is said",
        "are said",
        "that is said",
        "what it is against",
        "is against:",
        "takes nothing back",
        "as the frame stands",
        "worlds of cells",
        "is worth 30.0 draws",
        "a bound and no method",
        "Theory wants",
    ];
    let mut found = Vec::new();
    for page in pages() {
        if GENERATED.contains(&page.path.as_str()) {
            continue;
        }
        for block in blocks(&page.text) {
            for riddle in RIDDLES {
                if spoken(&block.text).contains(riddle) {
                    found.push(format!("{}:{}: {riddle}", page.path, block.line));
                }
            }
        }
    }
    assert!(found.is_empty(), "{}", found.join("\n"));
}

/// The anchor of a heading, as forges and mdBook make it.
fn anchor(heading: &str) -> String {
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

fn anchors(page: &str) -> BTreeSet<String> {
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

/// A path without `.` and `..`.
fn tidy(path: &Path) -> PathBuf {
    let mut tidied = PathBuf::new();
    for part in path.components() {
        match part {
            std::path::Component::ParentDir => {
                tidied.pop();
            }
            std::path::Component::CurDir => {}
            other => tidied.push(other),
        }
    }
    tidied
}

/// Every relative link leads to a file of the repository and to a heading of it. Pages of the book do not
/// link outside `docs/`, since the built book has nothing else.
#[test]
fn links_lead_somewhere() {
    let mut wrong = Vec::new();
    let (mut n_files, mut n_anchors) = (0, 0);
    for page in pages() {
        let here = Path::new(&page.path).parent().expect("a file");
        for block in blocks(&page.text) {
            for link in links(&block.text) {
                let (file, name) = link.target.split_once('#').unwrap_or((&link.target, ""));
                if file.contains("://") || file.starts_with("mailto:") {
                    continue;
                }
                let path = match file {
                    "" => PathBuf::from(&page.path),
                    file => tidy(&here.join(file)),
                };
                let mut fail = |why: &str| {
                    wrong.push(format!(
                        "{}:{}: {}: {why}",
                        page.path, block.line, link.target
                    ));
                };
                n_files += 1;
                if !root().join(&path).exists() {
                    fail("no such file");
                    continue;
                }
                if page.path.starts_with("docs/") && !path.starts_with("docs") {
                    fail("outside of the book");
                }
                if name.is_empty() {
                    continue;
                }
                n_anchors += 1;
                let text = fs::read_to_string(root().join(&path)).unwrap_or_default();
                if !anchors(&text).contains(name) {
                    fail("no such heading");
                }
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    assert!(
        n_files > 100 && n_anchors > 20,
        "{n_files} links, {n_anchors} to headings"
    );
}

/// The summary of the book lists every page once.
#[test]
fn the_book_has_every_page() {
    let summary = fs::read_to_string(root().join("docs/SUMMARY.md")).expect("a summary");
    let mut listed = Vec::new();
    for block in blocks(&summary) {
        listed.extend(
            links(&block.text)
                .into_iter()
                .map(|link| format!("docs/{}", link.target)),
        );
    }
    listed.sort();
    let there: Vec<String> = pages()
        .into_iter()
        .map(|page| page.path)
        .filter(|path| path.starts_with("docs/") && path != "docs/SUMMARY.md")
        .collect();
    assert_eq!(listed, there);
}

/// A term of the glossary: its anchor and the forms in which pages use it.
struct Term {
    anchor: String,
    forms: Vec<String>,
}

/// The terms of the glossary. A comment below a heading says in which forms the term is linked:
/// `<!-- forms: chain, chains -->`.
fn terms() -> Vec<Term> {
    let text = fs::read_to_string(root().join("docs/glossary.md")).expect("a glossary");
    let mut found = Vec::new();
    let mut heading = "";
    for line in text.lines() {
        if let Some(name) = line.strip_prefix("### ") {
            heading = name;
        } else if let Some(forms) = line.strip_prefix("<!-- forms:") {
            let forms = forms.trim_end_matches("-->").split(',');
            found.push(Term {
                anchor: anchor(heading),
                forms: forms.map(|form| form.trim().to_owned()).collect(),
            });
        }
    }
    found
}

/// Where a form first stands in a text as words of its own.
fn place(text: &str, form: &str) -> Option<usize> {
    let lower = text.to_lowercase();
    // Lower case of a few letters has another length; no page has such letters.
    let hay = if lower.len() == text.len() {
        lower.as_str()
    } else {
        text
    };
    let form = form.to_lowercase();
    let is_word = |c: char| c.is_alphanumeric() || c == '-' || c == '_';
    hay.match_indices(&form)
        .map(|(start, _)| start)
        .find(|start| {
            let before = hay[..*start].chars().next_back();
            let after = hay[start + form.len()..].chars().next();
            !before.is_some_and(is_word) && !after.is_some_and(is_word)
        })
}

/// A block with all blanked out that is no text of the page: code, pictures and the targets of links. Places stay
/// what they are.
fn visible(text: &str) -> String {
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

/// Where a page first uses a term in a paragraph or list, the term links to the glossary.
#[test]
fn terms_are_linked_where_a_page_first_uses_them() {
    let terms = terms();
    assert!(terms.len() > 30, "only {} terms", terms.len());
    let mut missing = Vec::new();
    for page in pages() {
        let exempt = ["docs/glossary.md", "docs/SUMMARY.md"];
        if exempt.contains(&page.path.as_str()) || GENERATED.contains(&page.path.as_str()) {
            continue;
        }
        let glossary = match page.path.as_str() {
            "README.md" => "docs/glossary.md#",
            _ => "glossary.md#",
        };
        let blocks: Vec<Block> = blocks(&page.text)
            .into_iter()
            .filter(|block| block.kind == Kind::Prose)
            .collect();
        for term in &terms {
            let target = format!("{glossary}{}", term.anchor);
            let first = blocks.iter().find_map(|block| {
                let text = visible(&block.text);
                let places = term.forms.iter().filter_map(|form| place(&text, form));
                Some((block, places.min()?))
            });
            let Some((block, at)) = first else { continue };
            // A term in the text of another link leads there.
            let linked = links(&block.text).iter().any(|link| {
                let is_ours = link.target == target || !link.target.starts_with(glossary);
                link.start <= at && at < link.end && (is_ours || link.text.contains(' '))
            });
            if !linked {
                missing.push(format!("{}:{}: {}", page.path, block.line, term.anchor));
            }
        }
    }
    assert!(
        missing.is_empty(),
        "not linked at first use:\n{}",
        missing.join("\n")
    );
}
