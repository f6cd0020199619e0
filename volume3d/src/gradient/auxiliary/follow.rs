//! One rigid motion per kernel.

use flatland::random::open01;
use glam::DVec3;

use super::Auxiliary;
use crate::gradient::warp::followed::FollowedPoint;
use crate::gradient::warp::rigid_motion::{Rigid, RigidMotion};
use crate::scene::Surface;

impl Auxiliary<'_> {
    /// The nearest of several points of a kernel around μ, which is sampled from the kernel around u: the
    /// nearest point occludes the others, and its edge is the visible one.
    #[expect(clippy::too_many_arguments, reason = "the ray's origin and the kernel's centre are independent")]
    pub(super) fn follow<D: Rigid>(
        &mut self,
        origin: DVec3,
        from: Option<Surface>,
        u: D::Vector,
        kappa: f64,
        candidates: usize,
        origin_moves: bool,
        ray: impl Fn(D::Vector) -> DVec3,
        keep: impl Fn(DVec3, f64) -> bool,
    ) -> Option<RigidMotion<D>> {
        let mut draw = |at| {
            let xi = [open01(&mut self.rng), open01(&mut self.rng)];
            D::draw(at, kappa, 1.0, xi).point
        };
        let centre = draw(u);
        let points: Vec<D::Vector> = (0..candidates).map(|_| draw(centre)).collect();
        self.directions.clear();
        self.directions.extend(points.iter().map(|&p| ray(p)));
        if !self.trace(origin, from, origin_moves) {
            return None;
        }
        let nearest = (0..candidates).filter_map(|i| Some((i, self.hits[i]?)));
        let nearest = nearest.filter(|(i, hit)| keep(self.directions[*i], hit.distance));
        let (i, hit) = nearest.min_by(|a, b| a.1.distance.total_cmp(&b.1.distance))?;
        let seen = FollowedPoint::by_ray(self.paths.scene, Some(hit), origin, self.directions[i], 1.0);
        let slope = D::project(u, centre - u) * kappa;
        Some(RigidMotion { point: u, at: points[i], seen, slope })
    }

    fn trace(&mut self, origin: DVec3, from: Option<Surface>, origin_moves: bool) -> bool {
        if !origin_moves && !self.directions.iter().any(|&d| self.moving.may_be_hit(origin, d)) {
            return false;
        }
        self.rays += self.directions.len() as u64;
        self.paths.scene.closest_bundle(origin, &self.directions, from, &mut self.hits);
        true
    }
}
