//! Statistical comparison of estimated with exact values over many scenes, one number per scene.

use flatland::estimator::{EdgeSampling, EstimatorError, Exact, GradientImage, Method, Rotation, WarpedArea};
use flatland::plane::exact::Arrangement;
use flatland::plane::{Film, Image, Motion, Scene};
use glam::DVec3;
use rayon::prelude::*;

use crate::comparison::Estimate;
use crate::power::{NOTICED, Power};
use crate::scenes::{Case, Kind, Knobs};

/// A sampling method, all of whose samples follow from its seed.
pub trait Sampler: Method + Sync {
    /// A copy of the method with another seed.
    fn reseeded(&self, seed: u64) -> Self;
}

macro_rules! sampler {
    ($($method:ty),*) => {
        $(impl Sampler for $method {
            fn reseeded(&self, seed: u64) -> Self {
                Self { seed, ..*self }
            }
        })*
    };
}

sampler!(WarpedArea, EdgeSampling, Rotation);

/// A scene with its exact derivative, reduced to one number by fixed random weights.
#[derive(Debug)]
pub struct Known {
    /// The scene, its motion and its film.
    pub case: Case,
    /// One weight per pixel, for one channel of it: the channels of a pixel share their samples.
    pub weights: Image,
    /// Σ weight · dI/dθ.
    pub exact: f64,
    /// Scale of errors where `exact` is nearly 0: |weights| · |I|, the change of the whole image by itself.
    pub scale: f64,
}

/// Share of the squared norm of the weights that does not come from the derivative.
const ROUGH: f64 = 0.1;

/// Weights of norm 1, mostly proportional to a derivative, so that its parts of opposite sign add up and
/// every pixel counts by its size; a part is rough from pixel to pixel, so that an error counts also where
/// the derivative is 0.
pub fn focused(derivative: &[f64]) -> Vec<f64> {
    let unit = |v: Vec<f64>| {
        let length = v.iter().map(|x| x * x).sum::<f64>().sqrt();
        if length > 0.0 { v.into_iter().map(|x| x / length).collect() } else { v }
    };
    let rough = unit((0..derivative.len()).map(|i| 1.0 + 0.5 * (7.3 * i as f64).sin()).collect());
    let smooth = unit(derivative.to_vec());
    let mixed = smooth.iter().zip(rough).map(|(s, r)| (1.0 - ROUGH).sqrt() * s + ROUGH.sqrt() * r);
    unit(mixed.collect())
}

impl Known {
    /// The case with its derivative by the exact engine, which must exist.
    pub fn new(case: Case) -> Self {
        let gradient = Exact.forward(&case.scene, &case.motion, &case.film);
        let gradient = gradient.unwrap_or_else(|e| panic!("{e}\n{}", case.label));
        let channel = |i: usize| DVec3::AXES[i % 3];
        let derivative: Vec<f64> =
            gradient.mean.pixels().iter().enumerate().map(|(i, d)| d.dot(channel(i))).collect();
        let weights = focused(&derivative).into_iter().enumerate().map(|(i, w)| w * channel(i));
        let weights = Image::from_pixels(&case.film, weights.collect());
        let exact = weights.dot(&gradient.mean);
        let image = Arrangement::new(&case.scene, &case.film).expect("it has a gradient").primal(&case.film);
        let scale = (weights.dot(&weights) * image.dot(&image)).sqrt();
        Self { case, weights, exact, scale }
    }

    /// The weighted sum of a gradient image.
    pub fn estimate(&self, gradient: &GradientImage) -> Estimate {
        assert!(gradient.non_finite.is_empty(), "{}", self.case.label);
        let squared = self.weights.zip(&gradient.standard_error, |w, e| (w * e) * (w * e));
        let variance: f64 = squared.pixels().iter().map(|p| p.element_sum()).sum();
        Estimate { mean: self.weights.dot(&gradient.mean), standard_error: variance.sqrt() }
    }

    /// The weighted estimate of a method with another seed.
    pub fn run(&self, seed: u64, method: &impl Sampler) -> Estimate {
        let Case { scene, motion, film, label } = &self.case;
        let gradient: Result<_, EstimatorError> = method.reseeded(seed).forward(scene, motion, film);
        self.estimate(&gradient.unwrap_or_else(|e| panic!("{e}\n{label}")))
    }

