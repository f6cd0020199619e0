//! Implicit surfaces among the jumps near a direction.
//!
//! The silhouettes of a level set φ = 0 are no arcs whose integrals are elementary. What stands for them is one point of the
//! ray, the mean x̄ = x + t̄u of the points of its sphere tracer with the weights of Vicini et al. (2022), which are largest where the ray is
//! nearest to the surface and grazes it ([`ViciniField`]). With r = |φ(x̄)|/t̄, which is about the angle to the silhouette, and reach c,
//!
//! > V = (∫ ḃ K + F Σ_i k_i G_i(x̄_i)/t̄_i) / (∫ K + F + F Σ_i k_i),  k = (c/r − 1)₊,
//!
//! where F = 2π/R is the floor that arcs have, and G = −φ̇ ∇φ/|∇φ|² the velocity of the level set. Its kernel grows as 1/r, as
//! that of an arc does with the distance: V is the velocity of whichever silhouette is at u, and 0 far from all. Without arcs, and with one
//! surface, V is m G/t̄ with m = (1 − r/c)₊: Vicini's field itself.
//!
//! The lemma of [the module](super) holds as it stands: k is infinite on both sides of a silhouette of its surface, and finite and continuous
//! elsewhere, if rays end at what they hit of a mesh: k falls to 0 as what is hit comes within the first step of the tracer, where there is no point to
//! take a mean of. Where the mesh ends, an arc is infinite. It is not where a mesh and an
//! implicit surface pass through one another, nor where two implicit surfaces do: their crossings jump, and nothing follows them.

use flatland::sdf::fields::{Tap, ViciniField};
use flatland::sdf::{End, Jet, Scalar, Sdf as _, SecondOrder, Trace, View};
use glam::DVec3;

use super::arc::Graded;
use crate::Sphere;
use crate::scene::{Scene, Surface};

/// Vicini's weights for a surface of size 1 with the reach c = 0.1 radians, which showed the least variance and no bias of those tried
/// on balls and their unions of about that size. Of rays that leave the surface, the points nearer than about `departure`
/// say little of its silhouettes.
const FIELD: ViciniField =
    ViciniField { epsilon: 1e-6, grazing: 0.05, gamma: 3.0, reach: Some(0.1), departure: 0.2 };

/// The weights for a surface of any size: its images do not depend on units, and neither do their derivatives.
fn field(size: f64, leaves: bool) -> ViciniField {
    ViciniField {
        epsilon: FIELD.epsilon * size,
        grazing: FIELD.grazing * size,
        departure: if leaves { FIELD.departure * size } else { 0.0 },
        ..FIELD
    }
}

/// Where rays at implicit surfaces begin, and end before the surface does.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sight {
    pub(crate) origin: DVec3,
    /// The surface that they leave.
    pub(crate) from: Option<Surface>,
    /// The plane {y: n·y = d} beyond which nothing counts.
    pub(crate) plane: Option<(DVec3, f64)>,
}

/// An implicit surface near a direction.
#[derive(Clone, Copy, Debug)]
pub(super) struct NearLevelSet {
    implicit: u32,
    t: Scalar<DVec3>,
    /// k.
    pub(super) kernel: Graded,
}

/// A point of an implicit surface's level sets, and what φ̇ and ∇φ̇ there give to the field.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LevelSetTap {
    /// Which surface.
    pub(crate) implicit: u32,
    /// φ there, to second order.
    pub(crate) there: SecondOrder<DVec3>,
    tap: Tap<DVec3>,
}

impl Sight {
    /// All implicit surfaces of a scene whose kernels do not vanish at u.
    pub(super) fn near(&self, scene: &Scene, u: DVec3, trace: &mut Trace<DVec3>) -> Vec<NearLevelSet> {
        let count = scene.description.implicits.len() as u32;
        (0..count).filter_map(|implicit| self.nearness(scene, implicit, u, trace)).collect()
    }

    fn nearness(
        &self,
        scene: &Scene,
        implicit: u32,
        u: DVec3,
        trace: &mut Trace<DVec3>,
    ) -> Option<NearLevelSet> {
        let leaves = self.from == Some(Surface::Implicit(implicit));
        let start = if leaves { scene.leaving(implicit) } else { 0.0 };
        let sdf = &scene.description.implicits[implicit as usize];
        let view = View { sdf, eye: self.origin, start, tracer: scene.description.tracer };
        let open = Scalar::constant(scene.far_of(implicit, self.origin));
        let far = self.plane.and_then(|plane| distance(plane, self.origin, u));
        let far = far.filter(|far| far.value < open.value).unwrap_or(open);
        if far.value <= start {
            return None;
        }
        view.trace_until(u, far, trace);
        if trace.end == End::OutOfSteps {
            scene.count_out_of_steps();
        }
        let field = field(scene.implicit_size(implicit), leaves);
        if !field.is_near::<Sphere>(&view, trace) {
            return None;
        }
        let t = field.mean_distance::<Sphere>(&view, trace)?;
        let Scalar { value, gradient } = field.multiplier::<Sphere>(&view, u, t);
        let rest = 1.0 - value;
        let kernel = Graded { value: value / rest, gradient: gradient / (rest * rest) };
        let kernel = kernel.times(room(trace, far));
        (value > 0.0).then_some(NearLevelSet { implicit, t, kernel })
    }
}

