//! Placing detections into a few blocks one after the other, with the probability of doing so.
//!
//! What the anchors move, sequential allocation and restricted Gibbs scans have in common: a detection
//! joins block b with probability (1−δ)·softmax(s)_b + δ/B, where s is the model's surrogate score of
//! joining those that are placed already. The same object replays a given allocation, which gives the
//! probability of the way back.

use super::choices::Choices;
use crate::model::{Block, Surrogate};

/// Most blocks of an allocation.
pub const MAX_BLOCKS: usize = 3;

const NOT_PLACED: u8 = u8::MAX;
/// Taken out for a while.
const LIFTED: u8 = u8::MAX - 1;

/// Blocks, and who is in which.
#[derive(Clone, Debug)]
pub struct Allocation {
    block_of: Vec<u8>,
    placed: Vec<u32>,
    blocks: [Block; MAX_BLOCKS],
    n_blocks: usize,
    /// δ.
    floor: f64,
    ln_probability: f64,
}

impl Allocation {
    /// Of some of N detections, with the floor δ in [0, 1).
    pub fn new(n_detections: usize, floor: f64) -> Self {
        Self {
            block_of: vec![NOT_PLACED; n_detections],
            placed: Vec::new(),
            blocks: [Block::default(); MAX_BLOCKS],
            n_blocks: 0,
            floor,
            ln_probability: 0.0,
        }
    }

    /// Forgets everything.
    pub fn clear(&mut self) {
        for i in self.placed.drain(..) {
            self.block_of[i as usize] = NOT_PLACED;
        }
        self.n_blocks = 0;
        self.ln_probability = 0.0;
    }

    /// Number of blocks B.
    pub fn n_blocks(&self) -> usize {
        self.n_blocks
    }

    /// ln of the probability of all choices counted so far.
    pub fn ln_probability(&self) -> f64 {
        self.ln_probability
    }

    /// Counts a choice that was made elsewhere, or whose probability is known.
    pub fn count_choice(&mut self, probability: f64) {
        self.ln_probability += libm::log(probability);
    }

    /// Starts counting anew.
    pub fn forget_choices(&mut self) {
        self.ln_probability = 0.0;
    }

    /// The block of a detection that is placed.
    pub fn block_of(&self, i: u32) -> usize {
        usize::from(self.block_of[i as usize])
    }

    /// Opens a block with detection i.
    pub fn open(&mut self, surrogate: &Surrogate, i: u32) {
        self.blocks[self.n_blocks] = Block::default();
        self.n_blocks += 1;
        self.join(surrogate, i, self.n_blocks - 1);
    }

    /// Puts detection i into a block, at no probability.
    pub fn join(&mut self, surrogate: &Surrogate, i: u32, block: usize) {
        if self.block_of[i as usize] == NOT_PLACED {
            self.placed.push(i);
        }
        self.block_of[i as usize] = block as u8;
        self.blocks[block] = surrogate.with(&self.blocks[block], i);
    }

    /// Takes detection i out of its block for a while.
    pub fn lift(&mut self, surrogate: &Surrogate, i: u32) {
        let block = self.block_of(i);
        self.blocks[block] = surrogate.without(&self.blocks[block], i);
        // It stays in `placed`, so that it is cleared.
        self.block_of[i as usize] = LIFTED;
    }

    /// Draws a block for detection i, and puts it there.
    pub fn draw(&mut self, surrogate: &Surrogate, i: u32, choices: &mut impl Choices) {
        if self.n_blocks == 1 {
            self.mark(i);
            return;
        }
        let probabilities = self.probabilities(surrogate, i);
        let block = choices.index(&probabilities[..self.n_blocks]);
        self.ln_probability += libm::log(probabilities[block]);
        self.join(surrogate, i, block);
    }

    /// Puts detection i into a given block, and counts how probable that was.
    pub fn replay(&mut self, surrogate: &Surrogate, i: u32, block: usize) {
        if self.n_blocks == 1 {
            self.mark(i);
            return;
        }
        let probabilities = self.probabilities(surrogate, i);
        self.ln_probability += libm::log(probabilities[block]);
        self.join(surrogate, i, block);
    }

    /// Into the only block: no choice, so its statistics are never asked for.
    fn mark(&mut self, i: u32) {
        self.placed.push(i);
        self.block_of[i as usize] = 0;
    }

    /// (1−δ)·softmax(s) + δ/B.
    fn probabilities(&self, surrogate: &Surrogate, i: u32) -> [f64; MAX_BLOCKS] {
        let mut scores = [0.0_f64; MAX_BLOCKS];
        let (neighbours, costs) = surrogate.neighbours().of_detection(i);
        for (&j, &cost) in neighbours.iter().zip(costs) {
            let block = self.block_of[j as usize];
            if usize::from(block) < self.n_blocks {
                let score = &mut scores[usize::from(block)];
                *score = score.max(cost);
            }
        }
        let scores = &mut scores[..self.n_blocks];
        for (score, block) in scores.iter_mut().zip(&self.blocks) {
            *score += surrogate.ln_gain(block, i);
        }
        let largest = scores.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let mut probabilities = [0.0; MAX_BLOCKS];
        let mut total = 0.0;
        for (probability, score) in probabilities.iter_mut().zip(scores.iter()) {
            *probability = libm::exp(score - largest);
            total += *probability;
        }
        let even = self.floor / self.n_blocks as f64;
        for probability in &mut probabilities[..self.n_blocks] {
            *probability = (1.0 - self.floor) * (*probability / total) + even;
        }
        probabilities
    }
}
