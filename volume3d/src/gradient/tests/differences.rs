//! Tests of central differences.

use super::*;
use crate::scene::{Bsdf, Microfacets, Reflectance};

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

/// A lamp before a metal, with what each emits and how rough it is.
fn lamp_and_metal(radiance: DVec3, alpha: f64) -> Scene {
    let camera = Camera::look_at(DVec3::new(0.0, 0.5, 3.0), DVec3::ZERO, DVec3::Y, 0.6);
    let mut d = Description::new(camera, film(4, Filter::Box));
    d.integrator.max_depth = Some(2);
    let metal = Bsdf::RoughConductor {
        distribution: Microfacets::Ggx,
        alpha,
        stretch: 1.0,
        eta: DVec3::ZERO,
        k: DVec3::ONE,
        specular_reflectance: Reflectance::Constant(DVec3::ONE),
    };
    let metal = d.add_material(Material::new("metal", metal, true));
    d.add_shape("sheet", Mesh::rectangle(), metal);
    let lamp = at(0.6, 0.4, 2.0, 0.3) * DAffine3::from_rotation_y(std::f64::consts::PI);
    d.add_emitter("lamp", Mesh::rectangle().transformed(&lamp), radiance);
    Scene::new(d).unwrap()
}

/// At a bound of its range a parameter has a difference on one side, which is said. What is linear in it has
/// the derivative of elsewhere; what is not has it up to a part in proportion to the step. Beyond both bounds
/// there is none.
#[test]
fn differences_at_a_bound_are_one_sided() {
    let none = Progress::none();
    let forward = |scene: &Scene, change: &Tangent, step| {
        FiniteDifference { samples: 64, step, seed: 3 }.forward(scene, change, &none)
    };
    let brighter = |scene: &Scene, rate: f64| {
        let mut change = Tangent::still(scene);
        change.radiance[1] = DVec3::splat(rate);
        change
    };
    let (dark, lit) = (lamp_and_metal(DVec3::ZERO, 0.4), lamp_and_metal(DVec3::ONE, 0.4));
    let central = forward(&lit, &brighter(&lit, 1.0), 0.1).unwrap();
    assert_eq!(central.one_sided, None);
    for (rate, ahead) in [(1.0, true), (-1.0, false)] {
        let found = forward(&dark, &brighter(&dark, rate), 0.1).unwrap();
        let one_sided = found.one_sided.unwrap();
        assert_eq!(one_sided.ahead, ahead);
        assert!(one_sided.outside.to_string().contains("the radiance"), "{}", one_sided.outside);
        for (a, b) in found.gradient.pixels.iter().zip(&central.gradient.pixels) {
            assert!((*a * rate - *b).abs().max_element() <= 1e-12 * b.abs().max_element(), "{a} {b}");
        }
    }
    // At α = 1 the mean slope of [0.9, 1] is that at 0.95, where it is central.
    let rougher = |scene: &Scene| {
        let mut change = Tangent::still(scene);
        change.roughness[0] = 1.0;
        change
    };
    let (bound, within) = (lamp_and_metal(DVec3::ONE, 1.0), lamp_and_metal(DVec3::ONE, 0.95));
    let found = forward(&bound, &rougher(&bound), 0.1).unwrap();
    assert!(found.one_sided.is_some_and(|one_sided| !one_sided.ahead));
    let middle = forward(&within, &rougher(&within), 0.05).unwrap();
    for (a, b) in found.gradient.pixels.iter().zip(&middle.gradient.pixels) {
        assert!((*a - *b).abs().max_element() <= 1e-9 * b.abs().max_element(), "{a} {b}");
    }
    let mut both = brighter(&dark, 1.0);
    both.radiance[1].x = -1.0;
    assert!(matches!(forward(&dark, &both, 0.1), Err(GradientError::Scene(_))));
}
