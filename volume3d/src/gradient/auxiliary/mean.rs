//! Means over discontinuities near a direction.

use std::f64::consts::FRAC_PI_2;

use glam::DVec3;

use super::{Auxiliary, Construction};
use crate::gradient::warp::jump_mean::{
    AngularSupport, Cone, HalfSpace, JumpMean, Known, Listed, Sight, Silhouettes, View, WIDEST,
};
use crate::path::{Kernel, VisibilityDomain};
use crate::scene::Surface;

/// Indices of the cached caps.
const WITHIN_LOBE: usize = 0;
const TOWARDS_LIGHT: usize = 1;
pub(super) const ON_FILM: usize = 2;

/// The camera's silhouettes near a direction, as last looked up.
#[derive(Debug, Default)]
pub(super) struct Near {
    direction: DVec3,
    /// Chord by which a direction may differ.
    margin: f64,
    edges: Listed,
}

impl Auxiliary<'_> {
    /// Angular support of the mean over discontinuities; `None` for other fields.
    pub(super) fn reach(&self, kernel: &Kernel) -> Option<AngularSupport> {
        let Construction::JumpMean { lobe, lobe_softness, .. } = self.construction else {
            return None;
        };
        if kernel.of_light && !self.warps_light() {
            return None;
        }
        let width = 1.0 / kernel.kappa.sqrt();
        let softness = if kernel.of_light { 0.0 } else { lobe_softness * width };
        let place = if kernel.of_light { TOWARDS_LIGHT } else { WITHIN_LOBE };
        // A softened field requires the unreduced reach, to which its softness is relative.
        let crowded = self.edges.filter(|_| softness == 0.0);
        let reach = crowded.map_or(lobe * width, |edges| edges.reach(lobe * width));
        Some(self.support(place, reach).softened(softness))
    }

    /// A cap with an angular radius, cached by purpose.
    pub(super) fn support(&self, place: usize, angle: f64) -> AngularSupport {
        let last = &self.supports[place];
        if last.get().angle != angle.min(WIDEST) {
            last.set(AngularSupport::new(angle));
        }
        last.get()
    }

    pub(super) fn jump_mean_on_film(
        &mut self,
        origin: DVec3,
        direction: DVec3,
        (reach, softness): (AngularSupport, f64),
        seen: Option<Surface>,
        camera_moves: bool,
        from_one_place: bool,
    ) -> Option<JumpMean> {
        if !camera_moves && !self.moving.may_be_near(origin, direction, reach) {
            return None;
        }
        if !from_one_place {
            // Samples differ in lens point or pixel: there is nothing to reuse.
            self.near.margin = -1.0;
        } else {
            self.gather(origin, direction, reach)?;
        }
        let (scene, tree) = (self.paths.scene, self.edges?);
        let triangle = seen.and_then(Surface::triangle);
        let front = triangle.map(|t| self.front(tree.plane(t), origin));
        let border_softness = triangle.map_or(0.0, |t| tree.border_softness(t, origin, softness));
        let (domain, seen) = (VisibilityDomain::Radiance, triangle);
        let rounding = self.paths.scene.rounding();
        let view =
            View { origin, planes: front.as_slice(), domain, seen, left: None, border_softness, rounding };
        let field = self.implicit_field();
        let known = if triangle.is_none() { self.ahead.of(origin, direction) } else { Known::Nothing };
        let sight = Sight { origin, from: None, plane: triangle.map(|t| self.plane_of(t)), field, known };
        let silhouettes =
            if from_one_place { Silhouettes::Listed(&self.near.edges) } else { Silhouettes::All };
        JumpMean::new(scene, tree, silhouettes, &view, direction, reach, &sight, &mut self.trace)
    }

    /// Looks up silhouettes around a direction once for all samples of a pixel, whose directions are nearly
    /// equal.
    fn gather(&mut self, origin: DVec3, direction: DVec3, reach: AngularSupport) -> Option<()> {
        let tree = self.edges?;
        let moved = (direction - self.near.direction).length();
        // Angles are at most π/2 times their chords, which are small here.
        if moved > self.near.margin {
            let margin = 2.0 * reach.versine.sqrt();
            // If the enlarged cap would be too wide, silhouettes are looked up for each direction.
            let margin = if reach.angle + FRAC_PI_2 * margin > WIDEST { 0.0 } else { margin };
            let wide = AngularSupport::new(reach.angle + FRAC_PI_2 * margin);
            let cone = Cone {
                origin,
                axis: direction,
                reach: wide,
                planes: &[],
                rounding: self.paths.scene.rounding(),
            };
            self.near.edges.clear();
            tree.for_each(&cone, |edge| self.near.edges.push(edge, origin));
            (self.near.direction, self.near.margin) = (direction, margin);
        }
        Some(())
    }

    pub(super) fn jump_mean_on_sphere(
        &mut self,
        x: DVec3,
        from: Surface,
        direction: DVec3,
        kernel: Kernel,
        reach: AngularSupport,
        x_moves: bool,
    ) -> Option<JumpMean> {
        if !x_moves && !self.moving.may_be_near(x, direction, reach) {
            return None;
        }
        // Objects in the plane of the horizon are not above it.
        let horizon = HalfSpace { normal: kernel.normal, point: x, slack: -self.paths.scene.rounding() };
        let (scene, tree) = (self.paths.scene, self.edges?);
        let (seen, plane, end) = match kernel.domain {
            VisibilityDomain::Distant => (None, None, None),
            VisibilityDomain::Radiance => {
                let triangle = kernel.surface.and_then(Surface::triangle);
                let front = triangle.map(|t| self.front(tree.plane(t), x));
                (triangle, front, triangle.map(|t| self.plane_of(t)))
            }
            VisibilityDomain::BeforePlane { normal, offset, .. } => {
                // Little more than rounding: the border of the light's own back, slightly behind it, moves
                // with it, and a field that followed it would have to vary between it and the occluder of
                // that border.
                let slack = 1e4 * self.paths.scene.rounding() + 2.0 * self.paths.scene.grain(x);
                let plane = HalfSpace { normal, point: offset * normal, slack };
                (None, Some(plane), Some((normal, offset)))
            }
        };
        let planes = [horizon, plane.unwrap_or(horizon)];
        let planes = &planes[..1 + usize::from(plane.is_some())];
        let left = from.triangle().map(|t| tree.plane(t));
        let rounding = self.paths.scene.rounding();
        let domain = kernel.domain;
        let view = View { origin: x, planes, domain, seen, left, border_softness: 0.0, rounding };
        let known = self.ahead.of(x, direction);
        let sight = Sight { origin: x, from: Some(from), plane: end, field: self.implicit_field(), known };
        let silhouettes =
            if kernel.of_light && self.samples_shadows() { Silhouettes::None } else { Silhouettes::All };
        let trace = &mut self.trace;
        JumpMean::new(scene, tree, silhouettes, &view, direction, reach, &sight, trace)
    }

    /// The half space of a triangle's plane that contains the viewer.
    fn front(&self, triangle: u32, viewer: DVec3) -> HalfSpace {
        let [point, ..] = self.paths.scene.corners(triangle);
        let normal = self.upward(Surface::Triangle(triangle), point, viewer - point);
        // Objects that touch a plane count as in front of it, also within the rounding of single-precision
        // meshes: 10⁻⁶ of the scene. Edges behind the plane are occluded and harmless.
        let scene = self.paths.scene;
        HalfSpace { normal, point, slack: 1e7 * scene.rounding() + 2.0 * scene.grain(point) }
    }

    /// The plane {y: n·y = d} of a triangle.
    fn plane_of(&self, triangle: u32) -> (DVec3, f64) {
        let normal = self.paths.scene.face_normal(triangle);
        (normal, normal.dot(self.paths.scene.corners(triangle)[0]))
    }
}
