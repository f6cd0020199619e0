//! Unbiasedness of softened means over discontinuities with samples of their residual curves: on the film,
//! for meshes of constant radiance with and without crossings, compared with the exact derivative of their
//! coverage; and for direct light with penumbras, where shadows are sampled.
//!
//! The mean is the derivative for any softness: from nearly none, where everything is followed, to so much
//! that only the border of the visible shape is followed. Without the samples of curves it is not, nor with
//! twice their contribution: these are the controls.

use std::sync::LazyLock;

use rayon::prelude::*;
use tests::effort::pick;
use tests::power::Power;
use tests::space::campaign::{Known, Sampler as _, accept, coverage, reject};
use tests::space::crossing::{coverage as crossing_coverage, lit};
use tests::space::worlds::{
    CoverageKind, CrossingMoving, DirectKind, DirectKnobs, DirectMoving, LitCrossingKind, LitCrossingMoving,
};
use volume3d::gradient::{Field, Pilot, WarpedArea};

static GENERIC: LazyLock<Vec<Known>> = LazyLock::new(|| coverage(&CoverageKind::GENERIC, pick(4, 6)));
/// Worlds a million times smaller, larger or farther from the origin.
static FAR: LazyLock<Vec<Known>> = LazyLock::new(|| {
    coverage(&[CoverageKind::Small, CoverageKind::Large, CoverageKind::FarFromOrigin], pick(4, 6))
});
static CROSSINGS: LazyLock<Vec<Known>> = LazyLock::new(|| {
    let moving: Vec<_> = CrossingMoving::AT_REST.into_iter().chain(CrossingMoving::MOVING).collect();
    crossing_coverage(&moving, pick(2, 3))
});
/// A ground lit past bodies that cross one another or the lamp.
static LIT: LazyLock<Vec<Known>> =
    LazyLock::new(|| lit(&LitCrossingKind::UNSEEN, &LitCrossingMoving::ALL, 1));
static PENUMBRAS: LazyLock<Vec<Known>> = LazyLock::new(|| {
    let all = DirectKind::ALL.into_iter().flat_map(|kind| {
        (0..pick(6, 12)).map(move |i| {
            let moving = DirectMoving::ALL[i as usize % DirectMoving::ALL.len()];
            DirectKnobs { moving, ..DirectKnobs::random(76_000 + i, kind) }
        })
    });
    let knobs: Vec<_> = all.collect();
    let known = knobs.par_iter().map(|knobs| {
        let case = knobs.build();
        Known::of_direct(&case.scene, 1e-3, &case.label)
    });
    known.collect()
});

/// A method with these numbers of samples of the area, of silhouettes and of shadows, and a softness in
/// pixels.
fn softened(samples: usize, softness: f64, silhouettes: usize, shadows: usize) -> WarpedArea {
    let field = Field::Softened { film: 1.2, lobe: 0.5, softness, silhouettes, shadows, bounces: 0 };
    WarpedArea { samples, field, ..WarpedArea::default() }
}

#[test]
fn coverage_is_unbiased_for_any_softness() {
    let mut power = Power::of("space_softened::coverage_is_unbiased_for_any_softness");
    for softness in [1e-3, 0.1, 0.4, f64::INFINITY] {
        let method = softened(8, softness, 8, 0);
        accept(&mut power, &format!("softened, ε = {softness}"), &GENERIC, &method);
    }
    accept(&mut power, "softened, small, large and far", &FAR, &softened(8, 0.4, 8, 0));
    // Where the control variate is 0, both sides count by their full radiance.
    let level = WarpedArea { control_variate: 0, ..softened(8, 0.4, 8, 0) };
    accept(&mut power, "softened, no control variate", &GENERIC, &level);
    let some = &GENERIC[..pick(16, 24)];
    reject("softened, silhouettes left out", some, |k, half| k.estimate(half, &softened(8, 0.4, 0, 0)));
    reject("softened, silhouettes twice", some, |k, half| {
        let once = k.estimate(half, &softened(8, 0.4, 8, 0)).scaled(2.0);
        once.plus(k.estimate(half, &softened(8, 0.4, 0, 0)).scaled(-1.0))
    });
}

#[test]
fn crossings_are_unbiased() {
    let mut power = Power::of("space_softened::crossings_are_unbiased");
    accept(&mut power, "softened, crossings", &CROSSINGS, &softened(8, 0.4, 8, 0));
    accept(&mut power, "softened, crossings in the light", &LIT, &softened(16, 0.4, 16, 32));
}

#[test]
fn penumbras_are_unbiased() {
    let mut power = Power::of("space_softened::penumbras_are_unbiased");
    let method = softened(16, 0.4, 16, pick(64, 128));
    accept(&mut power, "softened, sampled shadows", &PENUMBRAS, &method);
    // The softness applies to the film, which has no discontinuities here: the only discontinuities are
    // shadows, which the field follows.
    let followed = softened(pick(32, 64), 0.4, 16, 0);
    accept(&mut power, "softened, followed shadows", &PENUMBRAS, &followed);
    let still = WarpedArea { warps: false, ..method };
    reject("interior only", &PENUMBRAS, |k, half| k.estimate(half, &still));
}

/// A pilot samples a scene before it chooses a method and splits the samples: its choice must not bias the
/// final estimate.
#[test]
fn what_a_pilot_chooses_is_unbiased() {
    let mut power = Power::of("space_softened::what_a_pilot_chooses_is_unbiased");
    let pilot = Pilot { samples: 8, seed: 0 };
    accept(&mut power, "chosen by a pilot, coverage", &GENERIC, &pilot);
    accept(&mut power, "chosen by a pilot, crossings", &CROSSINGS, &pilot);
    accept(&mut power, "chosen by a pilot, penumbras", &PENUMBRAS, &Pilot { samples: 32, seed: 0 });
}

/// The same numbers, forward and in reverse.
#[test]
fn reverse_mode_is_the_transpose() {
    let method = softened(2, 0.4, 2, 4).reseeded(11);
    let of = |known: &[Known], step: usize| {
        known.iter().step_by(step).map(|k| k.assert_transposed(&method, &k.moving())).fold(0.0, f64::max)
    };
    let worst = [of(&GENERIC, 3), of(&CROSSINGS, 17), of(&PENUMBRAS, 5), of(&FAR, 5)];
    println!("forward against reverse: coverage, crossings, penumbras, far: worst {worst:?}");
}
