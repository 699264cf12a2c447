//! What a sweep runs: its data sets, and one task for each chain.

use std::collections::HashMap;
use std::sync::Arc;

use rayon::prelude::*;

use super::outcome::ChainRecord;
use super::posteriors::{AskedPosterior, Posteriors};
use super::{Shard, isolated};
use crate::dataset::{DataError, DataSet};
use crate::rng::{Purpose, SAMPLER_SEMANTICS};
use crate::settings::{Init, Settings, Until};
use crate::sweep::{Cell, Sweep, decides_the_chain, decides_the_world, hex};

/// Who a chain is run for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Owner {
    /// A cell of the design, by its index.
    Cell(usize),
    /// A posterior that cells ask the reference sampler for, by its index.
    Posterior(usize),
}

/// One chain of one cell on one world, or one that samples a posterior for several cells.
#[derive(Clone)]
pub struct Task {
    /// Its place among all tasks.
    pub index: usize,
    /// Who it is run for.
    pub owner: Owner,
    /// The world, by its index among the plan's data sets.
    pub data: usize,
    /// The world, by its number among the replicates of the cell, from 0; of a posterior by that in the cell that asked
    /// first.
    pub replicate: u64,
    /// The chain, by its number on that world, from 0.
    pub chain: u64,
    /// What all its random numbers come from.
    pub purpose: Purpose,
    /// Its identity: 32 hexadecimal digits.
    pub key: String,
}

/// The data sets and tasks of a sweep.
#[derive(Clone)]
pub struct Plan {
    /// Every distinct data set, or why it cannot be had.
    pub data_sets: Vec<Result<Arc<DataSet>, String>>,
    /// All chains, by owner, world and chain: those of posteriors stand behind those of cells.
    pub tasks: Vec<Task>,
    /// Worlds of each cell, by the cell's index: as many for all, or what a stopping rule has come to.
    pub replicates: Vec<u64>,
    /// Data sets of the first round, which identify the run.
    n_first: usize,
    index_of: HashMap<(String, u64), usize>,
    posteriors: Posteriors,
    /// Whether a shard takes whole cells, because what a cell needs next depends on all its chains.
    pub(super) by_cell: bool,
}

/// What a chain's random numbers come from: the sampler's semantics, the seed, the settings of model
/// and sampler, what the sampler sees of the data, the start, and the chain's number. Its length is
/// left out, so that a longer chain begins like a shorter one.
pub fn chain_purpose(settings: &Settings, data: &DataSet, chain: u64) -> Purpose {
    let start = match settings.init().of_chain(chain) {
        init @ (Init::File(_) | Init::Truth) => match data.start(&init, chain) {
            Ok(crate::chain::Start::At(topology)) => format!("at {topology}"),
            _ => "no such start".to_owned(),
        },
        init => init.to_string(),
    };
    let named = settings.naming_sampler(data.detections.len());
    Purpose::new(SAMPLER_SEMANTICS, settings.count("seed"))
        .text("settings", &named.identity_text(decides_the_chain))
        .text("start", &start)
        .text("data", &data.sampled_hash(settings))
        .number("chain", chain)
}

/// Whether the chains of a cell run until they have converged.
fn is_led_on(cell: &Cell) -> bool {
    cell.settings.until() == Until::Converged
}

/// The error with the place in the sweep file that names what is wrong.
fn in_sweep(sweep: &Sweep, error: DataError) -> DataError {
    let place = match error {
        DataError::World(_) => sweep.place_of("world"),
        DataError::Detections(_) => sweep.place_of("detections"),
        _ => None,
    };
    match place {
        Some(place) => DataError::InSweep {
            place,
            source: Box::new(error),
        },
        None => error,
    }
}

impl Plan {
    /// Reads or simulates every data set of the sweep, in parallel, and lists its chains.
    ///
    /// # Errors
    /// The sweep's one CSV, or a world file, that cannot be used. A simulation that fails is
    /// recorded and fails its chains only.
    pub fn new(sweep: &Sweep) -> Result<Self, DataError> {
        let mut plan = Self {
            data_sets: Vec::new(),
            tasks: Vec::new(),
            replicates: vec![0; sweep.cells.len()],
            n_first: 0,
            index_of: HashMap::new(),
            posteriors: Posteriors::default(),
            by_cell: sweep.stopping().is_some() || sweep.cells.iter().any(is_led_on),
        };
        plan.grow(sweep, &vec![sweep.n_replicates(); sweep.cells.len()])?;
        plan.n_first = plan.data_sets.len();
        Ok(plan)
    }

