//! Emission met by the paths of a wave.

use std::f64::consts::FRAC_1_PI;

use glam::DVec3;

use super::Row;
use crate::path::integrator::Paths;
use crate::scene::{Hit, Surface};

impl Paths<'_> {
    /// Radiance of a shape without an emission texture.
    pub(super) fn radiance_of(&self, surface: Surface) -> DVec3 {
        let shape = self.scene.shape_of(surface) as usize;
        self.scene.description.shapes[shape].radiance.unwrap_or(DVec3::ZERO)
    }

    /// Emission found in a lane's sampled direction, weighted against next-event estimation.
    pub(super) fn found(&self, row: &Row, lane: usize, hit: &Hit) -> [f64; 3] {
        let Row { arrival, vertices, .. } = row;
        let direction = vertices.sampled.of(lane);
        let shape = self.scene.shape_of(hit.surface);
        let other = self.lights.density_of_hit(self.scene, shape, hit, direction);
        let weight = 1.0 / (vertices.density[lane] + other);
        let cosine = vertices.normal.of(lane).dot(direction) * FRAC_1_PI;
        let (throughput, reflectance) = (row.throughput.at(lane), arrival.reflectance.at(lane));
        let radiance = self.radiance_of(hit.surface);
        [0, 1, 2].map(|c| throughput[c] * (reflectance[c] * cosine * weight) * radiance[c])
    }
}
