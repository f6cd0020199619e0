//! Unbiasedness where surfaces pass through one another: every method against the exact derivative of
//! the coverage of meshes that cross, and of the light past bodies that cross, at rest and moving.
//!
//! A crossing is a jump of the image that no edge of the mesh stands for. Where it moves its
//! boundary term is part of the derivative; where it rests a warp field must not flow through it.

use std::sync::LazyLock;

use tests::campaign::{Limits, Verdict};
use tests::effort::{pick, thorough};
use tests::power::Power;
use tests::space::campaign::{Known, limit, limits};
use tests::space::crossing::{Sampler, coverage, lit, zeros};
use tests::space::worlds::{CrossingMoving, LitCrossingKind, LitCrossingMoving};
use volume3d::gradient::{EdgeSampling, Field, WarpedArea};

/// The crossing rests in the world; a plate moves before it, or the camera moves.
static AT_REST: LazyLock<Vec<Known>> = LazyLock::new(|| coverage(&CrossingMoving::AT_REST, pick(4, 14)));
/// The crossing moves.
static MOVING: LazyLock<Vec<Known>> = LazyLock::new(|| coverage(&CrossingMoving::MOVING, pick(2, 6)));
/// Where the camera moves, alone or with everything. These the multilevel rays resolve: where a plate
/// slides before others at rest their errors have heavy tails, and no affordable number of samples would
/// show 15 % of bias.
static CAMERA: LazyLock<Vec<Known>> =
    LazyLock::new(|| coverage(&[CrossingMoving::Camera, CrossingMoving::Mixed], 5));
/// A ground lit past bodies that cross one another or the lamp; the camera sees the ground alone.
static LIT: LazyLock<Vec<Known>> =
    LazyLock::new(|| lit(&LitCrossingKind::UNSEEN, &LitCrossingMoving::ALL, 1));
/// The same without ceilings, whose own borders edge sampling finds by chance.
static LIT_BY_EDGES: LazyLock<Vec<Known>> = LazyLock::new(|| {
    let kinds = [LitCrossingKind::Plate, LitCrossingKind::Block, LitCrossingKind::Shadows];
    lit(&kinds, &LitCrossingMoving::ALL, 2)
});
/// What stands in the ground.
static SUNK: LazyLock<Vec<Known>> = LazyLock::new(|| lit(&LitCrossingKind::SEEN, &LitCrossingMoving::ALL, 2));
/// Exact zeros.
static ZEROS: LazyLock<Vec<Known>> = LazyLock::new(|| zeros(6));

fn warped(samples: usize) -> Sampler {
    Sampler::Warped(WarpedArea { samples, ..WarpedArea::default() })
}

fn rays(samples: usize) -> Sampler {
    Sampler::Warped(WarpedArea { samples, field: Field::AuxiliaryRays, ..WarpedArea::default() })
}

fn edges() -> Sampler {
    Sampler::Edges(EdgeSampling { samples: 1, primary: 8, secondary: 1, seed: 0 })
}

fn lit_edges() -> Sampler {
    Sampler::Edges(EdgeSampling { samples: 32, primary: 32, secondary: 128, seed: 0 })
}

fn verdict(scenes: &[Known], sampler: &Sampler) -> Verdict {
    Verdict::of(scenes, |known, half| sampler.estimate(known, half))
}

fn accept(power: &mut Power, name: &str, scenes: &[Known], sampler: &Sampler) {
    verdict(scenes, sampler).accept(power, name, limits());
}

#[test]
fn warped_area_is_unbiased() {
    let mut power = Power::of("space_crossing::warped_area_is_unbiased");
    accept(&mut power, "warped area, crossings at rest", &AT_REST, &warped(pick(8, 16)));
    accept(&mut power, "warped area, crossings that move", &MOVING, &warped(8));
    accept(&mut power, "warped area, crossings in the light", &LIT, &warped(pick(16, 32)));
    accept(&mut power, "warped area, bodies in the ground", &SUNK, &warped(pick(16, 32)));
    power.finish();
}

#[test]
fn auxiliary_rays_are_unbiased() {
    if !thorough() {
        return;
    }
    let mut power = Power::of("space_crossing::auxiliary_rays_are_unbiased");
    accept(&mut power, "auxiliary rays, crossings", &CAMERA, &rays(8));
    accept(&mut power, "auxiliary rays, crossings in the light", &LIT, &rays(16));
    power.finish();
}

#[test]
fn edge_sampling_is_unbiased() {
    let mut power = Power::of("space_crossing::edge_sampling_is_unbiased");
    accept(&mut power, "edge sampling, crossings at rest", &AT_REST, &edges());
    accept(&mut power, "edge sampling, crossings that move", &MOVING, &edges());
    if thorough() {
        accept(&mut power, "edge sampling, crossings in the light", &LIT_BY_EDGES, &lit_edges());
        accept(&mut power, "edge sampling, bodies in the ground", &SUNK, &lit_edges());
    }
    power.finish();
}

/// By estimates whose error is small.
#[test]
fn sums_that_are_zero_are_found_to_be() {
    let mut power = Power::of("space_crossing::sums_that_are_zero_are_found_to_be");
    for (name, sampler) in [("warped area", warped(64)), ("edge sampling", edges())] {
        let found = verdict(&ZEROS, &sampler);
        let limits = Limits { scene: limit(), slope: f64::INFINITY };
        found.print(name, limits);
        assert!(found.worst <= limits.scene, "{name} finds something where the sum is 0: {found:?}");
        power.add(format!("{name}: of the scale of zeros"), limits.scene * found.noise.0[0], 1.0);
    }
    power.finish();
}

/// The same numbers, forwards and backwards.
#[test]
fn reverse_mode_is_the_transpose() {
    for (name, sampler) in
        [("warped area", warped(8)), ("auxiliary rays", rays(8)), ("edge sampling", edges())]
    {
        let some = AT_REST.iter().step_by(17).chain(MOVING.iter().step_by(17));
        let worst = some.map(|k| sampler.transpose_error(k)).fold(0.0, f64::max);
        println!("{name}, forward against reverse: worst {worst:.1e}");
        assert!(worst < 1e-9, "{name}: {worst}");
    }
}

/// What vouches for a method is that it, made wrong, is found out on the same scenes; 0.85 times it is,
/// where it is accepted.
#[test]
fn controls_are_rejected() {
    for (name, scenes) in
        [("at rest", &AT_REST[..30]), ("moving", &MOVING[..30]), ("in the ground", &SUNK[..])]
    {
        let still = Sampler::Warped(WarpedArea { warps: false, samples: 8, ..WarpedArea::default() });
        verdict(scenes, &still).reject(&format!("interior only, {name}"), limits());
    }
}
