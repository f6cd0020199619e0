//! Tests of textured emitters: their light and its derivatives, against quadrature over lamp and film.

use std::f64::consts::{FRAC_1_PI, PI};

use glam::{DAffine2, DVec2};

use super::*;
use crate::geometry::Attribute;
use crate::scene::{Texture, Wrap};

/// Texels of the lamp, row by row from the top, equal in the three channels.
const TEXELS: [f64; 4] = [3.0, 0.5, 1.0, 0.3];
/// The sheet's reflectance.
const REFLECTANCE: f64 = 0.8;
const COLUMNS: usize = 4;
/// The lamp's centre.
const CENTRE: DVec3 = DVec3::new(0.9, 0.4, 1.5);

/// A motion of the lamp as a function of the step.
type Motion = fn(f64) -> DAffine3;

fn sideways(step: f64) -> DAffine3 {
    DAffine3::from_translation(step * DVec3::new(1.0, 0.5, 0.3))
}

/// Rotation about the lamp's normal.
fn turning(step: f64) -> DAffine3 {
    let centre = DAffine3::from_translation(CENTRE);
    centre * DAffine3::from_rotation_z(step) * centre.inverse()
}

fn lamp(seam: bool) -> Mesh {
    let mesh = Mesh::rectangle()
        .transformed(&(at(CENTRE.x, CENTRE.y, CENTRE.z, 0.5) * DAffine3::from_rotation_y(PI)));
    if !seam {
        return mesh;
    }
    // The texture is discontinuous between the two triangles.
    let values =
        [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.1, 0.9], [0.3, 0.7], [0.9, 0.8]].map(DVec2::from_array);
    mesh.with_uvs(Attribute { values: values.to_vec(), triangles: vec![[0, 1, 2], [3, 4, 5]] }).unwrap()
}

fn texture(texels: [f64; 4]) -> Texture {
    let texels = texels.map(DVec3::splat).to_vec();
    let (id, wrap) = ("slide".to_owned(), Wrap::Clamp);
    Texture { id, width: 2, height: 2, texels, wrap, to_uv: DAffine2::IDENTITY }
}

/// A sheet that fills the film below a lamp out of view; or the lamp alone, seen from the front.
fn scene(seen: bool, seam: bool) -> Description {
    let camera = if seen {
        Camera::look_at(DVec3::new(0.9, 0.4, -1.0), DVec3::new(0.9, 0.4, 0.0), DVec3::Y, 0.9)
    } else {
        Camera::look_at(DVec3::new(0.0, 0.5, 3.0), DVec3::ZERO, DVec3::Y, 0.3)
    };
    let filter = if seen { Filter::Tent { radius: 1.0 } } else { Filter::Box };
    let mut d = Description::new(camera, film(COLUMNS, filter));
    d.integrator.max_depth = Some(2);
    d.add_texture(texture(TEXELS));
    d.add_emitter("lamp", lamp(seam), DVec3::ONE);
    d.shapes[0].radiance_texture = Some(0);
    if !seen {
        let paper = d.add_material(Material::diffuse("paper", DVec3::splat(REFLECTANCE)));
        d.add_shape("sheet", Mesh::rectangle(), paper);
    }
    d
}

/// The texture at a point, implemented independently.
fn looked_up(texels: [f64; 4], uv: DVec2) -> f64 {
    let [x, y] = [2.0 * uv.x - 0.5, 2.0 * (1.0 - uv.y) - 0.5].map(|x| x.clamp(0.0, 1.0));
    let [a, b, c, d] = texels;
    (a * (1.0 - x) + b * x) * (1.0 - y) + (c * (1.0 - x) + d * x) * y
}

/// Number of subdivisions of each side of the lamp's triangles.
const PARTS: usize = 24;

/// Σ f(y, n, L dA) over small parts of the lamp after a motion.
fn over_the_lamp(
    d: &Description,
    map: &DAffine3,
    texels: [f64; 4],
    mut f: impl FnMut(DVec3, DVec3, f64) -> f64,
) -> f64 {
    let mesh = &d.shapes[0].mesh;
    let uvs = mesh.uvs().unwrap();
    let mut sum = 0.0;
    for (corners, places) in mesh.triangles().iter().zip(&uvs.triangles) {
        let p = corners.map(|k| map.transform_point3(mesh.positions()[k as usize]));
        let uv = places.map(|k| uvs.values[k as usize]);
        let cross = (p[1] - p[0]).cross(p[2] - p[0]);
        let part = 0.5 * cross.length() / (PARTS * PARTS) as f64;
        for i in 0..PARTS {
            for j in 0..PARTS - i {
                for (shift, whole) in [(1.0 / 3.0, true), (2.0 / 3.0, i + j + 1 < PARTS)] {
                    let [b, c] = [i, j].map(|k| (k as f64 + shift) / PARTS as f64);
                    let weights = [1.0 - b - c, b, c];
                    let y = weights[0] * p[0] + weights[1] * p[1] + weights[2] * p[2];
                    let at = weights[0] * uv[0] + weights[1] * uv[1] + weights[2] * uv[2];
                    if whole {
                        sum += f(y, cross.normalize(), looked_up(texels, at) * part);
                    }
                }
            }
        }
    }
    sum
}

