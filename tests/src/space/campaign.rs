//! Statistical comparison of estimated with exact values over many scenes in space, one number per scene, by
//! the [`Verdict`] of the plane's campaigns.
//!
//! Pixels share their samples, through the filter and because cells share random numbers, so that the
//! standard error of a weighted sum of pixels does not follow from their own errors. A gradient is estimated
//! many times, with independent seeds; the error of the mean follows from the repetitions, and is compared
//! with Student's distribution.

use glam::DVec3;
use rayon::prelude::*;
use volume3d::Image;
use volume3d::gradient::{
    ActiveParameters, EdgeSampling, FiniteDifference, Gradient, GradientError, GradientImage, Pilot,
    Progress, Tangent, WarpedArea,
};
use volume3d::scene::{Crop, Scene};

use super::coverage::ProjectedScene;
use super::direct::{DirectScene, Pixel};
use super::scenes::{self, Moving};
use super::worlds::{CoverageCase, CoverageKind, CoverageKnobs};
use crate::campaign::{Limits, Reference, Target, Verdict, focused};
use crate::comparison::Estimate;
use crate::power::Power;
use crate::statistics::{student, suite_threshold};

/// Number of independent estimates of a gradient in each of a verdict's two halves.
pub const REPETITIONS: u64 = 20;

/// A scene with its exact derivative, reduced to one number by fixed random weights.
#[derive(Debug)]
pub struct Known {
    /// The scene.
    pub scene: Scene,
    /// The tangent of the scene's parameters.
    pub change: Tangent,
    /// One weight per pixel and channel.
    pub weights: Vec<DVec3>,
    /// Σ weight · dI/dθ.
    pub exact: f64,
    /// The estimated error of [`exact`](Self::exact), which counts as one more standard error.
    pub error: f64,
    /// Scale of errors where [`exact`](Self::exact) is nearly 0: |weights| · |I|, the change of the whole
    /// image by itself.
    pub scale: f64,
    /// Description that suffices to repeat the case.
    pub label: String,
}

/// A sampling method, all of whose samples follow from its seed.
pub trait Sampler: Sync {
    /// A copy of the method with its seed increased by `more`.
    fn reseeded(&self, more: u64) -> Self;

    /// The gradient image.
    fn forward(&self, scene: &Scene, change: &Tangent) -> Result<GradientImage, GradientError>;

    /// Its transpose.
    fn reverse(
        &self,
        scene: &Scene,
        adjoint: &Image,
        active: &ActiveParameters,
    ) -> Result<Gradient, GradientError>;
}

macro_rules! sampler {
    ($method:ty) => {
        impl Sampler for $method {
            fn reseeded(&self, more: u64) -> Self {
                Self { seed: self.seed.wrapping_add(more), ..self.clone() }
            }

            fn forward(&self, scene: &Scene, change: &Tangent) -> Result<GradientImage, GradientError> {
                self.forward(scene, change, &Progress::none())
            }

            fn reverse(
                &self,
                scene: &Scene,
                adjoint: &Image,
                active: &ActiveParameters,
            ) -> Result<Gradient, GradientError> {
                self.reverse(scene, adjoint, active, &Progress::none())
            }
        }
    };
}

sampler!(WarpedArea);
sampler!(EdgeSampling);

/// The method that a pilot chooses.
impl Sampler for Pilot {
    fn reseeded(&self, more: u64) -> Self {
        Self { seed: self.seed.wrapping_add(more), ..*self }
    }

    fn forward(&self, scene: &Scene, change: &Tangent) -> Result<GradientImage, GradientError> {
        let choice = self.for_change(scene, change, &Progress::none())?;
        choice.method.forward(scene, change, &Progress::none())
    }

    fn reverse(
        &self,
        scene: &Scene,
        adjoint: &Image,
        active: &ActiveParameters,
    ) -> Result<Gradient, GradientError> {
        let choice = self.for_active(scene, Some(adjoint), active, &Progress::none())?;
        choice.method.reverse(scene, adjoint, active, &Progress::none())
    }
}

