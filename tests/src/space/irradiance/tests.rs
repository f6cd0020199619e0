use flatland::random::{open01, stream};

use super::*;
use crate::quadrature::rule;
use crate::space::constants::{
    BOX_FACES, box_corners, element_to_parallel_rectangle, parallel_rectangles, perpendicular_rectangles,
};
use crate::space::worlds::{IrradianceCase, IrradianceKind, IrradianceKnobs, IrradianceMoving};
use crate::worst;

fn exact(case: &IrradianceCase) -> Irradiance {
    irradiance(&case.world, &case.receiver).unwrap_or_else(|e| panic!("{e}\n{}", case.label))
}

/// E(θ) of the displaced world, ground and ray.
fn value_at(case: &IrradianceCase, theta: f64) -> DVec3 {
    let receiver = Receiver::on_ray(&case.ray.displaced(theta), &case.ground.displaced(theta));
    let receiver = receiver.unwrap_or_else(|e| panic!("{e}\n{} at {theta}", case.label));
    let value = irradiance(&case.world.displaced(theta), &receiver);
    value.unwrap_or_else(|e| panic!("{e}\n{} at {theta}", case.label)).value
}

/// Asserts that a figure is below a limit in all cases of all kinds and some seeds.
fn assert_below(
    limit: f64,
    seeds: std::ops::Range<u64>,
    figure: impl Fn(IrradianceKind, &IrradianceCase) -> f64 + Sync,
) {
    let knobs =
        IrradianceKind::ALL.iter().flat_map(|&k| seeds.clone().map(move |s| IrradianceKnobs::random(s, k)));
    worst::assert_below(limit, knobs, |knobs| {
        let case = knobs.build();
        (figure(knobs.kind, &case), case.label)
    });
}

/// The largest ratio of a coordinate to a distance from the receiver, by which rounding is amplified.
fn condition(case: &IrradianceCase) -> f64 {
    let x = case.receiver.point;
    let points = case.world.surfaces.iter().flat_map(|s| &s.vertices).chain(&case.ground.corners);
    points.map(|p| p.length().max(x.length()) / p.distance(x)).fold(1.0, f64::max)
}

/// Ratio of discrepancy to tolerance between a derivative and central differences; above 1 the derivative is
/// rejected.
///
/// The error of a difference is O(h²) while no edge crosses another within h, plus rounding of the
/// coordinates over h. Only gaps of 1e-9 between edges and emitters of 1e-6 need the smallest steps. Of
/// 30,000 other cases, 99 in 100 were within 1e-8 of the terms' sum at their best step, except cases with
/// gaps and cases far from the origin.
fn denial(kind: IrradianceKind, case: &IrradianceCase, light: &Irradiance) -> f64 {
    let brightness = case.world.surfaces.iter().map(|s| s.radiance.max_element()).fold(1.0, f64::max);
    let rounding = f64::EPSILON * brightness * condition(case);
    let excess = |h: f64| {
        let quotient = (value_at(case, h) - value_at(case, -h)) / (2.0 * h);
        (quotient - light.derivative).abs().max_element() / (1e-8 * light.absolute + rounding / h)
    };
    let smallest = match kind {
        IrradianceKind::AlignedEdges | IrradianceKind::TinyEmitter => 10,
        _ => 6,
    };
    (3..=smallest).map(|k| excess(10.0_f64.powi(-k))).fold(f64::INFINITY, f64::min)
}

#[test]
fn derivatives_are_limits_of_central_differences() {
    assert_below(1.0, 0..100, |kind, case| denial(kind, case, &exact(case)));
}

#[test]
fn wrong_derivatives_are_denied() {
    let mut tried = 0;
    for kind in IrradianceKind::GENERIC {
        for seed in 0..40 {
            let case = IrradianceKnobs::random(seed, kind).build();
            let light = exact(&case);
            if light.derivative.abs().max_element() < 1e-2 * light.absolute.max(1.0) {
                continue;
            }
            tried += 1;
            for factor in [0.0, -1.0, 1.0 + 1e-5] {
                let wrong = Irradiance { derivative: factor * light.derivative, ..light };
                assert!(denial(kind, &case, &wrong) > 1.0, "{factor} times the derivative of {}", case.label);
            }
        }
    }
    assert!(tried > 40, "{tried}");
}

