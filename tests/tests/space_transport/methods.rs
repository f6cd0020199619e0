//! Estimates of a scene by every method, and the controls that each must reject.

use std::time::Instant;

use rayon::prelude::*;
use tests::comparison::{Comparison, Estimate};
use tests::power::Power;
use tests::space::campaign::{Known, warped};
use tests::statistics::student;
use volume3d::gradient::{EdgeSampling, FiniteDifference, GradientImage, Progress, WarpedArea};

/// The estimate of a method with a seed, by its terms.
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

/// A deliberate error: factors on a method's own interior, primary and secondary term.
pub(crate) type Control = (&'static str, [f64; 3]);

/// No moving discontinuities.
const INTERIOR: Control = ("interior alone", [1.0, 0.0, 0.0]);
/// Moving discontinuities on the film only.
const PRIMARY: Control = ("no secondary term", [1.0, 1.0, 0.0]);
/// All discontinuities move in the opposite direction.
const FLIPPED: Control = ("flipped", [1.0, -1.0, -1.0]);

/// For scenes with shadows and reflections.
pub(crate) const ALL: &[Control] = &[INTERIOR, PRIMARY, FLIPPED];
/// For scenes with discontinuities on the film only.
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

/// Both methods on a scene, and the controls that each must reject. `times` are factors on the minimum number
/// of independent runs of differences, edge sampling and warped area; the number of runs gives the degrees of
/// freedom of each standard error.
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
            // The combined error is treated as if all of it came from the smaller number of runs: the limit
            // is conservative.
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
