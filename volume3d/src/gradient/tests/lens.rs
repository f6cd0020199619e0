//! Tests of cameras with a lens, as means of pinhole cameras.

use std::f64::consts::TAU;

use flatland::random::{open01, stream};
use flatland::sdf::shapes::Ball;

use super::*;
use crate::scene::Lens;

const LENS: Lens = Lens { radius: 0.3, focus_distance: 1.6 };

/// The room through a lens, with its block in front of the focal plane.
fn room_through_a_lens() -> Scene {
    let mut d = room(Filter::Tent { radius: 1.0 }).description().clone();
    (d.camera.lens, d.integrator.max_depth) = (Some(LENS), Some(2));
    Scene::new(d).unwrap()
}

/// Columns 1 and 2, where an outline passes that the lens spreads over other columns.
fn weighted(image: &Image) -> Vec<DVec3> {
    let (width, _) = image.size();
    let weight = |i: usize| if (1..3).contains(&(i % width)) { 1.0 } else { 0.0 };
    image.pixels.iter().enumerate().map(|(i, g)| *g * weight(i)).collect()
}

/// The image of a small emitter out of focus is a uniform disc.
#[test]
fn what_is_out_of_focus_spreads_over_the_circle_of_confusion() {
    const DEPTH: f64 = 3.0;
    const HALF: f64 = 0.03;
    let mut camera = Camera::look_at(DVec3::ZERO, DVec3::NEG_Z, DVec3::Y, 0.8);
    for focus_distance in [1.5, DEPTH, 20.0] {
        let lens = Lens { radius: 0.2, focus_distance };
        camera.lens = Some(lens);
        let mut d = Description::new(camera.clone(), film(40, Filter::Box));
        d.add_emitter("star", Mesh::rectangle().transformed(&at(0.03, -0.02, -DEPTH, HALF)), DVec3::ONE);
        let scene = Scene::new(d).unwrap();
        let image = render(&scene, 2048, 0, &Progress::none()).unwrap().image;
        let focal = 20.0 / 0.4_f64.tan();
        let centre = [20.0 + 0.03 * focal / DEPTH, 20.0 + 0.02 * focal / DEPTH];
        let (mut whole, mut second, mut farthest) = (0.0, 0.0, 0.0_f64);
        for (i, p) in image.pixels.iter().enumerate() {
            let [x, y] = [(i % 40) as f64 + 0.5 - centre[0], (i / 40) as f64 + 0.5 - centre[1]];
            whole += p.x;
            second += p.x * (x * x + y * y);
            if p.x > 0.0 {
                farthest = farthest.max(x.hypot(y));
            }
        }
        let radius = focal * lens.radius * (1.0 / DEPTH - 1.0 / focus_distance).abs();
        // Mean square distance of the image from its centre: of a disc, of the emitter's square, and of a
        // pixel.
        let expected = 0.5 * radius * radius + 2.0 * (HALF * focal / DEPTH).powi(2) / 3.0 + 1.0 / 6.0;
        let area = (2.0 * HALF * focal / DEPTH).powi(2);
        assert!((whole / area - 1.0).abs() < 0.02, "{focus_distance}: {whole} of {area}");
        let off = (second / whole / expected - 1.0).abs();
        // In focus all of the light is in one or two pixels, which do not resolve the second moment.
        assert!(off < if radius > 1.0 { 0.03 } else { 1.0 }, "{focus_distance}: {off} of {expected}");
        assert!(farthest < radius + 1.5, "{focus_distance}: {farthest} of {radius}");
    }
}

