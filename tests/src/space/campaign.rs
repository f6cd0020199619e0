//! One number per scene of space, estimated and exact, over many scenes, by the
//! [`Verdict`] of the plane's campaigns.
//!
//! Pixels share their samples, by the filter and because cells share random numbers, so that the
//! standard error of a weighted sum of pixels is none of their own errors'. A gradient is
//! estimated many times over, with independent seeds, and the error of the mean is that of the
//! repetitions: Student's distribution is the one to compare with.

use glam::DVec3;
use rayon::prelude::*;
use statrs::distribution::{ContinuousCDF, StudentsT};
use volume3d::gradient::{Change, Gradient, GradientImage, Progress, WarpedArea};
use volume3d::scene::{Crop, Scene};

use super::coverage::ProjectedScene;
use super::direct::DirectScene;
use super::scenes::{self, Moving};
use super::worlds::{CoverageCase, CoverageKind, CoverageKnobs};
use crate::campaign::{Estimate, Reference, Verdict};
use crate::statistics::{Moments, suite_threshold};

/// How often a gradient is estimated, in each of a verdict's two halves.
pub const REPETITIONS: u64 = 32;

/// A scene with its exact derivative, seen through fixed random weights.
#[derive(Debug)]
pub struct Known {
    /// The scene.
    pub scene: Scene,
    /// What moves.
    pub change: Change,
    /// One weight per pixel and channel.
    pub weights: Vec<DVec3>,
    /// Σ weight · dI/dθ.
    pub exact: f64,
    /// The estimated error of [`exact`](Self::exact), which counts as one more standard error.
    pub error: f64,
    /// Σ weight · I, where it is known.
    pub value: f64,
    /// Enough to repeat it.
    pub label: String,
}

/// Weights that are not smooth from pixel to pixel.
#[must_use]
pub fn weights(pixels: usize) -> Vec<DVec3> {
    let wave = |i: usize, k: f64| 1.0 + 0.5 * (7.3 * i as f64 + k).sin();
    (0..pixels).map(|i| DVec3::new(wave(i, 0.0), 0.5 * wave(i, 2.0), 0.7 * wave(i, 4.0))).collect()
}

impl Known {
    fn new(moving: Moving, derivative: &[DVec3], error: &[f64], label: String) -> Self {
        let weights = weights(derivative.len());
        let exact = weights.iter().zip(derivative).map(|(w, d)| w.dot(*d)).sum();
        let error = weights.iter().zip(error).map(|(w, e)| w.element_sum() * e).sum();
        Self { scene: moving.scene, change: moving.change, weights, exact, error, value: 0.0, label }
    }

    /// A mesh of constant radiance, by the plane's exact arrangement.
    ///
    /// # Panics
    /// If the case has no derivative.
    #[must_use]
    pub fn of_coverage(case: &CoverageCase, crop: Option<Crop>) -> Self {
        let CoverageCase { mesh, camera, motion, filter, label } = case;
        let projected = ProjectedScene::new(mesh, camera, motion, *filter);
        let derivative = projected.and_then(|p| p.derivative()).unwrap_or_else(|e| panic!("{e}\n{label}"));
        let whole = Crop { x: 0, y: 0, width: camera.width, height: camera.height };
        let window = crop.unwrap_or(whole);
        let rows = (window.y..window.y + window.height).map(|y| y * camera.width);
        let shown = rows.flat_map(|row| (window.x..window.x + window.width).map(move |x| row + x));
        let shown: Vec<DVec3> = shown.map(|i| derivative.pixels()[i]).collect();
        let moving = scenes::coverage(case, crop);
        Self::new(moving, &shown, &[], format!("{label} {crop:?}"))
    }

    /// A ground in direct light, by quadrature to `tolerance`.
    ///
    /// # Panics
    /// If some pixel cannot be had.
    #[must_use]
    pub fn of_direct(direct: &DirectScene, tolerance: f64, label: &str) -> Self {
        let image = direct.image(tolerance).unwrap_or_else(|e| panic!("{e}\n{label}"));
        let derivative: Vec<DVec3> = image.iter().map(|p| p.derivative).collect();
        let error: Vec<f64> = image.iter().map(|p| p.derivative_error).collect();
        let mut this = Self::new(scenes::direct(direct), &derivative, &error, label.to_owned());
        this.value = this.weighted(&image.iter().map(|p| p.value).collect::<Vec<_>>());
        this
    }

    /// The gradient image of one run.
    ///
    /// # Panics
    /// If the method refuses the scene, or a sample is not finite.
    #[must_use]
    pub fn run(&self, method: &WarpedArea) -> GradientImage {
        let found = method.forward(&self.scene, &self.change, &Progress::none());
        let found = found.unwrap_or_else(|e| panic!("{e}\n{}", self.label));
        assert!(found.non_finite.is_empty(), "{:?} {}", found.non_finite, self.label);
        found
    }

