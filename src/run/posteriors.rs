//! The posteriors that cells ask the reference sampler for, each once.
//!
//! A posterior is a function of model and data. Cells that differ only in settings of the sampler
//! (R, moves, start) share it, and with it the chains that sample it: ordinary tasks of the plan,
//! journalled, resumed and sharded as all others.

use std::collections::HashMap;

use super::exact_purpose;
use crate::dataset::DataSet;
use crate::rng::Purpose;
use crate::settings::Settings;

/// A posterior that cells ask for.
#[derive(Clone)]
pub struct AskedPosterior {
    /// Model and data as the cells have them, with the reference sampler.
    pub settings: Settings,
    /// The world, by its index among the plan's data sets.
    pub data: usize,
    /// The world's number in the cell that asked first, from 0.
    pub replicate: u64,
    /// What it is: model, data and seed.
    pub purpose: Purpose,
    /// The cells that ask, in order.
    pub cells: Vec<usize>,
}

impl AskedPosterior {
    /// Whether the reference sampler has this model. Without it only the exact posterior can
    /// answer.
    pub fn is_sampled(&self) -> bool {
        self.settings.check_together().is_ok()
    }

    /// Chains that sample it.
    pub(super) fn n_chains(&self) -> u64 {
        if self.is_sampled() {
            self.settings.count("chains")
        } else {
            0
        }
    }
}

/// All posteriors that are asked for, in the order in which they came to be.
#[derive(Clone, Default)]
pub(super) struct Posteriors {
    pub all: Vec<AskedPosterior>,
    by_content: HashMap<[u8; 32], usize>,
    by_world: HashMap<(usize, u64), usize>,
}

impl Posteriors {
    /// Asks for the posterior of a cell on its world number `replicate`, if the cell's settings do.
    pub fn ask(
        &mut self,
        cell: usize,
        settings: &Settings,
        replicate: u64,
        world: (usize, &DataSet),
    ) {
        let Some(settings) = settings.reference() else {
            return;
        };
        let (data, detections) = world;
        // A world without noise is the same in all its replicates.
        let purpose = exact_purpose(&settings, detections);
        let purpose = purpose.text("content", &detections.content_hash());
        let next = self.all.len();
        let index = *self.by_content.entry(purpose.key()).or_insert(next);
        if index == next {
            self.all.push(AskedPosterior {
                settings,
                data,
                replicate,
                purpose,
                cells: Vec::new(),
            });
        }
        let cells = &mut self.all[index].cells;
        if let Err(place) = cells.binary_search(&cell) {
            cells.insert(place, cell);
        }
        self.by_world.insert((cell, replicate), index);
    }

    /// The posterior of a cell on a world, by its index.
    pub fn of(&self, cell: usize, replicate: u64) -> Option<usize> {
        self.by_world.get(&(cell, replicate)).copied()
    }
}