    /// Gives each cell so many worlds, at least those that it has. Data sets that come to be stand after all others, so
    /// that none changes its number.
    pub(super) fn grow(&mut self, sweep: &Sweep, replicates: &[u64]) -> Result<(), DataError> {
        let mut wanted: Vec<(&Settings, u64)> = Vec::new();
        let mut added = Vec::new();
        for (cell, settings) in sweep.cells.iter().map(|cell| &cell.settings).enumerate() {
            let world = settings.canonical_text(decides_the_world);
            for replicate in self.replicates[cell]..replicates[cell] {
                let next = self.data_sets.len() + wanted.len();
                let entry = self.index_of.entry((world.clone(), replicate));
                let index = *entry.or_insert_with(|| {
                    wanted.push((settings, replicate));
                    next
                });
                added.push((cell, replicate, index));
            }
        }
        let loaded: Vec<Result<Result<DataSet, DataError>, String>> = wanted
            .par_iter()
            .map(|(settings, replicate)| isolated(|| DataSet::load(settings, *replicate)))
            .collect();
        for data in loaded {
            self.data_sets.push(match data {
                Ok(Ok(data)) => Ok(Arc::new(data)),
                Ok(Err(error @ DataError::Simulation(_))) => Err(error.to_string()),
                Ok(Err(error)) => return Err(in_sweep(sweep, error)),
                Err(panic) => Err(format!("panic: {panic}")),
            });
        }
        let n_asked = self.posteriors.all.len();
        for (cell, replicate, data) in added {
            let settings = &sweep.cells[cell].settings;
            for chain in 0..sweep.n_chains() {
                self.push(settings, Owner::Cell(cell), (data, replicate), chain);
            }
            if let Ok(detections) = &self.data_sets[data] {
                let world = (data, detections.as_ref());
                self.posteriors.ask(cell, settings, replicate, world);
            }
        }
        for index in n_asked..self.posteriors.all.len() {
            let asked = self.posteriors.all[index].clone();
            for chain in 0..asked.n_chains() {
                let world = (asked.data, asked.replicate);
                self.push(&asked.settings, Owner::Posterior(index), world, chain);
            }
        }
        self.tasks
            .sort_by_key(|task| (task.owner, task.replicate, task.chain));
        for (index, task) in self.tasks.iter_mut().enumerate() {
            task.index = index;
        }
        self.replicates = replicates.to_vec();
        Ok(())
    }

    /// The chains of a cell, by world and chain.
    pub fn tasks_of(&self, cell: usize) -> &[Task] {
        self.tasks_of_owner(Owner::Cell(cell))
    }

    /// The chains of an owner, by world and chain.
    pub fn tasks_of_owner(&self, owner: Owner) -> &[Task] {
        let first = self.tasks.partition_point(|task| task.owner < owner);
        let end = self.tasks.partition_point(|task| task.owner <= owner);
        &self.tasks[first..end]
    }

    /// The chains of all cells, with their cells.
    pub fn tasks_of_cells(&self) -> impl Iterator<Item = (usize, &Task)> {
        self.tasks.iter().filter_map(|task| match task.owner {
            Owner::Cell(cell) => Some((cell, task)),
            Owner::Posterior(_) => None,
        })
    }

    /// The posteriors that cells ask the reference sampler for.
    pub fn posteriors(&self) -> &[AskedPosterior] {
        &self.posteriors.all
    }

    /// The posterior of a cell on its world of this number, by its index; `None` if the cell does not ask for it.
    pub fn posterior_of(&self, cell: usize, replicate: u64) -> Option<usize> {
        self.posteriors.of(cell, replicate)
    }

    /// The settings that a chain runs with.
    pub fn settings<'a>(&'a self, sweep: &'a Sweep, task: &Task) -> &'a Settings {
        match task.owner {
            Owner::Cell(cell) => &sweep.cells[cell].settings,
            Owner::Posterior(index) => &self.posteriors.all[index].settings,
        }
    }

    /// The cells that need a chain: its own, or all that ask for its posterior.
    fn cells_of(&self, task: &Task) -> Vec<usize> {
        match task.owner {
            Owner::Cell(cell) => vec![cell],
            Owner::Posterior(index) => self.posteriors.all[index].cells.clone(),
        }
    }

    /// The record of every chain in order, where there is one. A record is large and a sweep has many: each is
    /// moved to the last chain that it is of, and copied only to those before it.
    pub fn in_order(&self, mut records: HashMap<String, ChainRecord>) -> Vec<Option<ChainRecord>> {
        let mut n_left: HashMap<&str, usize> = HashMap::new();
        for task in &self.tasks {
            *n_left.entry(&task.key).or_default() += 1;
        }
        let mut record_of = |task: &Task| {
            let n_left = n_left.get_mut(task.key.as_str())?;
            *n_left -= 1;
            if *n_left == 0 {
                records.remove(&task.key)
            } else {
                records.get(&task.key).cloned()
            }
        };
        self.tasks.iter().map(&mut record_of).collect()
    }

