//! One chain on many threads: the plane is cut into tiles whose sets move at the same time.
//!
//! For one *epoch*, [`PER_DETECTION`] proposals for each detection, the plane is cut at a random
//! place into square tiles. A set is *free* in a tile if all its locations lie inside the tile, at
//! least half the penalty's reach D from its edges. All other sets stand still. A tile runs a chain
//! of its own: its state is the free sets with their locations, the standing locations beside them
//! pay and are paid for, and a location within D/2 of the edge has weight 0. So
//!
//! - free sets of two tiles never pay for each other: the tiles are independent given what stands;
//! - a free set stays free: which sets are free is a function of what the epoch leaves alone, and
//!   the chain of a tile has π, given all else, as its law;
//! - the normal laws are not cut off: what falls outside is rejected by its weight.
//!
//! Each proposal of an epoch is dealt beforehand to the tile in which z of a uniform detection
//! lies, which no state decides. The chain that makes the proposals one after another in that
//! order is the same chain. [`Replay`] tells it step by step, so a trace is that of one chain and
//! does not depend on the number of threads. Every generator is named by the epoch and the tile.
//!
//! One epoch in 32 has one tile, the whole plane, so that a set wider than a tile is free at times
//! and far places can be reached. A prior that looks at M ties the tiles together and is refused by
//! the settings.
//!
//! Source: `docs/model.md`, "One chain on many threads".

mod grid;
mod replay;

pub use replay::{Replay, TileRun};

use super::Explicit;
use super::area::Area;
use super::laws::Laws;
use super::placement::Placement;
use crate::model::prior::PriorTable;
use crate::model::{Model, Prior};
use crate::partition::Partition;
use crate::rng::{Generator, Purpose};
use crate::sampler::choices::{Choices, Random};
use crate::sampler::{SamplerSettings, State};
use grid::Grid;

/// Proposals of an epoch for each detection. A tile is built anew for an epoch, which costs about
/// as much as two proposals for each detection.
pub const PER_DETECTION: u64 = 16;
/// Detections in a tile, about: with so many its state fits into the cache of a core.
const PER_TILE: f64 = 1024.0;
/// Tiles are at least so many reaches of the penalty wide: what stands still is at their edges.
const LEAST_REACHES: f64 = 16.0;
/// One epoch out of so many has one tile.
const WHOLE_EVERY: u64 = 32;
/// As many as this many epochs have one tile at the start of a chain with wide sets.
const WHOLE_AT_START: u64 = 8;
/// A start with a set of more members has wide sets.
const MOST_AT_START: usize = 128;
/// The margin for rounding of distances from edges.
const MARGIN: f64 = 1.0 + 1e-9;
/// The tile of what is free in none.
const NOWHERE: u32 = u32::MAX;

/// One tile of an epoch.
struct Tile {
    /// Where the locations of its free sets may be.
    area: Area,
    /// Detections in free sets, in rising order.
    free: Vec<u32>,
    /// The set of each.
    labels: Vec<u32>,
    /// Detections beside them that stand still.
    standing: Vec<u32>,
    n_proposals: u64,
    generator: Generator,
}

/// The tiles of an epoch, with the order of its proposals.
pub struct Cut {
    tiles: Vec<Tile>,
    /// The tile of each proposal.
    dealt: Vec<u32>,
    /// The tile in which each set is free.
    tile_of_set: Vec<u32>,
    /// Where each detection that is free in a tile stands among the free of it.
    place: Vec<u32>,
}

impl Cut {
    /// All tiles, by falling number of proposals.
    pub fn by_work(&self) -> Vec<usize> {
        let mut order: Vec<usize> = (0..self.tiles.len()).collect();
        order.sort_by_key(|&ix| std::cmp::Reverse(self.tiles[ix].n_proposals));
        order
    }
}

/// Who is in which set, and where.
pub struct Scene {
    partition: Partition,
    x_m: Vec<[f64; 2]>,
}

impl Scene {
    /// Of a partition, whatever the numbers of its sets, and its locations, m.
    pub fn new(partition: &Partition, x_m: &[[f64; 2]]) -> Self {
        Self {
            partition: Partition::from_labels(partition.set_of()),
            x_m: x_m.to_vec(),
        }
    }

