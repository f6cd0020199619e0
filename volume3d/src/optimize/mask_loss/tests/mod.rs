mod differences;
mod scenes;

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use flatland::random::{open01, stream};
use flatland::sdf::Sdf as _;
use flatland::sdf::shapes::Ball;
use glam::DVec3;

use self::scenes::{SIZE, Watched, ball, left_half, loss, network, outline, rays, scaled, scene};
use super::along_ray::{Chord, Search};
use crate::optimize::mask::random_pixels;
use crate::optimize::{MaskEvaluation, MaskLoss, MaskLossError};
use crate::scene::Scene;
use crate::sdf::analytic::Knot;

const COUNT: usize = SIZE.0 * SIZE.1;

fn of(loss: MaskLoss, scene: &Scene, mask: &[bool]) -> MaskEvaluation {
    loss.of(scene, 0, mask).expect("a loss")
}

/// The least φ along a ray is the distance of the ball's centre from it, less the radius.
#[test]
fn the_loss_of_a_ball_is_its_closed_form() {
    let ball = ball(0.5);
    let scene = scene(ball);
    let origin = scene.description().camera.origin;
    let distance = |ray: &DVec3| (ball.centre() - origin).cross(*ray).length() - ball.radius();
    let least: Vec<f64> = rays(&scene).iter().map(distance).collect();
    // Every ray hits it.
    let region = Ball::new(DVec3::ZERO, 2.0).expect("a ball");
    for alpha in [5.0, 50.0, 1600.0] {
        for mask in [left_half(), vec![true; COUNT], vec![false; COUNT], outline(&scene)] {
            let found = of(MaskLoss { alpha, region, ..loss() }, &scene, &mask);
            let (mut expected, mut counts, mut by_radius) = (0.0, [0; 3], 0.0);
            for (&m, &seen) in least.iter().zip(&mask) {
                let is_covered = seen && m <= 0.0;
                counts[0] += usize::from(is_covered);
                counts[1] += usize::from(seen && m > 0.0);
                counts[2] += usize::from(!seen && m <= 0.0);
                if !is_covered {
                    let sign = if seen { 1.0 } else { -1.0 };
                    let z = sign * alpha * m;
                    expected += if z > 30.0 { z } else { (1.0 + z.exp()).ln() } / alpha;
                    by_radius -= sign / (1.0 + (-z).exp());
                }
            }
            let share = 100.0 / COUNT as f64;
            assert_eq!([found.covered, found.missing, found.excess], counts);
            let close = |found: f64, expected: f64| (found - expected).abs() < 1e-11 * (1.0 + expected.abs());
            assert!(close(found.loss, share * expected), "{} {}", found.loss, share * expected);
            let found = found.gradient.parameters[3];
            assert!(close(found, share * by_radius), "{found} {}", share * by_radius);
        }
    }
}

/// With the path tracer's own mask, only pixels about 1/α from the silhouette contribute.
#[test]
fn of_its_own_outline_the_loss_goes_to_zero() {
    let scene = scene(ball(0.5));
    let mask = outline(&scene);
    let mut before = f64::INFINITY;
    for alpha in [50.0, 100.0, 200.0, 400.0, 800.0, 1600.0, 1e6] {
        let found = of(MaskLoss { alpha, ..loss() }, &scene, &mask);
        println!("α = {alpha}: {}", found.loss);
        assert_eq!((found.missing, found.excess), (0, 0));
        assert_eq!(found.covered, mask.iter().filter(|seen| **seen).count());
        assert!(found.loss < 0.5 * before || found.loss == 0.0, "{}", found.loss);
        before = found.loss;
    }
    assert!(before < 1e-6, "{before}");
}

#[test]
fn larger_masks_make_the_ball_grow_and_smaller_ones_shrink() {
    for (radius, sign) in [(0.7, -1.0), (0.3, 1.0)] {
        let mask = outline(&scene(ball(radius)));
        for alpha in [50.0, 1600.0] {
            let found = of(MaskLoss { alpha, ..loss() }, &scene(ball(0.5)), &mask);
            let slope = found.gradient.parameters[3];
            println!("a ball of 0.5 in a mask of {radius}, α = {alpha}: dL/dr = {slope}");
            assert!(slope * sign > 1.0, "{slope}");
        }
    }
}

