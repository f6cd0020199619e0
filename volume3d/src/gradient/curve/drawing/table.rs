//! Sampling in proportion to weights.

/// Cumulative weights.
#[derive(Clone, Debug, Default)]
pub(in crate::gradient::curve) struct Table {
    cumulative: Vec<f64>,
}

/// A sampled entry.
#[derive(Clone, Copy, Debug)]
pub(in crate::gradient::curve) struct Chosen {
    pub(in crate::gradient::curve) index: usize,
    /// Remainder of the random number, uniform in [0, 1).
    pub(in crate::gradient::curve) rest: f64,
    pub(in crate::gradient::curve) probability: f64,
}

impl Table {
    pub(in crate::gradient::curve) fn new(weights: impl IntoIterator<Item = f64>) -> Self {
        let mut sum = 0.0;
        let add = |w: f64| {
            sum += w;
            sum
        };
        Self { cumulative: weights.into_iter().map(add).collect() }
    }

    pub(in crate::gradient::curve) fn total(&self) -> f64 {
        self.cumulative.last().copied().unwrap_or(0.0)
    }

    /// Weight of one entry, up to rounding.
    pub(in crate::gradient::curve) fn weight(&self, index: usize) -> f64 {
        self.cumulative[index] - if index > 0 { self.cumulative[index - 1] } else { 0.0 }
    }

    /// The entry at a fraction of the total, which must not be zero.
    pub(in crate::gradient::curve) fn at(&self, fraction: f64) -> Chosen {
        let target = fraction * self.total();
        let index = self.cumulative.partition_point(|&c| c <= target).min(self.cumulative.len() - 1);
        let before = if index > 0 { self.cumulative[index - 1] } else { 0.0 };
        let weight = self.cumulative[index] - before;
        let rest = ((target - before) / weight).clamp(0.0, 1.0 - f64::EPSILON);
        Chosen { index, rest, probability: weight / self.total() }
    }
}
