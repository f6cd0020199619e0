//! Unbiasedness where surfaces pass through one another: every method compared with the exact derivative of
//! the coverage of crossing meshes, and of the light past crossing bodies, at rest and moving.
//!
//! A crossing is a discontinuity of the image without an edge of the mesh. Where it moves, its boundary term
//! is part of the derivative; where it rests, a warp field must not flow through it.

use std::sync::LazyLock;

use tests::campaign::{Limits, Verdict};
use tests::effort::{pick, thorough};
use tests::power::Power;
use tests::space::campaign::{Known, Sampler as _, accept, limit, reject, warped};
use tests::space::crossing::{coverage, lit, zeros};
use tests::space::worlds::{CrossingMoving, LitCrossingKind, LitCrossingMoving};
use volume3d::gradient::{EdgeSampling, Field, WarpedArea};

/// The crossing is at rest in the world; a plate moves in front of it, or the camera moves.
static AT_REST: LazyLock<Vec<Known>> = LazyLock::new(|| coverage(&CrossingMoving::AT_REST, pick(4, 10)));
/// The crossing moves.
static MOVING: LazyLock<Vec<Known>> = LazyLock::new(|| coverage(&CrossingMoving::MOVING, pick(2, 4)));
/// Where the camera moves, alone or with everything. Multilevel rays resolve these cases: where a plate
/// slides in front of others at rest, their errors have heavy tails, and no affordable number of samples
/// would reveal 15 % of bias.
static CAMERA: LazyLock<Vec<Known>> =
    LazyLock::new(|| coverage(&[CrossingMoving::Camera, CrossingMoving::Mixed], 5));
/// A ground lit past bodies that cross one another or the lamp; the camera sees only the ground.
static LIT: LazyLock<Vec<Known>> =
    LazyLock::new(|| lit(&LitCrossingKind::UNSEEN, &LitCrossingMoving::ALL, 1));
/// The same without ceilings, whose own borders edge sampling finds only by chance.
static LIT_BY_EDGES: LazyLock<Vec<Known>> = LazyLock::new(|| {
    let kinds = [LitCrossingKind::Plate, LitCrossingKind::Block, LitCrossingKind::Shadows];
    lit(&kinds, &LitCrossingMoving::ALL, 2)
});
/// Bodies that stand in the ground.
static SUNK: LazyLock<Vec<Known>> = LazyLock::new(|| lit(&LitCrossingKind::SEEN, &LitCrossingMoving::ALL, 2));
/// Sums that are exactly 0.
static ZEROS: LazyLock<Vec<Known>> = LazyLock::new(|| zeros(6));

fn rays(samples: usize) -> WarpedArea {
    WarpedArea { field: Field::AuxiliaryRays, ..warped(samples) }
}

const EDGES: EdgeSampling =
    EdgeSampling { samples: 1, primary: 8, secondary: 1, bounces: 1, seed: 0, allow_missing: vec![] };
const LIT_EDGES: EdgeSampling =
    EdgeSampling { samples: 32, primary: 32, secondary: 128, bounces: 128, seed: 0, allow_missing: vec![] };

#[test]
fn warped_area_is_unbiased() {
    let mut power = Power::of("space_crossing::warped_area_is_unbiased");
    accept(&mut power, "warped area, crossings at rest", &AT_REST, &warped(pick(8, 16)));
    accept(&mut power, "warped area, crossings that move", &MOVING, &warped(8));
    accept(&mut power, "warped area, crossings in the light", &LIT, &warped(pick(16, 32)));
    accept(&mut power, "warped area, bodies in the ground", &SUNK, &warped(pick(16, 32)));
}

#[test]
fn auxiliary_rays_are_unbiased() {
    if !thorough() {
        return;
    }
    let mut power = Power::of("space_crossing::auxiliary_rays_are_unbiased");
    accept(&mut power, "auxiliary rays, crossings", &CAMERA, &rays(8));
    accept(&mut power, "auxiliary rays, crossings in the light", &LIT, &rays(16));
}

#[test]
fn edge_sampling_is_unbiased() {
    let mut power = Power::of("space_crossing::edge_sampling_is_unbiased");
    accept(&mut power, "edge sampling, crossings at rest", &AT_REST, &EDGES);
    accept(&mut power, "edge sampling, crossings that move", &MOVING, &EDGES);
    if thorough() {
        accept(&mut power, "edge sampling, crossings in the light", &LIT_BY_EDGES, &LIT_EDGES);
        accept(&mut power, "edge sampling, bodies in the ground", &SUNK, &LIT_EDGES);
    }
}

/// Estimates with a small error.
#[test]
fn sums_that_are_zero_are_found_to_be() {
    let mut power = Power::of("space_crossing::sums_that_are_zero_are_found_to_be");
    let mut zeros = |name: &str, found: Verdict| {
        let limits = Limits { scene: limit(), slope: f64::INFINITY };
        found.print(name, limits);
        assert!(found.worst <= limits.scene, "{name} finds something where the sum is 0: {found:?}");
        power.add(format!("{name}: of the scale of zeros"), limits.scene * found.noise.0[0], 1.0);
    };
    zeros("warped area", Verdict::of(&ZEROS, |k, half| k.estimate(half, &warped(64))));
    zeros("edge sampling", Verdict::of(&ZEROS, |k, half| k.estimate(half, &EDGES)));
}

/// The same numbers, forward and in reverse.
#[test]
fn reverse_mode_is_the_transpose() {
    let mut worst = [0.0_f64; 3];
    for k in AT_REST.iter().step_by(17).chain(MOVING.iter().step_by(17)) {
        let active = k.moving();
        let [warped, rays] = [warped(8), rays(8)].map(|method| method.reseeded(11));
        let edges = k.assert_transposed(&EDGES.reseeded(11), &active);
        let errors = [k.assert_transposed(&warped, &active), k.assert_transposed(&rays, &active), edges];
        worst = std::array::from_fn(|i| worst[i].max(errors[i]));
    }
    println!("forward against reverse, warped area, auxiliary rays and edge sampling: worst {worst:?}");
}

/// A method is trusted if it is rejected on the same scenes when made wrong; 0.85 times a method is rejected
/// where the method is accepted.
#[test]
fn controls_are_rejected() {
    for (name, scenes) in
        [("at rest", &AT_REST[..30]), ("moving", &MOVING[..30]), ("in the ground", &SUNK[..])]
    {
        let still = WarpedArea { warps: false, ..warped(8) };
        reject(&format!("interior only, {name}"), scenes, |k, half| k.estimate(half, &still));
    }
}
