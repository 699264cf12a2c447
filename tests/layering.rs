//! The floor plan, kept true: which room may name which, and who alone may name what.
//!
//! Read from the source text; test modules are exempt, as a test may look anywhere.
#![allow(
    clippy::unwrap_used,
    reason = "a test that cannot go on should say where"
)]

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

/// Rooms in the order in which data flow, each with the earlier rooms that it names. A room that
/// names a later one, or one that its line does not list, breaks the build: change the plan on
/// purpose, here and in ARCHITECTURE.md, or not at all.
const PLAN: &[(&str, &[&str])] = &[
    ("rng", &[]),
    ("files", &[]),
    ("excerpt", &[]),
    ("partition", &["rng"]),
    ("input", &["excerpt"]),
    ("detections", &["input"]),
    ("baseline", &["detections", "partition"]),
    ("model", &["detections"]),
    ("sampler", &["model", "partition", "rng"]),
    ("chain", &["model", "partition", "rng", "sampler"]),
    ("labels", &["chain", "input", "partition"]),
    ("sighting", &["detections"]),
    ("tracker", &["detections", "sighting"]),
    ("import", &["input", "sighting"]),
    (
        "world",
        &[
            "detections",
            "excerpt",
            "files",
            "rng",
            "sighting",
            "tracker",
        ],
    ),
    ("settings", &["excerpt", "model", "sampler", "world"]),
    ("sweep", &["excerpt", "files", "rng", "settings"]),
    ("diagnostics", &["chain", "detections", "partition"]),
    ("exact", &["diagnostics", "model", "partition", "rng"]),
    (
        "evidence",
        &[
            "detections",
            "diagnostics",
            "partition",
            "rng",
            "sighting",
            "tracker",
        ],
    ),
    (
        "tune",
        &[
            "chain",
            "detections",
            "diagnostics",
            "evidence",
            "model",
            "partition",
            "rng",
            "sampler",
        ],
    ),
    (
        "dataset",
        &[
            "chain",
            "detections",
            "diagnostics",
            "input",
            "files",
            "model",
            "partition",
            "settings",
            "sighting",
            "sweep",
            "world",
        ],
    ),
    (
        "run",
        &[
            "chain",
            "dataset",
            "detections",
            "diagnostics",
            "exact",
            "excerpt",
            "files",
            "model",
            "partition",
            "rng",
            "sampler",
            "settings",
            "sweep",
        ],
    ),
    (
        "results",
        &[
            "baseline",
            "chain",
            "dataset",
            "diagnostics",
            "exact",
            "labels",
            "model",
            "partition",
            "rng",
            "run",
            "settings",
            "sweep",
        ],
    ),
    ("map", &["model", "partition"]),
    ("mission", &["import", "partition", "rng", "sighting"]),
    (
        "table",
        &[
            "chain",
            "diagnostics",
            "files",
            "input",
            "labels",
            "partition",
            "results",
            "run",
            "sampler",
            "settings",
            "sweep",
        ],
    ),
    ("figure", &[]),
    (
        "report",
        &[
            "dataset",
            "detections",
            "diagnostics",
            "figure",
            "files",
            "map",
            "mission",
            "partition",
            "results",
            "run",
            "settings",
            "sighting",
            "sweep",
        ],
    ),
    (
        "job",
        &[
            "dataset", "files", "input", "labels", "model", "report", "results", "run", "settings",
            "sweep", "table", "tune",
        ],
    ),
];

/// Crates and powers that only some rooms may name.
const RESERVED: &[(&[&str], &[&str])] = &[
    (&["polars", "polars_io"], &["table"]),
    (
        &[
            "plotters",
            "plotters_backend",
            "tiny_skia",
            "ab_glyph",
            "dejavu",
            "png",
        ],
        &["figure"],
    ),
    (&["maud"], &["report"]),
    (&["kodama"], &["baseline"]),
    (&["quick_xml"], &["map"]),
    (
        &[
            "clap",
            "clap_complete",
            "clap_mangen",
            "indicatif",
            "signal_hook",
            "std::env",
            "std::process",
        ],
        &["cli", "main", "job"],
    ),
    (&["print!", "println!", "eprint!", "eprintln!", "dbg!"], &[]),
    (
        &["rayon", "std::thread"],
        &[
            "chain", "exact", "run", "results", "report", "evidence", "tune", "cli", "mission",
            "table", "job",
        ],
    ),
    (
        &["std::fs", "std::io", "tempfile"],
        &[
            "files",
            "input",
            "detections",
            "import",
            "world",
            "sweep",
            "dataset",
            "run",
            "table",
            "report",
            "job",
            "cli",
        ],
    ),
    (&["std::time"], &["run", "job", "cli"]),
    (&["toml"], &["world", "sweep", "import"]),
    (&["rand_pcg"], &["rng"]),
    (&["crc32fast"], &["run"]),
    (
        &["nalgebra"],
        &[
            "evidence", "exact", "import", "mission", "model", "sighting", "tracker",
        ],
    ),
];

struct Source {
    path: PathBuf,
    room: String,
    /// Without comments and test modules.
    code: String,
    text: String,
}

fn sources() -> Vec<Source> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut open = vec![root.clone()];
    let mut found = Vec::new();
    while let Some(here) = open.pop() {
        for entry in fs::read_dir(here).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                open.push(path);
                continue;
            }
            if path.extension().is_none_or(|extension| extension != "rs") {
                continue;
            }
            let text = fs::read_to_string(&path).unwrap();
            let inside = path.strip_prefix(&root).unwrap().to_owned();
            let room = inside.iter().next().unwrap().to_str().unwrap();
            let is_test = inside
                .iter()
                .any(|part| part == "tests.rs" || part == "tests");
            let code = if is_test {
                String::new()
            } else {
                code_of(&text)
            };
            found.push(Source {
                room: room.trim_end_matches(".rs").to_owned(),
                path: inside,
                code,
                text,
            });
        }
    }
    found.sort_by(|a, b| a.path.cmp(&b.path));
    found
}

