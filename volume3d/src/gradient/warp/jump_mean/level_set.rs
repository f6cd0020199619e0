//! Implicit surfaces in the mean over discontinuities (Theory 10).
//!
//! The silhouettes of a level set φ = 0 are not arcs with elementary integrals. They are represented by
//! points x_i = x + t_i u of the ray, with weights that are largest where the ray is nearest to the surface
//! and grazes it ([`ImplicitField`]):
//!
//! > V = (∫ ḃ K + Σ_i κ_i G_i(x_i)/t_i) / (∫ K + F + Σ_i κ_i),
//!
//! where F = 2π/R is the floor of arcs, and G = −φ̇ ∇φ/|∇φ|² the velocity of the level set.
//!
//! - Vicini et al. (2022): one point per surface, the mean x̄ = x + t̄u of the points of its sphere tracer
//!   ([`ViciniField`]), with κ = F (c/r − 1)₊, r = |φ(x̄)|/t̄ and the reach c.
//! - Bangaru et al. (2022): every point of the tracer, with their weights in angles, κ_i =
//!   (ℓ_i/t_i)(S_i/t_i)^−γ ([`BangaruField::kernels`]), S = |φ| + λ |∇φ·u|. They are not normalised, as the
//!   sum must measure the distance to a silhouette: at an angle α it is ~ α^(1 − γ) outside and ~ α^((1 −
//!   γ)/2) inside.
//!
//! The lemma of [the module](super) holds unchanged: Σ κ is infinite on both sides of a silhouette of its
//! surface, and finite and continuous elsewhere, if rays end at mesh hits. As a hit moves into the first step
//! of the tracer, where there is no point to average, Vicini's κ falls to 0 by a factor, and Bangaru's with
//! the length ℓ of the only step. The lemma does not cover crossings of a mesh with an implicit surface, or
//! of two implicit surfaces: they are discontinuities that nothing follows.

use flatland::sdf::fields::{BangaruField, MeanPoint, PointKernel, Tap, ViciniField};
use flatland::sdf::{End, Jet, Scalar, SecondOrder, Trace, View};
use glam::DVec3;

use super::arc::Graded;
use crate::Sphere;
use crate::gradient::warp::implicit_field::{ImplicitField, Weights};
use crate::scene::{Hit, ImplicitShape, Placement, Scene, Surface};

/// Start and end of rays at implicit surfaces.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sight<'w> {
    pub(crate) origin: DVec3,
    /// The surface that the rays leave.
    pub(crate) from: Option<Surface>,
    /// The plane {y: n·y = d} beyond which nothing counts.
    pub(crate) plane: Option<(DVec3, f64)>,
    /// Type of weights along the ray.
    pub(crate) field: ImplicitField,
    /// Results already known for this ray.
    pub(crate) known: Known<'w>,
}

/// Results of tracing a ray at implicit surfaces that are available before the field is evaluated, as the
/// path traced it too.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Known<'w> {
    Nothing,
    /// For a camera ray that misses all meshes, the points of Vicini's field [for each surface](Sight::meet).
    Points(&'w [MeanPoint<DVec3>]),
    /// Whether the surface that the ray leaves [keeps away](Scene::keeps_away) from all of it.
    Leaves(bool),
}

/// A point that represents silhouettes of an implicit surface near a direction.
#[derive(Clone, Copy, Debug)]
pub(super) struct NearLevelSet {
    implicit: u32,
    t: Scalar<DVec3>,
    /// φ at the point.
    there: SecondOrder<DVec3>,
    /// κ/F.
    pub(super) kernel: Graded,
}

/// A point of an implicit surface's level sets, with the coefficients of φ̇ and ∇φ̇ in the field.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LevelSetTap {
    /// Index of the surface.
    pub(crate) implicit: u32,
    /// φ at the point, to second order.
    pub(crate) there: SecondOrder<DVec3>,
    tap: Tap<DVec3>,
}

