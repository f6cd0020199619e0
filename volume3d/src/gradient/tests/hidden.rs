//! Tests of cameras to which emitters are invisible.

use std::f64::consts::PI;

use super::*;
use crate::scene::Surface;

/// The room without its sky, with a small bright panel between camera and block.
fn panelled(hide_emitters: bool) -> Scene {
    let mut d = room(Filter::Tent { radius: 1.0 }).description().clone();
    let panel = Mesh::rectangle().transformed(&(at(0.15, -0.1, 1.0, 0.3) * DAffine3::from_rotation_y(PI)));
    d.add_emitter("panel", panel, DVec3::splat(3.0));
    (d.hide_emitters, d.integrator.max_depth, d.environment) = (hide_emitters, Some(2), None);
    Scene::new(d).unwrap()
}

/// A hidden emitter against black leaves the image black. Camera rays pass through hidden emitters; other
/// rays hit them.
#[test]
fn rays_of_the_camera_pass_what_emits() {
    let mut d = square(Filter::Box).description().clone();
    d.hide_emitters = true;
    let image = render(&Scene::new(d).unwrap(), 4, 0, &Progress::none()).unwrap().image;
    assert!(image.pixels.iter().all(|p| *p == DVec3::ZERO));

    let (hidden, seen) = (panelled(true), panelled(false));
    let mut bare = seen.description().clone();
    bare.shapes.pop();
    let bare = Scene::new(bare).unwrap();
    let origin = seen.description().camera.origin;
    let mut passed = 0;
    for direction in (0..200).map(|i| DVec3::new(0.002 * f64::from(i) - 0.2, -0.1, -1.0).normalize()) {
        let [hit, front, behind] =
            [&hidden, &seen, &bare].map(|scene| scene.closest(origin, direction, None));
        let (Some(hit), Some(behind)) = (hit, behind) else { continue };
        assert_eq!(hit.surface, behind.surface);
        assert!((hit.distance - behind.distance).abs() < 1e-12);
        let mut bundle = vec![None];
        hidden.closest_bundle(origin, &[direction], None, &mut bundle);
        assert_eq!(bundle[0].map(|h| h.surface), Some(hit.surface));
        assert!(!hidden.hidden_from_camera(origin, direction, 0.9 * hit.distance));
        let Some(front) = front.filter(|front| front.surface != hit.surface) else { continue };
        assert!(hidden.is_emitter(front.surface) && !hidden.is_emitter(hit.surface));
        let Surface::Triangle(triangle) = front.surface else { panic!("a panel") };
        // From the surface behind it, the panel blocks the ray back.
        let x = origin + hit.distance * direction;
        let back = hidden.closest(x, -direction, Some(hit.surface)).expect("the panel");
        assert_eq!(hidden.shape_of(back.surface), hidden.shape_of(Surface::Triangle(triangle)));
        passed += 1;
    }
    assert!(passed > 20, "{passed}");
}

/// Block and panel move: the panel's outline is no discontinuity on the film, and its illumination is
/// unchanged. The control is a camera to which the panel is visible.
#[test]
fn hidden_emitters_move_nothing_but_light() {
    let none = Progress::none();
    let (hidden, seen) = (panelled(true), panelled(false));
    let mut change = Tangent::still(&hidden);
    change.translate(&hidden, 2, DVec3::new(1.0, 0.0, 0.0));
    change.translate(&hidden, 4, DVec3::new(1.0, 0.0, 0.4));
    let sum = |image: Image| -> Vec<DVec3> {
        image.pixels.iter().enumerate().map(|(i, g)| *g * ((i % 6) as f64 - 2.5)).collect()
    };
    let warped = |scene: &Scene, seed| {
        let method = WarpedArea { samples: 144, seed, ..WarpedArea::default() };
        sum(method.forward(scene, &change, &none).unwrap().gradient)
    };
    let edges = total(|seed| {
        let method = EdgeSampling {
            samples: 24,
            primary: 96,
            secondary: 320,
            bounces: 320,
            seed,
            allow_missing: vec![],
        };
        sum(method.forward(&hidden, &change, &none).unwrap().gradient)
    });
    let differences = total(|seed| {
        let method = FiniteDifference { samples: 1152, step: 4e-3, seed };
        sum(method.forward(&hidden, &change, &none).unwrap().gradient)
    });
    let found = total(|seed| warped(&hidden, seed));
    let visible = total(|seed| warped(&seen, seed));
    // The contribution that must be absent.
    let scale = visible.0 - edges.0;
    let mut comparisons = Comparisons::of("hidden_emitters_move_nothing_but_light");
    comparisons.add("warped area on edge sampling".into(), found, edges, 0.0, scale);
    comparisons.add("differences on edge sampling".into(), differences, edges, 0.0, scale);
    comparisons.reject("a camera that sees them", visible, edges);
    comparisons.finish();
}
