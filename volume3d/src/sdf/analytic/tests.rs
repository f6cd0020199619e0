use flatland::random::{Stream, open01, stream};
use flatland::sdf::{Jet, Sdf, SecondOrder};
use glam::DVec3;

use super::*;

fn vector(rng: &mut Stream) -> DVec3 {
    DVec3::from_array([(); 3].map(|()| 4.0 * open01(rng) - 2.0))
}

/// Every derivative against central differences, and every transpose.
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
        assert!((jet.gradient.length() - 1.0).abs() < 1e-12, "{name} is a distance");
        let mut gradient = vec![0.0; theta.len()];
        shape.add_parameter_gradient(x, covector, &mut gradient);
        let reverse: f64 = gradient.iter().zip(&direction).map(|(g, d)| g * d).sum();
        assert!(
            (reverse - covector.dot(rate)).abs() < 1e-13 * (1.0 + reverse.abs() + rate.gradient.length())
        );
        // Second derivatives jump between faces and edges, and on medial axes: not where differences straddle that.
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
    check_derivatives("rounded box", &rounded);
    check_derivatives("torus", &Torus::new(centre, 1.0, 0.3).expect("a torus"));
    check_derivatives("ball", &Ball::new(centre, 0.7).expect("a ball"));
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
