use flatland::random::{Stream, open01, stream};
use flatland::sdf::{Jet, Sdf, SecondOrder};
use glam::DVec3;

use super::*;

fn vector(rng: &mut Stream) -> DVec3 {
    DVec3::from_array([(); 3].map(|()| 4.0 * open01(rng) - 2.0))
}

/// Checks that a shape is a distance: |∇φ| = 1 everywhere.
fn check_distance<S: Parametric<DVec3> + std::fmt::Debug + PartialEq>(name: &str, shape: &S) {
    let mut rng = stream(2, &[]);
    for _ in 0..400 {
        let slope = shape.jet(vector(&mut rng)).gradient.length();
        assert!((slope - 1.0).abs() < 1e-12, "{name} is a distance: {slope}");
    }
    check_derivatives(name, shape);
}

/// Checks all derivatives against central differences, and all transposes.
fn check_derivatives<S: Parametric<DVec3> + std::fmt::Debug + PartialEq>(name: &str, shape: &S) {
    let theta = shape.parameters();
    assert_eq!(theta.len(), shape.parameter_count());
    assert_eq!(&shape.with_parameters(&theta).expect("its own"), shape);
    assert!(matches!(shape.with_parameters(&theta[1..]), Err(ShapeError::Count { .. })));
    let (mut rng, h, mut checked) = (stream(1, &[]), 1e-5, 0);
    for _ in 0..400 {
        let (x, v) = (vector(&mut rng), vector(&mut rng));
        let direction: Vec<f64> = theta.iter().map(|_| open01(&mut rng) - 0.5).collect();
        let covector = Jet { value: open01(&mut rng) - 0.5, gradient: vector(&mut rng) };
        let (SecondOrder { jet, hessian }, rate) = (shape.second_order(x), shape.rate(x, &direction));
        assert_eq!(jet, shape.jet(x));
        assert!(jet.gradient.length() < 1.0 + 1e-12, "{name}: rays are safe");
        let mut gradient = vec![0.0; theta.len()];
        shape.add_parameter_gradient(x, covector, &mut gradient);
        let reverse: f64 = gradient.iter().zip(&direction).map(|(g, d)| g * d).sum();
        assert!(
            (reverse - covector.dot(rate)).abs() < 1e-13 * (1.0 + reverse.abs() + rate.gradient.length())
        );
        // Second derivatives are discontinuous between faces and edges, and on medial axes: points whose
        // differences straddle these are skipped.
        let near = [v, -v].map(|v| shape.second_order(x + 3.0 * h * v).hessian);
        if near.iter().any(|&other| (0..3).any(|k| (other.col(k) - hessian.col(k)).length() > 1e-2)) {
            continue;
        }
        checked += 1;
        let moved = |h: f64| {
            let moved: Vec<f64> = theta.iter().zip(&direction).map(|(p, d)| p + h * d).collect();
            shape.with_parameters(&moved).expect("still a shape")
        };
        let jets = |f: &dyn Fn(f64) -> Jet<DVec3>| {
            let (plus, minus) = (f(h), f(-h));
            ((plus.value - minus.value) / (2.0 * h), (plus.gradient - minus.gradient) / (2.0 * h))
        };
        let (slope, turn) = jets(&|h| shape.jet(x + h * v));
        assert!((jet.gradient.dot(v) - slope).abs() < 1e-7, "{name} at {x}");
        assert!((hessian * v - turn).length() < 1e-5, "{name} at {x}: {} {turn}", hessian * v);
        let (slope, turn) = jets(&|h| moved(h).jet(x));
        assert!((rate.value - slope).abs() < 1e-7, "{name} at {x}");
        assert!((rate.gradient - turn).length() < 1e-5, "{name} at {x}: {} {turn}", rate.gradient);
    }
    assert!(checked > 300, "{name}: {checked}");
}