/// Test modules stand at the end of their file; the text before is the program.
fn code_of(text: &str) -> String {
    let program = text.split("#[cfg(test)]").next().unwrap_or_default();
    let lines = program
        .lines()
        .map(|line| line.split("//").next().unwrap_or_default());
    lines.collect::<Vec<_>>().join("\n")
}

/// The names that follow `prefix`, groups in braces included.
fn named_after(code: &str, prefix: &str) -> BTreeSet<String> {
    let mut names = BTreeSet::new();
    for (place, _) in code.match_indices(prefix) {
        let rest = &code[place + prefix.len()..];
        let before = code[..place].chars().next_back();
        if before.is_some_and(|c| c.is_alphanumeric() || c == '_') {
            continue;
        }
        let name = |text: &str| -> String {
            let word = text.trim_start();
            word.chars()
                .take_while(|c| c.is_alphanumeric() || *c == '_')
                .collect()
        };
        match rest
            .strip_prefix('{')
            .and_then(|group| group.split_once("};"))
        {
            // Only the first name of each part of a group is a room.
            Some((group, _)) => names.extend(group.split(',').map(name)),
            None => {
                names.insert(name(rest));
            }
        }
    }
    names.remove("");
    names
}

/// Whether the code names a crate, a path of std or a macro.
fn names(code: &str, what: &str) -> bool {
    let suffix = if what.ends_with('!') { "" } else { "::" };
    let is_word = |c: char| c.is_alphanumeric() || c == '_' || c == ':';
    let standing_alone = |text: &str, needle: &str| {
        text.match_indices(needle)
            .any(|(place, _)| !text[..place].chars().next_back().is_some_and(is_word))
    };
    if let Some(module) = what.strip_prefix("std::") {
        let grouped = named_after(code, "std::").contains(module);
        return grouped || standing_alone(code, what);
    }
    standing_alone(code, &format!("{what}{suffix}")) || code.contains(&format!("use {what};"))
}

#[test]
fn data_flow_one_way() {
    let order: Vec<&str> = PLAN.iter().map(|(room, _)| *room).collect();
    for (place, (room, allowed)) in PLAN.iter().enumerate() {
        for other in *allowed {
            assert!(
                order[..place].contains(other),
                "the plan lets {room} look ahead to {other}"
            );
        }
    }
}

#[test]
fn rooms_name_only_the_rooms_of_the_plan() {
    for source in sources() {
        let room = source.room.as_str();
        let own = ["lib", "main", "cli"];
        let named = named_after(&source.code, "crate::");
        if own.contains(&room) {
            let by_name = named_after(&source.code, "topometric::");
            let is_shell = by_name.iter().all(|name| name == "cli");
            assert!(room != "main" || is_shell, "main.rs goes by way of cli");
            continue;
        }
        let Some((_, allowed)) = PLAN.iter().find(|(name, _)| *name == room) else {
            panic!("{}: a room that is not in the plan", source.path.display());
        };
        for other in named.iter().filter(|other| *other != room) {
            let path = source.path.display();
            assert!(
                allowed.contains(&other.as_str()),
                "{path}: {room} names {other}"
            );
        }
    }
}

#[test]
fn the_plan_allows_nothing_that_nobody_needs() {
    let sources = sources();
    for (room, allowed) in PLAN {
        for other in *allowed {
            let mut of_room = sources.iter().filter(|source| source.room == *room);
            let used = of_room.any(|source| named_after(&source.code, "crate::").contains(*other));
            assert!(used, "{room} no longer names {other}: take it off the plan");
        }
    }
}

#[test]
fn crates_and_powers_stay_where_they_belong() {
    for source in sources() {
        for (what, rooms) in RESERVED {
            for one in *what {
                let may = rooms.contains(&source.room.as_str());
                let path = source.path.display();
                assert!(
                    may || !names(&source.code, one),
                    "{path}: names {one}, only {rooms:?} may"
                );
            }
        }
    }
}

/// A report says what was found; it takes types from the diagnostics and calls nothing there.
#[test]
fn a_report_computes_no_statistics() {
    for source in sources().iter().filter(|source| source.room == "report") {
        for (place, _) in source.code.match_indices("diagnostics::") {
            let path: String = source.code[place..]
                .chars()
                .take_while(|c| c.is_alphanumeric() || "_:{, ".contains(*c))
                .collect();
            let last = path
                .trim_end_matches([' ', ','])
                .rsplit("::")
                .next()
                .unwrap();
            let is_type = last.trim_start_matches('{').starts_with(char::is_uppercase);
            assert!(is_type, "{}: {path}", source.path.display());
        }
    }
}

/// The loop over steps is the chain's: a kernel is `init` and `step`.
#[test]
fn the_sampler_makes_no_loop_over_steps() {
    for source in sources().iter().filter(|source| source.room == "sampler") {
        for line in source
            .code
            .lines()
            .map(str::trim)
            .filter(|line| line.starts_with("for "))
        {
            assert!(!line.contains("step"), "{}: {line}", source.path.display());
        }
    }
}

#[test]
fn every_file_opens_with_what_it_is_for() {
    for source in sources() {
        // Test modules are described where they are declared.
        if source.path.ends_with("tests.rs") {
            continue;
        }
        assert!(source.text.starts_with("//!"), "{}", source.path.display());
    }
}
