//! Seeds.

use flatland::random::{open01, stream};

/// A seed for the part of the study that the words name: 52 bits of their stream.
pub(crate) fn seed_of(seed: u64, words: &[u64]) -> u64 {
    (open01(&mut stream(seed, words)) * 2f64.powi(52)) as u64
}
