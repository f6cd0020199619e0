//! Seeds of random streams.

use flatland::random::{open01, stream};

/// A seed for the part of the study identified by `words`: 52 bits of their stream.
pub(crate) fn seed_of(seed: u64, words: &[u64]) -> u64 {
    (open01(&mut stream(seed, words)) * 2f64.powi(52)) as u64
}
