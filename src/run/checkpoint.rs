//! Checkpoints: where a long chain stands, on disk every few seconds, so that a kill costs seconds.
//!
//! A file is a line that says what it is of, the position and the trace so far as postcard, and the CRC-32 of
//! all before it; it replaces the one before whole. A chain is a function of its key, so whatever
//! checkpoint of it there is, of this machine or of one that was thought dead, leads to the same record.
//! One that cannot be read costs no more than the chain's beginning again, and that is said.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use serde::{Deserialize, Serialize};

use super::Journal;
use crate::chain::{Position, SavedPosition, TraceRecorder};
use crate::files::{TEMPORARY, read_at_most, write_whole};

/// Raised when a release changes what a checkpoint holds.
const FORMAT: &str = "ptm checkpoint 4";
/// Of a checkpoint: several times what the largest trace with its windows takes.
const MOST_BYTES: u64 = 1 << 30;
/// Time between two checkpoints, over the time that one takes, at least: they cost a twentieth at most.
const LEAST_PART: u32 = 19;

#[derive(Serialize)]
struct Content<'a> {
    seconds: f64,
    position: &'a Position<'a>,
    recorder: &'a TraceRecorder,
}

/// What a checkpoint held.
#[derive(Deserialize)]
pub struct Saved {
    /// Seconds of sampling until there.
    pub seconds: f64,
    /// Where the chain stands.
    pub position: SavedPosition,
    /// What it was seen to do.
    pub recorder: TraceRecorder,
}

/// The checkpoints of one chain.
pub struct Checkpoints {
    path: PathBuf,
    head: String,
    interval: Duration,
    last: Instant,
    took: Duration,
}

impl Checkpoints {
    /// In `folder`, of the chain with this key.
    pub fn new(folder: &Path, key: &str, interval: Duration) -> Self {
        let build = option_env!("PTM_COMMIT").unwrap_or("");
        Self {
            path: folder.join(key),
            head: format!("{FORMAT} {} {build} {key}\n", env!("CARGO_PKG_VERSION")),
            interval,
            last: Instant::now(),
            took: Duration::ZERO,
        }
    }

    /// The checkpoint that is there.
    ///
    /// # Errors
    /// What is there and cannot be used, in a line.
    pub fn load(&self) -> Result<Option<Saved>, String> {
        let bytes = match read_at_most(&self.path, MOST_BYTES) {
            Ok(bytes) => bytes,
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(None),
            Err(error) => return Err(self.unusable(&error.to_string())),
        };
        self.parse(&bytes)
            .map(Some)
            .map_err(|what| self.unusable(what))
    }

    fn parse(&self, bytes: &[u8]) -> Result<Saved, &'static str> {
        let damaged = "it is damaged";
        let (content, crc) = bytes.split_last_chunk::<4>().ok_or(damaged)?;
        if crc32fast::hash(content).to_le_bytes() != *crc {
            return Err(damaged);
        }
        let content = content
            .strip_prefix(self.head.as_bytes())
            .ok_or("it is of another version")?;
        postcard::from_bytes(content).map_err(|_| "it is of another version")
    }

    fn unusable(&self, what: &str) -> String {
        let path = self.path.display();
        format!("{path}: a checkpoint that cannot be used ({what}); its chain begins again")
    }

    /// Whether it is time for the next.
    pub fn is_due(&self) -> bool {
        self.last.elapsed() >= self.interval.max(self.took * LEAST_PART)
    }

    /// Puts one on disk. One that cannot be written is none: the journal will say why.
    pub fn save(&mut self, position: &Position<'_>, recorder: &TraceRecorder, seconds: f64) {
        let started = Instant::now();
        let content = Content {
            seconds,
            position,
            recorder,
        };
        let head = self.head.clone().into_bytes();
        if let Ok(mut bytes) = postcard::to_extend(&content, head) {
            bytes.extend(crc32fast::hash(&bytes).to_le_bytes());
            let written = || {
                self.path
                    .parent()
                    .map(std::fs::create_dir_all)
                    .transpose()?;
                write_whole(&self.path, &bytes)
            };
            // A full disk, or a folder that went away.
            let _: std::io::Result<()> = written();
        }
        self.last = Instant::now();
        self.took = started.elapsed();
    }

    /// The chain is done.
    pub fn remove(&self) {
        let _ = std::fs::remove_file(&self.path);
    }
}

