//! The calculus: the source of the numbers of a path's integrand.

use glam::DVec2;

use super::scattering::Scattering;
use super::{Hit, Material, Origin, World};
use crate::calculus::{Number, Vec2};

/// A direction ω + ε V(ω), with the Jacobian 1 + ε ∇·V(ω) of the change of variables.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Warped<T> {
    pub(crate) direction: Vec2<T>,
    pub(crate) jacobian: T,
}

/// A scattering point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Bounce<T> {
    /// Number of scattering points between the camera and this one.
    pub(crate) depth: usize,
    /// The point as the start of a ray.
    pub(crate) origin: Origin,
    /// The point over numbers.
    pub(crate) position: Vec2<T>,
    pub(crate) scattering: Scattering<T>,
    /// Scattering without derivatives, from which directions are sampled.
    pub(crate) still: Scattering<f64>,
}

/// The parameters of a world as numbers, and the treatment of discontinuities over the directions at a
/// surface.
pub(crate) trait Calculus {
    /// Number type.
    type Number: Number;

    /// The end points of a segment.
    fn ends(&self, segment: usize) -> [Vec2<Self::Number>; 2];

    /// The material of a segment.
    fn material(&self, segment: usize) -> Material<Self::Number>;

    /// The environment's radiance.
    fn environment(&self) -> Self::Number;

    /// Whether a black surface must be followed nevertheless, because its reflectance is a parameter.
    fn wants_black(&self) -> bool;

    /// The warp at a direction, for the light of one emitting segment or for all scattered light.
    fn warp(
        &mut self,
        at: &Bounce<Self::Number>,
        direction: DVec2,
        emitter: Option<usize>,
    ) -> Warped<Self::Number>;

    /// ∫ f cos φ L dω less its value: 0, with the derivative due to discontinuities that no warp follows.
    fn jumps(&mut self, at: &Bounce<Self::Number>) -> Self::Number;

    /// 1/p of a density, which is not differentiated. (Except in a negative control, which uses `attached`,
    /// the density as it moves.)
    fn weight(&self, density: f64, attached: impl FnOnce() -> Self::Number) -> Self::Number;
}

/// Plain numbers, without derivatives.
#[derive(Debug)]
pub(super) struct Plain<'w> {
    pub(super) world: &'w World,
}

impl Calculus for Plain<'_> {
    type Number = f64;

    fn ends(&self, segment: usize) -> [Vec2<f64>; 2] {
        self.world.segments()[segment].ends().map(Vec2::constant)
    }

    fn material(&self, segment: usize) -> Material {
        *self.world.material(segment)
    }

    fn environment(&self) -> f64 {
        self.world.environment()
    }

    fn wants_black(&self) -> bool {
        false
    }

    fn warp(&mut self, _: &Bounce<f64>, direction: DVec2, _: Option<usize>) -> Warped<f64> {
        Warped { direction: Vec2::constant(direction), jacobian: 1.0 }
    }

    fn jumps(&mut self, _: &Bounce<f64>) -> f64 {
        0.0
    }

    fn weight(&self, density: f64, _: impl FnOnce() -> f64) -> f64 {
        1.0 / density
    }
}

impl<T: Number> Bounce<T> {
    /// Intersection of the ray o + tω with a segment's line: t = (a − o) × e/(ω × e), where origin, direction
    /// and segment all move.
    pub(crate) fn new<C: Calculus<Number = T>>(
        world: &World,
        calculus: &C,
        [origin, direction]: [Vec2<T>; 2],
        hit: &Hit,
        depth: usize,
    ) -> Self {
        let [start, end] = calculus.ends(hit.segment);
        let edge = end - start;
        let distance = (start - origin).cross(edge) / direction.cross(edge);
        let normal = edge.perp().normalized();
        let still = Scattering::new(
            *world.material(hit.segment),
            Vec2::constant(normal.value()),
            Vec2::constant(-direction.value()),
        );
        Self {
            depth,
            origin: world.origin(hit),
            position: origin + direction * distance,
            scattering: Scattering::new(calculus.material(hit.segment), normal, -direction),
            still,
        }
    }
}
