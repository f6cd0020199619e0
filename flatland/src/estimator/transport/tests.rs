//! Comparisons of all methods with each other on simple worlds. The integration tests compare them with exact
//! values over many worlds.

use glam::DVec2;

use super::*;
use crate::plane::Filter;
use crate::transport::fields::Construction;
use crate::transport::{CameraTangent, Film, ImageError, Material, MaterialTangent, Paths, Shape};

fn p(x: f64, y: f64) -> DVec2 {
    DVec2::new(x, y)
}

fn camera(filter: Filter) -> Camera {
    let film = Film { pixels: 3, filter };
    Camera { position: p(0.2, 2.0), angle: -1.4, field_of_view: 0.9, film }
}

/// A floor, a light above it, and optionally an occluder in between.
fn world(floor: Material, occluder: bool) -> World {
    let mut shapes = vec![
        Shape::open([p(-6.0, 0.1), p(6.0, -0.2)], floor),
        Shape::open([p(-2.5, 2.6), p(-1.0, 3.0)], Material::emitter(3.0)),
    ];
    if occluder {
        let corners = [p(-1.6, 1.2), p(-0.7, 1.3), p(-0.9, 1.6)];
        shapes.push(Shape::closed(corners, Material::diffuse(0.6).with_emission(0.2)));
    }
    World::new(0.3, shapes).expect("a world")
}

fn glossy() -> Material {
    Material { reflectance: 0.1, ..Material::glossy(0.7, 0.15) }
}

fn changes(world: &World) -> Vec<Tangent> {
    let camera = |camera| Tangent::of_camera(world, camera);
    let last = world.shapes().len() - 1;
    let mut material = Tangent::none(world);
    material.materials[0] =
        MaterialTangent { reflectance: 1.0, gloss_strength: 0.4, gloss_width: 0.1, emission: 0.0 };
    material.materials[1].emission = 0.5;
    material.environment = 0.7;
    vec![
        Tangent::translate(world, [0], p(0.3, 1.0)),
        Tangent::rotate(world, [0], p(0.0, 0.0)),
        Tangent::translate(world, [1], p(1.0, 0.4)),
        Tangent::rotate(world, [last], p(0.0, 1.0)),
        camera(CameraTangent { position: p(1.0, 0.5), ..CameraTangent::default() }),
        camera(CameraTangent { angle: 1.0, field_of_view: 0.5, ..CameraTangent::default() }),
        material,
    ]
}

/// Edge sampling against the area estimators, with which it shares only the interior term.
#[test]
fn edges_and_areas_agree() {
    for (floor, occluder, bounces) in [
        (Material::diffuse(0.8), false, 1),
        (glossy(), false, 1),
        (Material::diffuse(0.8), true, 1),
        (glossy(), true, 3),
    ] {
        let world = world(floor, occluder);
        let paths = Paths { bounces, ..Paths::default() };
        for change in changes(&world) {
            let camera = camera(if bounces == 1 { Filter::Tent } else { Filter::Box });
            let run = |m: &dyn Method| m.forward(&world, &camera, &change).expect("valid");
            let edges = run(&EdgeSampling { samples: 2000, paths, ..EdgeSampling::default() });
            let warped = WarpedArea { samples: 1000, paths, ..WarpedArea::default() };
            for construction in [Construction::default(), Construction::Harmonic] {
                let areas = run(&WarpedArea { construction, ..warped });
                for pixel in 0..3 {
                    let error = edges.standard_error.total[pixel].hypot(areas.standard_error.total[pixel]);
                    let z = (edges.total()[pixel] - areas.total()[pixel]) / error.max(1e-12);
                    // 168 comparisons, within the false-alarm rate that the whole test suite shares.
                    assert!(z.abs() < 6.5, "{construction:?} {change:?} {pixel}: {z}");
                }
            }
        }
    }
}

