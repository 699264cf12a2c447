//! Random number generators: the one place where they are built.
//!
//! A generator is a function of *what it is for*. The caller lists what identifies the purpose
//! ("world", the sweep's seed, the world's content, replicate 3), the list is hashed with SHA-256,
//! and all 256 bits become the seed and the stream of a [`rand_pcg::Pcg64Dxsm`]. Seeds are never `seed + i`
//! and streams are never chosen by number: the documentation of `rand_pcg` warns that both may
//! correlate.
//!
//! Everything else in this crate takes `rng: &mut impl Rng` as its last argument.

use rand::SeedableRng;
use sha2::{Digest, Sha256};

/// The generator used throughout: PCG DXSM, 128-bit state, 64-bit output.
pub type Generator = rand_pcg::Pcg64Dxsm;

/// Raised when a release changes which worlds a seed simulates.
pub const WORLD_SEMANTICS: &str = "world-1";

/// Raised when a release changes which chain a seed runs.
pub const SAMPLER_SEMANTICS: &str = "sampler-2";

/// What a generator is for, as an unambiguous list of labelled parts.
#[derive(Clone)]
pub struct Purpose {
    hasher: Sha256,
}

impl Purpose {
    /// Starts the list with the semantics version and the seed the user gave.
    pub fn new(semantics: &str, seed: u64) -> Self {
        let hasher = Sha256::new();
        Self { hasher }
            .text("semantics", semantics)
            .number("seed", seed)
    }

    /// Adds a text. Key and value are length-prefixed, so no two lists hash alike by accident.
    #[must_use]
    pub fn text(mut self, key: &str, value: &str) -> Self {
        for part in [key, value] {
            self.hasher.update((part.len() as u64).to_le_bytes());
            self.hasher.update(part.as_bytes());
        }
        self
    }

    /// Adds a number.
    #[must_use]
    pub fn number(self, key: &str, value: u64) -> Self {
        self.text(key, &value.to_string())
    }

    /// The 256-bit key of this purpose.
    pub fn key(&self) -> [u8; 32] {
        self.hasher.clone().finalize().into()
    }

    /// The generator of this purpose.
    pub fn generator(&self) -> Generator {
        Generator::from_seed(self.key())
    }
}

/// Generators for numbered steps of one chain, cheap enough to build one per step.
///
/// The estimator `fresh` draws the normals of step `t` from `at(t)`, so that a step whose
/// evaluation is skipped changes nothing in the steps after it (`docs/model.md`, early rejection).
#[derive(Clone, Debug)]
pub struct StepGenerators {
    key: [u64; 4],
}

impl StepGenerators {
    /// From the purpose of the chain's importance draws.
    pub fn new(purpose: &Purpose) -> Self {
        let bytes = purpose.key();
        let mut key = [0; 4];
        for (word, chunk) in key.iter_mut().zip(bytes.chunks_exact(8)) {
            *word = u64::from_le_bytes(chunk.try_into().expect("a chunk of eight bytes"));
        }
        Self { key }
    }

    /// The generator of step `step`: every word of its seed is a full avalanche of (key, step).
    pub fn at(&self, step: u64) -> Generator {
        let mut seed = [0; 32];
        let mut word = split_mix(self.key[0] ^ step);
        for (bytes, key) in seed.chunks_exact_mut(8).zip(self.key) {
            word = split_mix(word.wrapping_add(key));
            bytes.copy_from_slice(&word.to_le_bytes());
        }
        Generator::from_seed(seed)
    }
}

/// The finaliser of SplitMix64 (Steele, Lea and Flood 2014): a bijection with full avalanche.
pub fn split_mix(word: u64) -> u64 {
    let mut z = word.wrapping_add(0x9E37_79B9_7F4A_7C15);
    z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    z ^ (z >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::Rng;

    #[test]
    fn parts_do_not_run_into_each_other() {
        let a = Purpose::new(SAMPLER_SEMANTICS, 1).text("ab", "c");
        let b = Purpose::new(SAMPLER_SEMANTICS, 1).text("a", "bc");
        assert_ne!(a.key(), b.key());
    }

    #[test]
    fn the_same_purpose_gives_the_same_numbers() {
        let purpose = Purpose::new(WORLD_SEMANTICS, 7).number("replicate", 3);
        assert_eq!(
            purpose.generator().next_u64(),
            purpose.generator().next_u64()
        );
        let next = Purpose::new(WORLD_SEMANTICS, 7).number("replicate", 4);
        assert_ne!(purpose.generator().next_u64(), next.generator().next_u64());
    }

    #[test]
    fn neighbouring_steps_share_no_bits_beyond_chance() {
        let steps = StepGenerators::new(&Purpose::new(SAMPLER_SEMANTICS, 1));
        let mut differing = 0;
        let n = 1000;
        for step in 0..n {
            let (a, b) = (steps.at(step).next_u64(), steps.at(step + 1).next_u64());
            differing += (a ^ b).count_ones();
        }
        // 64,000 fair coins: mean 32,000, standard deviation 126; five of them.
        let mean = f64::from(differing) / n as f64;
        assert!(
            (mean - 32.0).abs() < 5.0 * 4.0 / (n as f64).sqrt(),
            "{mean}"
        );
    }
}
