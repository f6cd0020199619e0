use std::f64::consts::FRAC_PI_4;

use glam::DVec2;

use super::*;
use crate::plane::Filter;
use crate::sdf::shapes::{Circle, Parametric as _, Polygon, RoundedBox, Shape, SmoothUnion};
use crate::sdf::{Shading, Tracer};

fn shading() -> Shading {
    Shading { base: 1.0, position: DVec2::new(0.1, -0.2), normal: DVec2::new(-0.4, 0.3) }
}

fn circle(x: f64, y: f64, r: f64) -> Shape {
    Shape::Circle(Circle::new(DVec2::new(x, y), r).expect("a circle"))
}

fn union(a: Shape, b: Shape) -> Shape {
    Shape::Union(Box::new(SmoothUnion::new(a, b, 0.05).expect("a union")))
}

/// A disc in front of a quadrilateral in front of a box, each of which occludes part of the next.
fn crowd() -> Shape {
    let corners = [(2.6, -0.5), (3.6, -0.2), (3.3, 0.9), (2.9, 0.2)].map(|(x, y)| DVec2::new(x, y));
    let bent = Shape::Polygon(Polygon::new(corners.to_vec()).expect("simple"));
    let far = RoundedBox::new(DVec2::new(5.0, 0.6), DVec2::new(0.6, 1.2), 0.3, 0.0).expect("a box");
    union(union(circle(2.0, -0.5, 0.4), bent), Shape::Box(far))
}

fn scene(shape: Shape) -> Scene {
    Scene::new(shape, DVec2::ZERO, Tracer::default(), shading(), 0.3).expect("a scene")
}

fn films() -> [AngularFilm; 3] {
    [Filter::Box, Filter::Tent, Filter::Gaussian]
        .map(|filter| AngularFilm::new(-FRAC_PI_4, FRAC_PI_4, 7, filter).expect("a film"))
}

#[test]
fn radiance_is_what_the_tracer_sees() {
    let scene = scene(crowd());
    let (exact, view) = (Exact::new(&scene).expect("closed"), scene.view());
    for i in 0..2000 {
        let angle = -0.8 + 1.6 * (f64::from(i) + 0.5) / 2000.0;
        let traced = scene.radiance(&view.trace(DVec2::from_angle(angle)));
        assert!((exact.radiance(angle) - traced).abs() < 1e-6, "{angle}");
    }
}

/// Central differences of the exact image: h = 1e-4 leaves about 1e-8 of truncation and 1e-10 of
/// rounding at second derivatives of unit scale.
#[test]
fn derivatives_are_those_of_the_image() {
    for shape in [circle(3.0, 0.2, 1.0), crowd()] {
        let scene = scene(shape);
        let exact = Exact::new(&scene).expect("closed");
        let theta = scene.shape().parameters();
        for (parameter, &value) in theta.iter().enumerate() {
            let image = |h: f64, film: &AngularFilm| {
                let mut moved = theta.clone();
                moved[parameter] = value + h;
                let Ok(shape) = scene.shape().with_parameters(&moved) else { unreachable!("still a shape") };
                let moved = self::scene(shape);
                Exact::new(&moved).expect("closed").image(film)
            };
            // A rounding radius of 0 has no central difference, as it cannot be negative; a positive one has
            // no closed form.
            if matches!(scene.shape(), Shape::Union(_)) && parameter + 2 == theta.len() {
                continue;
            }
            let h = 1e-4;
            let mut direction = vec![0.0; theta.len()];
            direction[parameter] = 1.0;
            for film in &films() {
                let found = exact.derivative(film, &direction).expect("fits");
                let (plus, minus) = (image(h, film), image(-h, film));
                for (pixel, [interior, boundary]) in found.into_iter().enumerate() {
                    let expected = (plus[pixel] - minus[pixel]) / (2.0 * h);
                    let difference = (interior + boundary - expected).abs();
                    let label = format!("parameter {parameter}, pixel {pixel}, {:?}", film.filter());
                    assert!(difference < 1e-6, "{label}: {interior} + {boundary} for {expected}");
                }
            }
        }
    }
}

#[test]
fn the_harmonic_field_meets_every_silhouette() {
    let scene = scene(crowd());
    let exact = Exact::new(&scene).expect("closed");
    let direction: Vec<f64> = (0..scene.shape().parameter_count()).map(|i| (i as f64).sin()).collect();
    let field = HarmonicField::new(&exact, &direction).expect("fits");
    let silhouettes = exact.silhouettes(&direction).expect("fits");
    assert!(silhouettes.len() > 4);
    for s in silhouettes {
        assert!((field.rate(s.angle)[0] - s.rate).abs() < 1e-12);
        assert!((field.rate(s.angle + 1e-9)[0] - s.rate).abs() < 1e-6);
        assert!((field.rate(s.angle - 1e-9)[0] - s.rate).abs() < 1e-6);
    }
}

#[test]
fn what_has_no_closed_form_is_refused() {
    let close = scene(union(circle(3.0, 0.0, 0.5), circle(3.0, 1.02, 0.5)));
    assert!(matches!(Exact::new(&close), Err(ExactError::Blended { first: 0, second: 1, .. })));
    let round = RoundedBox::new(DVec2::new(3.0, 0.0), DVec2::ONE, 0.0, 0.1).expect("a box");
    let round = scene(Shape::Box(round));
    assert_eq!(Exact::new(&round).err(), Some(ExactError::NoClosedForm { shape: "rounded box" }));
    // A plus sign: no vertex of either bar is near the other.
    let bar = |half| Shape::Box(RoundedBox::new(DVec2::new(4.0, 0.0), half, 0.0, 0.0).expect("a box"));
    let plus = scene(union(bar(DVec2::new(1.0, 0.2)), bar(DVec2::new(0.2, 1.0))));
    assert!(matches!(Exact::new(&plus), Err(ExactError::Blended { first: 0, second: 1, gap: 0.0, .. })));
    let simple = scene(circle(3.0, 0.0, 1.0));
    let exact = Exact::new(&simple).expect("closed");
    assert!(exact.derivative(&films()[0], &[1.0]).is_err());
    assert!(matches!(
        Scene::new(circle(0.0, 0.0, 1.0), DVec2::ZERO, Tracer::default(), shading(), 0.0),
        Err(crate::sdf::SceneError::EyeInside { .. })
    ));
}
