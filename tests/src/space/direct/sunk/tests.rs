use flatland::random::{open01, stream};

use super::super::tests::error_of_points;
use super::*;
use crate::effort::pick;
use crate::space::worlds::{DirectCase, LitCrossing, LitCrossingKind, LitCrossingMoving};
use crate::worst;

fn cases(kinds: &[LitCrossingKind], seeds: std::ops::Range<u64>) -> Vec<DirectCase> {
    let pairs = kinds.iter().flat_map(|&kind| LitCrossingMoving::ALL.map(|moving| (kind, moving)));
    let knobs =
        pairs.flat_map(|(kind, moving)| seeds.clone().map(move |seed| LitCrossing { seed, kind, moving }));
    knobs.collect::<Vec<_>>().par_iter().map(LitCrossing::build).collect()
}

/// Cut lamps and crossing blockers: the derivative at points of the film against Richardson's extrapolation
/// of central differences of the exact value.
#[test]
fn points_have_the_derivatives_of_their_values() {
    let all = cases(&LitCrossingKind::UNSEEN, 0..pick(5, 10));
    worst::assert_below(1e-8, all.into_iter().enumerate(), |(seed, case)| {
        let quotient = |[a, b, c, d]: [DVec3; 4], h: f64| (4.0 * ((c - d) / h) - (a - b) / (2.0 * h)) / 3.0;
        (error_of_points(&case, (seed as u64, 20), &[1e-2, 1e-3, 1e-4, 1e-5], quotient), case.label)
    });
}

/// Agreement of both functions where the camera sees the ground alone.
#[test]
fn without_bodies_in_sight_the_pixels_are_the_same() {
    for DirectCase { scene, label } in cases(&[LitCrossingKind::Plate], 30..31) {
        let [a, b] = [scene.image(1e-4), scene.image_past_bodies(1e-5)].map(|i| i.expect("an image"));
        let scale =
            a.iter().map(|p| p.value.max_element() + p.derivative.abs().max_element()).fold(0.0, f64::max);
        for (a, b) in a.iter().zip(&b) {
            let error =
                (a.value - b.value).abs().max_element() + (a.derivative - b.derivative).abs().max_element();
            assert!(error < 5e-3 * scale, "{a:?} {b:?} {label}");
        }
    }
}

/// Bodies in the ground: pixels against central differences of pixels, the best of a sweep, and the same for
/// 1.03 times the derivative.
///
/// The error is of order h, because second derivatives are discontinuous, plus the error of quadrature over
/// h, both relative to the whole image.
#[test]
fn pixels_past_bodies_have_the_derivatives_of_their_values() {
    let all: Vec<_> = cases(&LitCrossingKind::SEEN, 0..1).into_iter().step_by(pick(8, 2)).collect();
    let error = |DirectCase { scene, label }: &DirectCase| {
        let image =
            |scene: &DirectScene| scene.image_past_bodies(1e-4).unwrap_or_else(|e| panic!("{e}\n{label}"));
        let exact = image(scene);
        let size = |p: &Pixel| p.value.max_element().max(p.derivative.abs().max_element());
        let scale = exact.iter().map(size).fold(0.0, f64::max);
        let steps = [1e-2, 3e-3];
        let moved = steps.map(|h| [h, -h].map(|h| image(&scene.displaced(h))));
        let of = |factor: f64| {
            let largest = |(h, [ahead, behind]): (&f64, &[Vec<Pixel>; 2])| {
                let quotients = ahead.iter().zip(behind).map(|(a, b)| (a.value - b.value) / (2.0 * h));
                let errors =
                    quotients.zip(&exact).map(|(q, p)| (q - factor * p.derivative).abs().max_element());
                errors.fold(0.0, f64::max) / scale
            };
            steps.iter().zip(&moved).map(largest).fold(f64::INFINITY, f64::min)
        };
        let steepest = exact.iter().map(|p| p.derivative.abs().max_element()).fold(0.0, f64::max) / scale;
        (of(1.0), of(1.03), steepest, label.clone())
    };
    let all: Vec<_> = all.iter().map(error).collect();
    for (right, wrong, steepest, label) in &all {
        println!("{right:.1e}, 1.03 times it {wrong:.1e}, {label}");
        assert!(*right < 1e-2, "{right:e}, {label}");
        assert!(*wrong > 1e-2 || *steepest < 0.5, "{wrong:e}, {label}");
    }
}

/// The visible ground is the set that rays to it meet first: areas by points of a grid.
#[test]
fn visible_polygons_are_what_rays_see() {
    for DirectCase { scene, label } in cases(&LitCrossingKind::SEEN, 0..4) {
        let size = DVec2::new(scene.camera.width as f64, scene.camera.height as f64);
        let polygons = scene.visible(&scene.bodies(), DVec2::ZERO, size);
        let mut rng = stream(1, &[]);
        for _ in 0..2000 {
            let u = size * DVec2::new(open01(&mut rng), open01(&mut rng));
            let inside = |polygon: &Vec<Vector2>| {
                let at = |k: usize| polygon[k % polygon.len()].value();
                let sides: Vec<_> =
                    (0..polygon.len()).map(|k| (at(k + 1) - at(k)).perp_dot(u - at(k))).collect();
                sides.iter().all(|s| *s >= 0.0) || sides.iter().all(|s| *s <= 0.0)
            };
            let count = polygons.iter().filter(|p| inside(p)).count();
            let ray = scene.camera.ray(&scene.camera_motion, u);
            let ground = Receiver::on_ray(&ray, &scene.ground).expect("a ground").point;
            let is_hidden = scene.world.surfaces.iter().any(|s| s.hides(ray.origin, ground));
            assert_eq!(count, usize::from(!is_hidden), "{u} {label}");
        }
    }
}