/// ∫ max(0, n·ω) V dω over one surface, on a jittered grid over each triangle of its fan, with the standard
/// error, which includes the largest cell: where an edge cuts few cells, both samples of each may be on one
/// side of it by chance.
fn sampled(case: &IrradianceCase, i: usize, seed: u64) -> [f64; 2] {
    const SIDE: usize = 120;
    let (x, n) = (case.receiver.point, case.receiver.normal.normalize());
    let surface = &case.world.surfaces[i];
    let mut rng = stream(seed, &[i as u64]);
    let (mut sum, mut variance, mut largest) = (0.0, 0.0, 0.0_f64);
    for k in 2..surface.vertices.len() {
        let [a, b, c] = [0, k - 1, k].map(|v| surface.vertices[v]);
        let twice_area = (b - a).cross(c - a);
        let mut f = |col: usize, row: usize| {
            let s = ((col as f64 + open01(&mut rng)) / SIDE as f64).sqrt();
            let t = (row as f64 + open01(&mut rng)) / SIDE as f64;
            let point = a + s * (b - a).lerp(c - a, t);
            let others = case.world.surfaces.iter().enumerate().filter(|(j, _)| *j != i);
            if others.into_iter().any(|(_, other)| other.hides(x, point)) {
                return 0.0;
            }
            let d = point - x;
            n.dot(d).max(0.0) * 0.5 * twice_area.dot(d).abs() / d.length_squared().powi(2)
        };
        let cells = (SIDE * SIDE) as f64;
        for cell in 0..SIDE * SIDE {
            let (f, g) = (f(cell % SIDE, cell / SIDE), f(cell % SIDE, cell / SIDE));
            sum += 0.5 * (f + g) / cells;
            variance += (0.5 * (f - g) / cells).powi(2);
            largest = largest.max(f.max(g) / cells);
        }
    }
    [sum, variance.sqrt().hypot(largest)]
}

#[test]
fn factors_are_those_of_sampled_visibility() {
    let error = |_, case: &IrradianceCase| {
        let factors = factors(&case.world, &case.receiver).expect("factors");
        let deviations = factors.iter().enumerate().map(|(i, factor)| {
            let [mean, error] = sampled(case, i, 7);
            (mean - factor.value).abs() / (error + 1e-9 * factor.value.abs() + 1e-12)
        });
        deviations.fold(0.0, f64::max)
    };
    // About 1100 comparisons of cells that are nearly, not quite, independent and normal: a false alarm rate
    // of 1e-4 is |z| = 5.3.
    assert_below(5.3, 500..530, error);
}

/// The faces of a box, seen from inside.
fn room(radiance: DVec3) -> World {
    let corners = box_corners(DVec3::new(-1.0, -2.0, 0.0), DVec3::new(2.0, 1.5, 2.5));
    let face = |face: &[usize; 4]| {
        let mut vertices: Vec<_> = face.iter().map(|&v| corners[v]).collect();
        vertices.reverse();
        Surface::emitter(vertices, radiance)
    };
    World { surfaces: BOX_FACES.iter().map(face).collect(), environment: DVec3::ZERO }
}

#[test]
fn in_a_closed_room_the_irradiance_is_pi_whatever_moves() {
    let radiance = DVec3::new(1.0, 0.5, 2.0);
    let mut world = room(radiance);
    let lit = [0.2, -0.7, 1.1].into();
    let mut receiver = Receiver {
        velocity: DVec3::new(0.3, 0.2, -0.5),
        normal_rate: DVec3::new(-1.0, 0.4, 0.3),
        ..Receiver::still(lit, DVec3::new(0.3, -0.5, 0.4))
    };
    let check = |world: &World, receiver: &Receiver| {
        let light = irradiance(world, receiver).expect("irradiance");
        assert!((light.value - PI * radiance).abs().max_element() < 1e-13, "{}", light.value);
        assert!(light.derivative.abs().max_element() < 1e-13 * (1.0 + light.absolute), "{light:?}");
        light.absolute
    };
    assert!(check(&world, &receiver) > 0.1);
    // For a receiver on a wall, that wall is left out and the world's own room emits again.
    world.surfaces.remove(4);
    receiver.point.z = 0.0;
    (receiver.normal, receiver.velocity.z, receiver.normal_rate) = (DVec3::Z, 0.0, DVec3::ZERO);
    check(&world, &receiver);
    // An object in the room of the same radiance replaces exactly the walls that it hides.
    let glowing = vec![DVec3::new(0.1, 0.3, 0.7), DVec3::new(0.6, -0.4, 0.9), DVec3::new(-0.3, -0.9, 0.6)];
    let mut glowing = Surface { sides: Sides::Both, ..Surface::emitter(glowing, radiance) };
    glowing.velocities = vec![DVec3::X, DVec3::Y, DVec3::new(0.3, 0.2, -1.0)];
    world.surfaces.push(glowing);
    check(&world, &receiver);
    // One wall is replaced by an environment of the same radiance.
    world.surfaces.remove(1);
    world.environment = radiance;
    check(&world, &receiver);
}

