use glam::DVec2;

use super::*;
use crate::random::{open01, stream};
use crate::sdf::Scalar;
use crate::sdf::distance::{Jet, Sdf};
use crate::sdf::shapes::{Circle, Grid, Interpolation, Polygon, RoundedBox, Shape, SmoothUnion};
use crate::sdf::tracer::Tracer;
use crate::warp::{Circle as Directions, assert_transposed};

fn shapes() -> Vec<Shape> {
    let circle = |x, y, r| Shape::Circle(Circle::new(DVec2::new(x, y), r).expect("a circle"));
    let turned = RoundedBox::new(DVec2::new(3.2, 0.9), DVec2::new(0.5, 0.3), 0.4, 0.1).expect("a box");
    let union = SmoothUnion::new(circle(3.0, -0.8, 0.6), Shape::Box(turned), 0.5).expect("a union");
    let triangle = [(2.5, -0.6), (3.5, 0.2), (2.6, 0.8)].map(|(x, y)| DVec2::new(x, y));
    let corners = (DVec2::new(-0.5, -3.0), DVec2::new(5.5, 3.0));
    let value = |p: DVec2| (p - DVec2::new(3.0, 0.0)).length() - 1.0;
    let grid = Grid::sampled(Interpolation::Bicubic, corners, 40, value).expect("a grid");
    vec![
        circle(3.0, 0.2, 1.0),
        Shape::Union(Box::new(union)),
        Shape::Polygon(Polygon::new(triangle.to_vec()).expect("simple")),
        Shape::Grid(grid),
    ]
}

fn view(sdf: &Shape) -> View<'_, DVec2> {
    let tracer = Tracer { far: 5.0, step_scale: 0.9, ..Tracer::default() };
    View { sdf, eye: DVec2::ZERO, start: 0.0, tracer }
}

fn direction(shape: &Shape) -> Vec<f64> {
    let mut rng = stream(9, &[]);
    (0..shape.parameter_count()).map(|_| open01(&mut rng) - 0.3).collect()
}

fn deterministic() -> Vec<(&'static str, Box<dyn TracedField<Directions>>)> {
    vec![
        ("direct", Box::new(DirectField)),
        ("Bangaru", Box::new(BangaruField::default())),
        ("Bangaru, k = 6", Box::new(BangaruField { keep: Some(6), ..BangaruField::default() })),
        ("Vicini", Box::new(ViciniField { reach: Some(0.5), epsilon: 1e-3, ..ViciniField::default() })),
        ("Vicini, m = 1", Box::new(ViciniField { reach: None, ..ViciniField::default() })),
    ]
}

/// Angles away from silhouettes, where finite differences resolve the fields.
const ANGLES: [f64; 6] = [-0.52, -0.21, -0.04, 0.07, 0.23, 0.61];

#[test]
fn the_divergence_is_that_of_the_field() {
    let h = 1e-6;
    for (which, shape) in shapes().iter().enumerate() {
        let (view, theta) = (view(shape), direction(shape));
        for (name, field) in deterministic() {
            let at = |angle: f64| {
                let form = field.form(&view, DVec2::from_angle(angle), &mut stream(1, &[]));
                form.field(|x| shape.rate(*x, &theta))
            };
            for angle in ANGLES {
                let found = at(angle);
                let tangent = DVec2::from_angle(angle).perp();
                assert!(found.value.perp_dot(tangent).abs() < 1e-12);
                let (plus, minus) = (at(angle + h).value, at(angle - h).value);
                let expected = (plus - minus).dot(tangent) / (2.0 * h);
                let tolerance = 1e-4 * (1.0 + expected.abs());
                let label = format!("shape {which}, {name} at {angle}");
                assert!((found.divergence - expected).abs() < tolerance, "{label}: {found:?} {expected}");
            }
        }
    }
}

#[test]
fn scatter_is_the_transpose_of_field() {
    let mut fields = deterministic();
    let distance = SilhouetteDistance::default();
    let auxiliary = AuxiliaryField { warp: crate::warp::Warp::default(), kappa: 100.0, distance };
    fields.push(("auxiliary", Box::new(auxiliary)));
    for (which, shape) in shapes().iter().enumerate() {
        let (view, theta) = (view(shape), direction(shape));
        for (name, field) in &fields {
            for (seed, angle) in ANGLES.into_iter().enumerate() {
                let form = field.form(&view, DVec2::from_angle(angle), &mut stream(seed as u64, &[]));
                let (a, b) = (DVec2::new(0.4, -1.1), 0.7);
                assert_transposed(&form, (a, b), |x| shape.rate(*x, &theta), Jet::dot);
                let v = form.field(|x| shape.rate(*x, &theta));
                let forward = a.dot(v.value) + b * v.divergence;
                let (mut gradient, mut size) = (vec![0.0; theta.len()], 1.0);
                form.scatter(a, b, |x, covector: Jet<DVec2>| {
                    shape.add_parameter_gradient(*x, covector, &mut gradient);
                    size += covector.dot(shape.rate(*x, &theta)).abs();
                });
                let reverse: f64 = gradient.iter().zip(&theta).map(|(g, d)| g * d).sum();
                let label = format!("shape {which}, {name}");
                assert!((forward - reverse).abs() < 1e-12 * size, "{label}: {forward} {reverse}");
            }
        }
    }
}

#[test]
fn weights_add_up_to_one_and_vanish_at_rank_k() {
    let shape = &shapes()[1];
    let view = view(shape);
    let trace = view.trace(DVec2::from_angle(0.1));
    let field = BangaruField { keep: Some(5), ..BangaruField::default() };
    let weights = field.weights::<Directions>(&view, &trace);
    assert_eq!(weights.len() + 1, trace.points.len());
    assert!((weights.iter().sum::<f64>() - 1.0).abs() < 1e-12);
    assert_eq!(weights.iter().filter(|w| **w > 0.0).count(), 4);
}