/// Number of points along each side of the film.
const POINTS: usize = 16;

/// The pixels weighted by column where the lamp is in view, so that its position on the film matters. Under a
/// tent filter the sum over the film is the mean of ½ + x, with x the film coordinate.
fn weighted(d: &Description, image: Image) -> Vec<DVec3> {
    let weight = |i: usize| if d.shapes.len() == 1 { 1.0 + (i % COLUMNS) as f64 } else { 1.0 };
    image.pixels.iter().enumerate().map(|(i, pixel)| *pixel * weight(i)).collect()
}

/// The weighted sum of all pixels and channels, by quadrature.
fn expected(d: &Description, map: &DAffine3, texels: [f64; 4]) -> f64 {
    let Camera { origin, right, up, forward, field_of_view, .. } = d.camera;
    let focal = 0.5 * COLUMNS as f64 / (0.5 * field_of_view).tan();
    if d.shapes.len() == 1 {
        // A part of the lamp covers f² |n·(y − o)| dA/z³ pixels.
        return 3.0
            * over_the_lamp(d, map, texels, |y, n, light| {
                let way = y - origin;
                let (depth, column) = (way.dot(forward), way.dot(right));
                let place = 0.5 + 0.5 * COLUMNS as f64 + focal * column / depth;
                place * focal * focal * n.dot(way).abs() / depth.powi(3) * light
            });
    }
    let mut sum = 0.0;
    for k in 0..POINTS * POINTS {
        let side = |k: usize| ((k as f64 + 0.5) / POINTS as f64 - 0.5) * COLUMNS as f64 / focal;
        let way = forward + side(k % POINTS) * right + side(k / POINTS) * up;
        // The sheet is at z = 0 with normal z.
        let x = origin - way * (origin.z / way.z);
        sum += over_the_lamp(d, map, texels, |y, n, light| {
            let (to, squared) = ((y - x).normalize(), x.distance_squared(y));
            REFLECTANCE * FRAC_1_PI * to.z * (-n.dot(to)).max(0.0) / squared * light
        });
    }
    3.0 * sum * (COLUMNS * COLUMNS) as f64 / (POINTS * POINTS) as f64
}

fn rate(d: &Description, motion: Motion, texels: [f64; 4]) -> f64 {
    const STEP: f64 = 1e-3;
    (expected(d, &motion(STEP), texels) - expected(d, &motion(-STEP), texels)) / (2.0 * STEP)
}

/// Velocities of the lamp's vertices.
fn change(scene: &Scene, motion: Motion) -> Tangent {
    const STEP: f64 = 1e-4;
    let mut change = Tangent::still(scene);
    let positions = scene.description().shapes[0].mesh.positions();
    for (rate, p) in change.positions_of_mut(scene, 0).iter_mut().zip(positions) {
        *rate = (motion(STEP).transform_point3(*p) - motion(-STEP).transform_point3(*p)) / (2.0 * STEP);
    }
    change
}

/// Relative difference between the quadrature and one with twice as many points.
const QUADRATURE: f64 = 4e-3;

