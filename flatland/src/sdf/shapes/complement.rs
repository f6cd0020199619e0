//! Complements of shapes, and intersections and differences by smooth unions.

use super::{Parametric, ShapeError, SmoothUnion};
use crate::sdf::distance::{Jet, Sdf, SecondOrder};
use crate::sdf::space::Space;

/// −φ: inside and outside exchanged. It has the parameters of the shape.
///
/// Rays are then traced where φ < 0, so that the slope bound is [the one for
/// everywhere](Sdf::slope_bound_everywhere).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Complement<S>(pub S);

/// Blended intersection of two shapes, made by [`smooth_intersection`].
pub type SmoothIntersection<A, B = A> = Complement<SmoothUnion<Complement<A>, Complement<B>>>;

/// Blended difference of two shapes, made by [`smooth_difference`].
pub type SmoothDifference<A, B = A> = Complement<SmoothUnion<Complement<A>, B>>;

/// The quadratic smooth maximum of two distances: with d = φ_a − φ_b,
///
/// ```text
/// φ = max(φ_a, φ_b) + (k − |d|)₊²/(4k) = −smooth union of −φ_a and −φ_b.
/// ```
///
/// The properties of the [smooth union](SmoothUnion) hold with signs reversed. φ is too large by up to k/4
/// where it blends, which removes part of the shape, and still |∇φ| ≤ 1, so that tracing is safe. Elsewhere
/// φ > 0 need not be the distance either: near an edge it is the larger of the distances to both faces.
/// Parameters: all of a, all of b, k.
///
/// # Errors
/// If k is negative or not finite.
pub fn smooth_intersection<A, B>(a: A, b: B, width: f64) -> Result<SmoothIntersection<A, B>, ShapeError> {
    check("smooth intersection", width)?;
    Ok(Complement(SmoothUnion::new(Complement(a), Complement(b), width)?))
}

/// Difference a \ b with rounded edges: the [smooth intersection](smooth_intersection()) of a and the
/// complement of b,
///
/// ```text
/// φ = max(φ_a, −φ_b) + (k − |φ_a + φ_b|)₊²/(4k).
/// ```
///
/// Parameters: all of a, all of b, k.
///
/// # Errors
/// If k is negative or not finite.
pub fn smooth_difference<A, B>(a: A, b: B, width: f64) -> Result<SmoothDifference<A, B>, ShapeError> {
    check("smooth difference", width)?;
    Ok(Complement(SmoothUnion::new(Complement(a), b, width)?))
}

fn check(shape: &'static str, width: f64) -> Result<(), ShapeError> {
    ShapeError::check(shape, "width", width, "finite and not negative", width >= 0.0)
}

impl<V: Space, S: Parametric<V>> Parametric<V> for Complement<S> {
    fn parameters(&self) -> Vec<f64> {
        self.0.parameters()
    }

    fn with_parameters(&self, parameters: &[f64]) -> Result<Self, ShapeError> {
        Ok(Self(self.0.with_parameters(parameters)?))
    }
}

impl<V: Space, S: Sdf<V>> Sdf<V> for Complement<S> {
    fn jet(&self, x: V) -> Jet<V> {
        self.0.jet(x) * -1.0
    }

    fn second_order(&self, x: V) -> SecondOrder<V> {
        let SecondOrder { jet, hessian } = self.0.second_order(x);
        SecondOrder { jet: jet * -1.0, hessian: hessian * -1.0 }
    }

    fn slope_bound(&self) -> f64 {
        self.0.slope_bound_everywhere()
    }

    fn level_bounds(&self, level: f64) -> Option<(V, V)> {
        self.0.complement_level_bounds(level)
    }

    fn complement_level_bounds(&self, level: f64) -> Option<(V, V)> {
        self.0.level_bounds(level)
    }

    fn parameter_count(&self) -> usize {
        self.0.parameter_count()
    }

    fn rate(&self, x: V, direction: &[f64]) -> Jet<V> {
        self.0.rate(x, direction) * -1.0
    }

    fn add_parameter_gradient(&self, x: V, covector: Jet<V>, gradient: &mut [f64]) {
        self.0.add_parameter_gradient(x, covector * -1.0, gradient);
    }
}

#[cfg(test)]
mod tests {
    use glam::{DMat3, DVec3};

    use super::super::Ball;
    use super::*;

    fn balls() -> [Ball<DVec3>; 2] {
        [-0.3, 0.4].map(|x| Ball::new(DVec3::new(x, 0.0, 0.0), 0.6).expect("a ball"))
    }

    /// Away from the rounded edges the result equals the maximum; on the edges it is larger by k/4.
    #[test]
    fn intersections_and_differences_are_maxima() {
        let ([a, b], k) = (balls(), 0.1);
        let both = smooth_intersection(a, b, k).expect("an intersection");
        let without = smooth_difference(a, b, k).expect("a difference");
        let value = |shape: &dyn Sdf<DVec3>, x: DVec3| shape.jet(x).value;
        for x in [DVec3::new(0.3, 0.1, 0.2), DVec3::new(-0.8, 0.0, 0.1), DVec3::new(1.0, -1.0, 0.3)] {
            let (at_a, at_b) = (value(&a, x), value(&b, x));
            assert!((at_a - at_b).abs() > k && (at_a + at_b).abs() > k);
            assert_eq!(value(&both, x), at_a.max(at_b));
            assert_eq!(value(&without, x), at_a.max(-at_b));
        }
        let equal = DVec3::new(0.05, 0.4, 0.0);
        assert!((value(&both, equal) - value(&a, equal) - 0.25 * k).abs() < 1e-15);
        let touching = DVec3::new(0.05, (0.36_f64 - 0.1225).sqrt(), 0.0);
        assert!((value(&without, touching) - 0.25 * k).abs() < 1e-15);
    }

