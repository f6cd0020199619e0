//! The example in `volume3d/examples/basic.rs`, written to be read, compared with the library's estimator.

#[path = "../../volume3d/examples/basic.rs"]
#[allow(dead_code, reason = "its main")]
mod basic;

use rayon::prelude::*;
use tests::comparison::{Comparison, Estimate};
use tests::effort::pick;
use tests::power::Power;
use volume3d::gradient::{Progress, WarpedArea};

/// Independent runs of each estimator.
const RUNS: u64 = 24;

/// Sums of a weighted gradient image over the whole image, its upper half and its lower half.
fn sums(weights: &[f64], gradient: &[f64]) -> [f64; 3] {
    let products: Vec<f64> = weights.iter().zip(gradient).map(|(w, g)| w * g).collect();
    let (upper, lower) = products.split_at(products.len() / 9 * 5);
    let [upper, lower] = [upper, lower].map(|part| part.iter().sum::<f64>());
    [upper + lower, upper, lower]
}

/// The mean of each sum over the runs.
fn estimate(run: impl Fn(u64) -> [f64; 3] + Send + Sync) -> [Estimate; 3] {
    let runs: Vec<_> = (0..RUNS).into_par_iter().map(run).collect();
    [0, 1, 2].map(|m| Estimate::of(runs.iter().map(|run| run[m])))
}

#[test]
fn the_basic_estimator_agrees_with_the_library() {
    let (scene, change) = basic::table();
    let world = basic::World::new(&scene, &change);
    let (width, height) = scene.size();
    let library = |seed, samples| -> Vec<f64> {
        let method = WarpedArea { samples, seed, ..WarpedArea::default() };
        let image = method.forward(&scene, &change, &Progress::none()).unwrap().gradient;
        image.pixels.iter().map(|p| p.x).collect()
    };
    // Weights from an independent run, in which no parts cancel.
    let weights = library(RUNS, 64);
    let reference = estimate(|seed| sums(&weights, &library(seed, pick(8, 32))));
    let basic = |warp_light, samples| {
        estimate(|seed| {
            let pixel =
                |i: usize| basic::pixel((&world, &scene), [i % width, i / width], samples, warp_light, seed);
            sums(&weights, &(0..width * height).map(pixel).collect::<Vec<_>>())
        })
    };
    let mut power = Power::of("basic::the_basic_estimator_agrees_with_the_library").noticing(0.5);
    let names = ["whole image", "upper half", "lower half"];
    // Student's t with 23 degrees of freedom exceeds this with a probability of 1e-5.
    let limit = 5.6;
    for ((found, known), name) in basic(true, pick(360, 2000)).into_iter().zip(reference).zip(names) {
        Comparison { found, reference: known, limit, slack: 0.0 }.accept(&mut power, name, known.mean);
    }
    let [_, _, floor] = basic(false, 150);
    Comparison { found: floor, reference: reference[2], limit, slack: 0.0 }
        .reject("shadows that stand still");
}
