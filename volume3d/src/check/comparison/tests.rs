//! Verdicts on given numbers, and their error rates on random ones.

use flatland::random::{Stream, stream};
use rand::Rng as _;

use super::*;

fn estimate(mean: f64, error: f64) -> Estimate {
    Estimate { mean, error, grain: 0.0 }
}

/// A slope whose bias is at most `bias`.
fn slope(step: f64, mean: f64, error: f64, bias: f64) -> Slope {
    let bounds = [bias, -bias].map(|bias| estimate(mean + bias, error)).to_vec();
    Slope { step, estimate: estimate(mean, error), bounds, unseen: 0.0 }
}

#[test]
fn the_error_of_a_mean_is_that_of_its_spread() {
    let estimate = Estimate::of(&[1.0, 2.0, 3.0], 0.0);
    assert_eq!(estimate.mean, 2.0);
    assert!((estimate.error - (1.0_f64 / 3.0).sqrt()).abs() < 1e-15);
}

/// Quantiles of Student's distribution with 15 degrees of freedom, from tables.
#[test]
fn the_tolerance_is_students() {
    for (probability, quantile) in [(0.05, 2.131_45), (0.01, 2.946_71), (0.001, 4.072_8)] {
        assert!((student(probability) - quantile).abs() < 2e-3, "{probability}: {}", student(probability));
    }
    let tolerance = Tolerance::of(1);
    assert!((tolerance.errors - TOLERATED).abs() < 0.05, "{}", tolerance.errors);
}

#[test]
fn verdicts() {
    let method = estimate(1.0, 0.008);
    let slopes = [
        Slope { bounds: vec![], ..slope(0.1, 1.3, 0.001, 0.0) },
        slope(0.01, 1.01, 0.008, 0.003),
        slope(0.001, 0.8, 0.1, 0.0),
    ];
    assert!(matches!(Verdict::of(method, &slopes), Verdict::Agrees { step: 0.01, .. }));
    let flipped = estimate(-1.0, 0.008);
    assert!(matches!(Verdict::of(flipped, &slopes), Verdict::Differs { step: 0.01, .. }));
    assert!(matches!(Verdict::of(method, &slopes[2..]), Verdict::Open { more: Some(_), .. }));
    let biased = [slope(0.1, 1.0, 0.0, 0.4)];
    assert!(matches!(Verdict::of(method, &biased), Verdict::Open { more: None, .. }));
    assert!(matches!(Verdict::of(method, &slopes[..1]), Verdict::Open { more: None, .. }));
    // Errors of 20 %: a resolution of 10 % needs four times the samples, counted in factors of √2.
    let noisy = estimate(1.0, 0.2 / Tolerance::of(1).errors);
    let Verdict::Open { within, more } = Verdict::of(noisy, &[slope(0.1, 1.0, 0.0, 0.0)]) else { panic!() };
    assert!((within - 0.2).abs() < 1e-12 && (3.9..5.7).contains(&more.unwrap()), "{within} {more:?}");
}

#[test]
fn nothing_does_not_agree() {
    let (nothing, still) = (estimate(0.0, 0.0), [slope(0.1, 0.0, 0.0, 0.0)]);
    assert_eq!(Verdict::of(nothing, &still), Verdict::Nothing);
    let noisy = estimate(0.1, 0.1);
    assert!(matches!(Verdict::of(noisy, &still), Verdict::Open { more: None, .. }));
    let wrong = estimate(1.0, 0.1);
    assert!(matches!(Verdict::of(wrong, &still), Verdict::Differs { .. }));
    // A discontinuity that no sample saw may have been missed.
    let dark = [Slope { unseen: 0.2, ..slope(0.1, 0.0, 0.0, 0.0) }];
    assert!(matches!(Verdict::of(wrong, &dark), Verdict::Open { more: None, .. }));
}

/// A moving edge that crosses samples, and a method with its slope.
#[derive(Clone, Copy, Debug)]
struct Edge {
    /// Mean number of samples of a run that it crosses at the largest step.
    passed: f64,
    /// The distribution of the change of a crossed sample.
    jumps: Jumps,
    /// The density of samples at a part x of the largest step is 1 + curvature · x + bend · x², relative to
    /// that at step 0.
    curvature: f64,
    bend: f64,
    /// The method's standard error, relative to the slope.
    noise: f64,
    /// Relative error of the gradient.
    wrong: f64,
}