/// The mean irradiance over the receiver [0, w] × [0, l] of the plane z = 0, over π. Nodes are dense at x = 0
/// and at both ends of y, near which a wall at x = 0 makes the integrand not smooth.
fn mean_form_factor(world: &World, w: f64, l: f64) -> f64 {
    let rule = rule(40);
    let row = |&(s, ws): &(f64, f64)| -> f64 {
        let at = |&(t, wt): &(f64, f64)| {
            let (x, y) = (w * s.powi(4), l * t.powi(3) * (10.0 - 15.0 * t + 6.0 * t * t));
            let (dx, dy) = (4.0 * s.powi(3), 30.0 * (t * (1.0 - t)).powi(2));
            let receiver = Receiver::still(DVec3::new(x, y, 0.0), DVec3::Z);
            ws * wt * dx * dy * factors(world, &receiver).expect("factors")[0].value / PI
        };
        rule.iter().map(at).sum()
    };
    rule.iter().map(row).sum()
}

#[test]
fn form_factors_are_those_of_the_literature() {
    let (a, b, c) = (1.3, 0.8, 0.6);
    let above = [(0.0, 0.0), (0.0, b), (a, b), (a, 0.0)].map(|(x, y)| DVec3::new(x, y, c));
    let facing =
        World { surfaces: vec![Surface::emitter(above.to_vec(), DVec3::ONE)], environment: DVec3::ZERO };
    let corner = factors(&facing, &Receiver::still(DVec3::ZERO, DVec3::Z)).expect("factors")[0];
    assert!((corner.value / PI - element_to_parallel_rectangle(a, b, c)).abs() < 1e-15);
    let parallel = mean_form_factor(&facing, a, b) - parallel_rectangles(a, b, c);
    assert!(parallel.abs() < 1e-12, "{parallel:e}");

    let (h, w, l) = (0.9, 1.2, 0.7);
    let wall = [(0.0, 0.0), (l, 0.0), (l, h), (0.0, h)].map(|(y, z)| DVec3::new(0.0, y, z));
    let standing =
        World { surfaces: vec![Surface::emitter(wall.to_vec(), DVec3::ONE)], environment: DVec3::ZERO };
    let perpendicular = mean_form_factor(&standing, w, l) - perpendicular_rectangles(h, w, l);
    println!("parallel {parallel:e}, perpendicular {perpendicular:e}");
    assert!(perpendicular.abs() < 1e-11, "{perpendicular:e}");
}

/// Over a small emitter, Gauss–Legendre quadrature of cos cos/r² is exact up to terms in the sixth power of
/// its size.
#[test]
fn emitters_of_a_size_of_10_to_the_minus_k_lose_k_digits() {
    let rule = rule(3);
    for k in 2..8 {
        let size = 0.1_f64.powi(k);
        let corner = |(x, y): (f64, f64)| DVec3::new(0.4, -0.3, 1.3) + size * DVec3::new(x, y, 0.0);
        let vertices = [(0.0, 0.0), (0.0, 1.0), (1.0, 1.0), (1.0, 0.0)].map(corner).to_vec();
        // Its actual size after rounding.
        let extent = vertices[2] - vertices[0];
        let (mut value, mut derivative) = (0.0, 0.0);
        for (s, ws) in rule {
            for (t, wt) in rule {
                let p = vertices[0] + DVec3::new(s * extent.x, t * extent.y, 0.0);
                let term = ws * wt * extent.x * extent.y * (p.z / p.length_squared()).powi(2);
                value += term;
                derivative -= 4.0 * p.x / p.length_squared() * term;
            }
        }
        let emitter = Surface { velocities: vec![DVec3::X; 4], ..Surface::emitter(vertices, DVec3::ONE) };
        let world = World { surfaces: vec![emitter], environment: DVec3::ZERO };
        let light = irradiance(&world, &Receiver::still(DVec3::ZERO, DVec3::Z)).expect("irradiance");
        let errors = [light.value.x / value - 1.0, light.derivative.x / derivative - 1.0];
        assert!(errors.iter().all(|e| e.abs() < 1e-15 / size), "{size:e}: {errors:?}");
    }
}