    /// Σ weight · pixel.
    #[must_use]
    pub fn weighted(&self, pixels: &[DVec3]) -> f64 {
        self.weights.iter().zip(pixels).map(|(w, p)| w.dot(*p)).sum()
    }

    /// The mean of [`REPETITIONS`] runs of one half, with seeds of their own.
    #[must_use]
    pub fn repeated(&self, half: u64, run: impl Fn(u64) -> f64) -> Estimate {
        let runs: Moments = (0..REPETITIONS).map(|k| run(half * REPETITIONS + k)).collect();
        // Both halves are compared with the same number, whose error their mean does not reduce.
        let standard_error = runs.standard_error().hypot(std::f64::consts::SQRT_2 * self.error);
        Estimate { mean: runs.mean(), standard_error }
    }

    /// The estimate of warped-area sampling.
    #[must_use]
    pub fn estimate(&self, half: u64, method: &WarpedArea) -> Estimate {
        self.repeated(half, |seed| {
            let seed = method.seed.wrapping_add(seed);
            self.weighted(&self.run(&WarpedArea { seed, ..method.clone() }).gradient)
        })
    }
}

impl Reference for Known {
    fn exact(&self) -> f64 {
        self.exact
    }

    fn label(&self) -> &str {
        &self.label
    }
}

/// What reverse mode returns, of which every sample must have been finite.
///
/// # Panics
/// If one was not.
#[must_use]
pub fn pulled(found: impl Into<Gradient>) -> Change {
    let Gradient { change, non_finite } = found.into();
    assert!(non_finite.is_empty(), "{non_finite:?}");
    change
}

/// |z| above this rejects a single scene: what Student's distribution exceeds as rarely as the
/// normal one the threshold of the suite, with the degrees of freedom of both halves.
///
/// # Panics
/// Never.
#[must_use]
pub fn limit() -> f64 {
    let freedom = 2.0 * (REPETITIONS as f64 - 1.0);
    let (student, normal) = (StudentsT::new(0.0, 1.0, freedom), statrs::distribution::Normal::standard());
    let student = student.expect("degrees of freedom");
    let rare = normal.cdf(-suite_threshold());
    // Bisection, in the lower tail: 1 minus a small number would round it away.
    let (mut low, mut high) = (suite_threshold(), 1e3);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if student.cdf(-middle) > rare { low = middle } else { high = middle }
    }
    high
}

/// `per_kind` cases of each kind, some of them cropped, in which something moves on the film.
#[must_use]
pub fn coverage(kinds: &[CoverageKind], per_kind: u64) -> Vec<Known> {
    let knobs = kinds.iter().flat_map(|&k| (0..per_kind).map(move |i| CoverageKnobs::random(70_000 + i, k)));
    let knobs: Vec<_> = knobs.collect();
    let known: Vec<Known> = knobs
        .par_iter()
        .map(|k| {
            let case = k.build();
            let crop = (k.seed % 4 == 3).then(|| inner(case.camera.width, case.camera.height, k.seed));
            Known::of_coverage(&case, crop)
        })
        .collect();
    known.into_iter().filter(|k| k.exact.abs() > 1e-3).collect()
}

/// A window that leaves out something on each side or not, as the seed says.
fn inner(width: usize, height: usize, seed: u64) -> Crop {
    let [left, right, above, below] = [2, 3, 4, 5].map(|bit| (seed >> bit & 1) as usize);
    Crop { x: left, y: above, width: width - left - right, height: height - above - below }
}

/// A verdict, printed.
#[must_use]
pub fn verdict(name: &str, known: &[Known], estimate: impl Fn(&Known, u64) -> Estimate + Sync) -> Verdict {
    let v = Verdict::of(known, estimate);
    println!(
        "{name}: {} scenes, worst |z| {:.2} (limit {:.2}), rms z {:.3}, slope {:.4} ± {:.4}; {}",
        v.count,
        v.worst,
        limit(),
        v.spread,
        v.slope,
        v.slope_error,
        v.worst_label
    );
    v
}

/// Whether nothing speaks against the method being unbiased: no scene alone, and not their slope.
#[must_use]
pub fn passes(v: &Verdict) -> bool {
    v.worst <= limit() && v.slope_z().abs() <= suite_threshold()
}

/// Asserts that a method is unbiased on all scenes, as well as these can tell.
///
/// # Panics
/// If it is not, or if the scenes could not tell a bias of 30%.
pub fn accept(name: &str, known: &[Known], method: &WarpedArea) {
    let v = verdict(name, known, |k, half| k.estimate(half, method));
    assert!(passes(&v), "{name} is biased: {v:?}");
    assert!(suite_threshold() * v.slope_error < 0.3, "{name}: {v:?}");
}

/// Asserts that a wrong method is found out.
///
/// # Panics
/// If it is not.
pub fn reject(name: &str, known: &[Known], estimate: impl Fn(&Known, u64) -> Estimate + Sync) {
    let v = verdict(&format!("control {name}"), known, estimate);
    assert!(!passes(&v), "the control {name} was not rejected: {v:?}");
}