impl Sight<'_> {
    /// Points of all implicit surfaces whose kernels are nonzero at u, for a given floor of arcs.
    pub(super) fn near(
        &self,
        scene: &Scene,
        u: DVec3,
        floor: f64,
        trace: &mut Trace<DVec3>,
    ) -> Vec<NearLevelSet> {
        let count = scene.description.implicits.len() as u32;
        let mut near = vec![];
        (0..count).for_each(|implicit| self.add(scene, implicit, (u, floor), trace, &mut near));
        near
    }

    /// The nearest hit of a ray with implicit surfaces, found with the steps of Vicini's field, which need
    /// not be repeated then: the results for each surface go to `known`. `None` for other fields, or if the
    /// ray's end requires another search.
    pub(crate) fn meet(
        &self,
        scene: &Scene,
        u: DVec3,
        known: &mut Vec<MeanPoint<DVec3>>,
    ) -> Option<Option<Hit>> {
        known.clear();
        let mut nearest: Option<(Hit, bool)> = None;
        for (implicit, shape) in (0..).zip(scene.implicits()) {
            let Weights::Vicini(field) = self.field.weights(scene.implicit_size(implicit), false) else {
                return None;
            };
            let far = Scalar::constant(scene.far_of(implicit, self.origin));
            let view = View { sdf: shape, eye: self.origin, start: 0.0, tracer: scene.description.tracer };
            let point = Walk::new(field, shape, &view, (u, far)).mean_point();
            let hit = scene.hit_at_end(implicit, (self.origin, u), &point)?;
            nearest = match (nearest, hit) {
                (Some(a), Some(b)) if a.0.distance <= b.0.distance => Some(a),
                (a, b) => b.or(a),
            };
            known.push(point);
        }
        Some(nearest.map(|(hit, is_flat)| {
            if is_flat {
                scene.count_too_flat();
            }
            hit
        }))
    }

    /// Whether a surface that the ray leaves is farther from it than the reach of the field.
    fn keeps_away(
        &self,
        scene: &Scene,
        implicit: u32,
        u: DVec3,
        part: (f64, f64),
        field: &ViciniField,
    ) -> bool {
        match self.known {
            Known::Leaves(true) => true,
            // It does not keep away over the extent of the scene, but a plane may end the ray earlier.
            Known::Leaves(false) if self.plane.is_none() => false,
            _ => field.reach.is_some_and(|reach| scene.keeps_away(implicit, (self.origin, u), part, reach)),
        }
    }

    /// Adds the points of one surface.
    fn add(
        &self,
        scene: &Scene,
        implicit: u32,
        (u, floor): (DVec3, f64),
        trace: &mut Trace<DVec3>,
        near: &mut Vec<NearLevelSet>,
    ) {
        let leaves = self.from == Some(Surface::Implicit(implicit));
        let start = if leaves { scene.leaving(implicit) } else { 0.0 };
        let shape = &scene.implicits()[implicit as usize];
        let view = View { sdf: shape, eye: self.origin, start, tracer: scene.description.tracer };
        let open = Scalar::constant(scene.far_of(implicit, self.origin));
        let far = self.plane.and_then(|plane| distance(plane, self.origin, u));
        let far = far.filter(|far| far.value < open.value).unwrap_or(open);
        if far.value <= start {
            return;
        }
        let end = match self.field.weights(scene.implicit_size(implicit), leaves) {
            // Most rays that leave a surface have a mean point far from it: κ = 0.
            Weights::Vicini(field)
                if leaves && self.keeps_away(scene, implicit, u, (start, far.value), &field) =>
            {
                End::Miss
            }
            Weights::Vicini(field) => {
                let walk = Walk::new(field, shape, &view, (u, far));
                let point = match self.known {
                    Known::Points(points) => points[implicit as usize],
                    Known::Nothing | Known::Leaves(_) => walk.mean_point(),
                };
                near.extend(walk.near(implicit, shape, &point));
                point.end
            }
            Weights::Bangaru(field) => {
                view.trace_until(u, far, trace);
                near.extend(all_points(&field, implicit, &view, trace, floor));
                trace.end
            }
        };
        if end == End::OutOfSteps {
            scene.count_out_of_steps();
        }
    }
}

/// A ray in a surface's own coordinates: directions are rotated, lengths are scaled world lengths.
struct Walk<'a> {
    field: ViciniField,
    view: View<'a, DVec3>,
    direction: DVec3,
    far: Scalar<DVec3>,
    placement: Placement,
}

impl<'a> Walk<'a> {
    fn new(
        field: ViciniField,
        shape: &'a ImplicitShape,
        view: &View<'_, DVec3>,
        (u, far): (DVec3, Scalar<DVec3>),
    ) -> Self {
        let placement = shape.placement;
        let Placement { scale, rotation, .. } = placement;
        let (direction, eye, start) = (rotation.transpose() * u, shape.local(view.eye), view.start / scale);
        let far = Scalar { value: far.value / scale, gradient: rotation.transpose() * far.gradient / scale };
        let view = View { sdf: &*shape.surface, eye, start, tracer: view.tracer };
        let [epsilon, grazing, departure] =
            [field.epsilon, field.grazing, field.departure].map(|d| d / scale);
        Self { field: ViciniField { epsilon, grazing, departure, ..field }, view, direction, far, placement }
    }