/// Image and derivatives equal the means over the lens of those of pinhole cameras, by both methods; the
/// origin and the principal point of each pinhole follow from its point on the lens. Every run draws its own
/// points, one in each of [`POINTS`] rings of equal area.
#[test]
fn a_lens_is_the_mean_of_pinholes() {
    const POINTS: usize = 16;
    let scene = room_through_a_lens();
    let mut change = Tangent::still(&scene);
    change.translate(&scene, 2, DVec3::new(1.0, 0.2, 0.4));
    change.camera.translation = DVec3::new(0.3, -0.2, 0.5);
    change.camera.rotation = DVec3::new(0.2, 0.4, -0.1);
    let camera = &scene.description().camera;
    let size = scene.size().0 as f64;
    let focal = 0.5 * size / (0.5 * camera.field_of_view).tan();
    // Vogel's sunflower spiral, turned and shifted at random: uniform over the disc.
    let pinholes = |seed: u64| {
        let mut random = stream(3, &[seed]);
        let [shift, turn] = [(); 2].map(|()| open01(&mut random));
        (0..POINTS).map(move |k| (k as f64 + shift, k as f64 * 2.399_963_229_728_653 + TAU * turn))
    };
    let pinhole = |(ring, angle): (f64, f64)| {
        let radius = LENS.radius * (ring / POINTS as f64).sqrt();
        let (sin, cos) = angle.sin_cos();
        let offset = radius * (cos * camera.right + sin * camera.up);
        let mut d = scene.description().clone();
        d.camera.lens = None;
        d.camera.origin += offset;
        let shift = focal * radius / LENS.focus_distance / size;
        d.camera.principal_point += shift * glam::DVec2::new(cos, -sin);
        let mut change = change.clone();
        change.camera.translation += change.camera.rotation.cross(offset);
        (Scene::new(d).unwrap(), change)
    };
    let none = Progress::none();
    let mut comparisons = Comparisons::of("a_lens_is_the_mean_of_pinholes");
    let mean = |run: &(dyn Fn(&Scene, &Tangent, u64) -> Image + Sync)| {
        total(|seed| {
            let seeds = (POINTS as u64 * seed..).zip(pinholes(seed).map(pinhole));
            let images = seeds.map(|(seed, (scene, change))| weighted(&run(&scene, &change, seed)));
            let mut sum = vec![DVec3::ZERO; 36];
            images.for_each(|image| sum.iter_mut().zip(image).for_each(|(s, i)| *s += i / POINTS as f64));
            sum
        })
    };
    let mut compare =
        |name: &str, samples: usize, run: &(dyn Fn(&Scene, &Tangent, usize, u64) -> Image + Sync)| {
            let whole = total(|seed| weighted(&run(&scene, &change, samples, seed)));
            let parts = mean(&|scene, change, seed| run(scene, change, samples / POINTS, seed));
            comparisons.add(name.into(), whole, parts, 0.0, parts.0);
        };
    compare("image", 256, &|scene, _, samples, seed| render(scene, samples, seed, &none).unwrap().image);
    compare("warped area", 320, &|scene, change, samples, seed| {
        let method = WarpedArea { samples, seed, ..WarpedArea::default() };
        method.forward(scene, change, &none).unwrap().gradient
    });
    compare("edge sampling", 192, &|scene, change, samples, seed| {
        let [primary, secondary] = [2 * samples; 2];
        let method =
            EdgeSampling { samples, primary, secondary, bounces: secondary, seed, allow_missing: vec![] };
        method.forward(scene, change, &none).unwrap().gradient
    });
    comparisons.finish();
}

/// All of a camera's parameters, with a square out of focus, by edge sampling, warped area and differences.
/// Control: the derivative of a pinhole camera differs.
#[test]
fn a_lens_moves_and_zooms_with_its_camera() {
    let seen_by = |lens: Option<Lens>| {
        let mut d = square(Filter::Tent { radius: 1.0 }).description().clone();
        d.camera.lens = lens;
        Scene::new(d).unwrap()
    };
    let (scene, pinhole) = (seen_by(Some(LENS)), seen_by(None));
    let mut change = Tangent::still(&scene);
    change.translate(&scene, 0, DVec3::new(0.5, 0.2, 0.4));
    change.camera.translation = DVec3::new(0.3, -0.2, 0.5);
    change.camera.rotation = DVec3::new(0.2, 0.4, -0.1);
    change.camera.field_of_view = 0.6;
    let none = Progress::none();
    let warped = |scene: &Scene| {
        total(|seed| {
            let method = WarpedArea { samples: 64, seed, ..WarpedArea::default() };
            weighted(&method.forward(scene, &change, &none).unwrap().gradient)
        })
    };
    let edges = |scene: &Scene| {
        total(|seed| {
            let method = EdgeSampling {
                samples: 4,
                primary: 64,
                secondary: 1,
                bounces: 1,
                seed,
                allow_missing: vec![],
            };
            weighted(&method.forward(scene, &change, &none).unwrap().gradient)
        })
    };
    let differences = total(|seed| {
        let method = FiniteDifference { samples: 4096, step: 1e-2, seed };
        weighted(&method.forward(&scene, &change, &none).unwrap().gradient)
    });
    let mut comparisons = Comparisons::of("a_lens_moves_and_zooms_with_its_camera");
    let reference = edges(&scene);
    comparisons.add("warped area".into(), warped(&scene), reference, 0.0, reference.0);
    comparisons.add("differences".into(), differences, reference, 0.0, reference.0);
    comparisons.reject("a pinhole", edges(&pinhole), reference);
    comparisons.finish();
}

