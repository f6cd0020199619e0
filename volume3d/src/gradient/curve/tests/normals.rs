//! Tests of warped area on scenes with shading normals, against central differences.

use glam::{DAffine3, DQuat, DVec3};

use crate::geometry::{Attribute, Mesh, Normals};
use crate::gradient::curve::driver::Driver;
use crate::gradient::curve::field::Zero;
use crate::gradient::curve::horizons::Horizons;
use crate::gradient::curve::moving::Moving;
use crate::gradient::tests::{Comparisons, at, film, terms, thorough, total};
use crate::gradient::warp::motion::Motion;
use crate::gradient::{Field, FiniteDifference, Progress, Tangent, WarpedArea};
use crate::path::{Kernels, Paths};
use crate::scene::{Camera, Description, Environment, Filter, Integrator, Material, Scene};

fn facing(normal: DVec3, place: DVec3, half: f64) -> DAffine3 {
    let turn = DQuat::from_rotation_arc(DVec3::Z, normal.normalize());
    DAffine3::from_scale_rotation_translation(DVec3::splat(half), turn, place)
}

fn description(camera: Camera, depth: usize) -> (Description, usize) {
    let mut d = Description::new(camera, film(3, Filter::Tent { radius: 1.0 }));
    d.integrator = Integrator { max_depth: Some(depth), rr_depth: 100 };
    let white = d.add_material(Material::diffuse("white", DVec3::new(0.8, 0.7, 0.6)));
    (d, white)
}

/// A wall that is lit only by a sheet at its side, with shading normals of a bulge; if `depth` permits, a
/// second wall reflects the light again.
pub(super) fn sheet(depth: usize) -> Scene {
    let camera = Camera::look_at(DVec3::new(0.0, 0.0, 3.0), DVec3::ZERO, DVec3::Y, 0.3);
    let (mut d, white) = description(camera, depth);
    d.add_shape("wall", Mesh::rectangle().transformed(&at(0.0, 0.0, 0.0, 2.0)), white);
    let normal = DVec3::new(0.17, 0.1, -0.98);
    let sheet = Mesh::rectangle().transformed(&facing(normal, DVec3::new(1.2, 0.1, 0.9), 0.5));
    let centre = sheet.positions().iter().sum::<DVec3>() / 4.0;
    let bent = sheet.positions().iter().map(|p| normal.normalize() + 3.0 * (*p - centre));
    let normals = Attribute { values: bent.collect(), triangles: sheet.triangles().to_vec() };
    d.add_shape("sheet", sheet.with_normals(Normals::Given(normals)).unwrap(), white);
    let lamp = facing(DVec3::new(-0.3, 0.0, 1.0), DVec3::new(1.7, -0.2, 0.2), 0.3);
    d.add_emitter("lamp", Mesh::rectangle().transformed(&lamp), DVec3::splat(20.0));
    if depth > 3 {
        let place = facing(DVec3::new(1.0, 0.0, -0.2), DVec3::new(-1.2, 0.0, 1.0), 1.0);
        d.add_shape("second", Mesh::rectangle().transformed(&place), white);
    }
    Scene::new(d).unwrap()
}

/// A visible sheet with shading normals of a bulge, half of which turn away from the camera; and a leaf in
/// front of it.
fn view() -> Scene {
    let camera = Camera::look_at(DVec3::new(0.2, 0.1, 3.0), DVec3::ZERO, DVec3::Y, 0.35);
    let (mut d, white) = description(camera, 2);
    let normal = DVec3::new(0.8, 0.1, 0.6).normalize();
    let sheet = Mesh::rectangle().transformed(&facing(normal, DVec3::ZERO, 0.5));
    let bent = sheet.positions().iter().map(|p| normal + 3.0 * *p);
    let normals = Attribute { values: bent.collect(), triangles: sheet.triangles().to_vec() };
    d.add_shape("sheet", sheet.with_normals(Normals::Given(normals)).unwrap(), white);
    let leaf = facing(DVec3::new(0.0, 0.2, 1.0), DVec3::new(0.15, 0.25, 0.9), 0.2);
    d.add_shape("leaf", Mesh::rectangle().transformed(&leaf), white);
    let lamp = facing(DVec3::new(-1.0, -0.8, -0.4), DVec3::new(1.8, 1.4, 0.8), 0.4);
    d.add_emitter("lamp", Mesh::rectangle().transformed(&lamp), DVec3::splat(20.0));
    Scene::new(d).unwrap()
}

