//! Scenes: a shaded implicit shape seen from an eye.

use glam::DVec2;

use super::distance::{Jet, Sdf};
use super::shapes::Shape;
use super::tracer::{Trace, TracePoint, Tracer, TracerError, View};

/// L = base + a·x + b·n at the point x with unit normal n: smooth, like a Lambertian surface lit from all
/// around, and varying along a surface with both position and slope.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shading {
    /// The constant part.
    pub base: f64,
    /// a, per unit of length.
    pub position: DVec2,
    /// b. The normal of a polygon is discontinuous at its corners, and with it L, also away from silhouettes:
    /// no field of this module follows such discontinuities.
    pub normal: DVec2,
}

impl Shading {
    /// Constant radiance.
    #[must_use]
    pub fn constant(base: f64) -> Self {
        Self { base, position: DVec2::ZERO, normal: DVec2::ZERO }
    }

    /// L at x with unit normal n.
    #[must_use]
    pub fn radiance(&self, x: DVec2, n: DVec2) -> f64 {
        self.base + self.position.dot(x) + self.normal.dot(n)
    }
}

/// Reason for rejecting a scene.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SceneError {
    /// The tracer's parameters are out of range.
    #[error(transparent)]
    Tracer(#[from] TracerError),
    /// The eye is on or inside the shape.
    #[error("the eye is not outside the shape: φ = {phi} there")]
    EyeInside {
        /// φ at the eye.
        phi: f64,
    },
    /// A number of the shading or the background is not finite.
    #[error("the shading is not finite")]
    Shading,
}

/// A shape, an eye and a shading.
#[derive(Clone, Debug, PartialEq)]
pub struct Scene {
    shape: Shape,
    eye: DVec2,
    tracer: Tracer,
    shading: Shading,
    background: f64,
}

/// L along a ray and its derivative, as a linear form: dL/dθ = a·V + c φ̇ + r·∇φ̇ if the ray rotates with
/// velocity V.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Seen {
    pub(crate) radiance: f64,
    /// ∇_ω L = a; 0 on a miss.
    pub(crate) gradient: DVec2,
    /// The point where φ̇ is evaluated, and (c, r).
    pub(crate) hit: Option<(DVec2, Jet<DVec2>)>,
}

impl Scene {
    /// A shape seen from an eye outside it, over a constant background.
    ///
    /// # Errors
    /// If the eye is not outside, a number is not finite, or the tracer's parameters are out of range.
    pub fn new(
        shape: Shape,
        eye: DVec2,
        tracer: Tracer,
        shading: Shading,
        background: f64,
    ) -> Result<Self, SceneError> {
        tracer.check()?;
        let phi = shape.jet(eye).value;
        // NaN is not outside either.
        if !(phi > 0.0 && phi.is_finite()) {
            return Err(SceneError::EyeInside { phi });
        }
        let finite = shading.base.is_finite() && shading.position.is_finite() && shading.normal.is_finite();
        if !(finite && background.is_finite()) {
            return Err(SceneError::Shading);
        }
        Ok(Self { shape, eye, tracer, shading, background })
    }

    /// The shape.
    #[must_use]
    pub fn shape(&self) -> &Shape {
        &self.shape
    }

    /// The eye.
    #[must_use]
    pub fn eye(&self) -> DVec2 {
        self.eye
    }

    /// The shading of the shape.
    #[must_use]
    pub fn shading(&self) -> &Shading {
        &self.shading
    }

    /// Radiance of rays that miss.
    #[must_use]
    pub fn background(&self) -> f64 {
        self.background
    }

    /// The scene as seen by fields.
    #[must_use]
    pub fn view(&self) -> View<'_, DVec2> {
        View { sdf: &self.shape, eye: self.eye, start: 0.0, tracer: self.tracer }
    }

    /// L of a traced ray.
    #[must_use]
    pub fn radiance(&self, trace: &Trace<DVec2>) -> f64 {
        trace.hit().map_or(self.background, |hit| self.radiance_at(hit.position, hit.jet.gradient))
    }

    /// L of the surface, or the level set, through x.
    pub(crate) fn radiance_at(&self, x: DVec2, gradient: DVec2) -> f64 {
        self.shading.radiance(x, gradient.normalize_or_zero())
    }

    /// L of a traced ray with its derivatives.
    pub(crate) fn seen(&self, trace: &Trace<DVec2>) -> Seen {
        let radiance = self.radiance(trace);
        let Some(hit) = trace.hit() else {
            return Seen { radiance, gradient: DVec2::ZERO, hit: None };
        };
        let (gradient, form) = self.shading_form(trace.direction, hit);
        Seen { radiance, gradient, hit: Some((hit.position, form)) }
    }

    /// a, (c, r) of dL/dθ = a·V + c φ̇ + r·∇φ̇.
    ///
    /// The hit moves with ẋ = tV + ṫω where φ̇ + ∇φ·ẋ = 0, and n = ∇φ/|∇φ| with
    /// ṅ = P_n(Hẋ + ∇φ̇)/|∇φ|. With r = P_n b/|∇φ| and q = a_x + H r,
    ///
    /// ```text
    /// dL/dθ = q·ẋ + r·∇φ̇,   q·ẋ = t (q − ∇φ q·ω/(∇φ·ω))·V − φ̇ q·ω/(∇φ·ω).
    /// ```
    fn shading_form(&self, direction: DVec2, hit: &TracePoint<DVec2>) -> (DVec2, Jet<DVec2>) {
        let gradient = hit.jet.gradient;
        let inverse = gradient.length().recip();
        let n = gradient * inverse;
        let r = (self.shading.normal - n * n.dot(self.shading.normal)) * inverse;
        let q = self.shading.position + self.shape.second_order(hit.position).hessian * r;
        let slope = q.dot(direction) / gradient.dot(direction);
        ((q - gradient * slope) * hit.t, Jet { value: -slope, gradient: r })
    }
}
