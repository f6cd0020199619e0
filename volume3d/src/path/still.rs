//! Radiance without derivatives, with media or without.

use flatland::calculus::Vec3;
use glam::DVec3;

use super::integrator::Paths;
use super::plain::Plain;
use super::sequence::Draws;
use crate::scene::Hit;

impl Paths<'_> {
    /// One sample of the radiance that arrives from `hit` along the `depth`-th segment of a path, without derivatives. In a
    /// scene with media that is the first segment, from the camera.
    pub(crate) fn still_radiance(
        &self,
        origin: DVec3,
        direction: DVec3,
        hit: Option<Hit>,
        depth: usize,
        samples: &mut Draws<'_>,
    ) -> DVec3 {
        if !self.scene.description.media.is_empty() {
            return self.radiance_through_media(origin, direction, hit, samples);
        }
        let (origin, direction) = (Vec3::constant(origin), Vec3::constant(direction));
        self.radiance(&mut Plain { scene: self.scene }, origin, direction, hit, depth, samples).value()
    }
}
