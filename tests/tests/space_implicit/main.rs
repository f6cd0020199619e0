//! Implicit surfaces among meshes: gradients of the default method compared with central differences of
//! images, on the film, in shadows between both kinds of surfaces and of a surface on itself, forward and in
//! reverse.

mod scenes;

use flatland::warp::{Warp, Weighting};
use glam::DVec3;
use tests::comparison::{Comparison, Estimate};
use tests::effort::pick;
use tests::power::Power;
use tests::statistics::student;
use volume3d::Image;
use volume3d::gradient::{
    ActiveParameters, Field, FiniteDifference, GradientImage, ImplicitField, Progress, WarpedArea,
};

use scenes::{Moving, SIDE};

/// The step of differences: their error ~ h² is below a thousandth here.
const STEP: f64 = 0.01;

/// Weights that differ between left and right: motion to the right changes their sum most.
fn weights() -> Image {
    let weight = |i: usize| DVec3::new(1.0, 0.7, 0.4) * (2.0 * (i % SIDE) as f64 / SIDE as f64 - 1.0);
    Image { width: SIDE, height: SIDE, pixels: (0..SIDE * SIDE).map(weight).collect() }
}

fn dot(a: &Image, b: &Image) -> f64 {
    a.pixels.iter().zip(&b.pixels).map(|(a, b)| a.dot(*b)).sum()
}

/// Independent runs of an estimate: few and long, as the variance of stratified samples falls faster than
/// their number rises.
const RUNS: u64 = 24;

fn estimate(run: impl Fn(u64) -> GradientImage) -> Estimate {
    let weights = weights();
    Estimate::of((0..RUNS).map(|seed| {
        let image = run(seed);
        assert!(image.non_finite.is_empty(), "{:?}", image.non_finite);
        dot(&image.gradient, &weights)
    }))
}

fn warped(moving: &Moving, method: &WarpedArea) -> Estimate {
    let Moving { scene, change, .. } = moving;
    estimate(|seed| {
        let method = WarpedArea { seed, ..method.clone() };
        method.forward(scene, change, &Progress::none()).expect("a gradient")
    })
}

fn compare(moving: &Moving, method: &WarpedArea, differences: usize) -> Comparison {
    let Moving { scene, change, .. } = moving;
    let reference = estimate(|seed| {
        let method = FiniteDifference { samples: differences, step: STEP, seed: 1000 + seed };
        method.forward(scene, change, &Progress::none()).expect("differences")
    });
    Comparison { found: warped(moving, method), reference, limit: student(RUNS - 1), slack: 0.0 }
}

fn samples(samples: usize) -> WarpedArea {
    WarpedArea { samples, ..WarpedArea::default() }
}

/// The method with the field of all points of a ray.
fn all_points(samples: usize) -> WarpedArea {
    WarpedArea { samples, implicit: ImplicitField::bangaru(), ..WarpedArea::default() }
}

/// The method with the field of auxiliary rays.
fn rays(samples: usize) -> WarpedArea {
    WarpedArea { samples, field: Field::AuxiliaryRays, ..WarpedArea::default() }
}

fn accept(test: &'static str, cases: Vec<Moving>, effort: usize, method: fn(usize) -> WarpedArea) {
    let mut power = Power::of(test);
    for moving in cases {
        let comparison = compare(&moving, &method(moving.effort * effort), 8 * effort);
        comparison.accept(&mut power, moving.name, comparison.reference.mean.abs());
        println!("{}: {:?}", moving.name, moving.scene.trace_counts());
    }
}

#[test]
fn implicit_surfaces_are_followed() {
    let cases = vec![scenes::silhouette(), scenes::ring(), scenes::union(), scenes::camera()];
    accept("space_implicit::implicit_surfaces_are_followed", cases, 128, samples);
}