/// The default method with `samples` samples a pixel.
pub fn warped(samples: usize) -> WarpedArea {
    WarpedArea { samples, ..WarpedArea::default() }
}

/// Weights that are not smooth from pixel to pixel.
pub fn weights(pixels: usize) -> Vec<DVec3> {
    let wave = |i: usize, k: f64| 1.0 + 0.5 * (7.3 * i as f64 + k).sin();
    (0..pixels).map(|i| DVec3::new(wave(i, 0.0), 0.5 * wave(i, 2.0), 0.7 * wave(i, 4.0))).collect()
}

/// The weights of [`focused`], pixel by pixel.
pub fn directed(derivative: &[DVec3]) -> Vec<DVec3> {
    let channels: Vec<f64> = derivative.iter().flat_map(DVec3::to_array).collect();
    focused(&channels).chunks(3).map(DVec3::from_slice).collect()
}

impl Known {
    /// A case with the weights of [`directed`].
    pub(crate) fn new(
        moving: Moving,
        derivative: &[DVec3],
        error: &[f64],
        image: &[DVec3],
        label: String,
    ) -> Self {
        let weights = directed(derivative);
        let exact = weights.iter().zip(derivative).map(|(w, d)| w.dot(*d)).sum();
        let error = weights.iter().zip(error).map(|(w, e)| w.abs().element_sum() * e).sum();
        let scale = image.iter().map(|p| p.length_squared()).sum::<f64>().sqrt();
        Self { scene: moving.scene, change: moving.change, weights, exact, error, scale, label }
    }

    /// A mesh of constant radiance, by the plane's exact arrangement.
    pub fn of_coverage(case: &CoverageCase, crop: Option<Crop>) -> Self {
        let CoverageCase { mesh, camera, motion, filter, label } = case;
        let projected = ProjectedScene::new(mesh, camera, motion, *filter);
        let both = projected.and_then(|p| Ok((p.derivative()?, p.image()?)));
        let (derivative, image) = both.unwrap_or_else(|e| panic!("{e}\n{label}"));
        let whole = Crop { x: 0, y: 0, width: camera.width, height: camera.height };
        let window = crop.unwrap_or(whole);
        let rows = (window.y..window.y + window.height).map(|y| y * camera.width);
        let shown = rows.flat_map(|row| (window.x..window.x + window.width).map(move |x| row + x));
        let shown: Vec<usize> = shown.collect();
        let [derivative, image] =
            [&derivative, &image].map(|of| shown.iter().map(|&i| of.pixels()[i]).collect::<Vec<DVec3>>());
        Self::new(scenes::coverage(case, crop), &derivative, &[], &image, format!("{label} {crop:?}"))
    }

    /// A ground in direct light, by quadrature to `tolerance`.
    pub fn of_direct(direct: &DirectScene, tolerance: f64, label: &str) -> Self {
        let pixels = direct.image(tolerance).unwrap_or_else(|e| panic!("{e}\n{label}"));
        Self::of_pixels(direct, &pixels, 1.0, label)
    }

    /// A ground in direct light whose pixels are given, with stated errors that are too small by the factor
    /// `short`.
    pub(crate) fn of_pixels(direct: &DirectScene, pixels: &[Pixel], short: f64, label: &str) -> Self {
        let derivative: Vec<DVec3> = pixels.iter().map(|p| p.derivative).collect();
        let error: Vec<f64> = pixels.iter().map(|p| short * p.derivative_error).collect();
        let image: Vec<DVec3> = pixels.iter().map(|p| p.value).collect();
        Self::new(scenes::direct(direct), &derivative, &error, &image, label.to_owned())
    }

    /// The gradient image of one run.
    pub fn run(&self, method: &impl Sampler) -> GradientImage {
        let found = method.forward(&self.scene, &self.change);
        let found = found.unwrap_or_else(|e| panic!("{e}\n{}", self.label));
        assert!(found.non_finite.is_empty(), "{:?} {}", found.non_finite, self.label);
        found
    }

