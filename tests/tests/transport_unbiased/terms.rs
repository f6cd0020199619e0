//! Interior, primary and secondary term, each by itself.

use flatland::estimator::transport::GradientImage;
use flatland::transport::exact::Exact;
use flatland::transport::fields::Construction;
use rayon::prelude::*;
use tests::campaign::{Reference, Target, Verdict, focused};
use tests::comparison::Estimate;
use tests::power::Power;
use tests::transport::campaign::{Known, Sampler};
use tests::transport::worlds::Case;

use super::{ONCE, edges, limits, warped};

/// One term of a world.
struct Term<'k> {
    known: &'k Known,
    weights: Vec<f64>,
    which: usize,
    exact: f64,
    label: String,
}

impl Reference for Term<'_> {
    fn target(&self) -> Target<'_> {
        Target { exact: self.exact, scale: self.known.scale, label: &self.label }
    }
}

const TERMS: [&str; 3] = ["interior", "primary", "secondary"];

/// The terms of the exact engine.
fn terms(known: &Known) -> [Term<'_>; 3] {
    let Case { world, camera, change, label } = &known.case;
    let exact = Exact::default().gradient(world, camera, change).expect("differentiable");
    [0, 1, 2].map(|which| {
        let exact: Vec<f64> = exact.pixels.iter().map(|t| t.to_array()[which]).collect();
        let weights = focused(&exact);
        let exact = weights.iter().zip(&exact).map(|(w, e)| w * e).sum();
        Term { known, weights, which, exact, label: format!("{} term, {label}", TERMS[which]) }
    })
}

impl Term<'_> {
    fn estimate(&self, found: &GradientImage) -> Estimate {
        let own = |terms: &[flatland::transport::Terms<f64>]| -> Vec<f64> {
            terms.iter().zip(&self.weights).map(|(t, w)| t.to_array()[self.which] * w).collect()
        };
        let variance: f64 = own(&found.standard_error.by_term).iter().map(|e| e * e).sum();
        Estimate { mean: own(&found.mean).iter().sum(), standard_error: variance.sqrt() }
    }
}

/// Both halves of a method's estimate, term by term.
fn found(all: &[[Term<'_>; 3]], method: &impl Sampler) -> Vec<[[Estimate; 2]; 3]> {
    let of = |terms: &[Term<'_>; 3]| {
        let halves = [0, 1].map(|seed| terms[0].known.run(seed, method));
        terms.each_ref().map(|term| halves.each_ref().map(|found| term.estimate(found)))
    };
    all.par_iter().map(of).collect()
}

/// Each term has the value of the exact engine, whatever the method.
#[test]
fn terms_are_those_of_the_exact_engine() {
    let mut power = Power::of("transport_unbiased::terms_are_those_of_the_exact_engine");
    let all: Vec<[Term<'_>; 3]> = ONCE.par_iter().map(terms).collect();
    let harmonic = found(&all, &warped(Construction::Harmonic));
    let edges = found(&all, &edges());
    for (which, name) in TERMS.into_iter().enumerate() {
        let on = |halves: &[[[Estimate; 2]; 3]], counts: &dyn Fn(&Term<'_>) -> bool| {
            let pairs = all.iter().zip(halves).map(|(terms, halves)| (&terms[which], &halves[which]));
            Verdict::on(pairs.filter(|(term, _)| counts(term)))
        };
        // Where only objects seen by the camera move, the harmonic field's primary term is noise that
        // cancels.
        let harmonic = on(&harmonic, &|term| term.exact != 0.0);
        harmonic.accept(&mut power, &format!("{name} term, harmonic field"), limits());
        on(&edges, &|_| true).accept(&mut power, &format!("{name} term, edge sampling"), limits());
    }
}