#[derive(Clone, Copy, Debug)]
enum Jumps {
    Alike,
    Exponential,
    /// One of thirty is ten times as large.
    SomeLarge,
    /// Three positive for two negative.
    OfBothSigns,
}

impl Jumps {
    fn draw(self, rng: &mut Stream) -> f64 {
        let u = uniform(rng);
        match self {
            Self::Alike => 1.0,
            Self::Exponential => -u.ln(),
            Self::SomeLarge => {
                if u < 1.0 / 30.0 {
                    10.0
                } else {
                    1.0
                }
            }
            Self::OfBothSigns => {
                if u < 0.6 {
                    1.0
                } else {
                    -1.0
                }
            }
        }
    }

    fn mean(self) -> f64 {
        match self {
            Self::Alike | Self::Exponential => 1.0,
            Self::SomeLarge => 1.3,
            Self::OfBothSigns => 0.2,
        }
    }

    /// Value of the brightest pixel.
    fn brightest(self) -> f64 {
        if matches!(self, Self::SomeLarge) { 10.0 } else { 1.0 }
    }
}

fn uniform(rng: &mut Stream) -> f64 {
    ((rng.next_u64() >> 11) as f64 + 0.5) / (1_u64 << 53) as f64
}

fn normal(rng: &mut Stream) -> f64 {
    (-2.0 * uniform(rng).ln()).sqrt() * (std::f64::consts::TAU * uniform(rng)).cos()
}

/// The default steps, relative to the largest.
const STEPS: [f64; 5] = [1.0, 1.0 / 3.0, 0.1, 1.0 / 30.0, 0.01];

impl Edge {
    /// One check. `knows`: whether bounds include unseen changes.
    fn check(self, rng: &mut Stream, knows: bool) -> Verdict {
        let (method, slopes) = self.estimates(rng, knows);
        Verdict::of(method, &slopes)
    }

    /// The estimates of one check.
    fn estimates(self, rng: &mut Stream, knows: bool) -> (Estimate, Vec<Slope>) {
        let truth = self.passed * self.jumps.mean();
        let mut differences = STEPS.map(|_| vec![]);
        let mut largest = 0.0_f64;
        let mut method = vec![];
        for _ in 0..RUNS {
            let mut totals = [0.0; STEPS.len()];
            // A Poisson process over the largest step, thinned to a density that changes along it.
            let most = 1.0 + self.curvature.abs() + self.bend.abs();
            let mut at = 0.0;
            loop {
                at -= uniform(rng).ln() / (self.passed * most);
                if at > 1.0 {
                    break;
                }
                let jump = self.jumps.draw(rng);
                if uniform(rng) * most < 1.0 + at * (self.curvature + self.bend * at) {
                    largest = largest.max(jump.abs());
                    for (total, step) in totals.iter_mut().zip(STEPS) {
                        *total += if at < step { jump / step } else { 0.0 };
                    }
                }
            }
            differences.iter_mut().zip(totals).for_each(|(runs, total)| runs.push(total));
            let noise = (RUNS as f64).sqrt() * self.noise * normal(rng);
            method.push(truth * (1.0 - self.wrong) * (1.0 + noise));
        }
        let seen = |change: f64| if knows { change / RUNS as f64 } else { 0.0 };
        let grains = STEPS.map(|step| seen(largest) / step);
        let slopes = Slope::of(&STEPS, &differences, &grains, seen(self.jumps.brightest()));
        (Estimate::of(&method, 0.0), slopes)
    }

    /// The number of checks with the verdict `Differs`.
    fn differ(self, checks: u64, knows: bool) -> usize {
        let address =
            self.passed.to_bits() ^ (self.curvature + 8.0 * self.bend).to_bits() ^ self.jumps as u64;
        let differs = |k: &u64| {
            let mut rng = stream(*k, &[address]);
            matches!(self.check(&mut rng, knows), Verdict::Differs { .. })
        };
        (0..checks).filter(differs).count()
    }
}

const RIGHT: Edge =
    Edge { passed: 1.0, jumps: Jumps::Alike, curvature: 0.0, bend: 0.0, noise: 0.01, wrong: 0.0 };

/// Curvature and bend of errors of finite differences, relative to the slope, that change their signs: −5 %
/// at the largest step and +1 % at the next; and 0 at the largest step and 3 % at the next.
const SIGN_CHANGES: [(f64, f64); 2] = [(0.14, -0.36), (0.27, -0.405)];

