//! Radiance without derivatives, with or without media.

use flatland::calculus::{Rgb, Vec3};
use glam::DVec3;

use super::chain::{FirstAlone, Trail};
use super::integrator::{Paths, Vertex};
use super::plain::Plain;
use super::scattered::Scattered;
use super::sequence::Draws;
use crate::scene::Hit;

impl Paths<'_> {
    /// One sample of the radiance from `hit` along the `depth`-th segment of a path, without derivatives.
    /// With media, `depth` must be 1, the camera's segment.
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

    /// The part of [`still_radiance`](Self::still_radiance) that the first point scatters, without chains and
    /// lights without extent there.
    pub(crate) fn still_radiance_of_first(
        &self,
        origin: DVec3,
        direction: DVec3,
        hit: Option<Hit>,
        depth: usize,
        samples: &mut Draws<'_>,
    ) -> DVec3 {
        let mut first = FirstAlone(Rgb::constant(DVec3::ZERO));
        let ray = (Vec3::constant(origin), Vec3::constant(direction));
        self.radiance_in_parts(&mut Plain { scene: self.scene }, &mut first, ray, hit, depth, samples);
        first.0.value()
    }

    /// Sum of [`still_radiance`](Self::still_radiance) along the first segment over several samples, bit for
    /// bit; the first vertex is shaded once.
    pub(crate) fn still_radiances<'d>(
        &self,
        origin: DVec3,
        direction: DVec3,
        hit: Option<Hit>,
        samples: impl Iterator<Item = Draws<'d>>,
    ) -> DVec3 {
        if !self.scene.description.media.is_empty() {
            return samples.map(|mut s| self.radiance_through_media(origin, direction, hit, &mut s)).sum();
        }
        let calculus = &mut Plain { scene: self.scene };
        let path = Scattered::new(Vec3::constant(origin), Vec3::constant(direction), hit);
        let seen = self.seen_first(calculus, &path, 1);
        let point = self.arrive(calculus, &path, 1);
        let shading = point.as_ref().and_then(|point| point.shading(self.scene, calculus));
        let vertex = point.as_ref().zip(shading.as_ref());
        let one = |mut samples: Draws<'d>| {
            let (mut total, mut trail) = (seen, Trail::new());
            if let Some((point, shading)) = vertex
                && let Some(next) = self.reflect_at(
                    calculus,
                    Vertex { point, shading },
                    &path,
                    1,
                    (&mut trail, &mut total),
                    &mut samples,
                )
            {
                self.follow(calculus, next, 2, &mut trail, &mut total, &mut samples);
            }
            total.value()
        };
        samples.map(one).sum()
    }
}