/// Weights in angles equal the mean's weights times t^(γ − 1), and their gradients agree with differences.
#[test]
fn kernels_are_weights_in_angles() {
    let h = 1e-6;
    for shape in [&shapes()[0], &shapes()[1], &shapes()[3]] {
        for (start, departure) in [(0.0, 0.0), (0.3, 0.4)] {
            let view = View { start, ..view(shape) };
            for keep in [None, Some(5)] {
                let field = BangaruField { keep, departure, ..BangaruField::default() };
                let at = |angle: f64| {
                    let trace = view.trace(DVec2::from_angle(angle));
                    (field.kernels::<Directions>(&view, &trace), trace)
                };
                for angle in ANGLES {
                    let (found, trace) = at(angle);
                    assert_eq!(found.len() + 1, trace.points.len());
                    if keep.is_none() {
                        let weights = field.weights::<Directions>(&view, &trace);
                        let ratios = found.iter().zip(&trace.points[1..]).zip(&weights);
                        let ratios: Vec<f64> =
                            ratios.map(|((k, p), w)| k.kernel.value / (w * p.t * p.t)).collect();
                        assert!(ratios.iter().all(|r| (r / ratios[0] - 1.0).abs() < 1e-9), "{ratios:?}");
                    }
                    let tangent = DVec2::from_angle(angle).perp();
                    let (plus, minus) = (at(angle + h).0, at(angle - h).0);
                    for (i, (PointKernel { kernel: k, there }, point)) in
                        found.iter().zip(&trace.points[1..]).enumerate()
                    {
                        assert_eq!(*there, shape.second_order(point.position));
                        let expected = (plus[i].kernel.value - minus[i].kernel.value) / (2.0 * h);
                        let slope = k.gradient.dot(tangent);
                        let tolerance = 1e-4 * (1.0 + k.value + expected.abs());
                        assert!((slope - expected).abs() < tolerance, "{angle} {i}: {slope} {expected}");
                    }
                }
            }
        }
    }
}

#[test]
fn bad_parameters_are_refused() {
    let good = BangaruField::default();
    let check = |field: &dyn TracedField<Directions>| field.check();
    assert_eq!(check(&good), Ok(()));
    assert!(check(&BangaruField { gamma: 0.0, ..good }).is_err());
    assert!(check(&BangaruField { lambda: f64::NAN, ..good }).is_err());
    assert!(check(&BangaruField { keep: Some(1), ..good }).is_err());
    assert!(check(&BangaruField { departure: -1.0, ..good }).is_err());
    assert!(check(&ViciniField { epsilon: -1.0, ..ViciniField::default() }).is_err());
    assert!(check(&ViciniField { reach: Some(0.0), ..ViciniField::default() }).is_err());
    let warp = crate::warp::Warp::default();
    let distance = SilhouetteDistance::Grazing;
    assert!(check(&AuxiliaryField { warp, kappa: -1.0, distance }).is_err());
    // Invalid settings and motions are refused.
    let shape = &shapes()[0];
    let moving = |field: &dyn TracedField<Directions>, direction: &[f64]| {
        MovingField::<Directions, _>::new(view(shape), field, direction).map(|_| ())
    };
    let three = [1.0; 3];
    assert_eq!(moving(&good, &three), Ok(()));
    assert!(moving(&BangaruField { gamma: f64::NAN, ..good }, &three).is_err());
    assert!(moving(&BangaruField { keep: Some(0), ..good }, &three).is_err());
    assert!(moving(&ViciniField { reach: Some(-1.0), ..ViciniField::default() }, &three).is_err());
    let none = crate::warp::Warp { debias: crate::warp::Debias::Consistent { rays: 0 }, ..warp };
    assert!(moving(&AuxiliaryField { warp: none, kappa: 100.0, distance }, &three).is_err());
    assert_eq!(moving(&good, &three[..2]), Err(FieldError::Direction { expected: 3, found: 2 }));
}

/// Weights that are not finite must not pass as zero.
#[test]
fn weights_that_are_not_finite_are_seen() {
    let nothing = Scalar::constant(0.0);
    let normalised = |values: &[f64]| {
        let mut weights: Vec<Scalar<DVec2>> =
            values.iter().map(|&value| Scalar { value, ..nothing }).collect();
        mean::normalise(&mut weights);
        weights.iter().map(|w| w.value).collect::<Vec<_>>()
    };
    assert_eq!(normalised(&[1.0, 3.0]), [0.25, 0.75]);
    assert!(normalised(&[0.0, 0.0]).is_empty());
    for bad in [f64::NAN, f64::INFINITY] {
        assert!(normalised(&[1.0, bad]).iter().all(|w| w.is_nan()));
    }
}

#[test]
fn rays_of_the_field_that_run_out_of_steps_are_counted() {
    let shape = &shapes()[0];
    let short = View { tracer: Tracer { max_steps: 2, ..Tracer::default() }, ..view(shape) };
    let debias = crate::warp::Debias::Consistent { rays: 8 };
    let warp = crate::warp::Warp { debias, ..crate::warp::Warp::default() };
    let auxiliary = AuxiliaryField { warp, kappa: 100.0, distance: SilhouetteDistance::default() };
    let mut fields = deterministic();
    fields.push(("auxiliary", Box::new(auxiliary)));
    for (name, field) in fields {
        let rays = field.form(&short, DVec2::from_angle(0.07), &mut stream(1, &[])).rays();
        assert_eq!(rays.out_of_steps, rays.traced, "{name}");
        assert_eq!(rays.traced > 1, name == "auxiliary", "{name}");
    }
}