    /// The weighted estimate of a function of scene, motion and film.
    pub fn run_with(&self, estimate: impl Fn(&Scene, &Motion, &Film) -> GradientImage) -> Estimate {
        self.estimate(&estimate(&self.case.scene, &self.case.motion, &self.case.film))
    }
}

/// `per_kind` scenes of each given kind. Where nothing visible moves, the estimate must be 0.
pub fn known(kinds: &[Kind], per_kind: u64) -> Vec<Known> {
    let knobs: Vec<Knobs> = kinds
        .iter()
        .flat_map(|&kind| (0..per_kind).map(move |seed| Knobs::random(50_000 + seed, kind)))
        .collect();
    knobs.into_par_iter().map(|k| Known::new(k.build())).collect()
}

/// A number with a known exact value.
#[derive(Clone, Copy, Debug)]
pub struct Target<'a> {
    /// The exact value.
    pub exact: f64,
    /// Scale of errors where the exact value is nearly 0.
    pub scale: f64,
    /// Description that suffices to repeat the case.
    pub label: &'a str,
}

/// An estimated quantity with a known reference.
pub trait Reference: Sync {
    /// The reference value, scale and label.
    fn target(&self) -> Target<'_>;
}

impl Reference for Known {
    fn target(&self) -> Target<'_> {
        Target { exact: self.exact, scale: self.scale, label: &self.case.label }
    }
}

/// Rejection thresholds on |z|.
#[derive(Clone, Copy, Debug)]
pub struct Limits {
    /// Threshold for a single scene.
    pub scene: f64,
    /// Threshold for the regression over all scenes.
    pub slope: f64,
}

impl Limits {
    /// Equal thresholds for both.
    pub fn both(limit: f64) -> Self {
        Self { scene: limit, slope: limit }
    }

    /// The regression alone, for cases where variance is infinite and single scenes prove nothing.
    pub fn slope_alone(self) -> Self {
        Self { scene: f64::INFINITY, ..self }
    }
}

/// Bound on an exact value, relative to its scale, below which it counts as nearly 0.
pub const NEARLY_ZERO: f64 = 1e-3;

/// Rounding of an estimate, relative to the larger of its exact value and scale.
const ROUNDING: f64 = 1e-12;

/// Both halves of every scene's estimate, with seeds 0 and 1, in parallel.
pub fn halves<K: Reference>(
    known: &[K],
    estimate: impl Fn(&K, u64) -> Estimate + Sync,
) -> Vec<[Estimate; 2]> {
    known.par_iter().map(|k| [0, 1].map(|seed| estimate(k, seed))).collect()
}

/// Result of comparing estimates with exact values over a campaign.
#[derive(Clone, Debug, Default)]
#[must_use]
pub struct Verdict {
    /// The largest |z| of a single scene.
    pub worst: f64,
    /// The label of that scene.
    pub worst_label: String,
    /// The root mean square of z: 1 for normal errors.
    pub spread: f64,
    /// The weighted regression of estimates on exact values: 1 for an unbiased method.
    pub slope: Estimate,
    /// The number of scenes.
    pub count: usize,
    /// Standard errors relative to the exact values, of scenes whose exact value is not nearly 0.
    pub errors: Vec<f64>,
    /// The number of scenes whose exact value is nearly 0.
    pub zeros: usize,
    /// The largest standard error among those scenes and the allowance beside it, relative to the scale, and
    /// the label of that scene.
    pub noise: ([f64; 2], String),
}

impl Verdict {
    /// Runs an estimate over all scenes, in parallel, twice: with seeds 0 and 1.
    pub fn of<K: Reference>(known: &[K], estimate: impl Fn(&K, u64) -> Estimate + Sync) -> Self {
        Self::on(known.iter().zip(&halves(known, estimate)))
    }

