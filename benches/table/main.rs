//! The table of `docs/benchmarks.md`: what a proposal costs and what it buys, measured in one run.
//!
//! `cargo bench --bench table` prints it; `cargo bench --bench table -- FOLDER` writes `benchmarks.md` and
//! `benchmarks.png` into a folder; `-- --converged` prints the section about verdicts alone. Everything that is compared is timed in turns, and medians are shown.
#![allow(missing_docs, clippy::print_stdout, reason = "a program of its own")]

mod converged;
mod cost;
mod mixing;
mod parallel;
mod peak;
mod worlds;

use std::fmt::Write as _;
use std::path::Path;
use std::process::Command;

use cost::Cost;
use topometric::figure::scaling::{Scaling, ScalingLine};

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    if let [flag, n] = &arguments[..]
        && flag == "--memory-of"
    {
        let mb = cost::run_for_memory(n);
        println!("{}", mb.map_or_else(String::new, |mb| mb.to_string()));
        return;
    }
    if arguments.first().is_some_and(|flag| flag == "--converged") {
        println!("{}", converged::section());
        return;
    }
    let folder = arguments
        .iter()
        .find(|argument| !argument.starts_with("--"));
    let costs = cost::by_size();
    let text = page(&costs);
    match folder {
        None => println!("{text}"),
        Some(folder) => {
            let folder = Path::new(folder);
            std::fs::create_dir_all(folder).expect("a folder that can be made");
            std::fs::write(folder.join("benchmarks.md"), text).expect("a folder to write to");
            std::fs::write(folder.join("benchmarks.png"), figure(&costs)).expect("the same");
        }
    }
}

fn figure(costs: &[Cost]) -> Vec<u8> {
    let mut lines: Vec<ScalingLine> = Vec::new();
    for cost in costs {
        let point = (cost.n_detections as f64, cost.ns);
        match lines.iter_mut().find(|line| line.name == cost.name) {
            Some(line) => line.points.push(point),
            None => lines.push(ScalingLine {
                name: cost.name.clone(),
                points: vec![point],
            }),
        }
    }
    Scaling {
        title: "Time of one proposal from the truth, R = 8, two detections of each landmark"
            .to_owned(),
        x_name: "number of detections N".to_owned(),
        y_name: "time of one proposal (ns)".to_owned(),
        lines,
    }
    .page(1600, 900)
    .png()
}

fn page(costs: &[Cost]) -> String {
    let mut text = format!(
        "# Benchmarks\n\nWritten by `just bench-table`. {} Medians of parts that were timed in turns; \
         ratios within this page are what counts.\n\n\
         Worlds: landmarks on a jittered square grid 10 m apart, detection noise 0.3 m, σo = σt = 1 m, radius 3 m, height \
         50, quadratic penalty, uniform prior.\n\n![Time of one proposal over the number of detections](benchmarks.png)\n\n",
        machine()
    );
    text.push_str(&converged::section());
    by_size(&mut text, costs);
    offices(&mut text);
    at_sixteen(&mut text);
    let (kernel, operation) = (cost::pair_kernel_ns(), peak::operation_ns());
    let bound = cost::PAIR_OPERATIONS * operation;
    let _ = write!(
        text,
        "## The pair kernel\n\nPenalty of 120 pairs at 64 draws: **{kernel:.3} ns** for each pair and draw. It takes {} \
         operations. A core does one in {operation:.4} ns at best, in vectors that wait for nothing: a bound of {bound:.3} ns. \
         The kernel reaches **{:.0} %** of that speed, with its loads and stores.\n\n",
        cost::PAIR_OPERATIONS,
        100.0 * bound / kernel
    );
    let (n, of_sweep, of_loop, ratio) = parallel::efficiency();
    let _ = write!(
        text,
        "## All cores\n\nSpeed-up on {n} threads over {n}: a sweep {:.1} %, a loop of nothing but arithmetic {:.1} %, in interleaved \
         pairs: **{:.1} %** of what the loop reaches. `ptm sample` of one proposal takes {:.0} ms in all.\n\n",
        100.0 * of_sweep,
        100.0 * of_loop,
        100.0 * ratio,
        parallel::startup_ms()
    );
    mixing_table(&mut text);
    text
}

