use glam::{DVec2, DVec3};

use super::*;
use crate::random::{Stream, open01, stream};

fn every_shape() -> Vec<(&'static str, Shape)> {
    let circle = |x, y, r| Shape::Circle(Circle::new(DVec2::new(x, y), r).expect("a circle"));
    let turned = RoundedBox::new(DVec2::new(0.2, -0.1), DVec2::new(0.7, 0.3), 0.4, 0.1).expect("a box");
    let bent = [(0.0, -0.8), (0.9, 0.7), (0.1, 0.1), (-0.8, 0.6)].map(|(x, y)| DVec2::new(x, y));
    let clockwise: Vec<DVec2> = bent.iter().rev().copied().collect();
    let union = SmoothUnion::new(circle(-0.5, 0.0, 0.3), Shape::Box(turned.clone()), 0.4).expect("a union");
    let corners = (DVec2::splat(-1.5), DVec2::splat(1.5));
    let grid = |interpolation| {
        let value = |p: DVec2| (p - 0.1).length() - 0.6 + 0.05 * (3.0 * p.x).sin();
        Shape::Grid(Grid::sampled(interpolation, corners, 9, value).expect("a grid"))
    };
    vec![
        ("circle", circle(0.1, 0.2, 0.5)),
        ("box", Shape::Box(turned)),
        ("polygon", Shape::Polygon(Polygon::new(bent.to_vec()).expect("simple"))),
        ("clockwise polygon", Shape::Polygon(Polygon::new(clockwise).expect("simple"))),
        ("union", Shape::Union(Box::new(union))),
        ("bilinear grid", grid(Interpolation::Bilinear)),
        ("bicubic grid", grid(Interpolation::Bicubic)),
    ]
}

fn random_vector(rng: &mut Stream) -> DVec2 {
    DVec2::new(open01(rng), open01(rng)) * 2.4 - 1.2
}

/// Whether φ is smooth within reach of a finite difference: second differences agree with ∇²φ.
fn is_smooth(shape: &Shape, x: DVec2, h: f64) -> bool {
    let middle = shape.jet(x);
    [DVec2::X, DVec2::Y].iter().all(|&e| {
        let (plus, minus) = (shape.jet(x + h * e).gradient, shape.jet(x - h * e).gradient);
        (plus - middle.gradient).length() < 1e3 * h && (middle.gradient - minus).length() < 1e3 * h
    })
}

/// Central differences of everything, at random points; h = 1e-5 leaves truncation and rounding near
/// 1e-10 for functions of unit scale, 1e-8 next to corners, where third derivatives reach 1/ρ³.
#[test]
fn derivatives_are_those_of_the_value() {
    let h = 1e-5;
    for (name, shape) in every_shape() {
        let (mut rng, mut checked) = (stream(3, &[]), 0);
        let theta = shape.parameters();
        assert_eq!(shape.with_parameters(&theta).as_ref(), Ok(&shape), "{name}");
        for _ in 0..300 {
            let (x, v) = (random_vector(&mut rng), random_vector(&mut rng));
            let direction: Vec<f64> = theta.iter().map(|_| open01(&mut rng) - 0.5).collect();
            if !is_smooth(&shape, x, 3.0 * h) {
                continue;
            }
            checked += 1;
            let difference = |f: &dyn Fn(f64) -> f64| (f(h) - f(-h)) / (2.0 * h);
            let moved = |h: f64| {
                let moved: Vec<f64> = theta.iter().zip(&direction).map(|(p, d)| p + h * d).collect();
                shape.with_parameters(&moved).expect("still a shape")
            };
            let (jet, rate) = (shape.jet(x), shape.rate(x, &direction));
            let hessian = shape.second_order(x).hessian * v;
            assert_eq!(shape.second_order(x).jet, jet, "{name} at {x}");
            let pairs = [
                ("∇φ·v", jet.gradient.dot(v), difference(&|h| shape.jet(x + h * v).value)),
                ("v·Hv", hessian.dot(v), difference(&|h| shape.jet(x + h * v).gradient.dot(v))),
                ("Hv.x", hessian.x, difference(&|h| shape.jet(x + h * v).gradient.x)),
                ("∂θφ", rate.value, difference(&|h| moved(h).jet(x).value)),
                ("∇∂θφ·v", rate.gradient.dot(v), difference(&|h| moved(h).jet(x).gradient.dot(v))),
            ];
            for (what, found, expected) in pairs {
                let tolerance = 1e-6 * (1.0 + expected.abs());
                assert!((found - expected).abs() < tolerance, "{name} at {x}: {what} {found} for {expected}");
            }
        }
        assert!(checked > 200, "{name}: only {checked} smooth points");
    }
}

