//! All constructions of the warp field ([`crate::warp`] derives them), for scenes of polygons.
//!
//! | construction | continuous | boundary consistent | needs |
//! |---|---|---|---|
//! | [`DirectField`] | no: discontinuous at silhouettes | yes | nothing |
//! | [`AuxiliaryField`], Gaussian | yes | no: biased | auxiliary rays |
//! | [`AuxiliaryField`], boundary-aware | yes | yes | auxiliary rays |
//! | [`JumpField`] | yes | yes | a list of all edges |
//! | [`OracleField`](super::exact::OracleField) | yes | yes | all silhouettes |
//! | [`HarmonicField`](super::exact::HarmonicField) | yes | yes | all silhouettes |
//! | [`FollowedField`] | within a kernel | no: biased | a few rays |

use glam::DVec2;

use super::{EdgeTree, Hit, MaterialPoint, Scene};
use crate::random::{Stream, open01};
use crate::warp::{Field, Jump, JumpMean, LinearField as _, Plane, Stencil, Warp, WarpField};

/// "Attempt 1": the velocity of the visible material at u.
#[derive(Clone, Copy, Debug)]
pub struct DirectField<'a> {
    /// The scene.
    pub scene: &'a Scene,
    /// The velocity of every vertex.
    pub velocities: &'a [DVec2],
}

impl WarpField<Plane> for DirectField<'_> {
    fn at(&self, u: DVec2, _: &mut Stream) -> (Field<DVec2>, u64) {
        let field = self.scene.hit(u).map_or(Field::ZERO, |hit| {
            let gradients = self.scene.barycentric_gradients(&hit);
            let vertices = hit.point().vertices().into_iter().zip(gradients);
            let divergence = vertices.map(|(v, g)| g.dot(self.velocities[v])).sum();
            Field { value: hit.velocity(self.velocities), divergence }
        });
        (field, 1)
    }
}

/// "Attempt 2" and the published method: a weighted mean over auxiliary points.
#[derive(Clone, Copy, Debug)]
pub struct AuxiliaryField<'a> {
    /// The scene.
    pub scene: &'a Scene,
    /// The velocity of every vertex.
    pub velocities: &'a [DVec2],
    /// The weight and the number of points.
    pub warp: Warp,
    /// Kernel concentration, in the scene's unit.
    pub kappa: f64,
}

impl WarpField<Plane> for AuxiliaryField<'_> {
    fn at(&self, u: DVec2, rng: &mut Stream) -> (Field<DVec2>, u64) {
        let stencil = scene_stencil(self.scene, &self.warp, self.kappa, u, rng);
        (moved(&stencil, self.velocities), stencil.terms().len() as u64)
    }
}

/// Coefficients of (V, ∇·V) over the hits of auxiliary points; a miss is static.
pub fn scene_stencil(
    scene: &Scene,
    warp: &Warp,
    kappa: f64,
    u: DVec2,
    rng: &mut Stream,
) -> Stencil<Plane, Option<MaterialPoint>> {
    let reach = warp.reach(kappa);
    warp.stencil(u, kappa, rng, |point| {
        let hit = scene.hit(point);
        let distance = hit.as_ref().map_or(f64::INFINITY, |h| scene.boundary_distance(Some(h), point, reach));
        (hit.map(|hit| *hit.point()), distance)
    })
}

fn moved(stencil: &Stencil<Plane, Option<MaterialPoint>>, velocities: &[DVec2]) -> Field<DVec2> {
    stencil.field(|point| point.map_or(DVec2::ZERO, |point| point.velocity(velocities)))
}

/// Discontinuities of a scene, for means over those near a point.
///
/// S(u) is the edges of all shapes at or above the one visible at u, which satisfies the lemma of
/// [`JumpMean`] (Theory 5). Edges that are hidden by a shape above stay in S: no visibility is tested, and
/// they are harmless.
///
/// With a softness, the border of the visible shape is followed exactly, as it is one body, and edges of the
/// shapes above it in part: at an edge of shape i the field equals v on the side where i is visible, but not
/// on the side where some k < i is visible. See [`crate::warp::JumpMean`] for the residual.
#[derive(Clone, Debug)]
pub struct SceneJumps {
    edges: EdgeTree,
    mean: JumpMean,
    softness: f64,
}