    /// The verdict on both halves of every scene's estimate.
    ///
    /// Each half is weighted by the variance of the other, at least the variance of an error of 10%, so that
    /// no few scenes decide. Weights from a half's own variance would be correlated with its error: where the
    /// distribution is skewed, a large mean comes with a large variance, which would bias the slope.
    pub fn on<'a, K: Reference + 'a>(found: impl Iterator<Item = (&'a K, &'a [Estimate; 2])>) -> Self {
        let mut this = Self::default();
        let (mut xy, mut xx, mut variance) = (0.0, 0.0, 0.0);
        for (k, pair) in found {
            let ([a, b], Target { exact, scale, label }) = (pair, k.target());
            // An estimate without spread must be exact up to rounding, relative or (for a value of 0) the
            // smallest normal number.
            let rounding = (ROUNDING * exact.abs().max(scale)).max(f64::MIN_POSITIVE);
            let error = (0.5 * a.standard_error.hypot(b.standard_error)).max(rounding);
            // Samples may miss features thinner than their spacing. Where the exact value is nearly 0, an
            // estimate of 0 is accepted: such scenes test for spurious contributions.
            let zero = exact.abs() <= NEARLY_ZERO * scale;
            let slack = if zero { exact.abs() } else { 0.0 };
            let off = (0.5 * (a.mean + b.mean) - exact).abs();
            let z = if off.is_nan() { f64::INFINITY } else { (off - slack).max(0.0) / error };
            if z > this.worst {
                this.worst = z;
                this.worst_label = label.to_owned();
            }
            this.spread += z * z;
            this.count += 1;
            if zero {
                this.zeros += 1;
                let bare = exact == 0.0 && error == rounding;
                let noise = [if bare { 0.0 } else { error / scale }, if bare { 0.0 } else { slack / scale }];
                if noise[0].is_nan() || noise[0] > this.noise.0[0] {
                    this.noise = (noise, label.to_owned());
                }
                continue;
            }
            this.errors.push(error / exact.abs());
            for (own, other) in [(a, b), (b, a)] {
                let weight = 1.0 / (other.standard_error.powi(2) + (0.1 * exact).powi(2));
                xy += weight * exact * own.mean;
                xx += weight * exact * exact;
                variance += (weight * exact * own.standard_error).powi(2);
            }
        }
        this.spread = (this.spread / this.count as f64).sqrt();
        this.slope = Estimate { mean: xy / xx, standard_error: variance.sqrt() / xx };
        this
    }

    /// Whether no single scene and not the slope rejects unbiasedness.
    pub fn passes(&self, limits: Limits) -> bool {
        self.worst <= limits.scene && has_slope_1(self.slope, limits)
    }

    /// Adds the smallest biases that the test rejects: relative by the slope, and relative to the scale where
    /// the exact value is nearly 0; also by every single scene, if those are judged.
    fn tell(&self, power: &mut Power, name: &str, limits: Limits) {
        power.add(
            format!("{name}: slope of {} scenes", self.count),
            limits.slope * self.slope.standard_error,
            1.0,
        );
        if limits.scene.is_finite() {
            power.by_scene(self.errors.iter().map(|error| limits.scene * error));
        }
        if self.zeros > 0 && limits.scene.is_finite() {
            let label = format!("{name}: of the scale of {} scenes of nearly 0", self.zeros);
            let [error, slack] = self.noise.0;
            power.add(label, limits.scene * error + slack, 1.0);
        }
    }

    /// Prints the verdict.
    pub fn print(&self, name: &str, limits: Limits) {
        println!(
            "{name}: {} scenes, worst |z| {:.2} (limit {:.2}), rms z {:.3}, slope {:.4} ± {:.4}; {}; {} of nearly 0 to {:.4}, {}",
            self.count,
            self.worst,
            limits.scene,
            self.spread,
            self.slope.mean,
            self.slope.standard_error,
            self.worst_label,
            self.zeros,
            self.noise.0[0],
            self.noise.1
        );
    }

    /// Asserts that the verdict passes and reports its power; as a control, a slope with the same error that
    /// is short by [`NOTICED`] must not pass.
    pub fn accept(&self, power: &mut Power, name: &str, limits: Limits) {
        self.print(name, limits);
        assert!(self.passes(limits), "{name} is biased: {self:?}");
        let less = Estimate { mean: 1.0 - NOTICED, ..self.slope };
        assert!(!has_slope_1(less, limits), "{name} would pass with a bias of {NOTICED}: {self:?}");
        self.tell(power, name, limits);
    }

    /// Asserts that the verdict does not pass although all its estimates are finite.
    pub fn reject(&self, name: &str, limits: Limits) {
        self.print(&format!("control {name}"), limits);
        let Estimate { mean, standard_error } = self.slope;
        assert!(mean.is_finite() && standard_error.is_finite(), "{name}: {self:?}");
        assert!(!self.passes(limits), "the control {name} was not rejected: {self:?}");
    }
}

/// Whether a slope is consistent with 1, that of an unbiased method; NaN is not.
fn has_slope_1(slope: Estimate, limits: Limits) -> bool {
    ((slope.mean - 1.0) / slope.standard_error).abs() <= limits.slope
}
