//! Paths that start again with the warp of a chain.

use flatland::calculus::Number;

use super::bsdf::Bounce;
use super::calculus::{Calculus, VisibilityDomain};
use super::chain::{Departure, Parts, Passed, Trail};
use super::integrator::{Paths, reflect};
use super::scattered::Scattered;
use super::surface::SurfacePoint;
use crate::scene::Hit;

impl Paths<'_> {
    /// The path along a chain up to `hit`, with the chain's own warp or that of a light at its end; `None` if
    /// it has no other warp than the path so far.
    pub(super) fn again<C: Calculus>(
        &self,
        calculus: &mut C,
        parts: &mut impl Parts<C>,
        trail: &Trail<C::Number>,
        hit: Option<Hit>,
        light: Option<usize>,
    ) -> Option<Scattered<C::Number>> {
        if !calculus.follows_chains() {
            return None;
        }
        let mut path = match &trail.departure {
            Departure::Film => {
                let (origin, direction) = parts.begin(calculus, &trail.branches, light)?;
                Scattered::new(origin, direction, None)
            }
            Departure::Bounce { arriving, hit, direction, density } => {
                let point = self.point_at(calculus, arriving, hit);
                let shading = &point.shading(self.scene, calculus)?;
                let kernel = self.kernels.of_bounce(shading, VisibilityDomain::Radiance, None);
                let (x, from) = (point.position, point.surface);
                let warped = calculus.chain_warp(x, from, *direction, kernel, &trail.branches, light);
                let throughput = arriving.throughput * reflect(shading, &warped, 1.0 / density);
                let compression = arriving.compression * shading.compression(*direction);
                let direction = warped.direction;
                Scattered { origin: x, direction, throughput, compression, hit: None }
            }
        };
        for Passed { hit, numbers, survival } in &trail.passed {
            let point = self.point_at(calculus, &path, hit);
            let shading = point.shading(self.scene, calculus)?;
            let Some(Bounce::Ideal(ideal)) = shading.sample(*numbers) else { return None };
            path.throughput = path.throughput * C::Number::constant(*survival) * ideal.factor;
            path.compression *= shading.compression(ideal.direction.value());
            path.origin = point.position;
            path.direction = ideal.direction;
        }
        Some(Scattered { hit, ..path })
    }

    pub(super) fn point_at<C: Calculus>(
        &self,
        calculus: &C,
        path: &Scattered<C::Number>,
        hit: &Hit,
    ) -> SurfacePoint<C::Number> {
        SurfacePoint::new(self.scene, calculus, path.origin, path.direction, hit.surface, hit.distance)
    }
}
