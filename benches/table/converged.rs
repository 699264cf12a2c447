//! Seconds from dispersed starts to "converged": `ptm sample --until converged` by itself, one run
//! after the other.

use std::fmt::Write as _;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use crate::worlds::{self, World};

/// A chain that has not converged by then is stopped.
const MOST_SECONDS: u64 = 60;
/// The same of the report's estimator and the moves that the literature has for it.
const MOST_SECONDS_OF_FRESH: u64 = 20;

/// The default sampler, and `fresh` with each reference move.
const SAMPLERS: [(&str, &[&str]); 4] = [
    ("default", &[]),
    ("fresh, split-merge", &["fresh", "split-merge"]),
    (
        "fresh, sequential allocation",
        &["fresh", "sequential-allocation"],
    ),
    ("fresh, restricted Gibbs", &["fresh", "restricted-gibbs"]),
];

/// What came of a run.
struct Found {
    seconds: f64,
    n_proposals: f64,
    /// Of M, ln target and the pair of detections with the fewest, by second of both cores.
    ess_per_s: [Option<f64>; 3],
}

/// The section of the page.
pub fn section() -> String {
    let mut text = format!(
        "## Seconds to a verdict\n\nFour chains start apart on two cores and run until they are judged \
         converged (`ptm sample FILE --penalty-radius 3 --penalty-height 50 --until converged`). The columns are wall-clock \
         seconds, proposals of a chain, and effective draws a second of all chains together: of M, of ln target and of the \
         worst pair of detections that the verdict looks at. A run that has not converged in {MOST_SECONDS} s ({MOST_SECONDS_OF_FRESH} s with `fresh`) is stopped. Grids have \
         ten detections of each landmark. Overlapping landmarks: 50 with eight detections each, noise of 0.8 m, at least 4 m apart. \
         In the covariance model each detection has a covariance near 0.3 m², and σt is 4.\n\n\
         | world | N | model | sampler | seconds | proposals | M | ln target | pair |\n|---|---|---|---|---|---|---|---|---|\n",
    );
    let worlds = [
        ("grid", worlds::grid(16, 10, 1)),
        ("grid", worlds::grid(100, 10, 1)),
        ("grid", worlds::grid(1024, 10, 1)),
        ("office 6 × 6", worlds::office(6)),
        ("overlapping", worlds::overlapping(50, 8, 1)),
    ];
    for (name, world) in &worlds {
        let n = world.positions_m.len();
        for model in ["metric", "covariance"] {
            for (sampler, flags) in SAMPLERS {
                // The report's estimator costs N² a proposal, and is far from converging at 160.
                if !flags.is_empty() && (n > 200 || model == "covariance") {
                    continue;
                }
                let most = if flags.is_empty() {
                    MOST_SECONDS
                } else {
                    MOST_SECONDS_OF_FRESH
                };
                let row = run(world, model, flags, most);
                let _ = writeln!(
                    text,
                    "| {name} | {n} | {model} | {sampler} | {} |",
                    words(&row, most)
                );
            }
        }
    }
    text.push('\n');
    text
}

fn words(found: &Option<Found>, most: u64) -> String {
    let Some(found) = found else {
        return format!("not in {most} | – | – | – | –");
    };
    let ess = |per_s: Option<f64>| per_s.map_or_else(|| "–".to_owned(), |ess| format!("{ess:.0}"));
    let [m, ln_target, pair] = found.ess_per_s.map(ess);
    format!(
        "{:.1} | {:.0} | {m} | {ln_target} | {pair}",
        found.seconds, found.n_proposals
    )
}

/// `None` if it did not converge in time.
fn run(world: &World, model: &str, sampler: &[&str], most: u64) -> Option<Found> {
    let folder = tempfile::tempdir().expect("a temporary folder");
    write(world, &folder.path().join("world.csv"));
    let mut command = Command::new(env!("CARGO_BIN_EXE_ptm"));
    command.args(["sample", "world.csv", "--json", "found.json", "--quiet"]);
    command.args([
        "--penalty-radius",
        "3",
        "--penalty-height",
        "50",
        "--model",
        model,
    ]);
    command.args([
        "--until",
        "converged",
        "--max-samples",
        "1e9",
        "--figure",
        "figure.png",
    ]);
    if model == "covariance" {
        command.args(["--sigma-t", "4"]);
    }
    if let [estimator, moves] = sampler {
        command.args(["--estimator", estimator, "--moves", moves]);
    }
    command
        .current_dir(folder.path())
        .stdout(Stdio::null())
        .stderr(Stdio::null());
    let (before, mut child) = (Instant::now(), command.spawn().expect("the program"));
    while child.try_wait().expect("a child").is_none() {
        if before.elapsed() > Duration::from_secs(most) {
            child.kill().expect("a child that runs");
            child.wait().expect("a child");
            return None;
        }
        std::thread::sleep(Duration::from_millis(20));
    }
    let text = std::fs::read_to_string(folder.path().join("found.json")).ok()?;
    let json: serde_json::Value = serde_json::from_str(&text).expect("a result");
    let found = &json["convergence"];
    let seconds = json["seconds"].as_f64().expect("seconds");
    let value = |ess: &serde_json::Value| Some(ess["value"].as_f64()? / seconds);
    let pairs = found["judged"].as_array().expect("what was judged").iter();
    let pairs = pairs.filter(|own| {
        own["quantity"]
            .as_str()
            .is_some_and(|of| of.contains("pair"))
    });
    Some(Found {
        seconds,
        n_proposals: json["chains"][0]["n_steps"].as_f64().expect("proposals"),
        ess_per_s: [
            value(&found["n_sets"]["ess_bulk"]),
            value(&found["ln_target"]["ess_bulk"]),
            pairs.filter_map(|own| value(&own["ess"])).reduce(f64::min),
        ],
    })
}

fn write(world: &World, to: &Path) {
    let mut text = "x,y,cov_xx,cov_xy,cov_yy,landmark\n".to_owned();
    for (i, ([x, y], landmark)) in world.positions_m.iter().zip(&world.landmarks).enumerate() {
        let c = worlds::covariance_of(i);
        let _ = writeln!(text, "{x},{y},{},{},{},{landmark}", c.xx, c.xy, c.yy);
    }
    std::fs::write(to, text).expect("a folder to write to");
}