#[test]
fn so_they_are_among_meshes() {
    let mut cases = vec![
        scenes::over_a_floor(2),
        scenes::under_a_lamp(),
        scenes::two_balls(),
        scenes::mesh_over_a_ball(),
        scenes::behind_a_mesh(),
        scenes::rounded_box(),
        scenes::grid(),
    ];
    cases.extend(pick(None, Some(scenes::over_a_floor(4))));
    accept("space_implicit::so_they_are_among_meshes", cases, pick(128, 160), samples);
}

/// The field of Bangaru et al. (2022): in front of the sky, over a floor that it shades, shading itself, and
/// behind a mesh.
#[test]
fn all_points_follow_them_as_well() {
    let behind = Moving { effort: 20, ..scenes::behind_a_mesh() };
    let cases = vec![scenes::silhouette(), scenes::over_a_floor(2), scenes::union(), behind];
    accept("space_implicit::all_points_follow_them_as_well", cases, 128, all_points);
}

/// Auxiliary rays: in front of the sky, with a moving camera, and in shadows of meshes and of implicit
/// surfaces.
#[test]
fn auxiliary_rays_follow_them_too() {
    let balls = Moving { effort: 2, ..scenes::two_balls() };
    let cases = vec![scenes::silhouette(), scenes::camera(), scenes::mesh_over_a_ball(), balls];
    accept("space_implicit::auxiliary_rays_follow_them_too", cases, 96, rays);
}

/// Softened silhouettes and sampled shadows of meshes: a quarter as many samples of silhouettes as of the
/// area, and half as many of shadows.
fn softened(samples: usize) -> WarpedArea {
    WarpedArea { samples, field: Field::softened(samples), ..WarpedArea::default() }
}

/// Softened fields, in which only meshes have curves: silhouettes of meshes in front of implicit surfaces and
/// behind them, shadows between both, and a moving camera.
#[test]
fn softened_fields_follow_both() {
    let cases = vec![
        scenes::over_a_floor(2),
        scenes::under_a_lamp(),
        scenes::mesh_over_a_ball(),
        scenes::behind_a_mesh(),
        scenes::camera(),
        scenes::block_beside_a_ball(),
    ];
    accept("space_implicit::softened_fields_follow_both", cases, pick(128, 160), softened);
}

/// The same with softened fields at bounces: a cube that shades a ball from the sky, and a ball behind a
/// cube.
#[test]
fn so_they_do_at_bounces() {
    let bounced = |samples: usize| {
        let part = |n: usize| samples.div_ceil(n);
        let (film, lobe, softness) = (1.2, 0.5, 0.4);
        let (silhouettes, shadows, bounces) = (part(4), 0, part(2));
        let field = Field::Softened { film, lobe, softness, silhouettes, shadows, bounces };
        WarpedArea { samples, field, ..WarpedArea::default() }
    };
    let cases = vec![scenes::mesh_over_a_ball(), scenes::behind_a_mesh()];
    accept("space_implicit::so_they_do_at_bounces", cases, pick(80, 160), bounced);
}

/// Without samples of mesh silhouettes.
#[test]
fn softened_fields_need_their_curves() {
    let field = |silhouettes: usize, shadows: usize| {
        let (film, lobe, softness) = (1.2, 0.5, f64::INFINITY);
        Field::Softened { film, lobe, softness, silhouettes, shadows, bounces: 0 }
    };
    let moving = scenes::mesh_over_a_ball();
    // A control variate would hide part of the residual.
    let method = WarpedArea { field: field(0, 64), control_variate: 0, ..samples(256) };
    compare(&moving, &method, 512).reject("silhouettes of meshes left out");
}

/// Controls that must be rejected: no warp, a grid with ∇φ discontinuous between its cells, and auxiliary
/// rays without the distance to the silhouette.
#[test]
fn controls_are_rejected() {
    let kinked = scenes::kinked_grid();
    compare(&kinked, &samples(128), 512).reject(kinked.name);

    let blind = Warp { weighting: Weighting::Gaussian, ..rays(1).warp };
    compare(&scenes::silhouette(), &WarpedArea { warp: blind, ..rays(128) }, 512).reject("Gaussian weights");

    for moving in [scenes::silhouette(), scenes::over_a_floor(2), scenes::mesh_over_a_ball()] {
        let interior = WarpedArea { warps: false, ..samples(16) };
        compare(&moving, &interior, 64).reject(moving.name);
    }
}

