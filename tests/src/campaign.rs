//! One number per scene, estimated and exact, over many scenes: what the statistical tests compare.

use flatland::estimator::{EstimatorError, Exact, GradientImage, Method};
use flatland::plane::{Film, Image, Motion, Scene};
use glam::DVec3;
use rayon::prelude::*;

use crate::scenes::{Case, Kind, Knobs};

/// A scene with its exact derivative, seen through fixed random weights.
#[derive(Debug)]
pub struct Known {
    /// The scene, its motion and its film.
    pub case: Case,
    /// One weight per pixel, in one channel of it: channels of a pixel share their samples.
    pub weights: Image,
    /// Σ weight · dI/dθ.
    pub exact: f64,
}

/// The estimate of [`Known::exact`].
#[derive(Clone, Copy, Debug)]
pub struct Estimate {
    /// Σ weight · mean.
    pub mean: f64,
    /// Its standard error; pixels are independent.
    pub standard_error: f64,
}

impl Known {
    /// # Panics
    /// If the case has no derivative.
    #[must_use]
    pub fn new(case: Case) -> Self {
        let gradient = Exact.forward(&case.scene, &case.motion, &case.film);
        let gradient = gradient.unwrap_or_else(|e| panic!("{e}\n{}", case.label));
        let weights = (0..case.film.width() * case.film.height()).map(|i| {
            // Anything that is not smooth from pixel to pixel will do.
            let weight = 1.0 + 0.5 * (7.3 * i as f64).sin();
            DVec3::AXES[i % 3] * weight
        });
        let weights = Image::from_pixels(&case.film, weights.collect());
        let exact = weights.dot(&gradient.mean);
        Self { case, weights, exact }
    }

    /// The weighted sum of a gradient image.
    #[must_use]
    pub fn estimate(&self, gradient: &GradientImage) -> Estimate {
        assert_eq!(gradient.non_finite, 0, "{}", self.case.label);
        let squared = self.weights.zip(&gradient.standard_error, |w, e| (w * e) * (w * e));
        let variance: f64 = squared.pixels().iter().map(|p| p.element_sum()).sum();
        Estimate { mean: self.weights.dot(&gradient.mean), standard_error: variance.sqrt() }
    }

    /// The estimate of a method.
    ///
    /// # Panics
    /// If the method refuses the scene.
    #[must_use]
    pub fn run(&self, method: &impl Method) -> Estimate {
        let Case { scene, motion, film, label } = &self.case;
        let gradient: Result<_, EstimatorError> = method.forward(scene, motion, film);
        self.estimate(&gradient.unwrap_or_else(|e| panic!("{e}\n{label}")))
    }

    /// The estimate from a function of scene, motion and film.
    #[must_use]
    pub fn run_with(&self, estimate: impl Fn(&Scene, &Motion, &Film) -> GradientImage) -> Estimate {
        self.estimate(&estimate(&self.case.scene, &self.case.motion, &self.case.film))
    }
}

/// `per_kind` scenes of each of some kinds, in which something moves.
#[must_use]
pub fn known(kinds: &[Kind], per_kind: u64) -> Vec<Known> {
    let knobs: Vec<Knobs> = kinds
        .iter()
        .flat_map(|&kind| (0..per_kind).map(move |seed| Knobs::random(50_000 + seed, kind)))
        .collect();
    let all: Vec<Known> = knobs.into_par_iter().map(|k| Known::new(k.build())).collect();
    all.into_iter().filter(|k| k.exact.abs() > 1e-3).collect()
}

/// A number that is known, and what to call it.
pub trait Reference: Sync {
    /// The exact value.
    fn exact(&self) -> f64;
    /// Enough to repeat it.
    fn label(&self) -> &str;
}

impl Reference for Known {
    fn exact(&self) -> f64 {
        self.exact
    }

    fn label(&self) -> &str {
        &self.case.label
    }
}

/// How estimates compare with exact values over a campaign.
#[derive(Clone, Debug)]
pub struct Verdict {
    /// The largest |z| of a single scene.
    pub worst: f64,
    /// Which scene that is.
    pub worst_label: String,
    /// The root mean square of z: 1 for normal errors.
    pub spread: f64,
    /// The weighted regression of estimates on exact values: 1 for an unbiased method.
    pub slope: f64,
    /// Its standard error.
    pub slope_error: f64,
    /// How many scenes.
    pub count: usize,
}

impl Verdict {
    /// Runs an estimate over all scenes, in parallel, twice: with seeds 0 and 1.
    ///
    /// Each half is weighted by the variance of the other, but at least as if it were off by 30%.
    /// Weights from its own variance would be correlated with its error, because where the
    /// distribution is skewed a large mean comes with a large variance, and the slope would be
    /// biased by them.
    pub fn of<K: Reference>(known: &[K], estimate: impl Fn(&K, u64) -> Estimate + Sync) -> Self {
        let halves: Vec<[Estimate; 2]> =
            known.par_iter().map(|k| [0, 1].map(|seed| estimate(k, seed))).collect();
        let mut this = Self {
            worst: 0.0,
            worst_label: String::new(),
            spread: 0.0,
            slope: 0.0,
            slope_error: 0.0,
            count: known.len(),
        };
        let (mut xy, mut xx, mut variance) = (0.0, 0.0, 0.0);
        for (k, pair) in known.iter().zip(&halves) {
            let ([a, b], exact) = (pair, k.exact());
            // An estimate without any spread must be exact, but for rounding.
            let error = (0.5 * a.standard_error.hypot(b.standard_error)).max(1e-12 * exact.abs());
            let z = (0.5 * (a.mean + b.mean) - exact) / error;
            if z.is_nan() || z.abs() > this.worst {
                this.worst = if z.is_nan() { f64::INFINITY } else { z.abs() };
                this.worst_label = k.label().to_owned();
            }
            this.spread += z * z / known.len() as f64;
            for (own, other) in [(a, b), (b, a)] {
                let weight = 1.0 / (other.standard_error.powi(2) + (0.3 * exact).powi(2));
                xy += weight * exact * own.mean;
                xx += weight * exact * exact;
                variance += (weight * exact * own.standard_error).powi(2);
            }
        }
        this.spread = this.spread.sqrt();
        this.slope = xy / xx;
        this.slope_error = variance.sqrt() / xx;
        this
    }

    /// z of the slope against 1.
    #[must_use]
    pub fn slope_z(&self) -> f64 {
        (self.slope - 1.0) / self.slope_error
    }

    /// Whether nothing speaks against the method being unbiased.
    #[must_use]
    pub fn passes(&self, limit: f64) -> bool {
        self.worst <= limit && self.slope_z().abs() <= limit
    }
}
