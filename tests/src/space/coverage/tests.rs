use flatland::random::{open01, stream};
use glam::DVec3;
use rayon::prelude::*;

use super::*;
use crate::effort::pick;
use crate::oracle;
use crate::space::worlds::{
    CoverageCase, CoverageKind, CoverageKnobs, CrossingKind, CrossingKnobs, CrossingMoving,
};
use crate::worst;

fn projected(case: &CoverageCase) -> ProjectedScene {
    let CoverageCase { mesh, camera, motion, filter, label } = case;
    ProjectedScene::new(mesh, camera, motion, *filter).unwrap_or_else(|e| panic!("{e}\n{label}"))
}

fn derivative(case: &CoverageCase) -> Image {
    projected(case).derivative().unwrap_or_else(|e| panic!("{e}\n{}", case.label))
}

/// I(θ) of the displaced mesh and camera, cut at the crossings it then has.
fn image_at(case: &CoverageCase, theta: f64) -> Option<Image> {
    let mesh = case.mesh.displaced(&case.motion, theta);
    let camera = case.camera.displaced(&case.motion.camera, theta);
    ProjectedScene::new(&mesh, &camera, &case.motion, case.filter).ok()?.image().ok()
}

fn largest(image: &Image) -> f64 {
    image.pixels().iter().map(|p| p.abs().max_element()).fold(0.0, f64::max)
}

/// Cases of some kinds and seeds.
fn cases(kinds: &[CoverageKind], seeds: std::ops::Range<u64>) -> Vec<CoverageCase> {
    let knobs = kinds.iter().flat_map(|&k| seeds.clone().map(move |s| CoverageKnobs::random(s, k)));
    knobs.collect::<Vec<_>>().par_iter().map(CoverageKnobs::build).collect()
}

/// Cases whose triangles pass through one another, of all kinds and motions: every `step`th.
fn crossing(seeds: std::ops::Range<u64>, step: usize) -> Vec<CoverageCase> {
    let movings = [&CrossingMoving::AT_REST[..], &CrossingMoving::MOVING].concat();
    let pairs = CrossingKind::ALL.iter().flat_map(|&k| movings.iter().map(move |&m| (k, m)));
    let knobs = pairs.flat_map(|(k, m)| seeds.clone().map(move |s| CrossingKnobs::random(s, k, m)));
    knobs.step_by(step).collect::<Vec<_>>().par_iter().map(CrossingKnobs::build).collect()
}

fn assert_below(limit: f64, cases: &[CoverageCase], figure: impl Fn(&CoverageCase) -> f64 + Sync) {
    worst::assert_below(limit, cases, |case| (figure(case), case.label.clone()));
}

/// Richardson's extrapolations (4 D(h/2) − D(h))/3 of central differences D, and the rounding of each.
///
/// Their error is O(h⁴) while no order changes within h and no vertex crosses a pixel's border, plus rounding
/// over h: the rounding of the coordinates, which may be far larger than the depths, times pixels per depth.
fn quotients(case: &CoverageCase) -> Vec<(Image, f64)> {
    let central = |h: f64| {
        let (after, before) = (image_at(case, h)?, image_at(case, -h)?);
        Some(after.zip(&before, |a, b| (a - b) / (2.0 * h)))
    };
    let coordinates = case.mesh.positions.iter().map(|p| p.length() / p.distance(case.camera.origin));
    let rounding = f64::EPSILON * case.camera.pixels_per_slope() * coordinates.fold(1.0, f64::max);
    let quotient = |h: f64| {
        let quotient = central(0.5 * h)?.zip(&central(h)?, |half, whole| (4.0 * half - whole) / 3.0);
        Some((quotient, 4.0 * rounding / h))
    };
    [1e-3, 1e-4, 1e-5, 1e-6].into_iter().filter_map(quotient).collect()
}

/// Ratio of discrepancy to tolerance between a derivative and difference quotients, the least of the sweep;
/// above 1 the derivative is rejected. In 432 other cases that cross, the largest such discrepancy was 3e-9
/// of the derivative.
fn denial(quotients: &[(Image, f64)], derivative: &Image) -> f64 {
    let excess = |(quotient, rounding): &(Image, f64)| {
        let error = largest(&quotient.zip(derivative, |a, b| a - b));
        error / (2e-8 * largest(derivative).max(1e-2) + rounding)
    };
    quotients.iter().map(excess).fold(f64::INFINITY, f64::min)
}

#[test]
fn derivatives_are_limits_of_differences() {
    let limit =
        |cases: &[CoverageCase]| assert_below(1.0, cases, |case| denial(&quotients(case), &derivative(case)));
    limit(&cases(&CoverageKind::ALL, 0..8));
    limit(&crossing(0..pick(1, 2), 1));
}

