//! Identity of a sample, and its random numbers.

use flatland::random::{Stream, stream};

use crate::path::Sequence;

/// Purposes of random numbers, distinct from those of the area term.
pub(super) const FILM_EDGE: u64 = 16;
pub(super) const SHADOW_EDGE: u64 = 17;
pub(super) const INDIRECT_EDGE: u64 = 18;
pub(super) const OUTLINE: u64 = 19;
pub(super) const BACKWARDS: u64 = 20;
pub(super) const HORIZON: u64 = 21;
pub(super) const BEYOND_HORIZON: u64 = 22;
pub(super) const FILM_SIGN_CHANGE: u64 = 23;
pub(super) const INNER_SIGN_CHANGE: u64 = 24;
pub(super) const BEFORE_SIGN_CHANGE: u64 = 25;
pub(super) const WARPS: u64 = 26;
pub(super) const REFLECTED_OUTLINE: u64 = 27;

/// Identity of a sample.
#[derive(Clone, Copy, Debug)]
pub(super) struct Address {
    pub(super) seed: u64,
    pub(super) group: usize,
    /// Index within its group, and size of the group.
    pub(super) index: usize,
    pub(super) count: usize,
}

impl Address {
    /// Random numbers of the sample: samples of one group are stratified; groups are independent.
    pub(super) fn numbers(&self, purpose: u64) -> Sequence {
        Sequence::new(self.seed, &[purpose, self.group as u64], self.index)
    }

    /// A random stream of this sample alone.
    pub(super) fn stream(&self, purpose: u64) -> Stream {
        stream(self.seed, &[purpose, self.group as u64, self.index as u64])
    }

    /// The sample's stratified position in (0, 1).
    pub(super) fn fraction(&self, numbers: &mut Sequence) -> f64 {
        (self.index as f64 + numbers.one()) / self.count as f64
    }
}
