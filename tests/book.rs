//! The commands of the README and the book work: every `sh` block is run, page by page, with `ptm` on the
//! path, and prints what the page says.
//!
//! Comments in the Markdown steer this; readers do not see them:
//!
//! - `<!-- not run: REASON -->` before a block: it is listed and left out. Reasons are in [`REASONS`].
//! - `<!-- run before: COMMANDS -->` before a block: commands that make the files it needs.
//! - `<!-- printed by the block above -->` before a `text` block: its lines are printed by the last block
//!   that was run, in this order. `…` stands for lines that are left out, or for the rest of a line;
//!   seconds and rates may differ.
//! - `<!-- run with PACKAGE -->` before a `python` block: it is run where Python has that package.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// Why a block may be left out.
const REASONS: [&str; 7] = [
    "builds the program",
    "installs a package",
    "needs a recording",
    "needs Slurm",
    "needs Kubernetes",
    "needs Snakemake",
    "needs your own file",
];

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// A fenced block of a page.
struct Block {
    page: String,
    line: usize,
    language: String,
    content: String,
    /// What the comment right before it says.
    comment: String,
}

/// The README, then the pages of the book in the order of the summary.
fn pages() -> Vec<String> {
    let summary = fs::read_to_string(root().join("docs/SUMMARY.md")).expect("a summary");
    let mut pages = vec!["README.md".to_owned()];
    for line in summary.lines() {
        let target = line
            .split("](")
            .nth(1)
            .and_then(|rest| rest.split(')').next());
        pages.extend(target.map(|target| format!("docs/{target}")));
    }
    assert!(pages.len() > 15, "{pages:?}");
    pages
}

fn blocks(page: &str) -> Vec<Block> {
    let text = fs::read_to_string(root().join(page)).expect("a page of the summary");
    let mut found: Vec<Block> = Vec::new();
    let mut is_open = false;
    let mut comment = String::new();
    for (number, line) in text.lines().enumerate() {
        if is_open {
            if line.trim() == "```" {
                is_open = false;
            } else if let Some(block) = found.last_mut() {
                block.content.push_str(line);
                block.content.push('\n');
            }
            continue;
        }
        if let Some(language) = line.trim().strip_prefix("```") {
            is_open = true;
            found.push(Block {
                page: page.to_owned(),
                line: number + 1,
                language: language.to_owned(),
                content: String::new(),
                comment: std::mem::take(&mut comment),
            });
        } else if let Some(words) = line.trim().strip_prefix("<!--") {
            comment = words.trim_end_matches("-->").trim().to_owned();
        } else if !line.trim().is_empty() {
            comment.clear();
        }
    }
    assert!(!is_open, "{page}: a block has no end");
    found
}

/// A folder of its own for each page, with the shipped sweeps in it.
fn scratch(test: &str, page: &str) -> PathBuf {
    let name = page.replace(['/', '.'], "-");
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR"))
        .join("book")
        .join(test)
        .join(name);
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(folder.join("sweeps")).expect("a scratch folder");
    for entry in fs::read_dir(root().join("sweeps")).expect("sweeps") {
        let path = entry.expect("readable").path();
        let to = folder
            .join("sweeps")
            .join(path.file_name().expect("a file"));
        fs::copy(&path, to).expect("copied");
    }
    folder
}

/// The path with the built `ptm` first.
fn path_with_ptm() -> std::ffi::OsString {
    let here = Path::new(env!("CARGO_BIN_EXE_ptm"))
        .parent()
        .expect("a folder")
        .to_owned();
    let others = std::env::var_os("PATH").unwrap_or_default();
    std::env::join_paths(std::iter::once(here).chain(std::env::split_paths(&others)))
        .expect("a path")
}

/// Runs a script and gives all that it printed, standard error first: a page may show both.
fn run(program: &str, arguments: &[&str], script: &str, folder: &Path, block: &Block) -> String {
    let output = Command::new(program)
        .args(arguments)
        .arg(script)
        .current_dir(folder)
        .env("PATH", path_with_ptm())
        .env_remove("RUST_BACKTRACE")
        .stdin(Stdio::null())
        .output()
        .unwrap_or_else(|error| panic!("{program}: {error}"));
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    let (out, err) = (text(&output.stdout), text(&output.stderr));
    assert!(
        output.status.success(),
        "{}:{}: {}\n{}\n{err}{out}",
        block.page,
        block.line,
        output.status,
        block.content
    );
    err + &out
}

/// A line without what differs from run to run: numbers before `s` and `proposals/s`.
fn steady(line: &str) -> String {
    let words: Vec<&str> = line.split_whitespace().collect();
    let mut kept = Vec::new();
    for (i, word) in words.iter().enumerate() {
        let unit = words
            .get(i + 1)
            .map_or("", |next| next.trim_end_matches([',', ':', '.']));
        let is_number = word.chars().next().is_some_and(|c| c.is_ascii_digit());
        let differs = is_number && ["s", "proposals/s", "seconds"].contains(&unit);
        kept.push(if differs { "#" } else { word });
    }
    kept.join(" ")
}

