//! Tests of images and derivatives over the film. (Their values are compared with an independent oracle in
//! `tests/tests/transport_exact.rs`.)

use super::super::{Exact, ExactError};
use super::*;

const EXACT: Exact = Exact { bounces: 1, tolerance: 1e-12 };

fn filter(i: u64) -> Filter {
    [Filter::Box, Filter::Tent, Filter::Gaussian][(i % 3) as usize]
}

#[test]
fn the_error_estimate_holds() {
    for i in 0..20 {
        let mut rng = stream(6, &[i]);
        let world = random_world(&mut rng, 6, true);
        let camera = random_camera(&mut rng, filter(i));
        let change = random_vertices(&mut rng, &world).and(&random_camera_tangent(&mut rng, &world));
        let at = |tolerance| {
            Exact { bounces: 1, tolerance }.gradient(&world, &camera, &change).expect("a gradient")
        };
        let (coarse, fine) = (at(1e-6), at(1e-13));
        for p in 0..6 {
            let pairs = coarse.pixels[p].to_array().into_iter().zip(fine.pixels[p].to_array());
            let error: f64 = pairs.map(|(a, b)| (a - b).abs()).sum();
            assert!(error <= coarse.errors[p] + fine.errors[p] + 1e-13 * fine.scales[p]);
            assert!(fine.errors[p] <= 1e-11 * fine.scales[p], "{:e} {:e}", fine.errors[p], fine.scales[p]);
        }
    }
}

#[test]
fn moving_everything_changes_nothing() {
    for i in 0..12 {
        let mut rng = stream(7, &[i]);
        let world = random_world(&mut rng, 5, true);
        let camera = random_camera(&mut rng, filter(i));
        let all = 0..world.shapes().len();
        let shift = point(&mut rng, 1.0);
        let translation = Tangent::translate(&world, all.clone(), shift)
            .and(&Tangent::of_camera(&world, CameraTangent { position: shift, ..CameraTangent::default() }));
        let turned = CameraTangent { position: camera.position.perp(), angle: 1.0, field_of_view: 0.0 };
        let rotation = Tangent::rotate(&world, all, DVec2::ZERO).and(&Tangent::of_camera(&world, turned));
        let away = CameraTangent { position: camera.position, ..CameraTangent::default() };
        let mut scaling = Tangent::of_camera(&world, away);
        scaling.vertices = world.vertices().collect();
        for change in [translation, rotation, scaling] {
            let gradient = EXACT.gradient(&world, &camera, &change).expect("a gradient");
            for (p, terms) in gradient.pixels.iter().enumerate() {
                let scale = gradient.scales[p];
                assert!(terms.total().abs() <= 1e-12 * (1.0 + scale), "{terms:?} {scale}");
                // Rounding, which no refinement reduces, is not counted as quadrature error.
                assert!(gradient.errors[p] <= EXACT.tolerance * scale, "{:e}", gradient.errors[p]);
            }
        }
    }
}

#[test]
fn what_has_no_derivative_is_refused() {
    // The left end is seen on the edge between pixels 3 and 4.
    let wall = Shape::open([DVec2::new(1.0, 0.0), DVec2::new(1.0, 0.7)], Material::emitter(1.0));
    let world = World::new(0.0, vec![wall]).expect("a world");
    let camera = |filter| Camera {
        position: DVec2::ZERO,
        angle: 0.0,
        field_of_view: 1.0,
        film: Film { pixels: 8, filter },
    };
    let change = Tangent::translate(&world, [0], DVec2::Y);
    let refused = EXACT.gradient(&world, &camera(Filter::Box), &change);
    assert!(matches!(refused, Err(ExactError::PixelEdge { vertex: 0, .. })), "{refused:?}");
    EXACT.gradient(&world, &camera(Filter::Tent), &change).expect("the tent is continuous");
    let along = Tangent::translate(&world, [0], DVec2::X);
    EXACT.gradient(&world, &camera(Filter::Tent), &along).expect("differentiable");
    // Seen edge-on.
    let thin = Shape::open([DVec2::new(1.0, 0.0), DVec2::new(2.0, 0.0)], Material::emitter(1.0));
    let world = World::new(0.0, vec![thin]).expect("a world");
    let turning = Tangent::rotate(&world, [0], DVec2::X);
    let refused = EXACT.gradient(&world, &camera(Filter::Tent), &turning);
    assert!(matches!(refused, Err(ExactError::Coincide { vertices: [0, 1], .. })), "{refused:?}");
    let on = Camera { position: DVec2::new(1.5, 0.0), ..camera(Filter::Tent) };
    let refused = EXACT.image(&world, &on);
    assert!(matches!(refused, Err(ExactError::CameraOnSegment { shape: 0, segment: 0 })), "{refused:?}");
    let many = Exact { bounces: 2, ..EXACT }.image(&world, &camera(Filter::Box));
    assert_eq!(many, Err(ExactError::Bounces { bounces: 2 }));
    let loose = Exact { tolerance: f64::NAN, ..EXACT }.image(&world, &camera(Filter::Box));
    assert!(matches!(loose, Err(ExactError::Tolerance { .. })));
}
