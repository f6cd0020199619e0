//! Tests of visibility against tracing, of direct light against quadrature, and of the divergence identity.

use std::f64::consts::FRAC_PI_2;

use super::super::direct::emitted;
use super::super::{Interval, Surface, SurfaceMotion, View};
use super::*;
use crate::quadrature::adaptive;
use crate::transport::Origin;

/// Random points of segments of random worlds, with an outgoing direction.
fn places(count: u64, glossy: bool, mut visit: impl FnMut(&World, usize, f64, DVec2, &mut Stream)) {
    for i in 0..count {
        let mut rng = stream(11, &[i]);
        let shapes = 2 + (i % 9) as usize;
        let world = random_world(&mut rng, shapes, glossy);
        let segment = (open01(&mut rng) * world.segments().len() as f64) as usize;
        let s = match i % 8 {
            0 => 0.0,
            1 => 1.0,
            2 => 1e-9,
            _ => open01(&mut rng),
        };
        let outgoing = DVec2::from_angle(between(&mut rng, -3.1, 3.1));
        visit(&world, segment, s, outgoing, &mut rng);
    }
}

#[test]
fn partition_agrees_with_tracing() {
    places(300, false, |world, segment, s, outgoing, rng| {
        let side = world.segments()[segment].normal().dot(outgoing);
        let free = View::free(point(rng, 4.0), outgoing);
        for (view, own) in [(View::of_segment(world, segment, s, side), Some(segment)), (free, None)] {
            let intervals = view.intervals(world);
            let (first, last) = (intervals[0], intervals[intervals.len() - 1]);
            assert_eq!([first.start.angle, last.end.angle], [-FRAC_PI_2, FRAC_PI_2]);
            let total: f64 = intervals.iter().map(|i| i.width).sum();
            assert!((total - std::f64::consts::PI).abs() < 1e-12, "{total}");
            for pair in intervals.windows(2) {
                assert_eq!(pair[0].end, pair[1].start);
                assert_ne!(pair[0].seen, pair[1].seen);
            }
            if s == 0.0 || s == 1.0 {
                // The tracer has no limit from inside at the very end.
                continue;
            }
            for _ in 0..50 {
                let angle = between(rng, -FRAC_PI_2, FRAC_PI_2);
                let direction = angle.cos() * view.axis() + angle.sin() * view.tangent();
                let found = world.trace(Origin { point: view.point(), segment: own }, direction);
                let inside = |i: &&Interval| i.start.angle <= angle && angle <= i.end.angle;
                let expected = intervals.iter().find(inside).expect("no gap");
                let near = (angle - expected.start.angle).min(expected.end.angle - angle) < 1e-7;
                assert!(near || expected.seen == found.map(|h| h.segment), "{angle} {expected:?} {found:?}");
            }
        }
    });
}

/// ∫ f(angle) cos φ over the directions of a surface, by quadrature.
fn integral(world: &World, surface: &Surface, f: impl Fn(f64) -> f64) -> f64 {
    let mut total = 0.0;
    for interval in surface.intervals() {
        let l = emitted(world, interval.seen);
        let pieces = [[interval.start.angle, interval.end.angle]];
        total += l * adaptive(&pieces, |a| ([f(a)], f(a).abs()), 1e-12).value[0];
    }
    total
}

#[test]
fn radiance_agrees_with_quadrature() {
    places(200, true, |world, segment, s, outgoing, _| {
        let surface = Surface::new(world, segment, s, outgoing);
        let material = world.material(segment);
        let seen_from = surface.view().angle(outgoing);
        let gloss = |a: f64| material.gloss.map_or(0.0, |g| g.strength * g.density(a + seen_from));
        let f = |a: f64| (0.5 * material.reflectance + gloss(a)) * a.cos();
        let expected = material.emission + integral(world, &surface, f);
        let found = surface.radiance();
        assert!((found - expected).abs() < 1e-10 * (1.0 + expected), "{found} {expected}");
        let expected = integral(world, &surface, f64::cos);
        assert!((surface.irradiance() - expected).abs() < 1e-11 * (1.0 + expected));
    });
}

#[test]
fn radiance_rate_agrees_with_differences() {
    let mut worst = 0.0_f64;
    places(300, true, |world, segment, s, outgoing, rng| {
        let change = random_vertices(rng, world).and(&random_materials(rng, world));
        let own = &world.segments()[segment];
        let turn = between(rng, -1.0, 1.0);
        // The point slides along its segment while the segment moves.
        let slide = if s == 0.0 || s == 1.0 || s < 1e-6 { 0.0 } else { between(rng, -1.0, 1.0) };
        let velocity = own.material_point(s).velocity(&change.vertices) + slide * own.edge;
        let ends = own.turning_rate().into_iter().zip(own.vertices);
        let motion = SurfaceMotion {
            velocity,
            normal_turn: ends.map(|(c, v)| c.dot(change.vertices[v])).sum(),
            outgoing_turn: turn,
        };
        let rate = Surface::new(world, segment, s, outgoing).rate(&change, &motion);
        let at = |h: f64| {
            let moved = world.displaced(&change, h).ok()?;
            let direction = DVec2::from_angle(outgoing.to_angle() + h * turn);
            Some(vec![Surface::new(&moved, segment, s + h * slide, direction).radiance()])
        };
        let Some(found) = central_differences(&SWEEP, at) else { return };
        let error = (found[0] - rate.interior - rate.boundary).abs() / rate.magnitude.max(0.1);
        worst = worst.max(error);
        assert!(error < 1e-6, "{error} {found:?} {rate:?} {segment} {s}");
    });
    println!("worst {worst:e}");
}