#[test]
fn textured_lamps_and_their_motion_are_as_quadrature_has_them() {
    let mut comparisons = Comparisons::of("textured_lamps_and_their_motion_are_as_quadrature_has_them");
    let none = Progress::none();
    let mean = [TEXELS.iter().sum::<f64>() / 4.0; 4];
    for (seen, seam) in [(false, false), (false, true), (true, false), (true, true)] {
        let d = scene(seen, seam);
        let scene = Scene::new(d.clone()).unwrap();
        let name = format!(
            "lamp that is {}{}",
            if seen { "seen" } else { "not seen" },
            if seam { ", with a seam" } else { "" }
        );
        let light = expected(&d, &DAffine3::IDENTITY, TEXELS);
        let samples = if seen { 128 } else { 384 };
        let found = total(|seed| weighted(&d, render(&scene, samples, seed, &none).unwrap().image));
        comparisons.add(format!("{name}, image"), found, (light, 0.0), QUADRATURE * light, light);
        comparisons.reject(
            "a lamp without its texture",
            found,
            (expected(&d, &DAffine3::IDENTITY, mean), 0.0),
        );
        // A rotation hardly changes the light that the sheet receives.
        let motions = [(sideways as Motion, "moves"), (turning, "turns")];
        for (motion, verb) in motions.into_iter().take(if seen { 2 } else { 1 }) {
            let change = change(&scene, motion);
            let exact = rate(&d, motion, TEXELS);
            // The effect of a rotation is smaller: it is compared with the effect of a translation of this
            // lamp.
            let scale = exact.abs().max(rate(&d, sideways, TEXELS).abs());
            let warped = total(|seed| {
                let method = WarpedArea { samples, seed, ..WarpedArea::default() };
                weighted(&d, method.forward(&scene, &change, &none).unwrap().gradient)
            });
            let edges = total(|seed| {
                let method = EdgeSampling {
                    samples,
                    primary: samples,
                    secondary: samples,
                    bounces: samples,
                    seed,
                    allow_missing: vec![],
                };
                weighted(&d, method.forward(&scene, &change, &none).unwrap().gradient)
            });
            for (method, found) in [("warped area", warped), ("edge sampling", edges)] {
                comparisons.add(
                    format!("{name}, {verb}, {method}"),
                    found,
                    (exact, 0.0),
                    QUADRATURE * scale,
                    scale,
                );
                if (seen || !seam) && method == "warped area" {
                    comparisons.reject("a texture that stays behind", found, (rate(&d, motion, mean), 0.0));
                }
            }
        }
    }
    comparisons.finish();
}

/// An edge moves between the sheet and a lamp with a discontinuous texture: the shadow of a texture.
#[test]
fn shadows_of_textured_lamps_move() {
    let mut comparisons = Comparisons::of("shadows_of_textured_lamps_move");
    let none = Progress::none();
    let mut d = scene(false, true);
    d.add_shape("blocker", Mesh::rectangle().transformed(&at(1.1, 0.3, 0.9, 0.6)), 0);
    let scene = Scene::new(d).unwrap();
    let mut change = Tangent::still(&scene);
    change.translate(&scene, 2, DVec3::new(1.0, 0.3, 0.2));
    let differences = total(|seed| {
        let method = FiniteDifference { samples: 1024, step: 2e-2, seed };
        method.forward(&scene, &change, &none).unwrap().gradient.pixels
    });
    let warped = total(|seed| {
        let method = WarpedArea { samples: 384, seed, ..WarpedArea::default() };
        method.forward(&scene, &change, &none).unwrap().gradient.pixels
    });
    let edges = total(|seed| {
        let method = EdgeSampling {
            samples: 64,
            primary: 64,
            secondary: 128,
            bounces: 128,
            seed,
            allow_missing: vec![],
        };
        method.forward(&scene, &change, &none).unwrap().gradient.pixels
    });
    for (method, found) in [("warped area", warped), ("edge sampling", edges)] {
        comparisons.add(method.to_owned(), found, differences, 0.0, differences.0);
    }
    comparisons.finish();
}

/// Derivatives by the lamp's texels and vertices are equal forward and in reverse, and an image is linear in
/// the texels.
#[test]
fn texels_of_lamps_have_derivatives() {
    let none = Progress::none();
    for seam in [false, true] {
        let scene = Scene::new(scene(false, seam)).unwrap();
        let mut texels = Tangent::still(&scene);
        texels.texels[0] = TEXELS.map(DVec3::splat).to_vec();
        let method = WarpedArea { samples: 16, ..WarpedArea::default() };
        let image = method.forward(&scene, &texels, &none).unwrap();
        for (light, rate) in image.image.pixels.iter().zip(&image.gradient.pixels) {
            assert!((*light - *rate).length() < 1e-9 * light.length(), "{light} {rate}");
        }
        let mut change = change(&scene, turning);
        change.texels[0] = [0.3, -0.1, 0.2, 0.5].map(DVec3::splat).to_vec();
        change.radiance[0] = DVec3::new(0.1, 0.2, 0.3);
        let mut active = ActiveParameters::nothing(&scene);
        (active.shapes[0], active.lights) = (true, true);
        let adjoint = random_adjoint(scene.size());
        let image = method.forward(&scene, &change, &none).unwrap().gradient;
        let forward: f64 = image.pixels.iter().zip(&adjoint.pixels).map(|(a, b)| a.dot(*b)).sum();
        let reverse = method.reverse(&scene, &adjoint, &active, &none).unwrap().by_parameter.dot(&change);
        assert!((forward - reverse).abs() < 1e-9 * forward.abs(), "{forward} {reverse}");
    }
}