    /// A shape with slope 2 where φ > 0 and 3 elsewhere.
    #[derive(Clone, Copy)]
    struct Steep;

    impl Sdf<DVec3> for Steep {
        fn jet(&self, x: DVec3) -> Jet<DVec3> {
            let slope = if x.x > 0.0 { 2.0 } else { 3.0 };
            Jet { value: slope * x.x, gradient: slope * DVec3::X }
        }
        fn second_order(&self, x: DVec3) -> SecondOrder<DVec3> {
            SecondOrder { jet: self.jet(x), hessian: DMat3::ZERO }
        }
        fn slope_bound(&self) -> f64 {
            2.0
        }
        fn slope_bound_everywhere(&self) -> f64 {
            3.0
        }
        fn parameter_count(&self) -> usize {
            0
        }
        fn rate(&self, _: DVec3, _: &[f64]) -> Jet<DVec3> {
            Jet::ZERO
        }
        fn add_parameter_gradient(&self, _: DVec3, _: Jet<DVec3>, _: &mut [f64]) {}
    }

    #[test]
    fn slope_bounds_are_those_of_the_steeper_shape_on_the_side_of_rays() {
        let [ball, _] = balls();
        let union = SmoothUnion::new(ball, Steep, 0.1).expect("a union");
        assert_eq!(Sdf::<DVec3>::slope_bound(&union), 2.0);
        assert_eq!(Sdf::<DVec3>::slope_bound(&Complement(Steep)), 3.0);
        let without = smooth_difference(ball, Steep, 0.1).expect("a difference");
        assert_eq!(Sdf::<DVec3>::slope_bound(&without), 3.0);
        assert_eq!(Sdf::<DVec3>::slope_bound(&Complement(ball)), 1.0);
    }

    /// Outside the box φ exceeds the level; near each face of the box it attains the level, except for sharp
    /// unions.
    #[test]
    fn boxes_have_everything_within() {
        let ([a, b], k) = (balls(), 0.4);
        let union = SmoothUnion::new(a, b, k).expect("a union");
        let both = smooth_intersection(a, b, k).expect("an intersection");
        let without = smooth_difference(a, b, k).expect("a difference");
        let (low, high) = (-DVec3::new(1.0, 0.7, 0.7), DVec3::new(1.1, 0.7, 0.7));
        let close = |found: Option<(DVec3, DVec3)>, low: DVec3, high: DVec3| {
            let (found_low, found_high) = found.expect("a box");
            assert!((found_low - low).length() + (found_high - high).length() < 1e-14, "{found:?}");
        };
        close(Sdf::<DVec3>::bounds(&union), low, high);
        close(union.level_bounds(0.1), low - 0.1, high + 0.1);
        close(both.bounds(), DVec3::new(-0.2, -0.6, -0.6), DVec3::new(0.3, 0.6, 0.6));
        close(without.bounds(), DVec3::new(-0.9, -0.6, -0.6), DVec3::new(0.3, 0.6, 0.6));
        assert_eq!(Sdf::<DVec3>::bounds(&Complement(a)), None);
        assert_eq!(Sdf::<DVec3>::bounds(&Complement(Complement(a))), a.bounds());
        assert_eq!(Sdf::<DVec3>::bounds(&Steep), None);
        let half = smooth_intersection(Steep, a, k).expect("an intersection");
        assert_eq!(Sdf::<DVec3>::bounds(&half), a.bounds());
        assert!(SmoothUnion::new(a, Steep, k).is_ok_and(|open| Sdf::<DVec3>::bounds(&open).is_none()));
        let far = Ball::new(DVec3::splat(9.0), 1.0).expect("a ball");
        assert_eq!(smooth_intersection(a, far, k).expect("nothing").bounds(), a.bounds());
        let mut rng = crate::random::stream(1, &[]);
        let shapes: [&dyn Sdf<DVec3>; 3] = [&union, &both, &without];
        for _ in 0..5000 {
            let x = DVec3::from_array([(); 3].map(|()| 4.0 * crate::random::open01(&mut rng) - 2.0));
            for (shape, level) in shapes.into_iter().flat_map(|s| [(s, 0.0), (s, 0.3)]) {
                let (low, high) = shape.level_bounds(level).expect("a box");
                let outside = x.cmplt(low).any() || x.cmpgt(high).any();
                assert!(!outside || shape.jet(x).value > level - 1e-14, "{x}");
            }
        }
    }

    #[test]
    fn bad_widths_are_refused() {
        let [a, b] = balls();
        for width in [-1.0, f64::NAN, f64::INFINITY] {
            let error = smooth_intersection(a, b, width).expect_err("refused");
            assert!(matches!(error, ShapeError::Parameter { shape: "smooth intersection", .. }));
            assert!(smooth_difference(a, b, width).is_err());
        }
        let both = smooth_intersection(a, b, 0.1).expect("an intersection");
        let parameters = Parametric::<DVec3>::parameters(&both);
        assert!(matches!(
            Parametric::<DVec3>::with_parameters(&both, &parameters[1..]),
            Err(ShapeError::Count { expected: 9, found: 8 })
        ));
    }
}