/// Derivatives of balls and their unions in space, and of their parallax as the eye moves.
#[test]
fn balls_in_space_have_the_derivatives_of_their_values() {
    let vector = |rng: &mut Stream| DVec3::from_array([(); 3].map(|()| 2.4 * open01(rng) - 1.2));
    let ball = |x, r| Ball::new(DVec3::new(x, 0.2, -0.1), r).expect("a ball");
    let shape = SmoothUnion::new(ball(-0.4, 0.3), ball(0.5, 0.4), 0.7).expect("a union");
    let theta = shape.parameters();
    assert_eq!(theta.len(), Sdf::<DVec3>::parameter_count(&shape));
    let (mut rng, h) = (stream(6, &[]), 1e-5);
    for _ in 0..200 {
        let (x, v) = (vector(&mut rng), vector(&mut rng));
        let direction: Vec<f64> = theta.iter().map(|_| open01(&mut rng) - 0.5).collect();
        let moved = |h: f64| {
            let moved: Vec<f64> = theta.iter().zip(&direction).map(|(p, d)| p + h * d).collect();
            Parametric::<DVec3>::with_parameters(&shape, &moved).expect("still a shape")
        };
        let SecondOrder { jet, hessian } = shape.second_order(x);
        let second = SecondOrder { jet, hessian };
        let (rate, advected) = (shape.rate(x, &direction), second.advected(v));
        let difference = |f: &dyn Fn(f64) -> f64| (f(h) - f(-h)) / (2.0 * h);
        let pairs = [
            (jet.value, shape.jet(x).value),
            (jet.gradient.dot(v), difference(&|h| shape.jet(x + h * v).value)),
            ((hessian * v).y, difference(&|h| shape.jet(x + h * v).gradient.y)),
            (DVec3::trace(hessian), DVec3::AXES.map(|e| e.dot(hessian * e)).iter().sum()),
            (rate.value, difference(&|h| moved(h).jet(x).value)),
            (rate.gradient.z, difference(&|h| moved(h).jet(x).gradient.z)),
            (advected.value, difference(&|h| shape.jet(x + h * v).value)),
            (advected.gradient.x, difference(&|h| shape.jet(x + h * v).gradient.x)),
        ];
        for (index, (found, expected)) in pairs.into_iter().enumerate() {
            // Third derivatives reach 1/ρ², and are discontinuous where blending begins.
            assert!(
                (found - expected).abs() < 1e-4 * (1.0 + expected.abs()),
                "{index} at {x}: {found} {expected}"
            );
        }
        let covector = Jet { value: open01(&mut rng), gradient: vector(&mut rng) };
        let back = second.advected_transpose(covector).dot(v);
        assert!((back - covector.dot(advected)).abs() < 1e-13 * (1.0 + back.abs()));
        let mut gradient = vec![0.0; theta.len()];
        shape.add_parameter_gradient(x, covector, &mut gradient);
        let back: f64 = gradient.iter().zip(&direction).map(|(g, d)| g * d).sum();
        assert!((back - covector.dot(rate)).abs() < 1e-13 * (1.0 + back.abs()));
    }
    assert!(matches!(Ball::new(DVec3::NAN, 1.0), Err(ShapeError::Parameter { shape: "ball", .. })));
}

#[test]
fn the_parameter_gradient_is_the_transpose_of_the_rate() {
    for (name, shape) in every_shape() {
        let mut rng = stream(4, &[]);
        for _ in 0..200 {
            let x = random_vector(&mut rng);
            let covector = Jet { value: open01(&mut rng) - 0.5, gradient: random_vector(&mut rng) };
            let direction: Vec<f64> = (0..shape.parameter_count()).map(|_| open01(&mut rng) - 0.5).collect();
            let mut gradient = vec![0.0; direction.len()];
            shape.add_parameter_gradient(x, covector, &mut gradient);
            let reverse: f64 = gradient.iter().zip(&direction).map(|(g, d)| g * d).sum();
            let forward = covector.dot(shape.rate(x, &direction));
            let size: f64 = 1.0 + gradient.iter().map(|g| g.abs()).sum::<f64>();
            assert!((forward - reverse).abs() < 1e-14 * size, "{name}: {forward} {reverse}");
        }
    }
}

#[test]
fn distances_never_overtake_the_surface() {
    for (name, shape) in every_shape() {
        let mut rng = stream(5, &[]);
        for _ in 0..2000 {
            let (x, y) = (random_vector(&mut rng), random_vector(&mut rng));
            let bound = (x - y).length() * if name.contains("grid") { 1.2 } else { 1.0 + 1e-12 };
            assert!((shape.jet(x).value - shape.jet(y).value).abs() <= bound, "{name} {x} {y}");
        }
    }
}

