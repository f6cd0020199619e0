//! Warped-area sampling through mirrors, glass and openings, and of shadows of lights without extent, on
//! random worlds with exact derivatives.

use flatland::estimator::chain::{Fault, WarpedArea};
use tests::campaign::{Limits, Verdict};
use tests::chains::{Kind, known};
use tests::effort::pick;
use tests::power::Power;
use tests::statistics::suite_threshold;

fn limits() -> Limits {
    Limits::both(suite_threshold())
}

/// The method, with a number of samples per pixel in each of two halves.
fn method(samples: usize, fault: Option<Fault>) -> WarpedArea {
    WarpedArea { samples, fault, ..WarpedArea::default() }
}

#[test]
fn derivatives_through_chains_are_unbiased() {
    let mut power = Power::of("chains::derivatives_through_chains_are_unbiased");
    for kind in Kind::ALL {
        // Decisions that end a chain lengthen the tails of the distribution.
        let worlds = known(kind, pick(if kind == Kind::Openings { 30 } else { 12 }, 60));
        Verdict::of(&worlds, |k, seed| k.run(seed, &method(5_000, None))).accept(
            &mut power,
            &format!("{kind:?}"),
            limits(),
        );
    }
}

#[test]
fn wrong_weights_are_rejected() {
    use Fault::{FirstAlone, LastAlone, NoShadows, NoWarp, OneWeight};
    for (kind, faults) in [
        (Kind::Flat, &[NoWarp, FirstAlone, LastAlone, OneWeight][..]),
        (Kind::Curved, &[NoWarp, FirstAlone]),
        (Kind::Glass, &[NoWarp, FirstAlone]),
        (Kind::Openings, &[NoWarp, FirstAlone]),
        (Kind::Lights, &[NoWarp, NoShadows]),
    ] {
        let worlds = known(kind, 12);
        for &fault in faults {
            let verdict = Verdict::of(&worlds, |k, seed| k.run(seed, &method(3_000, Some(fault))));
            verdict.reject(&format!("{kind:?} {fault:?}"), limits());
        }
    }
}