/// The upper face of a cube with the shading normals of a ball, seen from above, and a lamp at its side that
/// the plane of the face halves.
fn top() -> Scene {
    let camera = Camera::look_at(DVec3::new(0.6, 4.0, 0.1), DVec3::new(0.6, 1.0, 0.1), DVec3::NEG_Z, 0.1);
    let (mut d, white) = description(camera, 2);
    d.add_shape("cube", Mesh::cube().smooth(), white);
    let lamp = facing(DVec3::NEG_X, DVec3::new(3.0, 1.1, 0.0), 0.5);
    d.add_emitter("lamp", Mesh::rectangle().transformed(&lamp), DVec3::splat(20.0));
    let radiance = DVec3::new(0.2, 0.3, 0.4);
    d.environment = Some(Environment::Constant { id: "sky".to_owned(), radiance });
    Scene::new(d).unwrap()
}

fn moved(scene: &Scene, shape: usize, shift: DVec3, turn: DVec3) -> Tangent {
    let mut change = Tangent::still(scene);
    change.translate(scene, shape, shift);
    let corners = scene.description().shapes[shape].mesh.positions();
    let centre = corners.iter().sum::<DVec3>() / corners.len() as f64;
    change.rotate(scene, shape, centre, turn);
    change
}

/// A change of the sheet's normals alone.
pub(super) fn bent(scene: &Scene) -> Tangent {
    let mut change = Tangent::still(scene);
    let range = scene.normal_range(1);
    for (rate, n) in change.normals[range.clone()].iter_mut().zip(&scene.normals[range]) {
        *rate = DVec3::new(0.2, 1.0, 0.1).cross(*n);
    }
    change
}

/// Samples per pixel of differences and of warped area, where no terms cancel.
fn usual() -> [usize; 2] {
    if thorough() { [4096, 512] } else { [1024, 192] }
}

/// Samples per pixel as in [`usual`], where terms cancel.
const CANCELLING: [usize; 2] = [8192, 2048];

fn differences(scene: &Scene, change: &Tangent, [samples, _]: [usize; 2]) -> (f64, f64) {
    total(|seed| {
        // Noise is proportional to 1/√step, and the error to the square of the step: here it is less than a
        // thousandth.
        let method = FiniteDifference { samples, step: 2e-2, seed: 50 + seed };
        method.forward(scene, change, &Progress::none()).unwrap().gradient.pixels
    })
}

fn warped(
    scene: &Scene,
    change: &Tangent,
    field: Field,
    sign_changes: usize,
    [_, samples]: [usize; 2],
) -> (f64, f64) {
    total(|seed| {
        // Auxiliary rays have less noise per sample and are slower; wide fields are slower too, which matters
        // at large sample counts.
        let samples = match field {
            Field::AuxiliaryRays => samples / 2,
            WIDE => samples.min(512),
            _ => samples,
        };
        let method = WarpedArea { samples, field, sign_changes, seed, ..WarpedArea::default() };
        method.forward(scene, change, &Progress::none()).unwrap().gradient.pixels
    })
}

/// A field with a reach so large that it is nonzero on most of a curve.
const WIDE: Field = Field::JumpMean { film: 20.0, lobe: 4.0 };

/// A field that samples shadows, and with them the horizons of faces, which are the shadows that faces cast
/// on themselves.
const SOFTENED: Field =
    Field::Softened { film: 1.2, lobe: 0.5, softness: 0.4, silhouettes: 64, shadows: 128, bounces: 0 };

