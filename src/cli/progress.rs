//! How a run goes: a bar on a terminal, plain lines elsewhere.

use std::io::IsTerminal;
use std::path::Path;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use crate::input::ReadSoFar;
use crate::run::{ChainStatus, Progress, Round};
use indicatif::{HumanDuration, ProgressBar, ProgressDrawTarget, ProgressStyle};

/// Time between two plain lines.
const LINE_INTERVAL: Duration = Duration::from_secs(10);

/// Time between two lines about a file that is being read.
const READING_INTERVAL: Duration = Duration::from_secs(2);

/// Shows progress on standard error.
pub struct Bar {
    bar: ProgressBar,
    quiet: bool,
    plain: bool,
    n_failed: AtomicUsize,
    started: Instant,
    last_line: Mutex<Instant>,
}

impl Bar {
    /// Nothing at all if `quiet`.
    pub fn new(quiet: bool) -> Self {
        let bar = ProgressBar::with_draw_target(None, ProgressDrawTarget::hidden());
        let plain = !std::io::stderr().is_terminal();
        let now = Instant::now();
        Self {
            bar,
            quiet,
            plain,
            n_failed: AtomicUsize::new(0),
            started: now,
            last_line: Mutex::new(now),
        }
    }

    fn line(&self) {
        let (done, all) = (self.bar.position(), self.bar.length().unwrap_or(0));
        let elapsed = self.started.elapsed();
        let rate = done as f64 / elapsed.as_secs_f64();
        let left = Duration::from_secs_f64((all - done) as f64 / rate.max(1e-9));
        let failed = match self.n_failed.load(Ordering::Relaxed) {
            0 => String::new(),
            n => format!(", {n} failed"),
        };
        errln!(
            "{done} of {all} chains, {rate:.1} chains/s, {} left{failed}",
            HumanDuration(left)
        );
    }
}

/// What is being computed, on one line of a terminal that is overwritten; nothing elsewhere.
pub struct Stages(ProgressBar);

impl Stages {
    /// Nothing at all if `quiet`.
    pub fn new(quiet: bool) -> Self {
        let bar = ProgressBar::with_draw_target(None, ProgressDrawTarget::hidden());
        if !quiet && std::io::stderr().is_terminal() {
            if let Ok(style) = ProgressStyle::with_template("{spinner} {msg} ({elapsed})") {
                bar.set_style(style);
            }
            bar.set_draw_target(ProgressDrawTarget::stderr());
            bar.enable_steady_tick(Duration::from_millis(200));
        }
        Self(bar)
    }

    /// From now on this is computed.
    pub fn say(&self, what: impl Into<String>) {
        self.0.set_message(what.into());
    }
}

impl Drop for Stages {
    fn drop(&mut self) {
        self.0.finish_and_clear();
    }
}

/// What to call while a file is read: a line after each interval, so that only large files are
/// heard of.
pub fn reading(path: &Path, quiet: bool) -> impl FnMut(ReadSoFar) + use<> {
    let name = path.display().to_string();
    let mut last = Instant::now();
    let mebi = |bytes: u64| bytes as f64 / f64::from(1 << 20);
    move |so_far: ReadSoFar| {
        if quiet || last.elapsed() < READING_INTERVAL {
            return;
        }
        last = Instant::now();
        let all = so_far.of_bytes.map(|all| format!(" of {:.0}", mebi(all)));
        let all = all.unwrap_or_default();
        errln!("reading {name}: {:.0}{all} MiB", mebi(so_far.bytes));
    }
}

impl Progress for Bar {
    fn start(&self, n_chains: usize, n_steps: u64, n_already_done: usize) {
        self.bar.set_length(n_chains as u64);
        self.bar.reset();
        if self.quiet {
            return;
        }
        if n_already_done > 0 {
            errln!("{n_already_done} chains were finished earlier and are kept");
        }
        if self.plain {
            errln!("{n_chains} chains to run, {n_steps} proposals");
            return;
        }
        let template = "{bar:32} {pos}/{len} chains  {per_sec}  {eta} left  {msg}";
        if let Ok(style) = ProgressStyle::with_template(template) {
            self.bar.set_style(style);
        }
        self.bar.set_draw_target(ProgressDrawTarget::stderr());
    }

    fn exact_done(&self, n_tables: usize, seconds: f64) {
        if !self.quiet {
            errln!("{n_tables} exact posteriors to compare with: {seconds:.1} s");
        }
    }

    fn note(&self, what: &str) {
        if !self.quiet {
            self.bar.suspend(|| errln!("{what}"));
        }
    }

    fn chain_done(&self, _n_steps: u64, status: &ChainStatus) {
        self.bar.inc(1);
        if let ChainStatus::Failed { .. } = status {
            let n = self.n_failed.fetch_add(1, Ordering::Relaxed) + 1;
            self.bar.set_message(format!("{n} failed"));
        }
        if !self.plain || self.quiet {
            return;
        }
        // Whoever comes first after the interval prints; nobody waits for the others.
        if let Ok(mut last) = self.last_line.try_lock()
            && last.elapsed() > LINE_INTERVAL
        {
            *last = Instant::now();
            self.line();
        }
    }

    fn round(&self, round: Round) {
        if !self.quiet {
            let Round { n_cells, n_worlds } = round;
            let (cells, go) = if n_cells == 1 {
                ("cell", "goes")
            } else {
                ("cells", "go")
            };
            let words = format!("{n_cells} {cells} {go} on, up to {n_worlds} worlds");
            self.bar.suspend(|| errln!("{words}"));
        }
    }

    fn finish(&self) {
        self.bar.finish_and_clear();
    }
}