/// Whether the printed lines have the shown ones, in their order.
fn check_printed(shown: &Block, printed: &str) {
    let mut lines = printed.lines().map(steady);
    for line in shown.content.lines() {
        let line = steady(line);
        if line == "…" || line.is_empty() {
            continue;
        }
        let begins = line.strip_suffix('…').map(str::trim_end);
        let is_it = |printed: String| match begins {
            Some(begin) => printed.starts_with(begin),
            None => printed == line,
        };
        assert!(
            lines.any(is_it),
            "{}:{}: not printed, or not in this order: {line}\nprinted was\n{printed}",
            shown.page,
            shown.line
        );
    }
}

/// Every command block runs. `PTM_BOOK=tutorial` runs one page only.
#[test]
#[cfg(unix)]
#[allow(clippy::print_stderr, reason = "blocks that are left out are listed")]
fn every_command_block_of_the_book_runs() {
    let only = std::env::var("PTM_BOOK").unwrap_or_default();
    let mut left_out: BTreeMap<String, Vec<String>> = BTreeMap::new();
    let (mut n_run, mut n_shown) = (0, 0);
    for page in pages().iter().filter(|page| page.contains(&only)) {
        let mut printed: Option<String> = None;
        let mut folder = None;
        let start = std::time::Instant::now();
        for block in blocks(page) {
            let place = format!("{}:{}", block.page, block.line);
            if block.language == "text" && block.comment == "printed by the block above" {
                let printed = printed
                    .as_ref()
                    .unwrap_or_else(|| panic!("{place}: no block above"));
                check_printed(&block, printed);
                n_shown += 1;
            }
            if block.language != "sh" {
                assert!(
                    !["bash", "shell", "console", ""].contains(&block.language.as_str()),
                    "{place}: a block of {:?}; commands are `sh`, all else names its language",
                    block.language
                );
                continue;
            }
            if let Some(reason) = block.comment.strip_prefix("not run: ") {
                let is_known = REASONS.iter().any(|known| reason.starts_with(known));
                assert!(is_known, "{place}: {reason:?} is not among {REASONS:?}");
                left_out.entry(reason.to_owned()).or_default().push(place);
                printed = None;
                continue;
            }
            let folder = folder.get_or_insert_with(|| scratch("commands", page));
            let before = block
                .comment
                .strip_prefix("run before: ")
                .unwrap_or_default();
            let script = format!("set -eu\n{before}\n{}", block.content);
            printed = Some(run("sh", &["-c"], &script, folder, &block));
            n_run += 1;
        }
        if folder.is_some() {
            eprintln!("{page}: {:.1} s", start.elapsed().as_secs_f64());
        }
    }
    for (reason, places) in &left_out {
        eprintln!("NOT RUN ({reason}): {}", places.join(", "));
    }
    eprintln!("{n_run} blocks were run, {n_shown} outputs compared");
    if only.is_empty() {
        assert!(
            n_run >= 15 && n_shown >= 6,
            "{n_run} blocks, {n_shown} outputs"
        );
    }
}

/// The Python of a page runs after its commands, where Python has the packages: `PTM_PYTHON` names one, else
/// `python3`.
#[test]
#[cfg(unix)]
#[allow(clippy::print_stderr, reason = "a skipped test must say so")]
fn the_python_of_the_book_runs() {
    let python = std::env::var("PTM_PYTHON").unwrap_or_else(|_| "python3".to_owned());
    let has = |package: &str| {
        let import = format!("import {package}");
        let quiet = Command::new(&python)
            .args(["-c", &import])
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .status();
        quiet.is_ok_and(|status| status.success())
    };
    let mut n_blocks = 0;
    for page in pages() {
        let all = blocks(&page);
        let is_wanted = |block: &Block| block.comment.starts_with("run with ");
        n_blocks += all.iter().filter(|block| is_wanted(block)).count();
        let missing = all
            .iter()
            .filter_map(|block| block.comment.strip_prefix("run with "))
            .find(|packages| !packages.split(" and ").all(has));
        if let Some(missing) = missing {
            eprintln!("SKIPPED: {page}: {python} has no {missing}");
            continue;
        }
        if !all.iter().any(is_wanted) {
            continue;
        }
        let folder = scratch("python", &page);
        for block in &all {
            if block.language == "sh" && !block.comment.starts_with("not run") {
                let before = block
                    .comment
                    .strip_prefix("run before: ")
                    .unwrap_or_default();
                let script = format!("set -eu\n{before}\n{}", block.content);
                run("sh", &["-c"], &script, &folder, block);
            } else if is_wanted(block) {
                run(&python, &["-c"], &block.content, &folder, block);
            }
        }
    }
    assert!(n_blocks >= 6, "{n_blocks} blocks of Python");
}

#[test]
fn lines_that_differ_by_their_seconds_are_equal() {
    assert_eq!(
        steady("a chain, 0.1 s: R-hat 1.2"),
        steady("a chain,  12.5 s: R-hat 1.2")
    );
    assert_ne!(steady("radius 0.1 m"), steady("radius 0.2 m"));
}
