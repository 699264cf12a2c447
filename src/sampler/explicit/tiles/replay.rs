//! What the tiles of an epoch did, told as the steps of one chain.

use super::Cut;
use crate::model::prior::PriorTable;
use crate::partition::Change;
use crate::sampler::explicit::{MoveKind, Outcome, info};
use crate::sampler::{State, StepInfo};

/// What a tile did: its steps, the sets that they brought, and where it ends.
#[derive(Default)]
pub struct TileRun {
    infos: Vec<StepInfo>,
    /// Number of members and ln B of each set that came.
    sets: Vec<(u32, f64)>,
    /// Members of these sets, one set after the other, as the whole chain numbers them.
    members: Vec<u32>,
    /// The set of each free detection and its location at the end.
    set_of: Vec<u32>,
    x_m: Vec<[f64; 2]>,
}

impl TileRun {
    /// Notes a step of a tile, whose detections are these of the whole.
    pub(super) fn note(&mut self, info: &StepInfo, state: &State, free: &[u32]) {
        self.infos.push(*info);
        let n_sets = state.partition.n_sets();
        for set in n_sets - info.n_new_sets as usize..n_sets {
            let members = &state.partition.sets()[set];
            self.sets
                .push((members.len() as u32, state.ln_bound_of[set]));
            self.members
                .extend(members.iter().map(|&i| free[i as usize]));
        }
    }

    /// Notes where a tile ends.
    pub(super) fn end(&mut self, state: &State) {
        self.set_of.extend_from_slice(state.partition.set_of());
        self.x_m.extend_from_slice(state.placement().locations_m());
    }

    /// The set of each free detection at the end, in the numbers of the tile.
    pub(super) fn set_of(&self) -> &[u32] {
        &self.set_of
    }

    pub(super) fn locations_m(&self) -> &[[f64; 2]] {
        &self.x_m
    }
}

/// How far the telling of a tile's run has come.
#[derive(Clone, Copy, Default)]
struct Told {
    steps: usize,
    sets: usize,
    members: usize,
}

/// The steps of an epoch, in the order in which they were dealt.
pub struct Replay<'a> {
    table: &'a PriorTable,
    cut: &'a Cut,
    runs: &'a [TileRun],
    told: Vec<Told>,
    step: usize,
    change: Change,
}

impl<'a> Replay<'a> {
    pub(super) fn new(table: &'a PriorTable, cut: &'a Cut, runs: &'a [TileRun]) -> Self {
        Self {
            table,
            cut,
            runs,
            told: vec![Told::default(); runs.len()],
            step: 0,
            change: Change::default(),
        }
    }

    /// Makes the next step of the epoch in the state of the whole chain; `None` after the last.
    pub fn step(&mut self, state: &mut State) -> Option<StepInfo> {
        let tile = *self.cut.dealt.get(self.step)? as usize;
        self.step += 1;
        let (run, told) = (&self.runs[tile], &mut self.told[tile]);
        let Some(&info) = run.infos.get(told.steps) else {
            // Nothing is free there.
            return Some(info(MoveKind::Site, Outcome::Impossible, 0));
        };
        told.steps += 1;
        if info.n_new_sets > 0 {
            let sets = told.sets..told.sets + info.n_new_sets as usize;
            self.change.clear();
            let mut members = told.members;
            for &(n, _) in &run.sets[sets.clone()] {
                let set = &run.members[members..members + n as usize];
                self.change.add().extend_from_slice(set);
                for &i in set {
                    let own = state.partition.set_of()[i as usize];
                    if !self.change.removed().contains(&own) {
                        self.change.remove(own);
                    }
                }
                members += n as usize;
            }
            (told.members, told.sets) = (members, sets.end);
            apply(self.table, state, &self.change, &run.sets[sets]);
        }
        Some(info)
    }
}

/// Replaces sets of the whole chain by others with these bounds.
fn apply(table: &PriorTable, state: &mut State, change: &Change, bounds: &[(u32, f64)]) {
    let State {
        partition,
        ln_bound_of,
        ln_bound,
        ln_prior,
        ..
    } = state;
    let n_sets = partition.n_sets();
    for &set in change.removed() {
        *ln_bound -= ln_bound_of[set as usize];
        *ln_prior -= table.ln_size(partition.sets()[set as usize].len());
    }
    partition.apply(change, |_, to| {
        ln_bound_of.swap_remove(to);
    });
    for &(n, bound) in bounds {
        ln_bound_of.push(bound);
        *ln_bound += bound;
        *ln_prior += table.ln_size(n as usize);
    }
    *ln_prior += table.ln_n_sets(partition.n_sets()) - table.ln_n_sets(n_sets);
}