/// Removes the checkpoints of chains that are over, by their keys, and the folder when it is empty.
/// What cannot be removed costs no more than its place.
pub(super) fn tidy(folder: &Path, is_over: impl Fn(&str) -> bool) {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    for entry in entries {
        let name = entry.file_name();
        let key = name.to_string_lossy();
        if !key.starts_with(TEMPORARY) && is_over(&key) {
            let _ = std::fs::remove_file(entry.path());
        }
    }
    let _ = std::fs::remove_dir(folder);
}

/// Removes from a folder the checkpoints of chains whose record a journal holds: a kill between the
/// two leaves them.
pub fn tidy_checkpoints(folder: &Path, journal: &Journal) {
    let is_over = |key: &str| journal.get(key).is_some_and(|record| !record.may_go_on());
    tidy(folder, is_over);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::chain::{self, Observer, Run, Start, Trace};
    use crate::model::{CovarianceModel, MetricModel, Model, Penalty, PenaltyShape, Prior};
    use crate::rng::Purpose;
    use crate::sampler::mix::{DEFAULT_EXPLICIT_MOVES, DEFAULT_MOVES};
    use crate::sampler::{
        Arithmetic, Estimator, SamplerSettings, SplitRule, State, StepInfo, Tempering,
    };

    /// Records, and saves and stops at one step.
    struct StopAt {
        recorder: TraceRecorder,
        checkpoints: Checkpoints,
        at: u64,
        step: u64,
    }

    impl Observer for StopAt {
        fn start(&mut self, state: &State) {
            self.recorder.start(state);
        }
        fn step(&mut self, step: u64, state: &State, info: &StepInfo) {
            self.recorder.step(step, state, info);
            self.step = step + 1;
        }
        fn tempered(&mut self, report: &crate::chain::TemperingReport) {
            self.recorder.tempered(report);
        }
        fn pause(&mut self, position: &Position<'_>) {
            if self.step >= self.at {
                self.checkpoints.save(position, &self.recorder, 1.5);
            }
        }
        fn wants_stop(&mut self) -> bool {
            self.step >= self.at
        }
    }

    const N_STEPS: u64 = 150_000;

    fn settings(estimator: Estimator, tempering: Option<Tempering>) -> SamplerSettings {
        let moves = match estimator {
            Estimator::Common => DEFAULT_MOVES,
            Estimator::Fresh => "split-merge=0.6,refresh=0.2,anchors=0.2",
            Estimator::Explicit => DEFAULT_EXPLICIT_MOVES,
        };
        SamplerSettings {
            moves: moves.parse().expect("a good mix"),
            estimator,
            // It looks at the stored order of a set.
            split: SplitRule::PrefixCut,
            arithmetic: Arithmetic::Log,
            importance_samples: 3,
            candidates: 3,
            early_rejection: true,
            tempering,
            tiles: false,
        }
    }

    fn models() -> [Model; 2] {
        let positions_m: Vec<[f64; 2]> = (0..9_i32)
            .map(|i| {
                [
                    f64::from(i % 3) + 0.01 * f64::from(i),
                    0.7 * f64::from(i / 3),
                ]
            })
            .collect();
        let penalty = Penalty {
            shape: PenaltyShape::Quadratic,
            radius_m: 1.5,
            height: 4.0,
        };
        let covariance = crate::detections::Covariance {
            xx: 1.0,
            xy: 0.3,
            yy: 0.5,
        };
        let covariances = vec![covariance; positions_m.len()];
        let other = CovarianceModel::new(&positions_m, &covariances, 0.9, 0.8, penalty);
        [
            MetricModel::new(&positions_m, 0.5, 0.6, penalty).into(),
            other.expect("positive definite").into(),
        ]
    }

    fn same(a: &Trace, b: &Trace) -> bool {
        let bits = |run: &Run| {
            (
                run.first_step,
                run.topology,
                run.n_sets,
                run.ln_target.to_bits(),
            )
        };
        let runs = |trace: &Trace| trace.runs.iter().map(bits).collect::<Vec<_>>();
        let (sums_a, sums_b) = (a.sums(N_STEPS / 2), b.sums(N_STEPS / 2));
        let of = |sums: &chain::ChainSums| {
            let [m, l] = [sums.n_sets, sums.ln_target];
            let bits = [m.mean, m.sum_of_squares, l.mean, l.sum_of_squares].map(f64::to_bits);
            (bits, sums.pairs.clone(), sums.pair_error_bound)
        };
        runs(a) == runs(b)
            && (a.stride, a.n_steps, a.moves) == (b.stride, b.n_steps, b.moves)
            && (a.n_evaluated, &a.tempering) == (b.n_evaluated, &b.tempering)
            && a.topologies.error_bound() == b.topologies.error_bound()
            && of(&sums_a) == of(&sums_b)
    }

    /// Whatever a chain is, and wherever it is stopped, it goes on as if it had not been.
    #[test]
    fn a_chain_that_is_stopped_again_and_again_is_the_same_bit_for_bit() {
        let folder = tempfile::tempdir().expect("a folder");
        let tempering = Tempering {
            n_temperatures: 3,
            swap_interval: 5,
        };
        let [metric, covariance] = models();
        let cases = [
            (&metric, Estimator::Common, None),
            (&metric, Estimator::Fresh, None),
            (&covariance, Estimator::Common, None),
            (&metric, Estimator::Common, Some(tempering)),
            (&metric, Estimator::Explicit, None),
            (&covariance, Estimator::Explicit, None),
        ];
        for (number, (model, estimator, tempering)) in cases.into_iter().enumerate() {
            let settings = settings(estimator, tempering);
            let purpose = Purpose::new("checkpoint test", number as u64);
            // A table that overflows, so that windows are among what is saved.
            let recorder = || TraceRecorder::new(60);
            let mut whole = recorder();
            let (prior, start) = (Prior::Uniform, Start::OneCluster);
            chain::run(
                model, prior, &settings, &start, N_STEPS, &purpose, &mut whole,
            );
            let whole = whole.finish();
            assert!(
                whole.topologies.error_bound() > 0,
                "case {number}: it overflows"
            );
            // In the rounds of tuning and at their ends (1,171, 2,343, … 37,500), around the rebuilding of sums
            // at 65,535, and late.
            let stops = [
                1,
                1171,
                1184,
                9375,
                18_752,
                37_504,
                65_536,
                65_552,
                140_001,
                u64::MAX,
            ];
            let mut done = 0;
            for at in stops {
                let checkpoints =
                    Checkpoints::new(folder.path(), &format!("k{number}"), Duration::ZERO);
                let saved = checkpoints.load().expect("our own checkpoint");
                let mut observer = StopAt {
                    recorder: recorder(),
                    checkpoints,
                    at,
                    step: done,
                };
                match saved {
                    None => {
                        assert_eq!(done, 0);
                        done = chain::run(
                            model,
                            prior,
                            &settings,
                            &start,
                            N_STEPS,
                            &purpose,
                            &mut observer,
                        )
                        .step();
                    }
                    Some(saved) => {
                        assert_eq!((saved.position.step(), saved.seconds), (done, 1.5));
                        observer.recorder = saved.recorder;
                        let position = saved.position;
                        done = chain::resume(
                            model,
                            prior,
                            &settings,
                            position,
                            N_STEPS,
                            &purpose,
                            &mut observer,
                        )
                        .step();
                    }
                }
                if at == u64::MAX {
                    assert_eq!(done, N_STEPS);
                    assert!(same(&observer.recorder.finish(), &whole), "case {number}");
                } else {
                    assert!((at..at + 16).contains(&done), "case {number}: {at}, {done}");
                }
            }
        }
    }

    #[test]
    fn a_damaged_checkpoint_is_none_and_says_so() {
        let folder = tempfile::tempdir().expect("a folder");
        let of = |key: &str| Checkpoints::new(folder.path(), key, Duration::ZERO);
        assert!(matches!(of("k").load(), Ok(None)));
        let [model, _] = models();
        let settings = settings(Estimator::Common, None);
        let mut observer = StopAt {
            recorder: TraceRecorder::new(60),
            checkpoints: of("k"),
            at: 100,
            step: 0,
        };
        let purpose = Purpose::new("checkpoint test", 9);
        let (prior, start) = (Prior::Uniform, Start::Singletons);
        chain::run(
            &model,
            prior,
            &settings,
            &start,
            200,
            &purpose,
            &mut observer,
        );
        assert!(matches!(of("k").load(), Ok(Some(_))));
        let bytes = std::fs::read(folder.path().join("k")).expect("the file");
        // Another chain's is no good either.
        std::fs::write(folder.path().join("other"), &bytes).expect("written");
        let refused = |key: &str| of(key).load().err().expect("refused");
        assert!(refused("other").ends_with("(it is of another version); its chain begins again"));
        for place in (0..bytes.len()).step_by(97) {
            let mut wrong = bytes.clone();
            wrong[place] ^= 16;
            std::fs::write(folder.path().join("k"), &wrong).expect("written");
            assert!(refused("k").ends_with("(it is damaged); its chain begins again"));
            std::fs::write(folder.path().join("k"), &bytes[..place]).expect("written");
            assert!(refused("k").ends_with("(it is damaged); its chain begins again"));
        }
    }
}
