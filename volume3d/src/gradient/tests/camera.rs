//! Tests of cameras with an off-centre principal point, with non-square pixels, and with orthographic
//! projection.

use glam::{DQuat, DVec2};

use super::*;
use crate::optimize::Parameters;
use crate::scene::{Crop, Film, SceneError};

/// A crop of a centred film has the same samples, to rounding, as a film of its own with a shifted principal
/// point.
#[test]
fn an_axis_beside_the_middle_is_that_of_a_part_of_a_film() {
    for filter in filters() {
        let crop = Crop { x: 2, y: 1, width: 6, height: 5 };
        let whole = Film { width: 12, height: 8, crop: Some(crop), sample_border: true, filter };
        let mut part = room(filter).description().clone();
        part.film = whole;
        let mut alone = part.clone();
        alone.film = Film { width: 6, height: 5, crop: None, sample_border: true, filter };
        // The same focal length in pixels, and the axis at (6, 4) − (2, 1) = (4, 3), from the middle a pixel
        // to the right and half a pixel down.
        let focal = 6.0 / (0.5 * part.camera.field_of_view).tan();
        alone.camera.field_of_view = 2.0 * (3.0 / focal).atan();
        alone.camera.principal_point = DVec2::new(1.0 / 6.0, 0.5 / 5.0);
        let [part, alone] = [part, alone].map(|description| Scene::new(description).unwrap());
        // The two focal lengths differ in their derivative by the field of view.
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

/// A square covers more pixels in proportion to the stretching of columns, by every method; in forward mode,
/// and in reverse to rounding.
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

/// Rotation of the square of [`before_sensor`], in radians.
const TURNED: f64 = 0.5;

/// A square rotated about a vertical axis, off the axis of an orthographic sensor of width 4.
fn before_sensor() -> Scene {
    let distance = 2e4;
    let origin = DVec3::new(0.0, 0.0, distance);
    let camera = Camera::look_at(origin, DVec3::ZERO, DVec3::Y, 2.0 * 1e-4_f64.atan());
    let mut d = Description::new(
        Camera { orthographic: Some(distance), ..camera },
        film(6, Filter::Tent { radius: 1.0 }),
    );
    let place = at(0.2, -0.1, -3.0, 0.7) * DAffine3::from_rotation_y(TURNED);
    d.add_emitter("square", Mesh::rectangle().transformed(&place), DVec3::splat(2.0));
    Scene::new(d).unwrap()
}

/// As an orthographic sensor rotates, a visible point moves at a speed proportional to its distance from the
/// sensor, and widths scale with cos(turn − angle).
#[test]
fn orthographic_sensors_turn_about_themselves() {
    let scene = before_sensor();
    assert!(scene.description().camera.pivot().length() < 1e-9);
    let mut change = Tangent::still(&scene);
    change.camera.rotation = DVec3::Y;
    // Columns are weighted by their distance from the middle: with these weights the sum of the filter h over
    // pixels is the film coordinate. With 1.5 pixels per unit of length and three channels the sum is
    // area · cos(TURNED − θ) (0.2 cos θ + 3 sin θ) 1.5.
    let weighted = |image: Image| -> Vec<DVec3> {
        image.pixels.iter().enumerate().map(|(i, g)| *g * ((i % 6) as f64 - 2.5)).collect()
    };
    let area = 3.0 * 2.0 * (1.4_f64 * 1.5).powi(2);
    let exact = area * 1.5 * (0.2 * TURNED.sin() + 3.0 * TURNED.cos());
    // The distant perspective camera that represents the sensor shows objects smaller by 3/20,000.
    let slack = 2e-3 * exact;
    let none = Progress::none();
    let mut comparisons = Comparisons::of("orthographic_sensors_turn_about_themselves");
    for (name, field, samples) in [
        ("the mean over jumps", Field::default(), 16),
        ("softened", Field::softened(16), 16),
        ("auxiliary rays", Field::AuxiliaryRays, 32),
    ] {
        let found = total(|seed| {
            let method = WarpedArea { samples, field, seed, ..WarpedArea::default() };
            weighted(method.forward(&scene, &change, &none).unwrap().gradient)
        });
        comparisons.add(name.to_owned(), found, (exact, 0.0), slack, exact);
    }
    let edges = |change: &Tangent| {
        total(|seed| {
            let method = EdgeSampling { samples: 8, primary: 40, seed, ..EdgeSampling::default() };
            weighted(method.forward(&scene, change, &none).unwrap().gradient)
        })
    };
    comparisons.add("edge sampling".to_owned(), edges(&change), (exact, 0.0), slack, exact);
    let differences = total(|seed| {
        let method = FiniteDifference { samples: 64, step: 0.03, seed };
        weighted(method.forward(&scene, &change, &none).unwrap().gradient)
    });
    comparisons.add("finite differences".to_owned(), differences, (exact, 0.0), slack, exact);
    // A rotation about that camera's eye moves the whole image out of view.
    let mut other = change.clone();
    other.camera.translation = DVec3::Y.cross(2e4 * DVec3::Z);
    comparisons.reject("about a distant eye", edges(&other), (exact, 0.0));
    comparisons.finish();
    let mut change = random_tangent(&scene, 7);
    change.camera.field_of_view = 0.0;
    let adjoint = random_adjoint((6, 6));
    for field in [Field::default(), Field::softened(16), Field::AuxiliaryRays] {
        let method = WarpedArea { samples: 16, seed: 2, field, ..WarpedArea::default() };
        let image = method.forward(&scene, &change, &none).unwrap().gradient;
        let forward: f64 = image.pixels.iter().zip(&adjoint.pixels).map(|(g, a)| g.dot(*a)).sum();
        let active = ActiveParameters::everything(&scene);
        let gradient = method.reverse(&scene, &adjoint, &active, &none).unwrap().by_parameter;
        let reverse = gradient.dot(&change);
        // Rotations about an arm 10⁴ times as long as the scene cancel.
        assert!((forward - reverse).abs() < 1e-6 * forward.abs(), "{field:?}: {forward} {reverse}");
        assert_eq!(gradient.camera.field_of_view, 0.0);
    }
}

/// Application, displacement and differentiation of a pose are the same motion; an orthographic sensor has no
/// field-of-view parameter.
#[test]
fn poses_of_orthographic_sensors_are_about_the_sensor() {
    let mut scene = before_sensor();
    let parameters = Parameters::new(&scene, &["camera.translation", "camera.rotation"]).unwrap();
    let x = [0.1, -0.2, 0.3, 0.4, -0.1, 0.2];
    let turn = DQuat::from_scaled_axis(DVec3::new(0.4, -0.1, 0.2));
    parameters.apply(&x, &mut scene).unwrap();
    let camera = &scene.description().camera;
    assert!(camera.pivot().distance(DVec3::new(0.1, -0.2, 0.3)) < 1e-9);
    assert!(camera.forward.distance(turn * DVec3::NEG_Z) < 1e-12);
    let mut change = Tangent::still(&scene);
    change.camera.rotation = DVec3::new(-0.3, 0.2, 0.5);
    let displaced = change.displaced(&scene, 0.7).unwrap().description().camera.clone();
    assert!(displaced.pivot().distance(camera.pivot()) < 1e-9);
    let further = DQuat::from_scaled_axis(0.7 * change.camera.rotation);
    assert!(displaced.forward.distance(further * camera.forward) < 1e-12);

    let named = Parameters::new(&scene, &["camera.fov"]).unwrap_err().to_string();
    assert!(named.contains("is an orthographic camera"), "{named}");
    let mut wider = Tangent::still(&scene);
    wider.camera.field_of_view = 1.0;
    let none = Progress::none();
    let refused = GradientError::Unsupported(Unsupported::FieldOfView);
    assert_eq!(WarpedArea::default().forward(&scene, &wider, &none).unwrap_err(), refused);
    assert_eq!(EdgeSampling::default().forward(&scene, &wider, &none).unwrap_err(), refused);
    assert_eq!(Rotation::default().forward(&scene, &wider, &none).unwrap_err(), refused);
    assert_eq!(FiniteDifference::default().forward(&scene, &wider, &none).unwrap_err(), refused);
    assert_eq!(wider.displaced(&scene, 0.1).unwrap_err(), SceneError::FieldOfView);
}

/// A scene in a mirror, with its camera, has the same film: a mirrored camera sees another scene as a camera
/// sees this one. Light and what does not depend on how directions are drawn is the same to rounding; edges
/// are drawn from their other ends.
#[test]
fn a_mirrored_camera_sees_what_is_mirrored() {
    let mirror = DAffine3::from_scale(DVec3::new(-1.0, 1.0, 1.0));
    let filter = Filter::Tent { radius: 1.0 };
    let scene = square(filter);
    let mut d = scene.description().clone();
    d.shapes.iter_mut().for_each(|shape| shape.mesh = shape.mesh.clone().transformed(&mirror));
    let camera = &mut d.camera;
    camera.origin = mirror.transform_point3(camera.origin);
    for axis in [&mut camera.right, &mut camera.up, &mut camera.forward] {
        *axis = mirror.transform_vector3(*axis);
    }
    let mirrored = Scene::new(d).unwrap();
    let none = Progress::none();
    let change = |scene: &Scene, sign: f64| {
        let mut change = Tangent::still(scene);
        change.translate(scene, 0, DVec3::new(sign, 0.3, 0.2));
        change.rotate(scene, 0, DVec3::new(sign * 0.1, 0.0, -3.0), sign * DVec3::Z);
        change
    };
    let (plain, turned) = (change(&scene, 1.0), change(&mirrored, -1.0));
    let area = |scene: &Scene, change: &Tangent| {
        let method = WarpedArea { samples: 8, seed: 3, ..WarpedArea::default() };
        method.forward(scene, change, &none).unwrap()
    };
    let (a, b) = (area(&scene, &plain), area(&mirrored, &turned));
    let largest = a.gradient.pixels.iter().map(|p| p.abs().max_element()).fold(0.0, f64::max);
    let off = |a: &Image, b: &Image| {
        a.pixels.iter().zip(&b.pixels).map(|(a, b)| (*a - *b).abs().max_element()).fold(0.0, f64::max)
    };
    assert!(largest > 0.0 && off(&a.gradient, &b.gradient) < 1e-9 * largest);
    assert!(off(&a.image, &b.image) < 1e-9);
    // Moved the other way, what is mirrored has another derivative: the control.
    let wrong = area(&mirrored, &change(&mirrored, 1.0));
    assert!(off(&a.gradient, &wrong.gradient) > 0.1 * largest);
    let mut comparisons = Comparisons::of("a_mirrored_camera_sees_what_is_mirrored");
    let weighted = |image: Image| -> Vec<DVec3> {
        image.pixels.iter().enumerate().map(|(i, g)| *g * (1.0 + (i % 4) as f64)).collect()
    };
    let edges = |scene: &Scene, change: &Tangent| {
        total(|seed| {
            let method = EdgeSampling { samples: 4, primary: 64, seed, ..EdgeSampling::default() };
            weighted(method.forward(scene, change, &none).unwrap().gradient)
        })
    };
    let expected = edges(&scene, &plain);
    comparisons.add("edge sampling".into(), edges(&mirrored, &turned), expected, 0.0, expected.0);
    comparisons.finish();
}