    /// What an epoch leaves.
    #[must_use]
    pub fn after(&self, cut: &Cut, runs: &[TileRun]) -> Self {
        let mut labels = self.partition.set_of().to_vec();
        let mut x_m = self.x_m.clone();
        let mut n_labels = labels.len() as u32;
        for (tile, run) in cut.tiles.iter().zip(runs) {
            for ((&i, &set), &to_m) in tile.free.iter().zip(run.set_of()).zip(run.locations_m()) {
                labels[i as usize] = n_labels + set;
                x_m[i as usize] = to_m;
            }
            n_labels += tile.free.len() as u32;
        }
        Self {
            partition: Partition::from_labels(&labels),
            x_m,
        }
    }
}

/// The tiles of one data set.
pub struct Tiles<'a> {
    model: &'a Model,
    prior: Prior,
    table: PriorTable,
    settings: &'a SamplerSettings,
    laws: Laws<'a>,
    purpose: Purpose,
    low_m: [f64; 2],
    extent_m: [f64; 2],
    side_m: f64,
}

impl<'a> Tiles<'a> {
    /// Of a model and the settings of a chain; `purpose` is that of the chain.
    pub fn new(
        model: &'a Model,
        prior: Prior,
        settings: &'a SamplerSettings,
        purpose: &Purpose,
    ) -> Self {
        let laws = Laws::new(model, prior);
        let (mut low_m, mut high_m) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for z in model.positions_m() {
            for axis in [0, 1] {
                low_m[axis] = low_m[axis].min(z[axis]);
                high_m[axis] = high_m[axis].max(z[axis]);
            }
        }
        let extent_m = [high_m[0] - low_m[0], high_m[1] - low_m[1]];
        let n = model.n_detections();
        let even = (extent_m[0] * extent_m[1] * PER_TILE / n as f64).sqrt();
        let least = LEAST_REACHES * laws.reach_m();
        Self {
            model,
            prior,
            table: prior.table(n),
            settings,
            purpose: purpose.clone().text("use", "tiles"),
            low_m,
            extent_m,
            // A row of detections without width has tiles of a length.
            side_m: even
                .max(least)
                .max(extent_m[0].max(extent_m[1]) * PER_TILE / n as f64 / 64.0),
            laws,
        }
    }

    /// The same with tiles of this side, m.
    #[cfg(test)]
    pub(crate) fn with_side(mut self, side_m: f64) -> Self {
        self.side_m = side_m;
        self
    }

    /// Proposals of an epoch.
    pub fn epoch_length(&self) -> u64 {
        PER_DETECTION * self.model.n_detections() as u64
    }

    /// How many epochs have one tile at the start of a chain from here.
    pub fn n_whole(&self, start: &Partition) -> u64 {
        let largest = start.sets().iter().map(Vec::len).max();
        if largest > Some(MOST_AT_START) {
            WHOLE_AT_START
        } else {
            0
        }
    }