#[test]
fn derivatives_are_those_of_the_value() {
    let centre = DVec3::new(0.1, -0.2, 0.3);
    let rounded = RoundedBox::new(centre, DVec3::new(0.6, 0.4, 0.5), 0.2).expect("a box");
    let (torus, ball) =
        (Torus::new(centre, 1.0, 0.3).expect("a torus"), Ball::new(centre, 0.7).expect("a ball"));
    check_distance("rounded box", &rounded);
    check_distance("torus", &torus);
    check_distance("ball", &ball);
    check_derivatives("intersection", &smooth_intersection(rounded, ball, 0.3).expect("an intersection"));
    check_derivatives("difference", &smooth_difference(ball, torus, 0.4).expect("a difference"));
    check_derivatives("union", &SmoothUnion::new(rounded, torus, 0.5).expect("a union"));
}

#[test]
fn values_are_distances() {
    let shape = RoundedBox::new(DVec3::ZERO, DVec3::new(1.0, 2.0, 3.0), 0.5).expect("a box");
    for (x, expected) in [
        (DVec3::new(4.0, 0.0, 0.0), 2.5),
        (DVec3::new(4.0, 6.0, 0.0), 4.5),
        (DVec3::new(0.9, 0.0, 0.0), -0.6),
        (DVec3::new(-2.0, -4.0, -5.0), 2.5),
    ] {
        assert!((shape.jet(x).value - expected).abs() < 1e-15, "{x}");
    }
    let ring = Torus::new(DVec3::Y, 2.0, 0.5).expect("a torus");
    for (x, expected) in
        [(DVec3::new(0.0, 1.0, 5.0), 2.5), (DVec3::Y, 1.5), (DVec3::new(2.0, 1.0, 0.0), -0.5)]
    {
        assert!((ring.jet(x).value - expected).abs() < 1e-15, "{x}");
    }
}

#[test]
fn bad_shapes_are_refused() {
    assert!(matches!(
        RoundedBox::new(DVec3::ZERO, DVec3::new(1.0, -1.0, 1.0), 0.0),
        Err(ShapeError::Parameter { shape: "rounded box", parameter: "half.y", .. })
    ));
    assert!(RoundedBox::new(DVec3::NAN, DVec3::ONE, 0.0).is_err());
    assert!(RoundedBox::new(DVec3::ZERO, DVec3::ONE, f64::INFINITY).is_err());
    assert!(Torus::new(DVec3::ZERO, 1.0, 1.0).is_err());
    assert!(Torus::new(DVec3::ZERO, 1.0, 0.0).is_err());
    assert!(Torus::new(DVec3::ZERO, f64::NAN, 0.1).is_err());
}

fn trefoil() -> Knot {
    Knot::new(DVec3::new(0.1, -0.2, 0.05), (2, 3), (1.0, 0.4), 0.15).expect("a knot")
}

#[test]
fn knots_have_the_derivatives_of_their_distances() {
    check_distance("trefoil", &trefoil());
    check_distance("wobbling ring", &Knot::new(DVec3::ZERO, (1, 2), (1.1, 0.3), 0.2).expect("a knot"));
    check_distance("cinquefoil", &Knot::new(DVec3::ZERO, (5, 2), (1.0, 0.5), 0.05).expect("a knot"));
}

/// Comparison with the nearest of many points on the curve, whose distance is too large by less than (step
/// |γ′|)²/(8 distance).
#[test]
fn the_nearest_point_of_a_knot_is_the_nearest_of_all() {
    for (p, q, minor) in [(2, 3, 0.4), (3, 2, 0.6), (1, 1, 0.001), (7, 4, 0.3)] {
        let knot = Knot::new(DVec3::ZERO, (p, q), (1.0, minor), 1e-3).expect("a knot");
        let count = 20_000;
        let points: Vec<DVec3> = (0..count)
            .map(|i| {
                let t = std::f64::consts::TAU * f64::from(i) / f64::from(count);
                let ((sin_p, cos_p), (sin_q, cos_q)) =
                    ((f64::from(p) * t).sin_cos(), (f64::from(q) * t).sin_cos());
                let out = 1.0 + minor * cos_q;
                DVec3::new(out * cos_p, minor * sin_q, out * sin_p)
            })
            .collect();
        let mut rng = stream(3, &[]);
        let axis = (0..20).map(|i| DVec3::Y * (f64::from(i) - 10.0) / 5.0);
        let special = axis.chain(points.iter().step_by(997).copied()).chain([DVec3::splat(1e9), DVec3::X]);
        for x in special.chain((0..200).map(|_| vector(&mut rng))).collect::<Vec<_>>() {
            let found = knot.jet(x).value + 1e-3;
            let sampled = points.iter().map(|point| point.distance(x)).fold(f64::INFINITY, f64::min);
            let rounding = 1e-13 * (1.0 + found);
            assert!(
                found <= sampled + rounding && sampled * sampled - found * found < 1e-4 * (1.0 + found),
                "{p} {q} at {x}: {found} {sampled}"
            );
        }
    }
}

