//! Draws in long form: one row for each draw of each chain.

use super::{Table, Values};
use crate::results::draws::Draws;

/// The draws of a cell on one world.
pub struct CellDraws<'a> {
    /// The cell.
    pub cell: &'a str,
    /// The world, from 1.
    pub world: u64,
    /// Numbers of its chains, from 1.
    pub chains: Vec<u64>,
    /// Their draws.
    pub draws: &'a Draws,
}

/// Of any number of cells and worlds.
pub fn draws_table(parts: &[CellDraws<'_>]) -> Table {
    let mut texts: [Vec<Option<String>>; 2] = Default::default();
    let mut counts: [Vec<Option<u64>>; 5] = Default::default();
    let mut ln_targets = Vec::new();
    for part in parts {
        for (chain, drawn) in part.chains.iter().zip(&part.draws.chains) {
            for draw in 0..drawn.n_sets.len() {
                let identity = &part.draws.topologies[drawn.topology[draw] as usize];
                texts[0].push(Some(part.cell.to_owned()));
                texts[1].push(Some(identity.clone()));
                let proposal = part.draws.first_step + (draw as u64 + 1) * part.draws.every;
                let row = [
                    part.world,
                    *chain,
                    draw as u64 + 1,
                    proposal,
                    u64::from(drawn.n_sets[draw]),
                ];
                for (column, value) in counts.iter_mut().zip(row) {
                    column.push(Some(value));
                }
                ln_targets.push(Some(drawn.ln_target[draw]));
            }
        }
    }
    let [cells, topologies] = texts;
    let mut table = Table::default();
    table.push("cell", Values::Texts(cells));
    for (name, column) in ["world", "chain", "draw", "proposal", "n_sets"]
        .into_iter()
        .zip(counts)
    {
        table.push(name, Values::Counts(column));
    }
    table.push("ln_target", Values::Numbers(ln_targets));
    table.push("topology", Values::Texts(topologies));
    table
}
