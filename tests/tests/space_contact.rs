//! Shadows of occluders that touch a lamp, or nearly do, compared with Lambert's formula over clipped
//! polygons.
//!
//! A plate hangs from a lamp, or a block stands under it, at gaps down to 0, and moves along the lamp. Light
//! that passes an edge near a lamp comes from all directions at once; at gap 0 it comes from the edge itself.
//! Each scene therefore has a slope of its own, and the standard error of one sample must not grow as the gap
//! closes.

use flatland::plane::Filter;
use glam::DVec3;
use rayon::prelude::*;
use tests::campaign::{Verdict, halves};
use tests::comparison::Estimate;
use tests::effort::pick;
use tests::power::Power;
use tests::space::campaign::{Known, limits, reject};
use tests::space::coverage::{Camera, CameraMotion};
use tests::space::direct::DirectScene;
use tests::space::irradiance::{Ground, Surface, World};
use volume3d::gradient::{EdgeSampling, Field, WarpedArea};

/// Gaps, relative to the size of the lamp.
const GAPS: [f64; 3] = [0.0, 1e-6, 1e-1];

/// Sizes of lamps, relative to the distance of the ground, roughly.
const LAMPS: [f64; 3] = [0.1, 1.0, 0.01];

/// Height of the lamp.
const HEIGHT: f64 = 2.0;

/// The occluder below the lamp.
#[derive(Clone, Copy, Debug)]
enum Shape {
    Plate,
    Block,
}

/// A square of n × n squares that face down, each a separate emitter.
fn squares(lamp: f64, n: usize) -> impl Iterator<Item = Surface> {
    let corner = move |i: usize, j: usize| {
        let at = |k: usize| lamp * (k as f64 / n as f64 - 0.5);
        DVec3::new(at(i), HEIGHT, at(j))
    };
    (0..n * n).map(move |k| {
        let (i, j) = (k % n, k / n);
        let corners = vec![corner(i, j), corner(i + 1, j), corner(i + 1, j + 1), corner(i, j + 1)];
        Surface::emitter(corners, DVec3::new(8.0, 7.0, 5.0) / lamp.powi(2))
    })
}

/// Vertical faces over the sides of a polygon, from `top` down, and the faces that close them above and
/// below.
fn below(top: f64, ring: &[DVec3], closed: bool) -> Vec<Surface> {
    let down = -0.6 * DVec3::Y;
    let ring: Vec<DVec3> = ring.iter().map(|p| *p + top * DVec3::Y).collect();
    let count = if closed { ring.len() } else { 1 };
    let side = |i: usize| {
        let (p, q) = (ring[i], ring[(i + 1) % ring.len()]);
        Surface::occluder(vec![p, q, q + down, p + down])
    };
    let mut faces: Vec<Surface> = (0..count).map(side).collect();
    if closed {
        // At gap 0 the lid coincides with the lamp: the sides and the base occlude all that it occludes.
        faces.push(Surface::occluder(ring.iter().map(|p| *p + down).collect()));
    }
    faces
}

