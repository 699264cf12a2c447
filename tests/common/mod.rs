//! What the black-box tests share: a folder to work in, `ptm` in it, and files read back.
#![allow(dead_code, reason = "every test binary uses a part of this")]
#![allow(
    clippy::unwrap_used,
    reason = "a test that cannot go on should say where"
)]

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use serde_json::Value;
use tempfile::TempDir;

/// A folder for one test, with `ptm` run inside it, so that messages hold relative paths only.
pub struct Bench {
    folder: TempDir,
}

/// What a run of `ptm` gave.
pub struct Ran {
    pub code: i32,
    pub stdout: String,
    pub stderr: String,
}

impl Bench {
    pub fn new() -> Self {
        Self {
            folder: tempfile::tempdir().unwrap(),
        }
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    pub fn exists(&self, name: &str) -> bool {
        self.path(name).exists()
    }

    pub fn write(&self, name: &str, content: impl AsRef<[u8]>) {
        let path = self.path(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, content).unwrap();
    }

    pub fn read(&self, name: &str) -> String {
        let path = self.path(name);
        fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
    }

    /// A command that is not started yet, for those that want to stop it half-way.
    pub fn command(&self, arguments: &[&str]) -> Command {
        let mut command = Command::new(assert_cmd::cargo::cargo_bin!("ptm"));
        command
            .args(arguments)
            .current_dir(self.folder.path())
            .env_remove("RUST_BACKTRACE");
        command
    }

    pub fn run(&self, arguments: &[&str]) -> Ran {
        ran(&self.command(arguments).output().unwrap())
    }

    /// As `run`, for what must succeed; gives standard output.
    pub fn ok(&self, arguments: &[&str]) -> String {
        let ran = self.run(arguments);
        assert_eq!(ran.code, 0, "{arguments:?}: {}", ran.stderr);
        ran.stdout
    }

    /// `ptm sample … --json -`, parsed.
    pub fn sample(&self, arguments: &[&str]) -> Value {
        let all: Vec<&str> = [&["sample"], arguments, &["--json", "-"]].concat();
        serde_json::from_str(&self.ok(&all)).unwrap()
    }

    /// All files in the bench, for tests of what is left behind.
    pub fn files(&self) -> Vec<String> {
        files(self.folder.path()).into_keys().collect()
    }
}

pub fn ran(output: &Output) -> Ran {
    let text = |bytes: &[u8]| String::from_utf8(bytes.to_vec()).unwrap();
    Ran {
        code: output.status.code().unwrap_or(-1),
        stdout: text(&output.stdout),
        stderr: text(&output.stderr),
    }
}

/// Every file below a folder by its relative path.
pub fn files(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut found = BTreeMap::new();
    let mut open = vec![folder.to_owned()];
    while let Some(here) = open.pop() {
        for entry in fs::read_dir(&here).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                open.push(path);
            } else {
                let name = path.strip_prefix(folder).unwrap().display().to_string();
                found.insert(name, fs::read(&path).unwrap());
            }
        }
    }
    found
}

/// The rows of a CSV by column.
pub fn rows(text: &str) -> Vec<BTreeMap<String, String>> {
    let mut reader = csv::Reader::from_reader(text.as_bytes());
    reader.deserialize().map(Result::unwrap).collect()
}

/// A file beside the repository that a fresh clone does not have; `None`, said aloud, if it is
/// missing.
#[allow(clippy::print_stderr, reason = "a skipped test must say so")]
pub fn shared(name: &str) -> Option<PathBuf> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let path = root.join("../shared").join(name);
    if !path.is_file() {
        eprintln!("SKIPPED: {} is not there", path.display());
        return None;
    }
    Some(path)
}

/// Detections on a grid of pairs, 20 m apart: easy to sample.
pub fn pairs_csv(n: usize) -> String {
    let mut text = "x,y,landmark\n".to_owned();
    for i in 0..n {
        let (column, row) = ((i / 2) % 20, i / 40);
        let aside = if i % 2 == 0 { 0.0 } else { 0.25 };
        let (x, y) = (20.0 * column as f64 + aside, 20.0 * row as f64);
        text.push_str(&format!("{x},{y},{}\n", i / 2));
    }
    text
}

/// A sweep of four cells, two worlds, two chains: seconds at most.
pub const SMALL_SWEEP: &str = "\
title = \"Small\"
[data]
noise = 0.8
replicates = 2
[sampler]
importance_samples = 5
[run]
samples = 300
chains = 2
seed = 5
[design]
kind = \"grid\"
[design.factors]
penalty_radius = [1, 10]
init = [\"singletons\", \"one-cluster\"]
";