fn by_size(text: &mut String, costs: &[Cost]) {
    let find = |name: &str, n: usize| {
        costs
            .iter()
            .find(|cost| cost.name == name && cost.n_detections == n)
    };
    let names = [
        "common, metric",
        "common, covariance",
        "fresh, metric",
        "fresh, covariance",
    ];
    let _ = write!(
        text,
        "## By the number of detections\n\nTwo detections of each landmark, R = 8, default mix, from the truth; ns for a proposal (for one \
         whose draws are evaluated). Memory: peak of a process with one chain of a million proposals and its full trace.\n\n\
         | N | {} | memory |\n|---|---|---|---|---|---|\n",
        names.join(" | ")
    );
    for n in cost::SIZES {
        let cells = names.map(|name| {
            find(name, n).map_or_else(
                || "–".to_owned(),
                |cost| format!("{:.0} ({:.0})", cost.ns, cost.ns_of_evaluated()),
            )
        });
        let memory = cost::peak_memory_mb(&n.to_string());
        let memory = memory.map_or_else(|| "–".to_owned(), |mb| format!("{mb:.0} MB"));
        let _ = writeln!(text, "| {n} | {} | {memory} |", cells.join(" | "));
    }
    for name in &names[..2] {
        if let (Some(small), Some(large)) = (find(name, 64), find(name, 16_384)) {
            let _ = write!(
                text,
                "\n{name}: 16,384 detections cost **{:.2}** times what 64 do over all proposals, {:.2} times over those that are \
                 evaluated.\n",
                large.ns / small.ns,
                large.ns_of_evaluated() / small.ns_of_evaluated()
            );
        }
    }
    text.push('\n');
}

fn offices(text: &mut String) {
    text.push_str(
        "## Offices\n\nCorners of rooms along corridors, one and a quarter laps at a fifth of the usual noise, R = 8, default mix, metric \
         model, from the truth. Corners lie closer together than on the grid, and drift moves the second visit: a detection has many \
         more neighbours.\n\n| office | N | ns for a proposal (evaluated) | memory |\n|---|---|---|---|\n",
    );
    for (cost, n_rows) in cost::offices().iter().zip(cost::OFFICES) {
        let memory = cost::peak_memory_mb(&format!("office:{n_rows}"));
        let memory = memory.map_or_else(|| "–".to_owned(), |mb| format!("{mb:.0} MB"));
        let _ = writeln!(
            text,
            "| {} | {} | {:.0} ({:.0}) | {memory} |",
            cost.name,
            cost.n_detections,
            cost.ns,
            cost.ns_of_evaluated()
        );
    }
    text.push('\n');
}

fn at_sixteen(text: &mut String) {
    text.push_str(
        "## Sixteen detections, R = 30\n\nThousands of proposals per second on one core, from the truth.\n\n\
         | sampler | early rejection | thousand/s | evaluated |\n|---|---|---|---|\n",
    );
    for (cost, early) in cost::at_sixteen() {
        let early = if early { "on" } else { "off" };
        let rate = 1e6 / cost.ns;
        let share = 100.0 * cost.evaluated;
        let _ = writeln!(
            text,
            "| {} | {early} | {rate:.0} | {share:.0} % |",
            cost.name
        );
    }
    text.push('\n');
}

fn mixing_table(text: &mut String) {
    let _ = write!(
        text,
        "## Mixes of moves\n\n8 landmarks × 8 detections, R = 30, {} seeds with a world each. Truth: seeds that sampled it within {} \
         proposals, and the median of when. ESS per second on one core over the second half of 60,000 proposals: median (quartiles) \
         over seeds. A mix that is stuck has little to be effective about, so read both columns.\n\n\
         | start | moves | truth | first | ESS/s of M | ESS/s of ln target |\n|---|---|---|---|---|---|\n",
        mixing::N_SEEDS,
        mixing::SOON,
    );
    for row in mixing::compare() {
        let of = |[low, middle, high]: [f64; 3]| format!("{middle:.0} ({low:.0}–{high:.0})");
        let first = row
            .first
            .map_or_else(|| "never".to_owned(), |first| format!("{first:.0}"));
        let _ = writeln!(
            text,
            "| {} | {} | {} of {} | {first} | {} | {} |",
            row.start,
            row.mix,
            row.n_soon,
            mixing::N_SEEDS,
            of(row.n_sets_per_s),
            of(row.ln_target_per_s)
        );
    }
}

/// What it was measured on.
fn machine() -> String {
    let info = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let model = info
        .lines()
        .find_map(|line| line.strip_prefix("model name"))
        .and_then(|line| line.split(':').nth(1))
        .map_or("unknown processor", str::trim);
    let n = std::thread::available_parallelism().map_or(1, usize::from);
    let commit = Command::new("git")
        .args(["rev-parse", "--short", "HEAD"])
        .output();
    let commit = commit
        .ok()
        .and_then(|output| String::from_utf8(output.stdout).ok())
        .unwrap_or_default();
    format!(
        "{model}, {n} cores, {} kernels, commit {}.",
        topometric::model::penalty::cpu_path(),
        commit.trim()
    )
}