#[test]
fn bits_do_not_depend_on_threads() {
    let scene = network();
    let pixels = random_pixels(COUNT, 3 * COUNT, 1);
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        pool.install(|| loss().of_pixels(&scene, 0, &left_half(), &pixels).expect("a loss"))
    };
    let (one, two) = (with(1), with(2));
    assert_eq!(one, two);
    assert!(
        one.gradient.parameters.iter().zip(&two.gradient.parameters).all(|(a, b)| a.to_bits() == b.to_bits())
    );
}

#[test]
fn losses_of_pixels_have_that_of_all_for_their_mean() {
    let (scene, mask) = (scene(ball(0.5)), left_half());
    let all = of(loss(), &scene, &mask);
    let some = |pixels: &[usize]| loss().of_pixels(&scene, 0, &mask, pixels).expect("a loss");
    let mean = (0..COUNT).map(|pixel| some(&[pixel]).loss).sum::<f64>() / COUNT as f64;
    assert!((mean - all.loss).abs() < 1e-12 * all.loss, "{mean} {}", all.loss);
    let twice: Vec<usize> = (0..2 * COUNT).map(|i| i / 2).collect();
    let twice = some(&twice);
    assert!((twice.loss - all.loss).abs() < 1e-12 * all.loss);
    assert_eq!(twice.covered, 2 * all.covered);
}

/// Settings are lengths in units of the ball's radius, so that scaling changes nothing.
#[test]
fn the_numbers_of_idr_are_in_units_of_the_ball() {
    let ball = |scale: f64| Ball::new(DVec3::new(0.1, 0.0, 0.0) * scale, 0.5 * scale).expect("a ball");
    let region = |scale: f64| Ball::new(DVec3::ZERO, scale).expect("a ball");
    let at = |scale: f64| of(MaskLoss::new(region(scale)), &scaled(ball(scale), scale), &left_half()).loss;
    assert!((at(7.0) - at(1.0)).abs() < 1e-12 * at(1.0), "{} {}", at(7.0), at(1.0));
    let alphas: Vec<f64> = (0..9).map(|step| loss().sharpened(step, 8).alpha).collect();
    assert_eq!(alphas, [50.0, 100.0, 200.0, 400.0, 800.0, 1600.0, 1600.0, 1600.0, 1600.0]);
    assert_eq!(loss().sharpened(0, 0).alpha, 50.0);
}

/// Includes a camera within the region, and rays that miss it.
#[test]
fn extremes_are_finite() {
    for (centre, radius) in
        [(DVec3::ZERO, 1.0), (DVec3::ZERO, 10.0), (DVec3::X * 5.0, 0.1), (DVec3::ZERO, 1e9)]
    {
        let region = Ball::new(centre, radius).expect("a ball");
        for alpha in [1e-300, 1e-6, 1e6, 1e300] {
            for mask in [left_half(), vec![true; COUNT], vec![false; COUNT]] {
                let loss = MaskLoss { alpha, region, ..loss() };
                let found = of(loss, &scene(ball(0.5)), &mask);
                // w (m + ln 2/α), with no m above 10.
                let most = 100.0 * (10.0 + 2_f64.ln() / alpha);
                assert!(found.loss >= 0.0 && found.loss <= most, "{} {most}", found.loss);
                assert!(found.gradient.parameters.iter().all(|g| g.abs() <= 101.0), "{:?}", found.gradient);
            }
        }
    }
}