/// Softened mean from ε = 0 (the exact mean, no boundary term) to ε = ∞ (edge sampling).
#[test]
fn a_softened_mean_leads_from_the_exact_mean_to_edge_sampling() {
    let world = world(glossy(), true);
    let (camera, paths) = (camera(Filter::Box), Paths { bounces: 3, ..Paths::default() });
    let softened = |softness| WarpedArea {
        paths,
        construction: Construction::Softened { reach: 8.0, softness },
        ..WarpedArea::default()
    };
    let construction = Construction::JumpMean { reach: 8.0 };
    let mean = WarpedArea { construction, ..softened(0.0) };
    let edges = EdgeSampling { paths, ..EdgeSampling::default() };
    for change in changes(&world) {
        let run = |m: &dyn Method| m.forward(&world, &camera, &change).expect("valid").total();
        assert_eq!(run(&softened(0.0)), run(&mean));
        for (softened, edges) in run(&softened(f64::INFINITY)).into_iter().zip(run(&edges)) {
            assert!((softened - edges).abs() < 1e-12 * (1.0 + edges.abs()), "{softened} {edges} {change:?}");
        }
    }
}

#[test]
fn the_primal_is_the_same_with_and_without_a_gradient() {
    // Only the environment's radiance changes, at a rate equal to itself: the derivative is the environment's
    // part of the image, which without emitters is the whole image.
    let shapes = vec![
        Shape::open([p(-6.0, 0.1), p(6.0, -0.2)], glossy()),
        Shape::closed([p(-1.6, 1.2), p(-0.7, 1.3), p(-0.9, 1.6)], Material::diffuse(0.6)),
    ];
    let world = World::new(1.0, shapes).expect("a world");
    let paths = Paths { bounces: 3, ..Paths::default() };
    let image = paths.image(&world, &camera(Filter::Tent), 50, 3).expect("valid");
    let change = Tangent { environment: 1.0, ..Tangent::none(&world) };
    let method = WarpedArea { samples: 50, paths, seed: 3, ..WarpedArea::default() };
    let gradient = method.forward(&world, &camera(Filter::Tent), &change).expect("valid");
    for ([mean, _], total) in image.iter().zip(gradient.total()) {
        assert!((mean - total).abs() < 1e-13 * mean, "{mean} {total}");
    }
}

#[test]
fn appearance_traces_no_auxiliary_ray() {
    let world = world(glossy(), true);
    let changes = changes(&world);
    let rays = |change| {
        let method = WarpedArea { samples: 10, ..WarpedArea::default() };
        method.forward(&world, &camera(Filter::Tent), change).expect("valid").rays
    };
    assert!(rays(&changes[6]) < 10 * 3 * 4);
    assert!(rays(&changes[0]) > 10 * 3 * 8);
}

#[test]
fn bad_parameters_are_named() {
    let world = world(glossy(), false);
    let (camera, change) = (camera(Filter::Box), Tangent::none(&world));
    let run = |m: WarpedArea| m.forward(&world, &camera, &change).expect_err("bad");
    let good = WarpedArea::default();
    assert_eq!(run(WarpedArea { samples: 0, ..good }), EstimatorError::NoSamples);
    let construction = Construction::Followed { candidates: 0 };
    assert_eq!(run(WarpedArea { construction, ..good }), EstimatorError::NoCandidates);
    let construction = Construction::Softened { reach: 8.0, softness: -1.0 };
    assert_eq!(run(WarpedArea { construction, ..good }), EstimatorError::Softness { softness: -1.0 });
    let kernels = Kernels { surface: f64::NAN, ..Kernels::default() };
    assert!(matches!(run(WarpedArea { kernels, ..good }), EstimatorError::Warp(_)));
    let kernels = Kernels { relative: 0.0, ..Kernels::default() };
    assert_eq!(run(WarpedArea { kernels, ..good }), EstimatorError::RelativeWidth { relative: 0.0 });
    let wide = Camera { field_of_view: 4.0, ..camera };
    assert!(matches!(good.forward(&world, &wide, &change), Err(EstimatorError::Camera(_))));
    let image = |camera, samples| Paths::default().image(&world, camera, samples, 0);
    assert!(matches!(image(&wide, 1), Err(ImageError::Camera(_))));
    assert_eq!(image(&camera, 0), Err(ImageError::NoSamples));
    let other = Tangent { vertices: vec![], ..change.clone() };
    assert!(matches!(good.forward(&world, &camera, &other), Err(EstimatorError::Tangent(_))));
    assert!(matches!(good.reverse(&world, &camera, &[1.0]), Err(EstimatorError::AdjointSize { .. })));
    let difference = FiniteDifference { step: 0.0, ..FiniteDifference::default() };
    assert_eq!(difference.forward(&world, &camera, &change), Err(EstimatorError::Step { step: 0.0 }));
}