/// From micrometres to megametres, if the scene is in metres: images and derivatives are the same up to
/// rounding and its consequences, such as whether a ray hits an edge.
#[test]
fn units_of_length_change_nothing() {
    let gradient = |unit: f64| {
        let Moving { scene, change, .. } = scenes::in_units(unit);
        samples(4).forward(&scene, &change, &Progress::none()).expect("a gradient").gradient
    };
    let metres = gradient(1.0);
    let norm = |image: &Image| image.pixels.iter().map(|g| g.length_squared()).sum::<f64>().sqrt();
    for unit in [1e-6, 1e-3, 1e3, 1e6] {
        let found = gradient(unit);
        let pairs = found.pixels.iter().zip(&metres.pixels);
        let difference = metres.with_pixels(pairs.map(|(a, b)| *a - *b).collect());
        let relative = norm(&difference) / norm(&metres);
        println!("unit {unit:.0e}: {relative:.1e}");
        assert!(relative < 1e-6, "{unit}: {relative}");
    }
}

#[test]
fn reverse_is_the_transpose_of_forward() {
    let cases = [
        scenes::ring(),
        scenes::union(),
        scenes::mesh_over_a_ball(),
        scenes::over_a_floor(4),
        scenes::grid(),
        scenes::camera(),
    ];
    let weights = weights();
    let few = ImplicitField::Bangaru { gamma: 3.0, lambda: 0.1, nearest: Some(6) };
    let methods = [samples(2), all_points(2), WarpedArea { implicit: few, ..samples(2) }, rays(2)];
    let pairs = cases.iter().flat_map(|case| methods.iter().map(move |method| (case, method)));
    for (Moving { name, scene, change, .. }, method) in pairs {
        let forward = method.forward(scene, change, &Progress::none()).expect("a gradient");
        let active = ActiveParameters::everything(scene);
        let reverse = || method.reverse(scene, &weights, &active, &Progress::none()).expect("a gradient");
        let gradient = reverse();
        let (found, expected) = (change.dot(&gradient.by_parameter), dot(&forward.gradient, &weights));
        let scale: f64 = forward.gradient.pixels.iter().map(|g| g.abs().element_sum()).sum();
        assert!((found - expected).abs() < 1e-11 * scale, "{name}: {found} for {expected}");
        // The same bits at one thread.
        let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a pool");
        assert!(pool.install(reverse).by_parameter == gradient.by_parameter, "{name}");
    }
}

/// Softened fields with the moving shapes active: curves are sampled according to the active parameters.
#[test]
fn so_it_is_of_softened_fields() {
    let weights = weights();
    let (film, lobe, softness) = (1.2, 0.5, 0.4);
    let field = Field::Softened { film, lobe, softness, silhouettes: 4, shadows: 4, bounces: 4 };
    let method = WarpedArea { field, ..samples(4) };
    for Moving { name, scene, change, .. } in [scenes::block_beside_a_ball(), scenes::mesh_over_a_ball()] {
        let mut active = ActiveParameters::nothing(&scene);
        for (shape, active) in active.shapes.iter_mut().enumerate() {
            *active = change.positions_of(&scene, shape).iter().any(|rate| *rate != DVec3::ZERO);
        }
        let rates = change.implicits.iter().map(|rates| rates.translation != DVec3::ZERO);
        active.implicits = rates.collect();
        let forward = method.forward(&scene, &change, &Progress::none()).expect("a gradient");
        let gradient = method.reverse(&scene, &weights, &active, &Progress::none()).expect("a gradient");
        let (found, expected) = (change.dot(&gradient.by_parameter), dot(&forward.gradient, &weights));
        let scale: f64 = forward.gradient.pixels.iter().map(|g| g.abs().element_sum()).sum();
        assert!((found - expected).abs() < 1e-11 * scale, "{name}: {found} for {expected}");
    }
}