/// An implicit surface out of focus: the field of trace points depends on the camera's rotation and field of
/// view.
#[test]
fn implicit_surfaces_are_seen_through_a_lens() {
    let mut camera = Camera::look_at(DVec3::ZERO, DVec3::NEG_Z, DVec3::Y, 0.8);
    camera.lens = Some(Lens { radius: 0.2, focus_distance: 1.8 });
    let mut d = Description::new(camera, film(6, Filter::Tent { radius: 1.0 }));
    d.integrator.max_depth = Some(2);
    let radiance = DVec3::new(0.6, 1.0, 0.8);
    d.environment = Some(Environment::Constant { id: "sky".to_owned(), radiance });
    let clay = d.add_material(Material::diffuse("clay", DVec3::splat(0.3)));
    d.add_implicit("ball", Ball::new(DVec3::new(0.2, 0.1, -3.0), 0.7).unwrap(), clay);
    let scene = Scene::new(d).unwrap();
    let mut change = Tangent::still(&scene);
    change.camera.translation = DVec3::new(0.3, -0.2, 0.5);
    change.camera.rotation = DVec3::new(0.2, 0.4, -0.1);
    change.camera.field_of_view = 0.6;
    change.implicits[0].translation = DVec3::new(0.2, 0.5, 0.1);
    let none = Progress::none();
    let warped = total(|seed| {
        let method = WarpedArea { samples: 64, seed, ..WarpedArea::default() };
        weighted(&method.forward(&scene, &change, &none).unwrap().gradient)
    });
    let differences = total(|seed| {
        let method = FiniteDifference { samples: 2048, step: 1e-2, seed };
        weighted(&method.forward(&scene, &change, &none).unwrap().gradient)
    });
    let mut comparisons = Comparisons::of("implicit_surfaces_are_seen_through_a_lens");
    comparisons.add("warped area".into(), warped, differences, 0.0, differences.0);
    comparisons.finish();
    are_transposes(&scene, &|samples| WarpedArea { samples, ..WarpedArea::default() });
}

fn are_transposes(scene: &Scene, method: &dyn Fn(usize) -> WarpedArea) {
    let (none, change) = (Progress::none(), random_tangent(scene, 7));
    let (adjoint, active) = (random_adjoint(scene.size()), ActiveParameters::everything(scene));
    let gradient = method(8).forward(scene, &change, &none).unwrap().gradient;
    let forward: f64 = gradient.pixels.iter().zip(&adjoint.pixels).map(|(g, a)| g.dot(*a)).sum();
    let reverse = method(8).reverse(scene, &adjoint, &active, &none).unwrap().by_parameter.dot(&change);
    assert!((forward - reverse).abs() < 1e-9 * forward.abs().max(1.0), "{forward} {reverse}");
}

#[test]
fn forward_and_reverse_are_transposes_through_a_lens() {
    let scene = room_through_a_lens();
    are_transposes(&scene, &|samples| WarpedArea { samples, ..WarpedArea::default() });
    are_transposes(&scene, &|samples| WarpedArea {
        samples,
        field: Field::AuxiliaryRays,
        ..WarpedArea::default()
    });
    let (none, change) = (Progress::none(), random_tangent(&scene, 7));
    let (adjoint, active) = (random_adjoint(scene.size()), ActiveParameters::everything(&scene));
    let method =
        EdgeSampling { samples: 4, primary: 4, secondary: 4, bounces: 4, seed: 2, allow_missing: vec![] };
    let gradient = method.forward(&scene, &change, &none).unwrap().gradient;
    let forward: f64 = gradient.pixels.iter().zip(&adjoint.pixels).map(|(g, a)| g.dot(*a)).sum();
    let reverse = method.reverse(&scene, &adjoint, &active, &none).unwrap().by_parameter.dot(&change);
    assert!((forward - reverse).abs() < 1e-9 * forward.abs(), "{forward} {reverse}");
}

#[test]
fn lenses_that_are_none_are_refused() {
    let refused = |radius: f64, focus_distance: f64| {
        let mut d = room(Filter::Box).description().clone();
        d.camera.lens = Some(Lens { radius, focus_distance });
        Scene::new(d).expect_err("no lens").to_string()
    };
    assert_eq!(refused(0.0, 1.0), "the radius of the lens of `camera` is 0, but must be positive and finite");
    assert!(refused(f64::NAN, 1.0).contains("the radius of the lens"));
    assert!(refused(0.1, -1.0).contains("the distance in focus"));
    assert!(refused(0.1, f64::INFINITY).contains("the distance in focus"));
}