    fn mean_point(&self) -> MeanPoint<DVec3> {
        self.field.mean_point::<Sphere>(&self.view, self.direction, self.far)
    }

    /// The point of Vicini's field, if its kernel is nonzero.
    fn near(&self, implicit: u32, shape: &ImplicitShape, point: &MeanPoint<DVec3>) -> Option<NearLevelSet> {
        let Self { field, view, direction, far, placement: Placement { scale, rotation, .. } } = *self;
        let (t, first) = point.t.zip(point.first)?;
        let there = view.sdf.second_order(view.eye + direction * t.value);
        let Scalar { value, gradient } = field.multiplier::<Sphere>(direction, t, there.jet);
        let rest = 1.0 - value;
        let kernel = Graded { value: value / rest, gradient: gradient / (rest * rest) };
        let Graded { value, gradient } = kernel.times(room(first, far));
        let kernel = Graded { value, gradient: rotation * gradient };
        let t = Scalar { value: scale * t.value, gradient: rotation * t.gradient * scale };
        let there = shape.placed_second_order(there);
        // NaN is passed on, and counted.
        (value != 0.0).then_some(NearLevelSet { implicit, t, there, kernel })
    }
}

/// Points of a ray for Bangaru's field: all but the first and those of zero weight.
fn all_points(
    field: &BangaruField,
    implicit: u32,
    view: &View<'_, DVec3>,
    trace: &Trace<DVec3>,
    floor: f64,
) -> impl Iterator<Item = NearLevelSet> {
    let kernels = field.kernels::<Sphere>(view, trace).into_iter();
    let points = trace.points.iter().skip(1).zip(kernels).filter(|(_, at)| at.kernel.value != 0.0);
    points.map(move |(point, PointKernel { kernel, there })| NearLevelSet {
        implicit,
        t: Scalar { value: point.t, gradient: point.t_gradient },
        there,
        kernel: Graded { value: kernel.value / floor, gradient: kernel.gradient / floor },
    })
}

/// Length of a ray beyond its first step, relative to a tenth of that step, at most 1. A ray that ends within
/// its first step has no point to average: kernels must vanish as it becomes so short.
fn room(first: Scalar<DVec3>, far: Scalar<DVec3>) -> Graded {
    const PART: f64 = 0.1;
    let value = (far.value - first.value) / (PART * first.value);
    if value >= 1.0 {
        return Graded { value: 1.0, gradient: DVec3::ZERO };
    }
    let gradient = (far.gradient - first.gradient * (far.value / first.value)) / (PART * first.value);
    Graded { value, gradient }
}

/// Distance to a plane along u: t = (d − n·x)/(n·u), with its gradient −t n_⊥/(n·u).
fn distance((normal, offset): (DVec3, f64), origin: DVec3, u: DVec3) -> Option<Scalar<DVec3>> {
    let along = normal.dot(u);
    let value = (offset - normal.dot(origin)) / along;
    let gradient = (normal - along * u) * (-value / along);
    (value > 0.0 && value.is_finite()).then_some(Scalar { value, gradient })
}

impl NearLevelSet {
    /// The point's coefficients in the field, for a given weight.
    pub(super) fn tap(&self, origin: DVec3, u: DVec3, weight: Graded) -> LevelSetTap {
        let Self { implicit, t, there, .. } = *self;
        let weight = Scalar { value: weight.value, gradient: weight.gradient };
        LevelSetTap { implicit, there, tap: Tap::of::<Sphere>(origin + t.value * u, there, u, t, weight) }
    }
}

impl LevelSetTap {
    /// x̄.
    pub(crate) fn point(&self) -> DVec3 {
        self.tap.point
    }

    /// Contribution of rates to V, before projection, and to ∇·V.
    pub(super) fn field(&self, rate: Jet<DVec3>) -> (DVec3, f64) {
        let Tap { value, slope, gradient, .. } = self.tap;
        (value * rate.value, slope * rate.value + gradient.dot(rate.gradient))
    }

    /// Transpose of [`field`](Self::field): the covector of the rates from a, projected, and b of a·V + b
    /// ∇·V.
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
mod tests;
