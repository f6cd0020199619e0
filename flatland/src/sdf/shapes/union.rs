//! Smooth unions of two shapes.

use super::{Parametric, ShapeError};
use crate::sdf::distance::{Jet, Sdf, SecondOrder};
use crate::sdf::space::Space;

/// The quadratic smooth minimum of two distances (Quilez 2013): with d = φ_a − φ_b,
///
/// ```text
/// φ = min(φ_a, φ_b) − (k − |d|)₊²/(4k).
/// ```
///
/// ∇φ is a convex combination of ∇φ_a and ∇φ_b, so that |∇φ| ≤ 1 and tracing is safe, and it is continuous
/// across the medial axis between them, as every field of tracer points requires. φ is not a true distance:
/// it is too small where it blends. Where a and b are farther apart than k, the surface is exactly the union
/// of both surfaces. k = 0 is the plain minimum, with its kink.
///
/// If a or b has a [slope bound](Sdf::slope_bound) above 1, the union has the larger of both bounds.
///
/// Parameters: all of a, all of b, k.
#[derive(Clone, Debug, PartialEq)]
pub struct SmoothUnion<A, B = A> {
    a: A,
    b: B,
    width: f64,
}

/// Both children at a point, with the data for blending.
struct Blend<V> {
    a: Jet<V>,
    b: Jet<V>,
    /// ∂φ/∂φ_a; ∂φ/∂φ_b is 1 minus it.
    share: f64,
    /// −∂share/∂d: 1/(2k) where the children blend, else 0.
    bend: f64,
}

impl<V: Space> Blend<V> {
    fn new(a: Jet<V>, b: Jet<V>, width: f64) -> Self {
        let d = a.value - b.value;
        if d.abs() >= width {
            return Self { a, b, share: if d <= 0.0 { 1.0 } else { 0.0 }, bend: 0.0 };
        }
        Self { a, b, share: 0.5 - 0.5 * d / width, bend: 0.5 / width }
    }

    /// ∇d.
    fn difference(&self) -> V {
        self.a.gradient - self.b.gradient
    }

    fn jet(&self, width: f64) -> Jet<V> {
        let gradient = self.a.gradient * self.share + self.b.gradient * (1.0 - self.share);
        let least = self.a.value.min(self.b.value);
        let value = if self.bend == 0.0 {
            least
        } else {
            let overlap = width - (self.a.value - self.b.value).abs();
            least - 0.25 * overlap * overlap / width
        };
        Jet { value, gradient }
    }

    /// ∂φ/∂k = −(k² − d²)/(4k²) and its gradient.
    fn width_rate(&self, width: f64) -> Jet<V> {
        if self.bend == 0.0 {
            return Jet::ZERO;
        }
        let relative = (self.a.value - self.b.value) / width;
        Jet {
            value: -0.25 * (1.0 - relative * relative),
            gradient: self.difference() * (0.5 * relative / width),
        }
    }
}

/// Applies a function of two numbers to each component.
fn each<V: Space>(of: impl Fn(f64, f64) -> f64, a: V, b: V) -> V {
    V::from_components(|axis| of(a.component(axis), b.component(axis)))
}

impl<A, B> SmoothUnion<A, B> {
    /// Blends two shapes over a width k ≥ 0.
    ///
    /// # Errors
    /// If k is negative or not finite.
    pub fn new(a: A, b: B, width: f64) -> Result<Self, ShapeError> {
        ShapeError::check("smooth union", "width", width, "finite and not negative", width >= 0.0)?;
        Ok(Self { a, b, width })
    }

    /// Both shapes.
    #[must_use]
    pub fn children(&self) -> (&A, &B) {
        (&self.a, &self.b)
    }

    /// k.
    #[must_use]
    pub fn width(&self) -> f64 {
        self.width
    }

    fn blend<V: Space>(&self, x: V) -> Blend<V>
    where
        A: Sdf<V>,
        B: Sdf<V>,
    {
        Blend::new(self.a.jet(x), self.b.jet(x), self.width)
    }
}