/// The reach of an almost circular curve is 1/κ; with several strands, half their distance.
#[test]
fn knots_are_thinner_than_their_reach() {
    let knot = |windings, minor, tube| Knot::new(DVec3::ZERO, windings, (1.0, minor), tube);
    assert!(knot((1, 1), 0.001, 0.99).is_ok() && knot((1, 1), 0.001, 1.01).is_err());
    // Two opposite strands on a thin torus, 2a apart.
    assert!(knot((2, 1), 0.05, 0.049).is_ok() && knot((2, 1), 0.05, 0.0501).is_err());
    assert!(matches!(
        knot((2, 3), 0.4, 0.4),
        Err(ShapeError::Parameter { shape: "knot", parameter: "tube radius", .. })
    ));
    for windings in [(0, 1), (1, 0), (2, 4), (31, 3), (u32::MAX, u32::MAX)] {
        assert!(knot(windings, 0.3, 1e-3).is_err(), "{windings:?}");
    }
    for (minor, tube) in [(1.0, 0.1), (0.0, 0.1), (1e-4, 0.1), (0.3, 0.0), (f64::NAN, 0.1), (0.3, f64::NAN)] {
        assert!(knot((2, 3), minor, tube).is_err(), "{minor} {tube}");
    }
    for size in [1e-300, 1e300, f64::INFINITY] {
        let huge = Knot::new(DVec3::ZERO, (2, 3), (size, 0.4 * size), 0.1 * size);
        assert!(huge.is_err() || huge.is_ok_and(|knot| !knot.jet(DVec3::ONE).value.is_nan()));
    }
    let far = trefoil().jet(DVec3::splat(1e300));
    assert!(!far.value.is_nan());
    assert!(matches!(trefoil().with_parameters(&[0.0; 5]), Err(ShapeError::Count { expected: 6, found: 5 })));
}

/// No point outside the box is within the level, and every face has one near it; except for knots, which do
/// not fill their torus.
#[test]
fn boxes_have_everything_within() {
    let centre = DVec3::new(0.1, -0.2, 0.3);
    let rounded = RoundedBox::new(centre, DVec3::new(0.6, 0.4, 0.5), 0.2).expect("a box");
    let torus = Torus::new(centre, 1.0, 0.3).expect("a torus");
    let shapes: [(&dyn Sdf<DVec3>, f64); 3] = [(&rounded, 0.1), (&torus, 0.1), (&trefoil(), 0.5)];
    for ((shape, close), level) in shapes.into_iter().flat_map(|shape| [(shape, 0.0), (shape, 0.25)]) {
        let (low, high) = shape.level_bounds(level).expect("a box");
        if level == 0.0 {
            assert_eq!(shape.bounds(), Some((low, high)));
        }
        let (mut rng, mut nearest) = (stream(6, &[]), [[f64::INFINITY; 2]; 3]);
        for _ in 0..20_000 {
            let x = low - 0.1 + (high - low + 0.2) * DVec3::from_array([(); 3].map(|()| open01(&mut rng)));
            let value = shape.jet(x).value;
            let outside = x.cmplt(low).any() || x.cmpgt(high).any();
            assert!(!outside || value > level - 1e-14, "{x}: {value}");
            for axis in 0..3 {
                if value <= level {
                    let sides = [x[axis] - low[axis], high[axis] - x[axis]];
                    (0..2).for_each(|side| nearest[axis][side] = nearest[axis][side].min(sides[side]));
                }
            }
        }
        assert!(nearest.as_flattened().iter().all(|&distance| distance < close), "{nearest:?}");
    }
}
