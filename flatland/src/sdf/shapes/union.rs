//! Two shapes as one, blended where they are close.

use glam::DVec2;

use super::{Shape, ShapeError, check};
use crate::sdf::distance::{Jet, Sdf};

/// The quadratic smooth minimum of two distances (Quilez 2013): with d = φ_a − φ_b,
///
/// ```text
/// φ = min(φ_a, φ_b) − (k − |d|)₊²/(4k).
/// ```
///
/// ∇φ is a convex combination of those of a and b, so that |∇φ| ≤ 1 and the tracer stays safe, and
/// it is continuous across the medial axis between them, which every field made of tracer points
/// needs. φ is not a true distance: it is too small where it blends. Where a and b are further
/// apart than k, the surface is exactly that of both. k = 0 is the plain minimum, with its kink.
///
/// Parameters: those of a, those of b, k.
#[derive(Clone, Debug, PartialEq)]
pub struct SmoothUnion {
    a: Shape,
    b: Shape,
    width: f64,
}

/// Both children at a point, with what blending needs.
struct Blend {
    a: Jet<DVec2>,
    b: Jet<DVec2>,
    /// ∂φ/∂φ_a; that of φ_b is the rest to 1.
    share: f64,
    /// −∂share/∂d: 1/(2k) where the children blend, else 0.
    bend: f64,
}

impl Blend {
    /// ∇d.
    fn difference(&self) -> DVec2 {
        self.a.gradient - self.b.gradient
    }
}

impl SmoothUnion {
    /// Blends two shapes over a width k ≥ 0.
    ///
    /// # Errors
    /// If k is negative or not finite.
    pub fn new(a: Shape, b: Shape, width: f64) -> Result<Self, ShapeError> {
        check("smooth union", "width", width, "finite and not negative", width >= 0.0)?;
        Ok(Self { a, b, width })
    }

    pub(super) fn with_parameters(&self, parameters: &[f64]) -> Result<Self, ShapeError> {
        let (a, rest) = parameters.split_at(self.a.parameter_count());
        let (b, k) = rest.split_at(self.b.parameter_count());
        Self::new(self.a.with_parameters(a)?, self.b.with_parameters(b)?, k[0])
    }

    pub(super) fn parameters(&self) -> Vec<f64> {
        [self.a.parameters(), self.b.parameters(), vec![self.width]].concat()
    }

    /// Both shapes.
    #[must_use]
    pub fn children(&self) -> [&Shape; 2] {
        [&self.a, &self.b]
    }

    /// k.
    #[must_use]
    pub fn width(&self) -> f64 {
        self.width
    }

    fn blend(&self, x: DVec2) -> Blend {
        let (a, b) = (self.a.jet(x), self.b.jet(x));
        let d = a.value - b.value;
        if d.abs() >= self.width {
            return Blend { a, b, share: if d <= 0.0 { 1.0 } else { 0.0 }, bend: 0.0 };
        }
        Blend { a, b, share: 0.5 - 0.5 * d / self.width, bend: 0.5 / self.width }
    }

    /// ∂φ/∂k = −(k² − d²)/(4k²) and its gradient.
    fn width_rate(&self, blend: &Blend) -> Jet<DVec2> {
        if blend.bend == 0.0 {
            return Jet::ZERO;
        }
        let relative = (blend.a.value - blend.b.value) / self.width;
        Jet {
            value: -0.25 * (1.0 - relative * relative),
            gradient: blend.difference() * (0.5 * relative / self.width),
        }
    }
}

impl Sdf<DVec2> for SmoothUnion {
    fn jet(&self, x: DVec2) -> Jet<DVec2> {
        let blend = self.blend(x);
        let gradient = blend.a.gradient * blend.share + blend.b.gradient * (1.0 - blend.share);
        let least = blend.a.value.min(blend.b.value);
        let value = if blend.bend == 0.0 {
            least
        } else {
            let overlap = self.width - (blend.a.value - blend.b.value).abs();
            least - 0.25 * overlap * overlap / self.width
        };
        Jet { value, gradient }
    }

    /// α H_a v + (1 − α) H_b v − ∇d (∇d·v)/(2k)
    fn hessian_times(&self, x: DVec2, v: DVec2) -> DVec2 {
        let blend = self.blend(x);
        let d = blend.difference();
        self.a.hessian_times(x, v) * blend.share + self.b.hessian_times(x, v) * (1.0 - blend.share)
            - d * (blend.bend * d.dot(v))
    }

    fn laplacian(&self, x: DVec2) -> f64 {
        let blend = self.blend(x);
        self.a.laplacian(x) * blend.share + self.b.laplacian(x) * (1.0 - blend.share)
            - blend.bend * blend.difference().length_squared()
    }

    fn parameter_count(&self) -> usize {
        self.a.parameter_count() + self.b.parameter_count() + 1
    }

    fn rate(&self, x: DVec2, direction: &[f64]) -> Jet<DVec2> {
        let blend = self.blend(x);
        let (a, rest) = direction.split_at(self.a.parameter_count());
        let (b, k) = rest.split_at(self.b.parameter_count());
        let (a, b) = (self.a.rate(x, a), self.b.rate(x, b));
        let bend = Jet { value: 0.0, gradient: blend.difference() * (-blend.bend * (a.value - b.value)) };
        a * blend.share + b * (1.0 - blend.share) + bend + self.width_rate(&blend) * k[0]
    }

    fn add_parameter_gradient(&self, x: DVec2, covector: Jet<DVec2>, gradient: &mut [f64]) {
        let blend = self.blend(x);
        let (a, rest) = gradient.split_at_mut(self.a.parameter_count());
        let (b, k) = rest.split_at_mut(self.b.parameter_count());
        let bend = -blend.bend * blend.difference().dot(covector.gradient);
        let part = |share: f64, bend: f64| {
            let scaled = covector * share;
            Jet { value: scaled.value + bend, ..scaled }
        };
        self.a.add_parameter_gradient(x, part(blend.share, bend), a);
        self.b.add_parameter_gradient(x, part(1.0 - blend.share, -bend), b);
        k[0] += self.width_rate(&blend).dot(covector);
    }
}