#[test]
fn wrong_derivatives_are_denied() {
    let mut tried = 0;
    for case in [cases(&CoverageKind::GENERIC, 0..4), crossing(0..1, pick(5, 2))].concat() {
        let exact = derivative(&case);
        if largest(&exact) < 1e-2 {
            continue;
        }
        tried += 1;
        let quotients = quotients(&case);
        for factor in [0.0, -1.0, 1.0 + 1e-6] {
            let wrong = exact.zip(&exact, |d, _| factor * d);
            assert!(denial(&quotients, &wrong) > 1.0, "{factor} times the derivative of {}", case.label);
        }
    }
    assert!(tried > 16, "{tried}");
}

#[test]
fn derivatives_and_values_are_those_of_the_slab_oracle() {
    let error = |case: &CoverageCase| {
        let projected = projected(case);
        let (image, derivative) = (projected.image().expect("an image"), derivative(case));
        let slabs = oracle::image(projected.scene(), projected.velocities(), projected.film());
        let errors =
            slabs.iter().zip(image.pixels()).zip(derivative.pixels()).map(|((slab, value), rate)| {
                let error =
                    (slab.value - value).abs().max_element() + (slab.derivative - rate).abs().max_element();
                error / (1.0 + slab.absolute)
            });
        errors.fold(0.0, f64::max)
    };
    assert_below(1e-9, &cases(&CoverageKind::ALL, 100..112), error);
    assert_below(1e-9, &crossing(100..101, 3), error);
}

/// The radiance of the nearest triangle along a ray (Möller and Trumbore 1997); NaN where its front faces
/// away.
fn cast(case: &CoverageCase, direction: DVec3) -> DVec3 {
    let mut nearest = (f64::INFINITY, case.mesh.background);
    for (corners, radiance) in case.mesh.triangles.iter().zip(&case.mesh.radiance) {
        let [a, b, c] = corners.map(|v| case.mesh.positions[v] - case.camera.origin);
        let across = direction.cross(c - a);
        let determinant = across.dot(b - a);
        let along = (-a).cross(b - a);
        let (u, v) = (across.dot(-a) / determinant, along.dot(direction) / determinant);
        let t = along.dot(c - a) / determinant;
        if u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t > 0.0 && t < nearest.0 {
            nearest = (t, if determinant > 0.0 { *radiance } else { DVec3::NAN });
        }
    }
    nearest.1
}

#[test]
fn the_plane_shows_what_rays_hit() {
    const SIDE: usize = 60;
    let wrong = |case: &CoverageCase| {
        let projected = projected(case);
        let size = DVec2::new(case.camera.width as f64, case.camera.height as f64);
        let points = (0..SIDE * SIDE)
            .map(|i| size * DVec2::new((i % SIDE) as f64 + 0.41, (i / SIDE) as f64 + 0.37) / SIDE as f64);
        let is_wrong = |u: &DVec2| {
            let scene = projected.scene();
            scene.value(scene.hit(*u).as_ref(), *u) != cast(case, case.camera.direction(*u))
        };
        points.filter(is_wrong).count() as f64
    };
    assert_below(1.0, &cases(&CoverageKind::ALL, 200..230), wrong);
    assert_below(1.0, &crossing(200..202, 1), wrong);
}

#[test]
fn most_cases_show_something_that_moves() {
    for kind in CoverageKind::ALL {
        let moves = (0..10).filter(|&s| largest(&derivative(&CoverageKnobs::random(s, kind).build())) > 1e-3);
        let moves = moves.count();
        assert!(moves >= 6, "{kind:?}: {moves} of 10");
    }
}

/// Across an edge, the projected velocity of a material point of the edge equals the linear interpolation, at
/// its image, of its end points' velocities; along the edge it does not.
#[test]
fn the_normal_velocity_of_a_projected_edge_is_linear_along_it() {
    let (mut across, mut along) = (0.0_f64, 0.0_f64);
    for seed in 0..200 {
        let case = CoverageKnobs::random(seed, CoverageKind::Solid).build();
        let point = |weights: [f64; 2]| {
            let mix = |of: &[DVec3]| weights[0] * of[0] + weights[1] * of[1];
            let (camera, motion) = (&case.camera, &case.motion);
            camera.project(&motion.camera, Vector3::new(mix(&case.mesh.positions), mix(&motion.positions)))
        };
        let (a, b) = (point([1.0, 0.0]), point([0.0, 1.0]));
        let edge = b.at - a.at;
        for t in [0.1, 0.35, 0.5, 0.8] {
            let material = point([1.0 - t, t]);
            let s = (material.at - a.at).dot(edge) / edge.length_squared();
            let error = material.velocity - a.velocity.lerp(b.velocity, s);
            let speed = a.velocity.length().max(b.velocity.length()).max(1e-300);
            across = across.max(error.perp_dot(edge.normalize()).abs() / speed);
            along = along.max(error.dot(edge.normalize()).abs() / speed);
        }
    }
    println!("across {across:e}, along {along:e}");
    assert!(across < 1e-12 && along > 1e-2, "across {across:e}, along {along:e}");
}