#[test]
fn a_polygon_knows_its_inside_at_convex_and_reflex_corners() {
    for (name, shape) in every_shape().into_iter().filter(|(name, _)| name.contains("polygon")) {
        let value = |x, y| shape.jet(DVec2::new(x, y)).value;
        assert!((value(0.0, -1.0) - 0.2).abs() < 1e-15, "{name}");
        // Above the reflex corner is outside, right below it inside.
        assert!(value(0.1, 0.25) > 0.0 && value(0.1, 0.05) < 0.0, "{name}");
        assert_eq!(value(0.1, 0.1), 0.0, "{name}");
    }
}

/// A square with one more vertex at or near the middle of its lower side.
#[test]
fn a_straight_corner_is_a_point_of_its_edge() {
    for off in [0.0, 1e-17, -1e-17, 1e-12, -1e-12] {
        let corners = [(0.0, 0.0), (0.5, off), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)];
        let corners = corners.map(|(x, y)| DVec2::new(x, y));
        let square = Polygon::new(corners.to_vec()).expect("simple");
        for (y, expected) in [(0.3, -0.3), (-0.3, 0.3)] {
            for x in [0.5, 0.5 + 1e-15, 0.5 - 1e-13, 0.4] {
                let jet = square.jet(DVec2::new(x, y));
                assert!((jet.value - expected).abs() < 1e-11, "{off} {x} {y}: {}", jet.value);
                assert!((jet.gradient + DVec2::Y).length() < 1e-11, "{off} {x} {y}: {}", jet.gradient);
            }
        }
        if off == 0.0 {
            assert_eq!(square.second_order(DVec2::new(0.5, 0.3)).hessian, glam::DMat2::ZERO);
        }
    }
}

#[test]
fn bad_shapes_are_refused() {
    let huge = [(0.0, 0.0), (1e200, 0.0), (0.0, 1e200)].map(|(x, y)| DVec2::new(x, y));
    let vertex = |scale: f64| Polygon::new(huge.map(|v| v * scale).to_vec());
    assert!(matches!(vertex(1.0), Err(ShapeError::Parameter { parameter: "vertex.x", .. })));
    let large = vertex(1e-50).expect("within the range");
    assert!((large.jet(DVec2::new(-1e149, 1e149)).value - 1e149).abs() < 1e135);
    // The area of a triangle 10⁻²⁰⁰ long underflows.
    let tiny = huge.map(|v| v * 1e-200 * 1e-200);
    assert!(matches!(Polygon::new(tiny.to_vec()), Err(ShapeError::NotSimple { .. })));
    let nowhere = RoundedBox::new(DVec2::new(0.0, f64::NAN), DVec2::ONE, 0.0, 0.0);
    assert!(matches!(nowhere, Err(ShapeError::Parameter { shape: "box", parameter: "centre.y", .. })));
    assert!(matches!(Circle::new(DVec2::ZERO, 0.0), Err(ShapeError::Parameter { parameter: "radius", .. })));
    assert!(Circle::new(DVec2::new(f64::NAN, 0.0), 1.0).is_err());
    assert!(RoundedBox::new(DVec2::ZERO, DVec2::ONE, f64::INFINITY, 0.0).is_err());
    assert!(RoundedBox::new(DVec2::ZERO, DVec2::ONE, 0.0, -1.0).is_err());
    let bow = [(0.0, 0.0), (1.0, 1.0), (1.0, 0.0), (0.0, 1.0)].map(|(x, y)| DVec2::new(x, y));
    assert_eq!(Polygon::new(bow.to_vec()), Err(ShapeError::NotSimple { first: 0, second: 2 }));
    assert_eq!(Polygon::new(bow[..2].to_vec()), Err(ShapeError::Vertices { count: 2 }));
    let nodes = |count| Grid::new(Interpolation::Bicubic, DVec2::ZERO, 1.0, (2, 3), vec![0.0; count]);
    assert!(nodes(6).is_ok());
    assert!(matches!(nodes(5), Err(ShapeError::Nodes { found: 5, .. })));
    let circle = Shape::Circle(Circle::new(DVec2::ZERO, 1.0).expect("a circle"));
    assert_eq!(circle.with_parameters(&[1.0]), Err(ShapeError::Count { expected: 3, found: 1 }));
    assert!(SmoothUnion::new(circle.clone(), circle, f64::NAN).is_err());
}