    /// What identifies a run: the sweep, and what its data hold wherever they came from. Worlds that a stopping rule adds
    /// are functions of the same settings, and do not count.
    pub fn key(&self, sweep: &Sweep) -> String {
        let mut purpose = Purpose::new(SAMPLER_SEMANTICS, sweep.seed()).text("sweep", &sweep.key());
        for data in &self.data_sets[..self.n_first] {
            // A simulation that fails is told from others by the settings in the sweep's key.
            let content = data
                .as_ref()
                .map_or_else(|_| String::new(), |d| d.content_hash());
            purpose = purpose.text("data", &content);
        }
        hex(&purpose.key()[..16])
    }

    /// A chain on a data set, which is the world of this number.
    fn push(
        &mut self,
        settings: &Settings,
        owner: Owner,
        (data, replicate): (usize, u64),
        chain: u64,
    ) {
        let (purpose, content) = match &self.data_sets[data] {
            Ok(data) => (chain_purpose(settings, data, chain), data.content_hash()),
            // A world that cannot be had has no content; its settings stand for it.
            Err(_) => {
                let world = settings.canonical_text(decides_the_world);
                let purpose = Purpose::new(SAMPLER_SEMANTICS, settings.count("seed"))
                    .text("settings", &settings.identity_text(decides_the_chain))
                    .number("replicate", replicate)
                    .number("chain", chain);
                (purpose, world)
            }
        };
        // What else the record of a chain depends on, besides its random numbers: until they have
        // converged, on the chains beside it.
        let beside = match settings.until() {
            Until::Samples => purpose.clone(),
            Until::Converged => purpose
                .clone()
                .text("beside", &settings.init().to_string())
                .number("chains", settings.count("chains"))
                .number("max_samples", settings.count("max_samples")),
        };
        let key = beside
            .text("content", &content)
            .text("init", &settings.init().of_chain(chain).to_string())
            .text("burn_in", settings.text("burn_in"))
            .number("samples", settings.count("samples"))
            .number("probes", settings.count("probes"))
            .number("max_topologies", settings.count("max_topologies"))
            .number("exact_up_to", settings.count("exact_up_to"));
        let key = match settings.count("coupling_lag") {
            0 => key,
            lag => key.number("coupling_lag", lag),
        };
        let key = key.key();
        let key = hex(&key[..16]);
        self.tasks.push(Task {
            index: self.tasks.len(),
            owner,
            data,
            replicate,
            chain,
            purpose,
            key,
        });
    }

    /// Chains, each once however many tasks ask for it, in order; those of one shard, if one is given. Where shards take
    /// whole cells, a chain that cells of two shards have is of both.
    pub fn chains(&self, shard: Option<Shard>) -> Vec<&Task> {
        let mut keys = std::collections::HashSet::new();
        if self.by_cell {
            let is_of = |shard: Shard, task: &Task| {
                let mut cells = self.cells_of(task).into_iter();
                cells.any(|cell| shard.holds(cell))
            };
            let own = |task: &&Task| shard.is_none_or(|shard| is_of(shard, task));
            let mut own: Vec<&Task> = self.tasks.iter().filter(own).collect();
            own.retain(|task| keys.insert(&task.key));
            return own;
        }
        let is_asked = |place| shard.is_none_or(|shard| shard.holds(place));
        let asked = self.placed().filter(|(place, _)| is_asked(*place));
        asked.map(|(_, task)| task).collect()
    }

    /// Chains, each once, with the places by which they are dealt to shards. The chains of a
    /// posterior are led on together and have one place.
    fn placed(&self) -> impl Iterator<Item = (usize, &Task)> {
        let mut keys = std::collections::HashSet::new();
        let (mut place, mut last) = (0, None);
        let distinct = self.tasks.iter();
        let distinct = distinct.filter(move |task| keys.insert(task.key.as_str()));
        distinct.map(move |task| {
            let is_led_on = matches!(task.owner, Owner::Posterior(_));
            if last.is_some_and(|last| !is_led_on || last != task.owner) {
                place += 1;
            }
            last = Some(task.owner);
            (place, task)
        })
    }

    /// Every distinct chain with the number of the shard, of `count`, that it belongs to; a chain of two shards is there
    /// twice.
    pub(super) fn chains_by_shard(&self, count: u64) -> Vec<(u64, &Task)> {
        if !self.by_cell {
            return self
                .placed()
                .map(|(place, task)| (place as u64 % count, task))
                .collect();
        }
        let mut seen = std::collections::HashSet::new();
        let shards_of = |task| {
            let cells = self.cells_of(task).into_iter();
            cells.map(move |cell| (cell as u64 % count, task))
        };
        let with_shard = self.tasks.iter().flat_map(shards_of);
        with_shard
            .filter(|(shard, task)| seen.insert((*shard, &task.key)))
            .collect()
    }

    /// The data set of a task, or why it cannot be had.
    pub fn data(&self, task: &Task) -> Result<&DataSet, &String> {
        self.data_sets[task.data].as_ref().map(Arc::as_ref)
    }
}