/// The difference is one-sided for an emission of 0, which cannot decrease.
#[test]
fn finite_differences_in_reverse_are_those_of_every_parameter() {
    let world = world(glossy(), false);
    let camera = camera(Filter::Tent);
    let method = FiniteDifference { samples: 50, step: 1e-3, ..FiniteDifference::default() };
    let adjoint = [0.3, -1.0, 0.7];
    let reverse = method.reverse(&world, &camera, &adjoint).expect("valid").total();
    let mut change = Tangent::none(&world);
    change.materials[0].emission = 1.0;
    let forward = method.forward(&world, &camera, &change).expect("valid").total();
    let expected: f64 = forward.iter().zip(adjoint).map(|(g, a)| g * a).sum();
    assert!(expected != 0.0 && reverse.materials[0].emission == expected);
}

/// A discontinuity on a pixel border: both pixels have the mean of the two one-sided derivatives. At a
/// millionth of a pixel from the border one of them has all.
#[test]
fn jumps_on_pixel_ends_are_a_part_of_both() {
    let film = Film { pixels: 8, filter: Filter::Box };
    let camera = Camera { position: DVec2::ZERO, angle: 0.0, field_of_view: 1.0, film };
    let wall = |low: f64| {
        let wall = Shape::open([p(1.0, low), p(1.0, 0.7)], Material::emitter(1.0));
        World::new(0.0, vec![wall]).expect("a world")
    };
    let paths = Paths { bounces: 1, ..Paths::default() };
    let rates = |method: &dyn Method, low: f64| {
        let world = wall(low);
        let found =
            method.forward(&world, &camera, &Tangent::translate(&world, [0], DVec2::Y)).expect("valid");
        [3, 4].map(|pixel| (found.total()[pixel], found.standard_error.total[pixel]))
    };
    let edges = EdgeSampling { samples: 1000, paths, ..EdgeSampling::default() };
    let warped = WarpedArea { samples: 4000, paths, ..WarpedArea::default() };
    let construction = Construction::Softened { reach: 8.0, softness: 2.0 };
    let softened = WarpedArea { construction, ..warped };
    let construction = Construction::JumpMean { reach: 8.0 };
    let mean = WarpedArea { construction, ..warped };
    let methods: [(&str, &dyn Method); 4] =
        [("edges", &edges), ("auxiliary", &warped), ("softened", &softened), ("mean", &mean)];
    let whole: f64 = rates(&edges, 1e-6).iter().map(|rate| rate.0).sum();
    assert!(whole.abs() > 1.0, "{whole}");
    for (name, method) in methods {
        for low in [0.0, 1e-16, -1e-16] {
            for (rate, error) in rates(method, low) {
                assert!(
                    (rate - 0.5 * whole).abs() < 6.5 * error + 5e-3 * whole.abs()
                        && error < 0.05 * whole.abs(),
                    "{name} at {low:e}: {rate} ± {error} of {whole}"
                );
            }
        }
        let least = rates(method, 1e-6).map(|rate| rate.0.abs()).into_iter().fold(f64::INFINITY, f64::min);
        assert!(least < 0.1 * whole.abs(), "{name}: {least} of {whole}");
    }
}