impl SceneJumps {
    /// All edges of a scene, and the reach, in the scene's unit; takes time O(n log n) in the number of
    /// edges.
    #[must_use]
    pub fn new(scene: &Scene, mean: JumpMean) -> Self {
        Self::softened(scene, mean, 0.0)
    }

    /// [`new`](Self::new) with a softness ε ≥ 0, in the scene's unit.
    #[must_use]
    pub fn softened(scene: &Scene, mean: JumpMean, softness: f64) -> Self {
        Self { edges: EdgeTree::new(scene), mean, softness }
    }

    /// The scene's edges.
    pub(crate) fn edges(&self) -> &EdgeTree {
        &self.edges
    }

    /// Coefficients of (V, ∇·V) at u, over the vertices of the nearby edges, given the hit at u.
    #[must_use]
    pub fn stencil(
        &self,
        scene: &Scene,
        u: DVec2,
        seen: Option<&Hit>,
    ) -> Stencil<Plane, Option<MaterialPoint>> {
        let lowest = seen.map_or(0, Hit::shape);
        let mut near = vec![];
        self.edges.near(u, self.mean.reach, |edge| {
            if edge.shape >= lowest {
                let place = edge.vertices.map(|v| scene.vertices()[v]);
                let moved_by = edge.vertices.map(|v| Some(MaterialPoint::vertex(v)));
                let own = seen.is_some_and(|hit| hit.shape() == edge.shape);
                near.push(Jump { place, moved_by, softness: if own { 0.0 } else { self.softness } });
            }
        });
        self.mean.of_segments(u, near)
    }
}

/// Mean over discontinuities: exact, and without auxiliary points.
#[derive(Clone, Debug)]
pub struct JumpField<'a> {
    /// The scene.
    pub scene: &'a Scene,
    /// The velocity of every vertex.
    pub velocities: &'a [DVec2],
    /// The scene's edges.
    pub jumps: SceneJumps,
}

impl WarpField<Plane> for JumpField<'_> {
    fn at(&self, u: DVec2, _: &mut Stream) -> (Field<DVec2>, u64) {
        let seen = self.scene.hit(u);
        (moved(&self.jumps.stencil(self.scene, u, seen.as_ref()), self.velocities), 1)
    }
}

/// The heuristic of Loubet et al. (2019): a kernel follows one of the points seen in it.
#[derive(Clone, Copy, Debug)]
pub struct FollowedField<'a> {
    /// The scene.
    pub scene: &'a Scene,
    /// The velocity of every vertex.
    pub velocities: &'a [DVec2],
    /// Kernel concentration, in the scene's unit.
    pub kappa: f64,
    /// Number of points from which the followed one is chosen.
    pub candidates: usize,
}

impl WarpField<Plane> for FollowedField<'_> {
    fn at(&self, u: DVec2, rng: &mut Stream) -> (Field<DVec2>, u64) {
        let followed = followed(self.scene, u, self.kappa, self.candidates, rng);
        let value = followed.map_or(DVec2::ZERO, |hit| hit.velocity(self.velocities));
        (Field { value, divergence: 0.0 }, self.candidates as u64)
    }
}

/// Hit of the topmost shape among `candidates` points drawn from the kernel around μ, if any: the visible
/// edge is the occluder's.
pub(crate) fn followed(
    scene: &Scene,
    mu: DVec2,
    kappa: f64,
    candidates: usize,
    rng: &mut Stream,
) -> Option<Hit> {
    let hits = (0..candidates).map(|_| scene.hit(mu + kernel_offset(kappa, rng)));
    hits.flatten().reduce(|best, hit| if hit.shape() > best.shape() { hit } else { best })
}

/// A point of the kernel N(0, I/κ).
pub(crate) fn kernel_offset(kappa: f64, rng: &mut Stream) -> DVec2 {
    let radius = (-2.0 * open01(rng).ln() / kappa).sqrt();
    radius * DVec2::from_angle(std::f64::consts::TAU * open01(rng))
}

#[cfg(test)]
mod tests;