/// A camera above the ground, which may move as well.
fn scene((lamp, parts): (f64, usize), gap: f64, shape: Shape, ground: DVec3) -> Known {
    let turned =
        |x: f64, z: f64| DVec3::new(0.94 * x + 0.34 * z + 0.1, 0.0, -0.34 * x + 0.94 * z + 0.05) * lamp;
    let top = HEIGHT - gap * lamp;
    let mut surfaces = match shape {
        Shape::Plate => below(top, &[turned(-0.2, 0.0), turned(0.25, 0.0)], false),
        Shape::Block => {
            let ring = [turned(-0.2, -0.15), turned(0.25, -0.15), turned(0.25, 0.15), turned(-0.2, 0.15)];
            below(top, &ring, true)
        }
    };
    for surface in &mut surfaces {
        surface.velocities = vec![DVec3::new(0.7, 0.0, 0.5) * lamp; surface.vertices.len()];
    }
    surfaces.extend(squares(lamp, parts));
    let forward = DVec3::new(0.1, -1.0, 0.2).normalize();
    let right = forward.any_orthonormal_vector();
    let camera = Camera {
        origin: DVec3::new(0.3, 0.9, -0.1),
        right,
        up: right.cross(forward),
        forward,
        field_of_view: 1.8,
        width: 4,
        height: 4,
    };
    let corners = [DVec3::ZERO, DVec3::Z, DVec3::X].map(|p| 40.0 * p - DVec3::new(10.0, 0.0, 10.0));
    let direct = DirectScene {
        world: World { surfaces, environment: DVec3::ZERO },
        ground: Ground { corners, velocities: [ground; 3] },
        albedo: DVec3::new(0.8, 0.7, 0.6),
        camera,
        camera_motion: CameraMotion::default(),
        filter: Filter::Tent,
    };
    Known::of_direct(
        &direct,
        1e-3,
        &format!("{shape:?}, lamp {lamp} of {parts}², gap {gap:e}, ground {ground}"),
    )
}

fn edges() -> EdgeSampling {
    let samples = 32;
    EdgeSampling {
        samples,
        primary: samples,
        secondary: 10 * samples,
        bounces: 1,
        seed: 0,
        allow_missing: vec![],
    }
}

fn softened() -> WarpedArea {
    WarpedArea { samples: 32, field: Field::softened(640), ..WarpedArea::default() }
}

/// Scenes with all gaps.
fn scenes(gaps: &[f64], shape: Shape, lamp: (f64, usize), ground: DVec3) -> Vec<Known> {
    gaps.par_iter().map(|&gap| scene(lamp, gap, shape, ground)).collect()
}

/// Judges each scene, all scenes together, and the standard error at every gap relative to the widest.
fn judge(power: &mut Power, name: &str, known: &[Known], estimate: impl Fn(&Known, u64) -> Estimate + Sync) {
    let found = halves(known, estimate);
    let error =
        |(k, [a, b]): (&Known, &[Estimate; 2])| a.standard_error.hypot(b.standard_error) / k.exact.abs();
    let errors: Vec<f64> = known.iter().zip(&found).map(error).collect();
    println!("{name}: relative errors {errors:.4?}");
    let widest = errors[errors.len() - 1];
    assert!(errors.iter().all(|e| *e < 3.0 * widest), "{name}: {errors:?}");
    Verdict::on(known.iter().zip(&found)).accept(power, name, limits());
}

#[test]
fn shadows_of_what_touches_a_lamp() {
    let mut power = Power::of("space_contact::shadows_of_what_touches_a_lamp");
    for shape in [Shape::Plate, Shape::Block] {
        for &lamp in pick(&LAMPS[1..], &LAMPS[..]) {
            let known = scenes(&GAPS, shape, (lamp, 1), DVec3::ZERO);
            judge(&mut power, &format!("edge sampling, {shape:?}, lamp {lamp}"), &known, |k, half| {
                k.estimate(half, &edges())
            });
        }
    }
    // More triangles than the limit up to which directions are sampled towards each one.
    let known = scenes(&GAPS, Shape::Plate, (1.0, 6), DVec3::ZERO);
    let more = EdgeSampling { secondary: 3 * edges().secondary, ..edges() };
    judge(&mut power, "edge sampling, many lamps", &known, |k, half| k.estimate(half, &more));
    // Towards lamps a softened field is 0: edge sampling again, except for points that slide with the film's
    // field.
    let known = scenes(&GAPS, Shape::Plate, (0.1, 1), DVec3::new(0.02, 0.01, 0.03));
    judge(&mut power, "softened, over a ground that moves", &known, |k, half| k.estimate(half, &softened()));
}

#[test]
fn without_their_shadows_they_are_rejected() {
    let known = scenes(&GAPS[..2], Shape::Plate, (1.0, 1), DVec3::ZERO);
    reject("no shadows", &known, |k, half| {
        k.estimate(half, &WarpedArea { warps: false, samples: 32, ..WarpedArea::default() })
    });
}
