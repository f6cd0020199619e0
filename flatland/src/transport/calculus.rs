//! Where the numbers of a path's integrand come from.

use glam::DVec2;

use super::scattering::Scattering;
use super::{Hit, Material, Origin, World};
use crate::calculus::{Number, Vec2};

/// A direction ω + ε V(ω) and the Jacobian 1 + ε ∇·V(ω) of the change of variables it belongs to.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Warped<T> {
    pub(crate) direction: Vec2<T>,
    pub(crate) jacobian: T,
}

/// A point at which light is scattered.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Bounce<T> {
    /// How many such points there are between the camera and this one.
    pub(crate) depth: usize,
    /// Where it is, as the start of a ray.
    pub(crate) origin: Origin,
    /// The same in numbers.
    pub(crate) position: Vec2<T>,
    pub(crate) scattering: Scattering<T>,
    /// Without derivatives, for what is drawn from it.
    pub(crate) still: Scattering<f64>,
}

/// The parameters of a world as numbers, and what is done about the jumps over the directions at a surface.
pub(crate) trait Calculus {
    /// What is computed with.
    type Number: Number;

    /// The end points of a segment.
    fn ends(&self, segment: usize) -> [Vec2<Self::Number>; 2];

    /// The material of a segment.
    fn material(&self, segment: usize) -> Material<Self::Number>;

    /// The environment's radiance.
    fn environment(&self) -> Self::Number;

    /// Whether a surface that scatters nothing must be followed all the same, because its reflectance is a parameter.
    fn wants_black(&self) -> bool;

    /// The warp at a direction, of the light of one emitting segment or of all scattered light.
    fn warp(
        &mut self,
        at: &Bounce<Self::Number>,
        direction: DVec2,
        emitter: Option<usize>,
    ) -> Warped<Self::Number>;

    /// ∫ f cos φ L dω less its value: 0, with the derivative due to jumps that no warp follows.
    fn jumps(&mut self, at: &Bounce<Self::Number>) -> Self::Number;

    /// 1/p of a density, which is not differentiated. (But for a mistake that tests make, for which there is
    /// `attached`, the density as it moves.)
    fn weight(&self, density: f64, attached: impl FnOnce() -> Self::Number) -> Self::Number;
}

/// No derivatives.
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
    /// Where the ray o + tω meets a segment's line: t = (a − o) × e/(ω × e). All of it moves: the origin, the direction
    /// and the segment.
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