/// The tube of a trefoil knot, with several minima along many rays, against 4,000 points and against the
/// unrefined search.
#[test]
fn minima_are_those_of_a_fine_search() {
    let knot = Knot::new(DVec3::ZERO, (2, 3), (0.5, 0.2), 0.08).expect("a knot");
    let scene = scene(knot);
    let shape = &scene.description().implicits[0];
    let (origin, region) = (scene.description().camera.origin, loss().region);
    let (mut coarse, mut exact, mut worst, mut total): (f64, _, f64, _) = (0.0, 0, 0.0, 0);
    let mut random = stream(1, &[]);
    while total < 400 {
        let target = DVec3::from_array([(); 3].map(|()| 1.4 * open01(&mut random) - 0.7));
        let direction = (target - origin).normalize();
        let chord = Chord::new(origin, direction, &region);
        let least =
            Search::new(shape, 100).least(&chord, f64::NEG_INFINITY).expect("finite").expect("a value");
        let middle = (region.centre() - origin).dot(direction);
        let half = (1.0 - (origin + middle * direction).length_squared()).max(0.0).sqrt();
        let among = |count: usize| {
            let at = |k: usize| middle + half * (2.0 * k as f64 / count as f64 - 1.0);
            (0..=count).map(|k| shape.value(origin + at(k) * direction)).fold(f64::INFINITY, f64::min)
        };
        let (fine, hundred) = (among(4_000), among(100));
        // The fine search itself is too large by at most a step of slope 1.
        assert!(least.jet.value < fine + 0.01 && least.jet.value > fine - 1e-4);
        coarse = coarse.max(hundred - fine);
        worst = worst.max(least.jet.value - fine);
        exact += usize::from(least.jet.value <= fine);
        total += 1;
    }
    println!(
        "{exact} of {total} minima found; the worst is too large by {worst:.1e}, of 100 points by {coarse:.1e}"
    );
    assert!(exact as f64 >= 0.97 * f64::from(total));
}

/// Along a ray past a ball few of 101 points can be less than the best so far.
#[test]
fn points_that_cannot_be_less_are_left_out() {
    let asked = Arc::new(AtomicUsize::new(0));
    let scene = scene(Watched { ball: ball(0.5), good_below: f64::INFINITY, asked: asked.clone() });
    asked.store(0, Ordering::Relaxed);
    let found = of(loss(), &scene, &vec![false; COUNT]);
    let each = asked.load(Ordering::Relaxed) as f64 / COUNT as f64;
    println!("{each} points a ray");
    assert!(found.excess > 0 && each < 40.0, "{each}");
}

#[test]
fn what_has_no_loss_is_refused() {
    let scene = scene(ball(0.5));
    let refused = |loss: MaskLoss| loss.of(&scene, 0, &left_half()).expect_err("no loss").to_string();
    assert_eq!(
        refused(MaskLoss { alpha: 0.0, ..loss() }),
        "the sharpness α of a loss of masks is 0, but must be positive and finite"
    );
    assert!(refused(MaskLoss { alpha: f64::NAN, ..loss() }).contains("NaN"));
    assert!(refused(MaskLoss { weight: -1.0, ..loss() }).contains("weight"));
    assert!(refused(MaskLoss { samples: 0, ..loss() }).contains("samples"));
    let size = MaskLossError::Size { width: SIZE.0, height: SIZE.1, found: 5 };
    assert_eq!(loss().of(&scene, 0, &[true; 5]), Err(size));
    let surface = MaskLossError::Surface { index: 1, count: 1 };
    assert_eq!(loss().of(&scene, 1, &left_half()), Err(surface));
    let pixels = |pixels: &[usize]| loss().of_pixels(&scene, 0, &left_half(), pixels).expect_err("no loss");
    assert_eq!(pixels(&[]), MaskLossError::NoPixels);
    assert_eq!(pixels(&[0, COUNT]), MaskLossError::Pixel { index: COUNT, count: COUNT });
    let asked = Arc::new(AtomicUsize::new(0));
    let spoilt = scenes::scene(Watched { ball: ball(0.5), good_below: 0.35, asked });
    let error = loss().of(&spoilt, 0, &left_half()).expect_err("no number");
    let MaskLossError::NotFinite { point, value, .. } = error else { panic!("{error}") };
    assert!(value.is_nan() && point.x >= 0.35, "{point}");
}
