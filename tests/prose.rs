//! The README and the book read well: sentences are short, links lead somewhere, and each term of the
//! glossary is linked where a page first uses it.

#[path = "common/markdown.rs"]
mod markdown;

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use markdown::{Block, Kind, anchor, anchors, blocks, count, links, sentences, spoken, visible};

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
                // mdBook writes README.md as index.html, and does not follow links to it.
                if path == Path::new("docs/README.md") && page.path.starts_with("docs/") {
                    assert_eq!(page.path, "docs/SUMMARY.md", "{}", link.target);
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

/// Every picture of the book is shown, and all of them together are small.
#[test]
fn pictures_are_shown_and_small() {
    let mut shown = BTreeSet::new();
    for page in pages() {
        let here = Path::new(&page.path).parent().expect("a file");
        for block in blocks(&page.text) {
            for link in links(&block.text)
                .into_iter()
                .filter(|link| link.is_picture)
            {
                assert!(
                    link.text.len() > 10,
                    "{}: {} has no description",
                    page.path,
                    link.target
                );
                shown.insert(tidy(&here.join(&link.target)));
            }
        }
    }
    let mut bytes = 0;
    for entry in fs::read_dir(root().join("docs/pictures")).expect("pictures") {
        let path = entry.expect("readable").path();
        if path.extension().is_some_and(|ending| ending == "png") {
            bytes += fs::metadata(&path).expect("readable").len();
            let path = path.strip_prefix(root()).expect("below the root");
            assert!(shown.contains(path), "{} is on no page", path.display());
        }
    }
    assert!(
        bytes > 0 && bytes <= 2_000_000,
        "docs/pictures has {bytes} bytes"
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