/// Triangles are cut if and only if they cross.
#[test]
fn only_what_crosses_is_cut() {
    for case in [cases(&CoverageKind::GENERIC, 0..4), crossing(0..2, 1)].concat() {
        let crosses = !crossings(&case.mesh, &case.motion).expect("valid").is_empty();
        let pieces = projected(&case).scene().shapes().len();
        assert_eq!(pieces > case.mesh.triangles.len(), crosses, "{}: {pieces}", case.label);
    }
}

/// A defect of a mesh and a camera, and a part of the error's message.
type Refused = (fn(&mut Mesh, &mut Camera), &'static str);

#[test]
fn what_is_not_a_scene_of_the_plane_is_an_error_that_names_it() {
    let refused: [Refused; 10] = [
        (|_, c| c.forward = -c.forward, "vertex 0 is at a depth"),
        (|_, c| c.right += 0.1 * c.up, "orthonormal"),
        (|_, c| c.field_of_view = 4.0, "field of view"),
        (|_, c| c.width = 0, "film"),
        (|m, _| m.positions[1].y = f64::NAN, "vertex 1 is not finite"),
        (|m, _| m.triangles[0][2] = 7, "triangle 0: [0, 1, 7] of 3 vertices"),
        (|m, _| m.radiance.clear(), "0 radiances for 1 triangles"),
        (|m, _| m.radiance[0].x = f64::INFINITY, "shape 0"),
        (|m, _| m.positions[2] = m.positions[0], "triangle 0 is no triangle"),
        (
            |m, _| {
                m.triangles.push(m.triangles[0]);
                m.radiance.push(DVec3::ONE);
            },
            "triangles 0 and 1 have no order",
        ),
    ];
    let CoverageCase { mesh, camera, motion, filter, .. } =
        CoverageKnobs::random(0, CoverageKind::Triangle).build();
    for (change, expected) in refused {
        let (mut mesh, mut camera) = (mesh.clone(), camera);
        change(&mut mesh, &mut camera);
        let error = ProjectedScene::new(&mesh, &camera, &motion, filter).expect_err(expected).to_string();
        assert!(error.contains(expected), "{error:?} for {expected:?}");
    }
}

#[test]
fn rings_of_triangles_that_hide_each_other_are_refused() {
    // Three blades around the line of sight, each with one end nearer.
    let camera = Camera {
        origin: DVec3::ZERO,
        right: DVec3::X,
        up: DVec3::Y,
        forward: -DVec3::Z,
        field_of_view: 1.0,
        width: 4,
        height: 4,
    };
    let blade = |k: u32| {
        let turn = |x: f64, y: f64, z: f64| {
            DVec2::from_angle(f64::from(k) * std::f64::consts::TAU / 3.0).rotate(DVec2::new(x, y)).extend(z)
        };
        [turn(0.2, -1.0, -3.5), turn(0.3, 1.0, -2.5), turn(0.4, -1.0, -3.5)]
    };
    let positions: Vec<_> = (0..3).flat_map(blade).collect();
    let mesh = Mesh {
        triangles: vec![[0, 1, 2], [3, 4, 5], [6, 7, 8]],
        radiance: vec![DVec3::ONE; 3],
        background: DVec3::ZERO,
        positions,
    };
    let motion = Motion { positions: vec![DVec3::ZERO; 9], ..Motion::default() };
    let error = ProjectedScene::new(&mesh, &camera, &motion, Filter::Box).expect_err("a ring").to_string();
    assert!(error.contains("ring"), "{error}");
}

#[test]
fn any_numbers_are_answered_or_refused() {
    let mut answers = 0;
    for seed in 0..1000 {
        let mut rng = stream(seed, &[]);
        let kind = CoverageKind::ALL[seed as usize % CoverageKind::ALL.len()];
        let mut case = CoverageKnobs::random(seed % 50, kind).build();
        for _ in 0..3 {
            let mut index = |n: usize| (open01(&mut rng) * n as f64) as usize;
            let (number, axis) = (worst::HOSTILE[index(12)], index(3));
            let vertex = index(case.mesh.positions.len());
            match index(6) {
                0 => case.mesh.positions[vertex][axis] = number,
                1 => case.motion.positions[vertex][axis] = number,
                2 => case.camera.origin[axis] = number,
                3 => case.camera.field_of_view = number,
                4 => case.motion.camera.angular[axis] = number,
                _ => case.mesh.positions[vertex] = case.mesh.positions[0],
            }
        }
        let CoverageCase { mesh, camera, motion, filter, .. } = &case;
        let answer = ProjectedScene::new(mesh, camera, motion, *filter).and_then(|p| p.derivative());
        if let Ok(image) = answer {
            answers += 1;
            assert!(image.pixels().iter().all(|p| p.is_finite()), "seed {seed}");
        }
    }
    println!("{answers} answers");
    assert!(answers > 100, "{answers}");
}