/// Step sizes, from the scale at which a random world's structure changes to that at which rounding
/// dominates.
pub(super) const SWEEP: [f64; 4] = [1e-3, 1e-4, 1e-5, 3e-6];

/// Central difference quotients of several values, each at the step at which two neighbouring steps agree
/// best; `None` if the world does not exist at two steps.
pub(super) fn central_differences(steps: &[f64], f: impl Fn(f64) -> Option<Vec<f64>>) -> Option<Vec<f64>> {
    // Fourth order: (4 Δ(h) − Δ(2h)) / 3.
    let quotients = |h: f64| {
        let [a, b, c, d] = [f(-2.0 * h)?, f(-h)?, f(h)?, f(2.0 * h)?];
        let of = |i: usize| (4.0 * (c[i] - b[i]) - 0.5 * (d[i] - a[i])) / (6.0 * h);
        Some((0..a.len()).map(of).collect::<Vec<f64>>())
    };
    let found: Vec<Vec<f64>> = steps.iter().filter_map(|h| quotients(*h)).collect();
    let best = |i: usize| {
        let pairs = found.windows(2).map(|q| ((q[0][i] - q[1][i]).abs(), q[1][i]));
        pairs.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, q)| q)
    };
    (0..found.first()?.len()).map(best).collect()
}

#[test]
fn a_harmonic_field_fulfils_the_divergence_theorem() {
    places(100, true, |world, segment, s, outgoing, rng| {
        let change = random_vertices(rng, world);
        let surface = Surface::new(world, segment, s, outgoing);
        let view = surface.view();
        let velocity = point(rng, 1.0);
        let material = world.material(segment);
        if !material.scatters() {
            return;
        }
        // V: linear between discontinuities, constant up to the horizon, where f vanishes.
        let knot = |Interval { start, .. }: &Interval| {
            let tangent = view.direction(start).perp();
            Some([start.angle, tangent.dot(change.vertices[start.vertex?] - velocity) / start.distance])
        };
        let mut knots: Vec<[f64; 2]> = surface.intervals().iter().skip(1).filter_map(knot).collect();
        if knots.is_empty() {
            return;
        }
        knots.insert(0, [-FRAC_PI_2, knots[0][1]]);
        knots.push([FRAC_PI_2, knots[knots.len() - 1][1]]);
        let seen_from = view.angle(outgoing);
        let gloss = material.gloss.unwrap_or(Gloss { strength: 0.0, width: 1.0 });
        let f = |a: f64| 0.5 * material.reflectance + gloss.strength * gloss.density(a + seen_from);
        let slope = |a: f64| {
            let steep = gloss.strength * gloss.density_gradient(a + seen_from)[0];
            steep * a.cos() - f(a) * a.sin()
        };
        let (mut area, mut scale) = (0.0, 0.0);
        for (interval, pair) in surface.intervals().iter().zip(knots.windows(2)) {
            let [a, b] = [pair[0], pair[1]];
            if b[0] <= a[0] {
                continue;
            }
            let growth = (b[1] - a[1]) / (b[0] - a[0]);
            let field = |x: f64| a[1] + growth * (x - a[0]);
            let divergence = |x: f64| {
                let parts = [slope(x) * field(x), f(x) * x.cos() * growth];
                ([parts[0] + parts[1]], parts[0].abs() + parts[1].abs())
            };
            let l = emitted(world, interval.seen);
            let result = adaptive(&[[a[0], b[0]]], divergence, 1e-13);
            area += l * result.value[0];
            scale += l * result.scale;
        }
        let motion = SurfaceMotion { velocity, ..SurfaceMotion::default() };
        let rate = surface.rate(&change, &motion);
        assert!((area - rate.boundary).abs() <= 1e-10 * scale.max(rate.magnitude), "{area} {rate:?} {scale}");
    });
}

#[test]
fn light_of_known_strength() {
    let floor = |material| Shape::open([DVec2::new(-1.0, 0.0), DVec2::new(1.0, 0.0)], material);
    let bare = World::new(1.0, vec![floor(Material::diffuse(1.0))]).expect("a world");
    let surface = Surface::new(&bare, 0, 0.3, DVec2::new(0.2, 1.0).normalize());
    assert!((surface.radiance() - 1.0).abs() < 1e-15, "a white surface in a white world is white");
    assert!((surface.irradiance() - 2.0).abs() < 1e-15, "the half circle gives 2L");
    // A segment at height h from a to b over x gives L (b/√(b² + h²) − a/√(a² + h²)).
    let lamp = Shape::open([DVec2::new(-0.5, 2.0), DVec2::new(1.5, 2.0)], Material::emitter(3.0));
    let lit = World::new(0.0, vec![floor(Material::diffuse(0.5)), lamp]).expect("a world");
    let surface = Surface::new(&lit, 0, 0.75, DVec2::Y);
    let expected = 3.0 * (1.0 / 5.0_f64.sqrt() + 1.0 / 5.0_f64.sqrt());
    assert!((surface.irradiance() - expected).abs() < 1e-15);
    let below = Surface::new(&lit, 0, 0.75, -DVec2::Y);
    assert_eq!(below.irradiance(), 0.0);
}