#[test]
fn most_cases_are_lit_and_change() {
    for kind in IrradianceKind::ALL {
        for moving in IrradianceMoving::ALL {
            let lights = (0..40).map(|seed| {
                let knobs = IrradianceKnobs { moving, ..IrradianceKnobs::random(seed, kind) };
                exact(&knobs.build())
            });
            let changes = lights.filter(|l| l.derivative.abs().max_element() > 1e-3 * l.value.max_element());
            let changes = changes.count();
            assert!(changes >= 12, "{kind:?} {moving:?}: {changes} of 40");
        }
    }
}

#[test]
fn the_eye_sees_the_ground() {
    for kind in IrradianceKind::ALL {
        for seed in 0..50 {
            let case = IrradianceKnobs::random(seed, kind).build();
            let hidden = case.world.surfaces.iter().any(|s| s.hides(case.ray.origin, case.receiver.point));
            assert!(!hidden, "{}", case.label);
            let [a, b, c] = case.ground.corners;
            let front = (b - a).cross(c - a).dot(case.receiver.normal);
            assert!(front > 0.0, "{}", case.label);
        }
    }
}

#[test]
fn bad_worlds_are_errors_that_name_the_surface() {
    type Tangent = fn(&mut Surface);
    let triangle = || Surface::occluder(vec![DVec3::Z, DVec3::X + DVec3::Z, DVec3::Y + 2.0 * DVec3::Z]);
    let square = || {
        let corners = [(0., 0.), (1., 0.), (1., 1.), (0., 1.)].map(|(x, y)| DVec3::new(x, y, 1.0));
        Surface::occluder(corners.to_vec())
    };
    let receiver = Receiver::still(DVec3::ZERO, DVec3::Z);
    let with = |surface: Surface| {
        let world = World { surfaces: vec![triangle(), surface], environment: DVec3::ONE };
        irradiance(&world, &receiver)
    };
    with(square()).expect("a world");
    let refused: [(Tangent, &str); 7] = [
        (|s| s.velocities.truncate(3), "4 corners and 3 velocities"),
        (|s| s.velocities[2].x = f64::NAN, "not finite"),
        (|s| s.vertices[2].z = 1.1, "not flat"),
        (|s| s.velocities[2].z = 1.0, "not flat"),
        (|s| s.vertices[2] = DVec3::new(0.2, 0.2, 1.0), "not convex"),
        (|s| s.vertices.fill(DVec3::ONE), "no area"),
        (
            |s| *s = Surface::occluder(vec![DVec3::X, DVec3::Z, DVec3::X + DVec3::Z]),
            "in the plane of surface 1",
        ),
    ];
    for (change, expected) in refused {
        let mut surface = square();
        change(&mut surface);
        let error = format!("{:#}", with(surface).expect_err(expected));
        assert!(error.contains("surface 1") && error.contains(expected), "{error:?} for {expected:?}");
    }
    irradiance(&World::default(), &Receiver::still(DVec3::ZERO, DVec3::ZERO)).expect_err("no normal");
    let ground = Ground { corners: [DVec3::ZERO, DVec3::X, DVec3::Y], velocities: [DVec3::ZERO; 3] };
    for direction in [DVec3::X, DVec3::Z] {
        Receiver::on_ray(&Ray::still(DVec3::Z, direction), &ground).expect_err("no ground");
    }
}

#[test]
fn any_numbers_are_answered_or_refused() {
    let mut answers = 0;
    for seed in 0..3000 {
        let mut rng = stream(seed, &[]);
        let kind = IrradianceKind::ALL[seed as usize % IrradianceKind::ALL.len()];
        let mut case = IrradianceKnobs::random(seed % 50, kind).build();
        for _ in 0..3 {
            let mut index = |n: usize| (open01(&mut rng) * n as f64) as usize;
            let (number, axis) = (worst::HOSTILE[index(12)], index(3));
            let surface = index(case.world.surfaces.len());
            let surface = &mut case.world.surfaces[surface];
            let vertex = index(surface.vertices.len());
            match index(6) {
                0 => surface.vertices[vertex][axis] = number,
                1 => surface.velocities[vertex][axis] = number,
                2 => surface.radiance[axis] = number,
                3 => case.receiver.point[axis] = number,
                4 => case.receiver.normal = DVec3::splat(number),
                _ => surface.vertices[vertex] = case.receiver.point,
            }
        }
        if let Ok(light) = irradiance(&case.world, &case.receiver) {
            answers += 1;
            assert!(light.value.is_finite() && light.derivative.is_finite(), "seed {seed}: {light:?}");
        }
    }
    println!("{answers} answers");
    assert!(answers > 100, "{answers}");
}
