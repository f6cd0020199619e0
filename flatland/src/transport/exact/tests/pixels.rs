//! Images and derivatives over the film.

use super::super::{Exact, ExactError};
use super::surfaces::central_differences;
use super::*;

const EXACT: Exact = Exact { bounces: 1, tolerance: 1e-12 };

fn filter(i: u64) -> Filter {
    [Filter::Box, Filter::Tent, Filter::Gaussian][(i % 3) as usize]
}

#[test]
fn gradients_agree_with_differences() {
    let (mut worst, mut worst_error, mut tested) = (0.0_f64, 0.0_f64, [0; 3]);
    let mut failures = vec![];
    for i in 0..80 {
        let mut rng = stream(5, &[i]);
        let world = random_world(&mut rng, 3 + (i % 5) as usize, i % 2 == 0);
        let camera = random_camera(&mut rng, filter(i));
        let changes = [
            random_vertices(&mut rng, &world),
            random_camera_change(&mut rng, &world),
            random_materials(&mut rng, &world),
        ];
        for (kind, change) in changes.iter().enumerate() {
            let exact = Exact { bounces: usize::from(i % 7 != 0), ..EXACT };
            let gradient = exact.gradient(&world, &camera, change).expect("differentiable");
            let image = |h: f64| {
                let moved = world.displaced(change, h).ok()?;
                Some(exact.image(&moved, &change.displaced_camera(&camera, h)).ok()?.pixels)
            };
            // Too near to another world that is none.
            let Some(found) = central_differences(image) else { continue };
            tested[kind] += 1;
            for (p, found) in found.into_iter().enumerate() {
                let scale = gradient.scales[p].max(0.1);
                let error = (found - gradient.pixels[p].total()).abs() / scale;
                worst = worst.max(error);
                worst_error = worst_error.max(gradient.errors[p] / scale);
                if error > 1e-7 {
                    failures.push(format!("{i} {kind} {p} {error:e} {found} {:?}", gradient.pixels[p]));
                }
            }
        }
    }
    println!("{tested:?} worlds, worst {worst:e}, worst estimate {worst_error:e}");
    assert!(failures.is_empty(), "{failures:#?}");
    assert!(tested.iter().all(|count| *count >= 45), "{tested:?}");
}

#[test]
fn the_error_estimate_holds() {
    for i in 0..20 {
        let mut rng = stream(6, &[i]);
        let world = random_world(&mut rng, 6, true);
        let camera = random_camera(&mut rng, filter(i));
        let change = random_vertices(&mut rng, &world).and(&random_camera_change(&mut rng, &world));
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
        let translation = Change::translate(&world, all.clone(), shift)
            .and(&Change::of_camera(&world, CameraChange { position: shift, ..CameraChange::default() }));
        let turned = CameraChange { position: camera.position.perp(), angle: 1.0, field_of_view: 0.0 };
        let rotation = Change::rotate(&world, all, DVec2::ZERO).and(&Change::of_camera(&world, turned));
        for change in [translation, rotation] {
            let gradient = EXACT.gradient(&world, &camera, &change).expect("a gradient");
            for (terms, scale) in gradient.pixels.iter().zip(&gradient.scales) {
                assert!(terms.total().abs() <= 1e-12 * (1.0 + scale), "{terms:?} {scale}");
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
    let change = Change::translate(&world, [0], DVec2::Y);
    let refused = EXACT.gradient(&world, &camera(Filter::Box), &change);
    assert!(matches!(refused, Err(ExactError::PixelEdge { vertex: 0, .. })), "{refused:?}");
    EXACT.gradient(&world, &camera(Filter::Tent), &change).expect("the tent does not jump");
    let along = Change::translate(&world, [0], DVec2::X);
    EXACT.gradient(&world, &camera(Filter::Tent), &along).expect("differentiable");
    // Seen edge-on.
    let thin = Shape::open([DVec2::new(1.0, 0.0), DVec2::new(2.0, 0.0)], Material::emitter(1.0));
    let world = World::new(0.0, vec![thin]).expect("a world");
    let turning = Change::rotate(&world, [0], DVec2::X);
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