    /// Cuts the plane for an epoch, of which the first `n_proposals` are made. `n_whole` as at the
    /// start of the chain.
    pub fn cut(&self, scene: &Scene, (epoch, n_whole): (u64, u64), n_proposals: u64) -> Cut {
        let Scene { partition, x_m } = scene;
        let purpose = self.purpose.clone().number("epoch", epoch);
        let mut rng = purpose.generator();
        let is_whole = epoch < n_whole || epoch.is_multiple_of(WHOLE_EVERY);
        let grid = if is_whole {
            Grid::WHOLE
        } else {
            let shift = [0, 1].map(|_| rng.uniform() * self.side_m);
            Grid::new(self.low_m, self.extent_m, self.side_m, shift)
        };
        let half_m = 0.5 * self.laws.reach_m() * MARGIN;
        let mut tiles: Vec<Tile> = (0..grid.n_tiles())
            .map(|ix| Tile {
                area: grid.area(ix).inset(half_m),
                free: Vec::new(),
                labels: Vec::new(),
                standing: Vec::new(),
                n_proposals: 0,
                generator: purpose.clone().number("tile", ix as u64).generator(),
            })
            .collect();
        let n = self.model.n_detections();
        let mut place = vec![NOWHERE; n];
        let tile_of_set: Vec<u32> = partition
            .sets()
            .iter()
            .map(|members| {
                let tile = grid.tile(x_m[members[0] as usize]);
                let area = tiles[tile].area;
                let is_free = members.iter().all(|&i| area.holds(x_m[i as usize]));
                if is_free { tile as u32 } else { NOWHERE }
            })
            .collect();
        for (i, &set) in (0..).zip(partition.set_of()) {
            let tile = tile_of_set[set as usize];
            if tile != NOWHERE {
                let tile = &mut tiles[tile as usize];
                place[i as usize] = tile.free.len() as u32;
                tile.free.push(i);
                tile.labels.push(set);
                continue;
            }
            grid.tiles_near(x_m[i as usize], half_m, |tile| tiles[tile].standing.push(i));
        }
        let of_z: Vec<u32> = self
            .model
            .positions_m()
            .iter()
            .map(|&z| grid.tile(z) as u32)
            .collect();
        let dealt: Vec<u32> = (0..n_proposals).map(|_| of_z[rng.below(n)]).collect();
        for &tile in &dealt {
            tiles[tile as usize].n_proposals += 1;
        }
        Cut {
            tiles,
            dealt,
            place,
            tile_of_set,
        }
    }

    /// Runs the proposals of one tile.
    pub fn run(&self, cut: &Cut, tile_ix: usize, scene: &Scene) -> TileRun {
        let tile = &cut.tiles[tile_ix];
        let n_free = tile.free.len();
        let mut run = TileRun::default();
        if n_free == 0 {
            return run;
        }
        let at = |detections: &[u32]| -> Vec<[f64; 2]> {
            detections.iter().map(|&i| scene.x_m[i as usize]).collect()
        };
        let model = self
            .model
            .part(&[tile.free.as_slice(), &tile.standing].concat());
        let set_of = scene.partition.set_of();
        let neighbours = self.laws.neighbours.part(&tile.free, |j| {
            let free_in = cut.tile_of_set[set_of[j as usize] as usize];
            (free_in == tile_ix as u32).then(|| cut.place[j as usize])
        });
        let laws = self
            .laws
            .of_tile(&model, self.prior, neighbours, (n_free, tile.area));
        let partition = Partition::from_labels(&tile.labels);
        let (placement, ln_bound_of) =
            Placement::at(&laws, &partition, at(&tile.free), &at(&tile.standing));
        let mut state = State {
            ln_prior: 0.0,
            ln_bound: 0.0,
            ln_bound_of,
            blocks: Vec::new(),
            ln_mean: 0.0,
            draws: None,
            placement: Some(Box::new(placement)),
            partition,
        };
        let mut explicit = Explicit::of(laws, self.settings.candidates);
        let mut rng = tile.generator.clone();
        for _ in 0..tile.n_proposals {
            let info = explicit.step(&self.settings.moves, &mut state, &mut rng);
            run.note(&info, &state, &tile.free);
        }
        run.end(&state);
        run
    }

    /// The steps of an epoch, from what its tiles did.
    pub fn replay<'b>(&'b self, cut: &'b Cut, runs: &'b [TileRun]) -> Replay<'b> {
        Replay::new(&self.table, cut, runs)
    }

    /// What an epoch leaves of the whole chain: locations, and running sums from scratch.
    pub fn settle(&self, cut: &Cut, runs: &[TileRun], state: &mut State, x_m: &mut [[f64; 2]]) {
        for (tile, run) in cut.tiles.iter().zip(runs) {
            for (&i, &to_m) in tile.free.iter().zip(run.locations_m()) {
                x_m[i as usize] = to_m;
            }
        }
        state.ln_bound = state.ln_bound_of.iter().sum();
        let sizes = state.partition.sets().iter().map(Vec::len);
        state.ln_prior = self.table.ln_prior(sizes);
    }
}
