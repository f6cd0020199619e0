//! The gradient that samples add to in reverse, one after the other.

use glam::DVec3;

use super::Tangent;
use super::contribution::{Contribution, Source};
use super::non_finite::NonFinite;
use super::result::Gradient;
use super::reverse::Sink;
use crate::scene::Scene;

/// A gradient, and what the current sample has added to its positions.
#[derive(Debug)]
pub(super) struct Accumulator {
    pub(super) gradient: Gradient,
    touched: Vec<(u32, DVec3)>,
}

impl Accumulator {
    /// Of nothing yet.
    pub(super) fn new(scene: &Scene) -> Self {
        Self { gradient: Tangent::still(scene).into(), touched: vec![] }
    }

    /// Ends a sample, and keeps it if none before it has contributed more: Σ |·| of what it has added to each position,
    /// in which parts of opposite sign cancel.
    pub(super) fn end_sample(&mut self, at: NonFinite, source: Source) {
        if self.touched.is_empty() {
            return;
        }
        let largest = self.gradient.largest.map_or(0.0, |largest| largest.amount);
        let bound: f64 = self.touched.iter().map(|(_, covector)| covector.abs().element_sum()).sum();
        // What cannot be the largest need not be known exactly.
        let amount = if bound > largest { net(&mut self.touched) } else { 0.0 };
        let sample = Contribution { among: 1, ..Contribution::new(at, source, amount) };
        Contribution::merge(&mut self.gradient.largest, Some(sample));
        self.touched.clear();
    }
}

/// Σ over positions of |Σ covectors|.
fn net(touched: &mut [(u32, DVec3)]) -> f64 {
    touched.sort_by_key(|(index, _)| *index);
    let by_position = touched.chunk_by(|a, b| a.0 == b.0);
    by_position.map(|same| same.iter().map(|(_, c)| *c).sum::<DVec3>().abs().element_sum()).sum()
}

impl Sink for Accumulator {
    fn position(&mut self, index: u32, covector: DVec3) {
        self.gradient.by_parameter.positions[index as usize] += covector;
        self.touched.push((index, covector));
    }

    fn normal(&mut self, index: u32, covector: DVec3) {
        self.gradient.by_parameter.normals[index as usize] += covector;
    }

    fn rest(&mut self) -> &mut Tangent {
        &mut self.gradient.by_parameter
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gradient::tests::square;
    use crate::scene::Filter;

    #[test]
    fn the_largest_sample_is_kept_and_its_parts_cancel() {
        let mut sums = Accumulator::new(&square(Filter::Box));
        let at = |sample| NonFinite { column: 1, row: 2, sample };
        for (index, covector) in [(0, DVec3::X), (1, DVec3::Y), (0, -DVec3::X)] {
            sums.position(index, covector);
        }
        sums.end_sample(at(0), Source::Path);
        sums.position(2, DVec3::new(2.0, -0.5, 0.0));
        sums.end_sample(at(1), Source::Jump);
        sums.position(2, DVec3::new(-2.0, 0.0, 0.0));
        sums.end_sample(at(2), Source::Path);
        // A sample that adds nothing does not count.
        sums.end_sample(at(3), Source::Path);
        let largest = sums.gradient.largest.expect("samples");
        let expected = Contribution { among: 3, ..Contribution::new(at(1), Source::Jump, 2.5) };
        assert_eq!(largest, expected);
        // The gradient is (0, 1 ŷ, −½ ŷ): the largest sample is more than all together.
        assert!((sums.gradient.largest_share() - 2.5 / 1.5).abs() < 1e-12);
        assert!(sums.gradient.outlier().is_none(), "three samples have much each");
    }
}
