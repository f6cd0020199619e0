//! Harmonic field: the smoothest boundary-consistent field.

use std::f64::consts::TAU;

use glam::DVec2;

use super::{Exact, ExactError};
use crate::random::Stream;
use crate::sdf::fields::MotionField;
use crate::sdf::tracer::RayCount;
use crate::warp::{Circle, Field, WarpField};

/// ΔV = 0 between silhouettes and V = v on them: on the circle, linear in the angle from one silhouette to
/// the next. It needs all silhouettes.
#[derive(Clone, Debug, PartialEq)]
pub struct HarmonicField {
    /// Angles in [0, 2π), ascending, with their velocities.
    nodes: Vec<[f64; 2]>,
    direction: Vec<f64>,
}

impl HarmonicField {
    /// The field of a scene that changes along a direction in parameter space.
    ///
    /// # Errors
    /// If the direction does not fit the shape.
    pub fn new(exact: &Exact<'_>, direction: &[f64]) -> Result<Self, ExactError> {
        let silhouettes = exact.silhouettes(direction)?;
        let mut nodes: Vec<_> = silhouettes.iter().map(|s| [s.angle.rem_euclid(TAU), s.rate]).collect();
        nodes.sort_by(|a, b| a[0].total_cmp(&b[0]));
        Ok(Self { nodes, direction: direction.to_vec() })
    }

    /// dα/dθ of the field at an angle, and its slope.
    #[must_use]
    pub fn rate(&self, angle: f64) -> [f64; 2] {
        let (Some(first), Some(last)) = (self.nodes.first(), self.nodes.last()) else { return [0.0; 2] };
        let angle = angle.rem_euclid(TAU);
        let next = self.nodes.partition_point(|node| node[0] <= angle);
        // Around the circle from the last to the first.
        let low = if next == 0 { [last[0] - TAU, last[1]] } else { self.nodes[next - 1] };
        let high = self.nodes.get(next).copied().unwrap_or([first[0] + TAU, first[1]]);
        let slope = (high[1] - low[1]) / (high[0] - low[0]);
        [low[1] + slope * (angle - low[0]), slope]
    }
}

impl WarpField<Circle> for HarmonicField {
    fn at(&self, u: DVec2, _: &mut Stream) -> (Field<DVec2>, u64) {
        let [rate, slope] = self.rate(u.to_angle());
        (Field { value: rate * u.perp(), divergence: slope }, 0)
    }
}

impl MotionField<Circle> for HarmonicField {
    fn direction(&self) -> &[f64] {
        &self.direction
    }

    fn sample(&self, omega: DVec2, rng: &mut Stream) -> (Field<DVec2>, RayCount) {
        (self.at(omega, rng).0, RayCount::default())
    }
}
