//! Unbiasedness where surfaces pass through one another: every method against the exact derivative of
//! the coverage of meshes that cross, at rest and moving.
//!
//! A crossing is a jump of the image that no edge of the mesh stands for. Where it moves its
//! boundary term is part of the derivative; where it rests a warp field must not flow through it.
//! Estimates are made once, and what accepts them also rejects 0.85 times them.

use std::sync::LazyLock;

use flatland::warp::{Debias, Warp};
use tests::space::campaign::limit;
use tests::space::crossing::{Sampler, Sized, Tried, coverage, zeros};
use tests::space::worlds::CrossingMoving;
use volume3d::gradient::{EdgeSampling, Field, WarpedArea};

/// The crossing rests in the world; a plate moves before it, or the camera moves.
static AT_REST: LazyLock<Vec<Sized>> = LazyLock::new(|| coverage(&CrossingMoving::AT_REST, 12));
/// The crossing moves.
static MOVING: LazyLock<Vec<Sized>> = LazyLock::new(|| coverage(&CrossingMoving::MOVING, 5));
/// Exact zeros.
static ZEROS: LazyLock<Vec<Sized>> = LazyLock::new(|| zeros(6));

/// The largest share of the reference by which an estimate may be off unnoticed.
const NOTICED: f64 = 0.15;

fn outlines() -> WarpedArea {
    WarpedArea { samples: 8, ..WarpedArea::default() }
}

fn warped() -> Sampler {
    Sampler::Warped(outlines())
}

/// With levels that find the slope in the least time.
fn rays() -> Sampler {
    let debias = Debias::Multilevel { rays: 8, first: 0.3, ratio: 0.35 };
    let warp = Warp { debias, ..WarpedArea::default().warp };
    Sampler::Warped(WarpedArea { field: Field::AuxiliaryRays, warp, ..outlines() })
}

fn edges() -> Sampler {
    Sampler::Edges(EdgeSampling { samples: 1, primary: 8, secondary: 1, seed: 0 })
}

fn all() -> [(&'static str, Sampler); 3] {
    [("warped area", warped()), ("auxiliary rays", rays()), ("edge sampling", edges())]
}

/// Asserts that a method is unbiased on all scenes, that a bias of 15 % would have been seen, and
/// that one of 15 % is.
fn accept(name: &str, scenes: &[Sized], sampler: &Sampler) {
    let tried = Tried::of(scenes, sampler);
    let found = tried.agreement(1.0);
    let unnoticed = found.unnoticed();
    println!("{name}, {} scenes: a bias of {:.1} % is noticed, {found:?}", scenes.len(), 100.0 * unnoticed);
    assert!(found.passes(), "{name} is biased: {found:?}");
    assert!(unnoticed < NOTICED, "{name} could be off by {unnoticed}");
    assert!(!tried.agreement(1.0 - NOTICED).passes(), "0.85 × {name} was not rejected");
}

/// Asserts that sums which are 0 are found to be 0, by estimates whose error is small.
fn accept_zeros(name: &str, sampler: &Sampler) {
    let more = match sampler.clone() {
        Sampler::Warped(method) => Sampler::Warped(WarpedArea { samples: 64, ..method }),
        edges @ Sampler::Edges(_) => edges,
    };
    let found = Tried::of(&ZEROS, &more).agreement(1.0);
    println!("{name}, {} zeros: error {:.4} of the terms, {found:?}", ZEROS.len(), found.largest_error);
    assert!(found.worst <= limit(), "{name} finds something where the sum is 0: {found:?}");
    assert!(limit() * found.largest_error < NOTICED, "{name} is too noisy to find 0: {found:?}");
}

#[test]

fn warped_area_is_unbiased_at_rest() {
    accept("warped area, crossings at rest", &AT_REST, &warped());
}

#[test]

fn warped_area_is_unbiased_where_crossings_move() {
    accept("warped area, crossings that move", &MOVING, &warped());
}

#[test]

fn auxiliary_rays_are_unbiased_at_rest() {
    accept("auxiliary rays, crossings at rest", &AT_REST, &rays());
}

#[test]

fn auxiliary_rays_are_unbiased_where_crossings_move() {
    accept("auxiliary rays, crossings that move", &MOVING, &rays());
}

#[test]

fn edge_sampling_is_unbiased_at_rest() {
    accept("edge sampling, crossings at rest", &AT_REST, &edges());
}

#[test]

fn edge_sampling_is_unbiased_where_crossings_move() {
    accept("edge sampling, crossings that move", &MOVING, &edges());
}

#[test]

fn sums_that_are_zero_are_found_to_be() {
    for (name, sampler) in all() {
        accept_zeros(name, &sampler);
    }
}

/// The same numbers, forwards and backwards.
#[test]
fn reverse_mode_is_the_transpose() {
    for (name, sampler) in [("warped area", warped()), ("auxiliary rays", rays()), ("edge sampling", edges())]
    {
        let some = AT_REST.iter().step_by(5).chain(MOVING.iter().step_by(5));
        let worst = some.map(|s| sampler.transpose_error(&s.known)).fold(0.0, f64::max);
        println!("{name}, forward against reverse: worst {worst:.1e}");
        assert!(worst < 1e-9, "{name}: {worst}");
    }
}

/// What vouches for a method is that it, made wrong, is found out on the same scenes; 0.85 times it is,
/// where it is accepted.
#[test]
fn controls_are_rejected() {
    for (name, scenes) in [("at rest", &AT_REST[..30]), ("moving", &MOVING[..30])] {
        let still = Sampler::Warped(WarpedArea { warps: false, ..outlines() });
        let found = Tried::of(scenes, &still).agreement(1.0);
        assert!(!found.passes(), "interior only, {name}, was not rejected: {found:?}");
    }
}

/// How badly each method fails on each family, for those who look.
#[test]
#[ignore = "prints a table and asserts nothing"]
fn table() {
    for (name, sampler) in all() {
        for moving in [&CrossingMoving::AT_REST[..], &CrossingMoving::MOVING].concat() {
            let scenes = coverage(&[moving], 8);
            let found = Tried::of(&scenes, &sampler).agreement(1.0);
            println!(
                "{name:15} {moving:?}: slope {:.3} ± {:.3}, worst |z| {:.1}, {}",
                found.slope, found.slope_error, found.worst, found.worst_label
            );
        }
    }
}