/// For correct gradients, from edges that hardly any sample crosses to edges that hundreds cross in every
/// run.
#[test]
fn false_alarms_are_as_rare_as_promised() {
    const CHECKS: u64 = 400;
    let (mut alarms, mut of_spread_alone, mut settings) = (0, 0, 0);
    for passed in [0.01, 0.05, 0.2, 1.0, 4.0, 20.0] {
        for jumps in [Jumps::Alike, Jumps::Exponential, Jumps::SomeLarge, Jumps::OfBothSigns] {
            for curvature in [0.0, 0.5] {
                let edge = Edge { passed, jumps, curvature, ..RIGHT };
                let found = edge.differ(CHECKS, true);
                // At most 0.44 are expected; a Poisson number with that mean exceeds 8 once in a million
                // times.
                assert!(found <= 8, "{edge:?}: {found} of {CHECKS}");
                alarms += found;
                of_spread_alone += if curvature == 0.0 { edge.differ(CHECKS / 10, false) } else { 0 };
                settings += 1;
            }
        }
    }
    let checks = CHECKS as f64 * f64::from(settings);
    println!(
        "{alarms} false alarms in {checks} checks; by the spread of runs alone {of_spread_alone} in {}",
        0.05 * checks
    );
    assert!(alarms as f64 <= FALSE_ALARMS * checks, "{alarms} of {checks}");
    // The control: without the bound on unseen changes, false alarms are frequent.
    assert!(of_spread_alone as f64 > 20.0 * FALSE_ALARMS * 0.05 * checks, "{of_spread_alone}");
}

/// In an image of 64 × 64 pixels with the default samples, an edge as long as the image is wide crosses 3,900
/// samples of a run at the largest step. A gradient that is 30 % wrong is found there, and with twice the
/// samples a correct one is not left open.
#[test]
fn wrong_gradients_are_found() {
    const CHECKS: u64 = 40;
    for curvature in [0.0, 0.1, -0.1] {
        let edge = Edge { passed: 3900.0, curvature, ..RIGHT };
        for wrong in [0.3, -0.3] {
            let found = Edge { wrong, ..edge }.differ(CHECKS, true);
            assert!(found == CHECKS as usize, "{edge:?}, {wrong} wrong: {found} of {CHECKS} found");
        }
        let agrees = |passed: f64, k: u64| {
            let verdict = Edge { passed, ..edge }.check(&mut stream(k, &[]), true);
            assert!(!matches!(verdict, Verdict::Differs { .. }), "{edge:?}: {verdict:?}");
            matches!(verdict, Verdict::Agrees { .. })
        };
        let [few, many] = [3900.0, 7800.0].map(|n| (0..CHECKS).filter(|&k| agrees(n, k)).count());
        println!("curvature {curvature}: {few} of {CHECKS} agree, with twice the samples {many}");
        assert!(many == CHECKS as usize, "{edge:?}: {many} of {CHECKS} agree");
    }
}

/// An error of finite differences that changes its sign between two steps is no error of the gradient,
/// however small the noise; and gradients that are 10 % wrong are still found.
#[test]
fn errors_that_change_their_sign_are_allowed_for() {
    const CHECKS: u64 = 16;
    let mut of_one_side = 0;
    for (curvature, bend) in SIGN_CHANGES.into_iter().flat_map(|(c, b)| [(c, b), (-c, -b)]) {
        for passed in [4e3, 4e4] {
            let edge = Edge { passed, curvature, bend, noise: 1e-3, ..RIGHT };
            let alarms = edge.differ(CHECKS, true);
            assert!(alarms == 0, "{edge:?}: {alarms} of {CHECKS}");
            let found = [0.1, -0.1].map(|wrong| Edge { wrong, ..edge }.differ(CHECKS, true));
            println!("{edge:?}: no false alarm, 10 % wrong found {found:?} of {CHECKS}");
            assert!(passed < 1e4 || found == [CHECKS as usize; 2], "{edge:?}: {found:?} of {CHECKS}");
            // The control: bounds for errors that keep their signs, on one side of each slope.
            let differs = |k: &u64| {
                let (method, mut slopes) = edge.estimates(&mut stream(*k, &[]), true);
                slopes.iter_mut().for_each(|s| s.bounds = s.bounds.chunks(2).map(|pair| pair[1]).collect());
                matches!(Verdict::of(method, &slopes), Verdict::Differs { .. })
            };
            of_one_side += (0..CHECKS).filter(differs).count();
        }
    }
    println!("with bounds on one side {of_one_side} false alarms");
    assert!(of_one_side > 40);
}