/// How much of a ray there is beyond its first step, as a part of a tenth of that, at most 1. A ray that ends within its first step
/// has no point to take a mean of: kernels must vanish as it becomes so short.
fn room(trace: &Trace<DVec3>, far: Scalar<DVec3>) -> Graded {
    const PART: f64 = 0.1;
    let Some(first) = trace.points.get(1) else { return Graded { value: 0.0, gradient: DVec3::ZERO } };
    let value = (far.value - first.t) / (PART * first.t);
    if value >= 1.0 {
        return Graded { value: 1.0, gradient: DVec3::ZERO };
    }
    let gradient = (far.gradient - first.t_gradient * (far.value / first.t)) / (PART * first.t);
    Graded { value, gradient }
}

/// How far away a plane is along u: t = (d − n·x)/(n·u), with its gradient −t n_⊥/(n·u).
fn distance((normal, offset): (DVec3, f64), origin: DVec3, u: DVec3) -> Option<Scalar<DVec3>> {
    let along = normal.dot(u);
    let value = (offset - normal.dot(origin)) / along;
    let gradient = (normal - along * u) * (-value / along);
    (value > 0.0 && value.is_finite()).then_some(Scalar { value, gradient })
}

impl NearLevelSet {
    /// Its part of the field, where it has the given weight.
    pub(super) fn tap(&self, scene: &Scene, origin: DVec3, u: DVec3, weight: Graded) -> LevelSetTap {
        let Self { implicit, t, .. } = *self;
        let point = origin + t.value * u;
        let there = scene.description.implicits[implicit as usize].second_order(point);
        let weight = Scalar { value: weight.value, gradient: weight.gradient };
        LevelSetTap { implicit, there, tap: Tap::of::<Sphere>(point, there, u, t, weight) }
    }
}

impl LevelSetTap {
    /// x̄.
    pub(crate) fn point(&self) -> DVec3 {
        self.tap.point
    }

    /// What rates there give to V, before it is projected, and to ∇·V.
    pub(super) fn field(&self, rate: Jet<DVec3>) -> (DVec3, f64) {
        let Tap { value, slope, gradient, .. } = self.tap;
        (value * rate.value, slope * rate.value + gradient.dot(rate.gradient))
    }

    /// The transpose: the covector of the rates from a, projected, and b of a·V + b ∇·V.
    pub(super) fn covector(&self, a: DVec3, b: f64) -> Jet<DVec3> {
        let Tap { value, slope, gradient, .. } = self.tap;
        Jet { value: a.dot(value) + b * slope, gradient: gradient * b }
    }

    pub(super) fn is_finite(&self) -> bool {
        let Tap { value, slope, gradient, .. } = self.tap;
        value.is_finite() && slope.is_finite() && gradient.is_finite()
    }
}

#[cfg(test)]
mod tests {
    use flatland::sdf::shapes::Ball;

    use super::*;
    use crate::scene::{Camera, Description, Film, Filter, Material};

    /// A small ball before a floor on which rays end: near the viewer's side of the ball they do so within the tracer's first
    /// step, whose points are then none.
    #[test]
    fn kernels_do_not_jump_where_rays_end_within_the_first_step() {
        let eye = DVec3::new(0.3, -5.0, 3.0);
        let camera = Camera::look_at(eye, DVec3::ZERO, DVec3::Z, 0.7);
        let film = Film { width: 4, height: 4, crop: None, filter: Filter::Box };
        let mut description = Description::new(camera, film);
        let clay = description.add_material(Material::diffuse("clay", DVec3::ONE));
        let ball = Ball::new(DVec3::new(0.1, 0.0, 0.3), 0.3).expect("a ball");
        description.add_implicit("ball", ball, clay);
        let scene = Scene::new(description).expect("a scene");
        let sight = Sight { origin: eye, from: None, plane: Some((DVec3::Z, 0.0)) };
        let mut trace = Trace { direction: eye, points: vec![], end: End::Miss };
        let mut at = |y: f64| {
            let u = (DVec3::new(0.12, y, 0.0) - eye).normalize();
            let kernel = sight.near(&scene, u, &mut trace).first().map_or(0.0, |near| near.kernel.value);
            (kernel, trace.points.len())
        };
        let (low, high) = (-0.9, -0.35);
        let count = 400;
        let place = |i: usize| low + (high - low) * i as f64 / count as f64;
        let points: Vec<usize> = (0..=count).map(|i| at(place(i)).1).collect();
        assert!(points.contains(&1) && points.iter().any(|&n| n > 1), "{points:?}");
        let mut greatest = 0.0_f64;
        for i in 0..count {
            let (mut a, mut b) = (place(i), place(i + 1));
            greatest = greatest.max(at(a).0);
            // Halved down to rounding, towards the half in which it changes more.
            for _ in 0..40 {
                let middle = 0.5 * (a + b);
                let [left, there, right] = [a, middle, b].map(|y| at(y).0);
                if (left - there).abs() > (right - there).abs() { b = middle } else { a = middle }
            }
            let jump = (at(a).0 - at(b).0).abs();
            assert!(jump < 1e-9, "{jump} at {a}");
        }
        assert!(greatest > 0.1, "{greatest}");
    }
}
