//! Tests of central differences.

use super::*;

/// Samples that see an edge move are rare events. If cells shared their random numbers, an edge along a row
/// of pixels would pass the samples of all its cells at once or none, and the variance would be 13 times that
/// of a Poisson variable, as the edges here are 13 pixels long.
#[test]
fn samples_of_different_cells_see_edges_move_independently() {
    const RUNS: u64 = 400;
    const STEP: f64 = 2e-3;
    let camera = Camera::look_at(DVec3::ZERO, DVec3::NEG_Z, DVec3::Y, 0.9);
    let mut d = Description::new(camera, film(16, Filter::Tent { radius: 1.0 }));
    let place = at(0.0, 0.0, -4.0, 1.6);
    d.add_emitter("square", Mesh::rectangle().transformed(&place), DVec3::ONE);
    let scene = Scene::new(d).unwrap();
    let mut change = Tangent::still(&scene);
    change.scale(&scene, 0, DVec3::new(0.0, 0.0, -4.0), 1.0);
    let run = |seed| {
        let method = FiniteDifference { samples: 1, step: STEP, seed };
        let gradient = method.forward(&scene, &change, &Progress::none()).unwrap().gradient;
        // In units of samples, each of which counts in three channels.
        gradient.pixels.iter().map(|p| p.element_sum()).sum::<f64>() * 2.0 * STEP / 3.0
    };
    let runs: Vec<f64> = (0..RUNS).map(run).collect();
    let mean = runs.iter().sum::<f64>() / RUNS as f64;
    let variance = runs.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / (RUNS - 1) as f64;
    println!("{mean} samples a run, with a variance of {variance}");
    // The variance of this many Poisson variables is known to 8 %.
    assert!(mean > 1.0 && variance < 1.6 * mean, "{mean} {variance}");
}