    /// Σ weight · pixel.
    pub fn weighted(&self, pixels: &[DVec3]) -> f64 {
        self.weights.iter().zip(pixels).map(|(w, p)| w.dot(*p)).sum()
    }

    /// A scene whose derivative is known by an argument, or is compared with that of another method.
    pub fn given(scene: Scene, change: Tangent, exact: f64, label: &str) -> Self {
        let (width, height) = scene.size();
        let weights = weights(width * height);
        Self { scene, change, weights, exact, error: 0.0, scale: 0.0, label: label.to_owned() }
    }

    /// Weights pixels by their gradient, so that parts of opposite sign do not cancel. The gradient comes
    /// from central differences: the method under test would give no weight to pixels where it misses a
    /// contribution.
    pub fn focused(self, samples: usize, step: f64) -> Self {
        let other = FiniteDifference { samples, step, seed: 7777 };
        let found = other.forward(&self.scene, &self.change, &Progress::none()).expect("valid");
        Self { weights: directed(&found.gradient.pixels), ..self }
    }

    /// The weighted gradient of a method.
    pub fn sample(&self, method: &impl Sampler) -> f64 {
        self.weighted(&self.run(method).gradient.pixels)
    }

    /// Central differences with common random numbers at N steps, each twice the last, extrapolated
    /// (Richardson), and the distance between the last two extrapolations: errors of order h²ᴺ and h²ᴺ⁻².
    pub fn differences<const N: usize>(&self, narrowest: FiniteDifference, runs: u64) -> (Estimate, f64) {
        let run = |k: u64| {
            let mut at: Vec<f64> = (0..N as i32)
                .map(|i| {
                    let step = 2.0_f64.powi(i) * narrowest.step;
                    let method = FiniteDifference { step, seed: narrowest.seed + k, ..narrowest };
                    let found = method.forward(&self.scene, &self.change, &Progress::none()).expect("valid");
                    // One-sided differences have errors of order h, to which the extrapolation does not
                    // apply.
                    assert_eq!(found.one_sided, None);
                    self.weighted(&found.gradient.pixels)
                })
                .collect();
            let (mut apart, mut order) = (0.0, 4.0);
            while at.len() > 1 {
                apart = (at[0] - at[1]) / (order - 1.0);
                at = at.windows(2).map(|w| (order * w[0] - w[1]) / (order - 1.0)).collect();
                order *= 4.0;
            }
            (at[0], apart)
        };
        let (found, apart): (Vec<f64>, Vec<f64>) = (0..runs).into_par_iter().map(run).unzip();
        (Estimate::of(found), Estimate::of(apart).mean.abs())
    }

    /// The mean of [`REPETITIONS`] runs of one half, with seeds of their own.
    pub fn repeated(&self, half: u64, run: impl Fn(u64) -> f64) -> Estimate {
        let runs = Estimate::of((0..REPETITIONS).map(|k| run(half * REPETITIONS + k)));
        // Both halves are compared with the same reference, whose error their mean does not reduce.
        let standard_error = runs.standard_error.hypot(std::f64::consts::SQRT_2 * self.error);
        Estimate { standard_error, ..runs }
    }

    /// The estimate of a method.
    pub fn estimate(&self, half: u64, method: &impl Sampler) -> Estimate {
        self.repeated(half, |seed| self.sample(&method.reseeded(seed)))
    }

    /// The moving parameters as active parameters for edge sampling, which then draws from their edges only.
    pub fn moving(&self) -> ActiveParameters {
        let Self { scene, change, .. } = self;
        let moves = |shape: usize| change.positions_of(scene, shape).iter().any(|v| *v != DVec3::ZERO);
        let shapes = (0..scene.description().shapes.len()).map(moves).collect();
        let camera = &change.camera;
        let turns = camera.translation != DVec3::ZERO || camera.rotation != DVec3::ZERO;
        ActiveParameters {
            shapes,
            camera: turns || camera.field_of_view != 0.0,
            ..ActiveParameters::everything(scene)
        }
    }