impl<V: Space, A: Parametric<V>, B: Parametric<V>> Parametric<V> for SmoothUnion<A, B> {
    fn parameters(&self) -> Vec<f64> {
        [self.a.parameters(), self.b.parameters(), vec![self.width]].concat()
    }

    fn with_parameters(&self, parameters: &[f64]) -> Result<Self, ShapeError> {
        ShapeError::count(self.parameter_count(), parameters)?;
        let (a, rest) = parameters.split_at(self.a.parameter_count());
        let (b, k) = rest.split_at(self.b.parameter_count());
        Self::new(self.a.with_parameters(a)?, self.b.with_parameters(b)?, k[0])
    }
}

impl<V: Space, A: Sdf<V>, B: Sdf<V>> Sdf<V> for SmoothUnion<A, B> {
    fn jet(&self, x: V) -> Jet<V> {
        self.blend(x).jet(self.width)
    }

    /// H = α H_a + (1 − α) H_b − ∇d ∇dᵀ/(2k)
    fn second_order(&self, x: V) -> SecondOrder<V> {
        let (a, b) = (self.a.second_order(x), self.b.second_order(x));
        let blend = Blend::new(a.jet, b.jet, self.width);
        let d = blend.difference();
        let bend = d.outer(d) * blend.bend;
        let hessian = a.hessian * blend.share + b.hessian * (1.0 - blend.share) - bend;
        SecondOrder { jet: blend.jet(self.width), hessian }
    }

    /// The larger bound of the two shapes: where φ > 0, φ_a and φ_b are positive too.
    fn slope_bound(&self) -> f64 {
        self.a.slope_bound().max(self.b.slope_bound())
    }

    fn slope_bound_everywhere(&self) -> f64 {
        self.a.slope_bound_everywhere().max(self.b.slope_bound_everywhere())
    }

    /// Box around the boxes of a and b at a level raised by k/4, as φ ≥ min(φ_a, φ_b) − k/4: for distances a
    /// union exceeds its parts by at most k/4.
    fn level_bounds(&self, level: f64) -> Option<(V, V)> {
        let raised = level + 0.25 * self.width;
        let ((a_low, a_high), (b_low, b_high)) = (self.a.level_bounds(raised)?, self.b.level_bounds(raised)?);
        Some((each(f64::min, a_low, b_low), each(f64::max, a_high, b_high)))
    }

    /// Intersection of the boxes of −a and −b, as −φ ≥ −φ_a and −φ ≥ −φ_b; the box of −a if it is empty.
    fn complement_level_bounds(&self, level: f64) -> Option<(V, V)> {
        let (a, b) = (self.a.complement_level_bounds(level), self.b.complement_level_bounds(level));
        let (Some((a_low, a_high)), Some((b_low, b_high))) = (a, b) else {
            return a.or(b);
        };
        let (low, high) = (each(f64::max, a_low, b_low), each(f64::min, a_high, b_high));
        let empty = (0..V::DIMENSION).any(|axis| low.component(axis) > high.component(axis));
        if empty { a } else { Some((low, high)) }
    }

    fn parameter_count(&self) -> usize {
        self.a.parameter_count() + self.b.parameter_count() + 1
    }

    fn rate(&self, x: V, direction: &[f64]) -> Jet<V> {
        let blend = self.blend(x);
        let (a, rest) = direction.split_at(self.a.parameter_count());
        let (b, k) = rest.split_at(self.b.parameter_count());
        let (a, b) = (self.a.rate(x, a), self.b.rate(x, b));
        let bend = Jet { value: 0.0, gradient: blend.difference() * (-blend.bend * (a.value - b.value)) };
        a * blend.share + b * (1.0 - blend.share) + bend + blend.width_rate(self.width) * k[0]
    }

    fn add_parameter_gradient(&self, x: V, covector: Jet<V>, gradient: &mut [f64]) {
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
        k[0] += blend.width_rate(self.width).dot(covector);
    }
}
