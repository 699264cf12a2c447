//! `docs/commands.md` is what the program says of itself: the help of every command, and the exit codes.
//! `PTM_WRITE=1 cargo test --test commands` (`just docs-commands`) writes the page anew.

use std::path::Path;
use std::process::Command;

const PAGE: &str = "docs/commands.md";

fn help(arguments: &[&str]) -> String {
    let output = Command::new(env!("CARGO_BIN_EXE_ptm"))
        .args(arguments)
        .arg("--help")
        // The width of help depends on the terminal; without one it is always the same.
        .env_remove("COLUMNS")
        .output()
        .expect("ptm starts");
    assert!(output.status.success(), "{arguments:?}");
    String::from_utf8(output.stdout).expect("UTF-8")
}

/// Name and summary of each command, from the list that `ptm --help` prints.
fn commands(main: &str) -> Vec<(String, String)> {
    let mut found: Vec<(String, String)> = Vec::new();
    let list = main.lines().skip_while(|line| *line != "Commands:").skip(1);
    for line in list.take_while(|line| !line.is_empty()) {
        match line.strip_prefix("   ") {
            // A summary that goes on in the next line.
            Some(more) => {
                let last = found.last_mut().expect("a command before");
                last.1.push_str(&format!(" {}", more.trim()));
            }
            None => {
                let (name, summary) = line.trim().split_once(' ').expect("a summary");
                found.push((name.to_owned(), summary.trim().to_owned()));
            }
        }
    }
    found.retain(|(name, _)| name != "help");
    assert!(found.len() >= 16, "{found:?}");
    found
}

/// Codes and their meanings, from the end of `ptm --help`.
fn exit_codes(main: &str) -> Vec<(String, String)> {
    let (_, words) = main.split_once("Exit codes: ").expect("exit codes");
    let words = words.split_whitespace().collect::<Vec<_>>().join(" ");
    let mut found = Vec::new();
    for part in words.trim_end_matches('.').split("; ") {
        let digits = |word: &&str| word.bytes().all(|b| b.is_ascii_digit()) || *word == "or";
        let code: Vec<&str> = part.split(' ').take_while(digits).collect();
        let meaning: Vec<&str> = part.split(' ').skip(code.len()).collect();
        assert!(!code.is_empty() && !meaning.is_empty(), "{part}");
        found.push((code.join(" "), meaning.join(" ")));
    }
    found
}

/// The page.
fn page() -> String {
    let main = help(&[]);
    let commands = commands(&main);
    let mut text = "\
# Commands and exit codes

This page is written by `just docs-commands` from the help of the program. `ptm COMMAND --help` prints the
same.

| command | what it does |
|---|---|
"
    .to_owned();
    for (name, summary) in &commands {
        text.push_str(&format!("| [`ptm {name}`](#ptm-{name}) | {summary} |\n"));
    }
    text.push_str("\n## Exit codes\n\n| code | meaning |\n|---|---|\n");
    for (code, meaning) in exit_codes(&main) {
        text.push_str(&format!("| {code} | {meaning} |\n"));
    }
    text.push_str(
        "\nAn error is one line on standard error. It says what is wrong, where, and what to do.\n",
    );
    for (name, _) in &commands {
        let words = help(&[name]);
        let words: Vec<&str> = words.trim_end().lines().map(str::trim_end).collect();
        text.push_str(&format!(
            "\n## `ptm {name}`\n\n```text\n{}\n```\n",
            words.join("\n")
        ));
    }
    text
}

#[test]
fn the_page_of_commands_is_the_help_of_the_program() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(PAGE);
    let page = page();
    if std::env::var_os("PTM_WRITE").is_some() {
        std::fs::write(&path, &page).expect("written");
    }
    let written = std::fs::read_to_string(&path).expect("a page");
    assert!(
        written == page,
        "{PAGE} is old: `just docs-commands` writes it anew"
    );
}

/// Every exit code that the program documents is in the list, and no other.
#[test]
fn the_exit_codes_are_all_there() {
    let codes: Vec<String> = exit_codes(&help(&[]))
        .into_iter()
        .map(|(code, _)| code)
        .collect();
    assert_eq!(codes, ["0", "1", "2", "3", "65", "70", "75", "130 or 143"]);
}