    /// All parameters, materials only if asked for: paths continue past black surfaces whose reflectance is
    /// active.
    pub fn everything(&self, materials: bool) -> ActiveParameters {
        let materials = vec![materials; self.scene.description().materials.len()];
        ActiveParameters { materials, ..ActiveParameters::everything(&self.scene) }
    }

    /// Asserts that reverse mode is the transpose of forward mode, sample by sample, and returns the
    /// discrepancy relative to the absolute values of the terms: sums over parameters may cancel.
    pub fn assert_transposed(&self, method: &impl Sampler, active: &ActiveParameters) -> f64 {
        let image = self.run(method).gradient;
        let forward = self.weighted(&image.pixels);
        let scale: f64 =
            self.weights.iter().zip(&image.pixels).map(|(w, g)| (*w * *g).abs().element_sum()).sum();
        let found = method.reverse(&self.scene, &image.with_pixels(self.weights.clone()), active);
        let reverse = pulled(found.unwrap_or_else(|e| panic!("{e}\n{}", self.label)));
        let found = reverse.dot(&self.change);
        let scale = scale.max(magnitude(&reverse, &self.change)).max(f64::MIN_POSITIVE);
        let error = (found - forward).abs() / scale;
        assert!(error < 1e-12, "{forward} {found} {}", self.label);
        error
    }
}

/// Σ |gradient · rate| over positions and camera.
fn magnitude(gradient: &Tangent, change: &Tangent) -> f64 {
    let positions = gradient.positions.iter().zip(&change.positions);
    let (g, r) = (&gradient.camera, &change.camera);
    let camera = [(&g.translation, &r.translation), (&g.rotation, &r.rotation)];
    let terms = positions.chain(camera).map(|(g, r)| (*g * *r).abs().element_sum());
    terms.sum::<f64>() + (g.field_of_view * r.field_of_view).abs()
}

impl Reference for Known {
    fn target(&self) -> Target<'_> {
        Target { exact: self.exact, scale: self.scale, label: &self.label }
    }
}

/// The gradient of reverse mode, all of whose samples must have been finite.
pub fn pulled(found: impl Into<Gradient>) -> Tangent {
    let Gradient { by_parameter: change, non_finite, .. } = found.into();
    assert!(non_finite.is_empty(), "{non_finite:?}");
    change
}

/// [`student`] for a single scene of a campaign, with the degrees of freedom of both halves.
pub fn limit() -> f64 {
    student(2 * (REPETITIONS - 1))
}

/// The limits of a campaign.
pub fn limits() -> Limits {
    Limits { scene: limit(), slope: suite_threshold() }
}

/// `per_kind` cases of each kind, some of them cropped. Where nothing visible moves, the estimate must be 0.
pub fn coverage(kinds: &[CoverageKind], per_kind: u64) -> Vec<Known> {
    let knobs = kinds.iter().flat_map(|&k| (0..per_kind).map(move |i| CoverageKnobs::random(70_000 + i, k)));
    let knobs: Vec<_> = knobs.collect();
    knobs
        .par_iter()
        .map(|k| {
            let case = k.build();
            let crop = (k.seed % 4 == 3).then(|| inner(case.camera.width, case.camera.height, k.seed));
            Known::of_coverage(&case, crop)
        })
        .collect()
}

/// A crop window that, depending on the seed, omits something on each side.
fn inner(width: usize, height: usize, seed: u64) -> Crop {
    let [left, right, above, below] = [2, 3, 4, 5].map(|bit| (seed >> bit & 1) as usize);
    Crop { x: left, y: above, width: width - left - right, height: height - above - below }
}

/// Asserts that a method is unbiased on all scenes.
pub fn accept(power: &mut Power, name: &str, known: &[Known], method: &impl Sampler) {
    Verdict::of(known, |k, half| k.estimate(half, method)).accept(power, name, limits());
}

/// Asserts that a wrong method is rejected.
pub fn reject(name: &str, known: &[Known], estimate: impl Fn(&Known, u64) -> Estimate + Sync) {
    Verdict::of(known, estimate).reject(name, limits());
}
