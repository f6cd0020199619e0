//! Cameras whose axis is beside the middle of the film, and whose pixels are not square.

use glam::DVec2;

use super::*;
use crate::scene::{Crop, Film};

/// What a part of a centred film sees, a film of its own sees with its axis elsewhere: the same samples, to rounding.
#[test]
fn an_axis_beside_the_middle_is_that_of_a_part_of_a_film() {
    for filter in filters() {
        let crop = Crop { x: 2, y: 1, width: 6, height: 5 };
        let whole = Film { width: 12, height: 8, crop: Some(crop), filter };
        let mut part = room(filter).description().clone();
        part.film = whole;
        let mut alone = part.clone();
        alone.film = Film { width: 6, height: 5, crop: None, filter };
        // The same focal length in pixels, and the axis at (6, 4) − (2, 1) = (4, 3), from the middle a pixel to the right and half a pixel down.
        let focal = 6.0 / (0.5 * part.camera.field_of_view).tan();
        alone.camera.field_of_view = 2.0 * (3.0 / focal).atan();
        alone.camera.principal_point = DVec2::new(1.0 / 6.0, 0.5 / 5.0);
        let [part, alone] = [part, alone].map(|description| Scene::new(description).unwrap());
        // What a wider field of view does to the focal length differs.
        let mut change = random_tangent(&part, 5);
        change.camera.field_of_view = 0.0;
        let close = |a: &Image, b: &Image| {
            let largest = a.pixels.iter().map(|p| p.abs().max_element()).fold(0.0, f64::max);
            let off = a
                .pixels
                .iter()
                .zip(&b.pixels)
                .map(|(a, b)| (*a - *b).abs().max_element())
                .fold(0.0, f64::max);
            assert!(off <= 1e-9 * largest, "{filter:?}: {off} of {largest}");
        };
        let area = |scene: &Scene| {
            let method = WarpedArea { samples: 8, seed: 3, ..WarpedArea::default() };
            method.forward(scene, &change, &Progress::none()).unwrap()
        };
        let [a, b] = [area(&part), area(&alone)];
        close(&a.image, &b.image);
        close(&a.gradient, &b.gradient);
        let edges = |scene: &Scene| {
            let method = EdgeSampling { samples: 8, seed: 3, ..EdgeSampling::default() };
            method.forward(scene, &change, &Progress::none()).unwrap().gradient
        };
        close(&edges(&part), &edges(&alone));
    }
}

/// A square covers as many more pixels as columns are stretched, by every method; forward, and in reverse to rounding.
#[test]
fn stretched_columns_stretch_what_changes() {
    const ASPECT: f64 = 0.8;
    let mut comparisons = Comparisons::of("stretched_columns_stretch_what_changes");
    let filter = Filter::Tent { radius: 1.0 };
    let mut description = square(filter).description().clone();
    description.camera.pixel_aspect = ASPECT;
    description.camera.principal_point = DVec2::new(0.04, -0.03);
    let scene = Scene::new(description).unwrap();
    let mut change = Tangent::still(&scene);
    change.scale(&scene, 0, DVec3::new(0.05, -0.02, -3.0), 1.0);
    let exact = ASPECT * rate_of_square();
    let none = Progress::none();
    let area = total(|seed| {
        let method = WarpedArea { samples: 16, seed, ..WarpedArea::default() };
        method.forward(&scene, &change, &none).unwrap().gradient.pixels
    });
    comparisons.add("warped area".to_owned(), area, (exact, 0.0), 1e-9 * exact, exact);
    let rays = total(|seed| {
        let field = Field::AuxiliaryRays;
        let method = WarpedArea { samples: 24, field, seed, ..WarpedArea::default() };
        method.forward(&scene, &change, &none).unwrap().gradient.pixels
    });
    comparisons.add("auxiliary rays".to_owned(), rays, (exact, 0.0), 1e-9 * exact, exact);
    let edges = total(|seed| {
        let method = EdgeSampling { samples: 8, primary: 40, seed, ..EdgeSampling::default() };
        method.forward(&scene, &change, &none).unwrap().gradient.pixels
    });
    comparisons.add("edge sampling".to_owned(), edges, (exact, 0.0), 1e-9 * exact, exact);
    comparisons.finish();
    let change = random_tangent(&scene, 7);
    let adjoint = random_adjoint((6, 6));
    let method = WarpedArea { samples: 16, seed: 2, ..WarpedArea::default() };
    let image = method.forward(&scene, &change, &none).unwrap().gradient;
    let forward: f64 = image.pixels.iter().zip(&adjoint.pixels).map(|(g, a)| g.dot(*a)).sum();
    let active = ActiveParameters::everything(&scene);
    let gradient = method.reverse(&scene, &adjoint, &active, &none).unwrap().by_parameter;
    let reverse = gradient.dot(&change);
    assert!((forward - reverse).abs() < 1e-9 * forward.abs(), "{forward} {reverse}");
}

#[test]
fn cameras_that_are_none_are_refused() {
    let refused = |change: &dyn Fn(&mut Camera)| {
        let mut description = square(Filter::Box).description().clone();
        change(&mut description.camera);
        Scene::new(description).unwrap_err().to_string()
    };
    let message = refused(&|camera| camera.principal_point.y = f64::NAN);
    assert!(message.contains("principal point"), "{message}");
    for aspect in [0.0, -1.0, f64::INFINITY, f64::NAN] {
        let message = refused(&|camera| camera.pixel_aspect = aspect);
        assert!(message.contains("pixel aspect"), "{message}");
    }
}