#[test]
fn sides_that_turn_are_found() {
    let (view, near, far) = (view(), sheet(3), sheet(5));
    let shift = DVec3::new(0.2, 0.5, -0.3);
    let turn = DVec3::new(0.3, 1.0, 0.2);
    // Where the wall moves, a wide field happens to follow the curve. That case shows that nothing is counted
    // twice; without sign changes nothing is missing there.
    let cases = [
        ("a leaf moves before a sheet", &view, moved(&view, 1, shift, DVec3::ZERO), true),
        ("a sheet in view turns", &view, moved(&view, 0, shift, turn), true),
        ("normals turn", &near, bent(&near), true),
        ("a wall moves", &near, moved(&near, 0, DVec3::new(0.2, 0.5, 0.3), DVec3::ZERO), false),
        ("a sheet turns between walls", &far, moved(&far, 1, shift, turn), true),
    ];
    let mut comparisons = Comparisons::of("warped::sides_that_turn_are_found");
    // The other cases take longer, as their terms cancel more strongly.
    let count = if thorough() { cases.len() } else { 2 };
    for (at, (name, scene, change, missed)) in cases.iter().enumerate().take(count) {
        let samples = if at < 2 { usual() } else { CANCELLING };
        let expected = differences(scene, change, samples);
        let split = WarpedArea { samples: 4096, seed: 9, ..WarpedArea::default() };
        let scale = terms(&split.forward_terms(scene, change, &Progress::none()).unwrap());
        // The tails of auxiliary rays are too heavy here to show a bias of 15 %. The samples of a curve are
        // the same for all fields.
        for field in [Field::default(), WIDE, SOFTENED] {
            // Where the wall moves, nearly all noise is that of the curve, and the terms are small in
            // comparison.
            let sign_changes = if *missed { 64 } else { 512 };
            let found = warped(scene, change, field, sign_changes, samples);
            comparisons.add(format!("{name}, {field:?}"), found, expected, 1e-3 * scale, scale);
        }
        if *missed {
            let without = warped(scene, change, WIDE, 0, samples);
            comparisons.reject(&format!("{name}, no sign changes"), without, expected);
        }
    }
    comparisons.finish();
}

/// Warped area does not sample horizons: the plane of a face is where its own edges are seen from within it,
/// and fields follow edges. Edge sampling's horizon term is a considerable part of the whole.
#[test]
fn horizons_are_silhouettes() {
    let scene = top();
    let change = moved(&scene, 0, DVec3::ZERO, DVec3::new(0.1, 0.2, 1.0));
    let expected = differences(&scene, &change, usual());
    let motion = Motion::new(&scene, &change);
    let moving = Moving::of(&scene, &motion);
    let paths = Paths::new(&scene, Kernels::default());
    let horizon = Horizons::new(&paths, &moving, Zero);
    let term = total(|seed| {
        let driver = Driver::new(&scene, seed, 9 * 256);
        driver.forward(&horizon, &motion, &Progress::none()).unwrap().mean
    });
    let mut comparisons = Comparisons::of("warped::horizons_are_silhouettes");
    for field in [Field::default(), WIDE, SOFTENED, Field::AuxiliaryRays] {
        let found = warped(&scene, &change, field, 64, usual());
        comparisons.add(format!("{field:?}"), found, expected, 1e-3 * expected.0.abs(), expected.0);
        let twice = (found.0 + term.0, found.1.hypot(term.1));
        comparisons.reject(&format!("{field:?}, horizon counted twice"), twice, expected);
    }
    comparisons.finish();
}

/// Curves on the film count in the primary term and others in the secondary term, and in the errors; without
/// shading normals both are zero.
#[test]
fn terms_are_kept_apart() {
    let turn = DVec3::new(0.3, 1.0, 0.2);
    let mut flat = view().description().clone();
    for shape in &mut flat.shapes {
        shape.mesh = Mesh::new(shape.mesh.positions().to_vec(), shape.mesh.triangles().to_vec()).unwrap();
    }
    let flat = Scene::new(flat).unwrap();
    for (scene, shape, counts) in
        [(view(), 0, [true, false]), (sheet(3), 1, [false, true]), (flat, 0, [false; 2])]
    {
        let change = moved(&scene, shape, DVec3::ZERO, turn);
        let [without, with] = [0, 4].map(|sign_changes| {
            let method = WarpedArea { samples: 16, sign_changes, ..WarpedArea::default() };
            method.forward_terms(&scene, &change, &Progress::none()).unwrap()
        });
        let [before, after] = [&without, &with].map(|image| image.terms.as_ref().unwrap());
        assert_eq!(before.interior, after.interior);
        assert_eq!([before.primary != after.primary, before.secondary != after.secondary], counts);
        assert_eq!(with.standard_error != without.standard_error, counts != [false; 2]);
        let grows = with.standard_error.pixels.iter().zip(&without.standard_error.pixels);
        assert!(grows.clone().all(|(a, b)| a.cmpge(*b * (1.0 - 1e-12)).all()));
        for (i, g) in with.gradient.pixels.iter().enumerate() {
            let sum = after.interior.pixels[i] + after.primary.pixels[i] + after.secondary.pixels[i];
            assert!((*g - sum).length() < 1e-12 * (1.0 + sum.length() + g.length()), "{g} {sum}");
        }
    }
}
