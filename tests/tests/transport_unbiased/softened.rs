//! Softened means over discontinuities with samples of their residual, from the exact mean to edge sampling.

use std::sync::LazyLock;

use flatland::estimator::transport::{Fault, Method as _, WarpedArea};
use flatland::plane::Filter;
use flatland::transport::exact::Exact;
use flatland::transport::fields::Construction;
use flatland::transport::{Camera, Film, Material, Shape, Tangent, World};
use glam::DVec2;
use rayon::prelude::*;
use tests::campaign::Verdict;
use tests::comparison::{Comparison, Estimate};
use tests::effort::pick;
use tests::power::Power;
use tests::statistics::{regression_slope, student};
use tests::transport::campaign::{Known, Sampler as _, known};
use tests::transport::worlds::{Case, Kind, Moving};

use super::{SOME, TWICE, accept, limits, reject, warped};

/// R, in kernel widths.
const REACH: f64 = 8.0;

/// Worlds in which geometry moves.
static MOVED: LazyLock<Vec<Known>> =
    LazyLock::new(|| known(&Kind::GENERIC, &Moving::GEOMETRIC, pick(5, 10), 1));

/// A softness in units of the reach.
fn softened(reaches: f64) -> WarpedArea {
    warped(Construction::Softened { reach: REACH, softness: reaches * REACH })
}

#[test]
fn softened_means_over_jumps() {
    let mut power = Power::of("transport_unbiased::softened_means_over_jumps");
    for reaches in [0.0, 0.1, 1.0, f64::INFINITY] {
        accept(&mut power, &format!("softened, ε = {reaches} R"), &MOVED, &softened(reaches));
    }
    for reaches in [0.1, 1.0] {
        let name = format!("softened, ε = {reaches} R, two bounces");
        accept(&mut power, &name, &TWICE, &softened(reaches));
    }
}

/// Reverse mode by itself: the gradient along the change, with the standard error of the same samples in
/// forward mode.
#[test]
fn softened_means_over_jumps_in_reverse() {
    let mut power = Power::of("transport_unbiased::softened_means_over_jumps_in_reverse");
    let method = softened(0.1);
    let reverse = |k: &Known, seed: u64| {
        let Case { world, camera, change, .. } = &k.case;
        let gradient = method.on(k.paths(), seed).reverse(world, camera, k.adjoint()).expect("valid");
        Estimate { mean: gradient.total().dot(change), ..k.total(seed, &method) }
    };
    Verdict::of(&MOVED, reverse).accept(&mut power, "softened, ε = 0.1 R, in reverse", limits());
}

#[test]
fn softened_controls_are_rejected() {
    let (whole, faulty) = (softened(0.5), |fault| WarpedArea { fault: Some(fault), ..softened(0.5) });
    reject("residual left out", &SOME, |k, seed| k.total(seed, &faulty(Fault::NoResidual)));
    reject("residual of the other sign", &SOME, |k, seed| {
        let without = k.total(seed, &faulty(Fault::NoResidual)).scaled(2.0);
        without.plus(k.total(!seed, &whole).scaled(-1.0))
    });
    // As if the ends of the visible segment were followed however narrow it is.
    reject("softened ends left out", &SOME, |k, seed| k.total(seed, &faulty(Fault::OneSided)));
}

/// Distance between two plates.
const GAP: f64 = 1e-6;

/// Two black plates with a gap between them, one of which moves, over a floor: from above, the floor is
/// visible through the gap; from below, it is lit through it.
fn gap(is_above: bool) -> (World, Camera, Tangent) {
    let p = DVec2::new;
    let shine = if is_above { 1.5 } else { 0.0 };
    let shapes = vec![
        Shape::open([p(-2.0, 0.0), p(2.0, 0.1)], Material::diffuse(0.8).with_emission(shine)),
        Shape::open([p(-0.6, 3.0), p(0.7, 3.1)], Material::emitter(3.0)),
        Shape::open([p(-0.5, 1.3), p(0.05, 1.2)], Material::default()),
        Shape::open([p(0.05 + GAP, 1.2), p(0.4, 1.25)], Material::default()),
    ];
    let world = World::new(0.0, shapes).expect("a world");
    let film = Film { pixels: 1, filter: Filter::Tent };
    let (height, field_of_view) = if is_above { (2.2, 0.4) } else { (0.9, 0.2) };
    let camera = Camera { position: p(0.07, height), angle: -1.63, field_of_view, film };
    let change = Tangent::translate(&world, [2], p(1.0, 0.3));
    (world, camera, change)
}

/// Numbers of samples, doubled four times.
const NUMBERS: [usize; 5] = [32, 64, 128, 256, 512];

/// Exponent a of errors ∝ nᵃ.
fn exponent(errors: [f64; 5]) -> f64 {
    regression_slope(&NUMBERS.map(|n| (n as f64).ln()), &errors.map(f64::ln))
}

/// In a tight gap the square of an error halves whenever samples double, even for few samples: no sample is
/// rare and large. The exact mean concentrates the motion there in samples of the gap, one in a million, and
/// no other sample sees it: its error is the whole derivative, and more when such a sample occurs.
#[test]
fn softened_samples_of_a_tight_gap_have_short_tails() {
    let mut power = Power::of("transport_unbiased::softened_samples_of_a_tight_gap_have_short_tails");
    for is_above in [true, false] {
        let (world, camera, change) = gap(is_above);
        let exact = Exact::default().gradient(&world, &camera, &change).expect("differentiable");
        let exact = exact.pixels[0].total();
        // Results of the runs at each number of samples, and their root mean square errors.
        let runs = |construction| {
            let found = NUMBERS.map(|samples| {
                let seeds = 10_000 * samples as u64;
                let found = (seeds..seeds + pick(200, 800)).into_par_iter().map(|seed| {
                    let method = WarpedArea { samples, seed, ..warped(construction) };
                    method.forward(&world, &camera, &change).expect("valid").total()[0]
                });
                found.collect::<Vec<f64>>()
            });
            let square =
                |run: &Vec<f64>| run.iter().map(|x| (x - exact).powi(2)).sum::<f64>() / run.len() as f64;
            let errors = found.each_ref().map(|run| square(run).sqrt());
            (found, errors)
        };
        let (found, errors) = runs(Construction::Softened { reach: REACH, softness: 0.25 * REACH });
        let (_, of_mean) = runs(Construction::JumpMean { reach: REACH });
        let label = if is_above { "seen through a gap" } else { "lit through a gap" };
        let (exponent, ratio) = (exponent(errors), (of_mean[4] / errors[4]).powi(2));
        println!("{label}: errors {errors:.4?} of {exact:.4} fall as n^{exponent:.3}");
        println!(
            "errors of the exact mean are {of_mean:.4?}; the square of the last is {ratio:.0} times as large"
        );
        // For normal errors, the exponent from these runs has a standard error of 0.023.
        assert!((exponent + 0.5).abs() < 0.1, "{label}: {exponent}");
        assert!(ratio > 10.0, "{label}: {ratio}");
        let last = found.into_iter().next_back().expect("the last");
        let limit = student(last.len() as u64 - 1);
        let found = Estimate::of(last);
        let reference = Estimate::exact(exact);
        Comparison { found, reference, limit, slack: 0.0 }.accept(&mut power, label, exact);
    }
}
