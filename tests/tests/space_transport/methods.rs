//! What every method makes of a scene, and what it must reject of its own.

use std::time::Instant;

use rayon::prelude::*;
use tests::comparison::{Comparison, Estimate};
use tests::power::Power;
use tests::space::campaign::{Known, warped};
use tests::statistics::student;
use volume3d::gradient::{EdgeSampling, FiniteDifference, GradientImage, Progress, WarpedArea};

/// What a method finds with a seed, by its terms.
type Method = fn(&Known, u64) -> GradientImage;

const METHODS: [(&str, Method); 2] = [
    ("edge sampling", |k, seed| {
        let method = EdgeSampling {
            samples: 64,
            primary: 64,
            secondary: 256,
            bounces: 256,
            seed,
            allow_missing: vec![],
        };
        method.forward_terms(&k.scene, &k.change, &Progress::none()).expect("valid")
    }),
    ("warped area", |k, seed| {
        let method = WarpedArea { seed, ..warped(64) };
        method.forward_terms(&k.scene, &k.change, &Progress::none()).expect("valid")
    }),
];

/// What is wrong on purpose: factors of a method's own interior, primary and secondary term.
pub(crate) type Control = (&'static str, [f64; 3]);

/// Nothing that jumps moves.
const INTERIOR: Control = ("interior alone", [1.0, 0.0, 0.0]);
/// What jumps moves on the film only.
const PRIMARY: Control = ("no secondary term", [1.0, 1.0, 0.0]);
/// All that jumps moves the other way.
const FLIPPED: Control = ("flipped", [1.0, -1.0, -1.0]);

/// Where shadows and reflections count.
pub(crate) const ALL: &[Control] = &[INTERIOR, PRIMARY, FLIPPED];
/// Where only what is on the film jumps.
pub(crate) const FILM: &[Control] = &[INTERIOR, FLIPPED];

/// Interior, primary and secondary term of every run.
fn terms(k: &Known, runs: u64, method: Method) -> Vec<[f64; 3]> {
    let run = |seed| {
        let found = method(k, seed);
        assert!(found.non_finite.is_empty(), "{:?} {}", found.non_finite, k.label);
        let terms = found.terms.expect("asked for");
        [&terms.interior, &terms.primary, &terms.secondary].map(|term| k.weighted(&term.pixels))
    };
    (0..runs).into_par_iter().map(run).collect()
}

/// Both methods on a scene, and what each must reject of its own. `times` says how many times as many
/// independent runs as there are at least differences, edge sampling and warped area are given: the spread of
/// each is estimated by as many degrees of freedom.
pub(crate) fn compare(power: &mut Power, k: Known, step: f64, times: [u64; 3], controls: &[Control]) {
    let k = k.focused(16384, 4e-2);
    let [difference_runs, edge_runs, warped_runs] = times.map(|times| 96 * times);
    let start = Instant::now();
    let narrowest = FiniteDifference { samples: 176, step, seed: 9000 };
    let (reference, slack) = k.differences::<3>(narrowest, difference_runs);
    let seconds = start.elapsed().as_secs_f64();
    println!("{}: {reference:?}, steps differ by {slack:.1e}, {seconds:.1} s", k.label);
    for ((name, method), count) in METHODS.into_iter().zip([edge_runs, warped_runs]) {
        let start = Instant::now();
        let terms = terms(&k, count, method);
        println!("{name}: {:.1} s", start.elapsed().as_secs_f64());
        let compared = |factors: [f64; 3]| {
            let runs = terms.iter().map(|t| t.iter().zip(factors).map(|(t, f)| t * f).sum());
            // Of two errors the one with fewer runs is taken to be all: the limit is on the safe side.
            let limit = student(count.min(difference_runs) - 1);
            Comparison { found: Estimate::of(runs), reference, limit, slack }
        };
        let whole = compared([1.0; 3]);
        whole.accept(power, &format!("{}, {name}", k.label), reference.mean);
        for (control, factors) in controls {
            compared(*factors).reject(&format!("{}, {name}, {control}", k.label));
        }
    }
}
