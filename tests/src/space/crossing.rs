//! Scenes whose triangles pass through one another, with exact derivatives, and what methods make of
//! them.

use flatland::plane::Filter;
use glam::{DVec2, DVec3};
use rayon::prelude::*;
use volume3d::gradient::{Change, EdgeSampling, Gradient, Progress, Wanted, WarpedArea};

use super::campaign::{Known, limit, weights};
use super::coverage::{Camera, CameraMotion, Mesh, Motion, ProjectedScene};
use super::scenes::{self, Moving};
use super::worlds::{
    CoverageCase, CrossingKind, CrossingKnobs, CrossingMoving, DirectCase, LitCrossing, LitCrossingKind,
    LitCrossingMoving,
};
use crate::campaign::Estimate;
use crate::statistics::suite_threshold;

/// A method of the renderer, of a seed that estimates choose.
#[derive(Clone, Debug)]
pub enum Sampler {
    /// Warped-area sampling.
    Warped(WarpedArea),
    /// Edge sampling.
    Edges(EdgeSampling),
}

impl Sampler {
    fn gradient(&self, known: &Known, seed: u64) -> Vec<DVec3> {
        let (scene, change, progress) = (&known.scene, &known.change, Progress::none());
        let found = match self {
            Self::Warped(method) => WarpedArea { seed, ..method.clone() }.forward(scene, change, &progress),
            Self::Edges(method) => EdgeSampling { seed, ..method.clone() }.forward(scene, change, &progress),
        };
        let found = found.unwrap_or_else(|e| panic!("{e}\n{}", known.label));
        assert!(found.non_finite.is_empty(), "{:?} {}", found.non_finite, known.label);
        found.gradient
    }

    /// The weighted sum of the gradient image, over the repetitions of one half.
    ///
    /// # Panics
    /// If the method refuses the scene, or a sample is not finite.
    #[must_use]
    pub fn estimate(&self, known: &Known, half: u64) -> Estimate {
        known.repeated(half, |seed| known.weighted(&self.gradient(known, seed)))
    }

    /// How far reverse mode is from being the transpose of forward mode at one seed, relative to the
    /// absolute values of what is summed.
    ///
    /// # Panics
    /// As [`estimate`](Self::estimate).
    #[must_use]
    pub fn transpose_error(&self, known: &Known) -> f64 {
        const SEED: u64 = 11;
        let image = self.gradient(known, SEED);
        let scale: f64 = known.weights.iter().zip(&image).map(|(w, g)| (*w * *g).abs().element_sum()).sum();
        let (wanted, progress) = (moving(known), Progress::none());
        let found = match self {
            Self::Warped(method) => {
                let method = WarpedArea { seed: SEED, ..method.clone() };
                method.reverse(&known.scene, &known.weights, &wanted, &progress)
            }
            Self::Edges(method) => {
                let method = EdgeSampling { seed: SEED, ..method.clone() };
                method.reverse(&known.scene, &known.weights, &wanted, &progress)
            }
        };
        let Gradient { change, .. } = found.unwrap_or_else(|e| panic!("{e}\n{}", known.label));
        let error = (change.dot(&known.change) - known.weighted(&image)).abs();
        error / scale.max(magnitude(&change, &known.change))
    }
}

/// What moves: edge sampling draws from the edges of that alone.
fn moving(known: &Known) -> Wanted {
    let Known { scene, change, .. } = known;
    let moves = |shape: usize| change.positions_of(scene, shape).iter().any(|v| *v != DVec3::ZERO);
    let shapes = (0..scene.description().shapes.len()).map(moves).collect();
    let camera = &change.camera;
    let turns = camera.translation != DVec3::ZERO || camera.rotation != DVec3::ZERO;
    Wanted { shapes, camera: turns || camera.field_of_view != 0.0, ..Wanted::everything(scene) }
}

/// Σ |gradient · rate| over positions and camera.
fn magnitude(gradient: &Change, change: &Change) -> f64 {
    let positions = gradient.positions.iter().zip(&change.positions);
    let (g, r) = (&gradient.camera, &change.camera);
    let camera = [(g.translation, r.translation), (g.rotation, r.rotation)];
    positions.map(|(g, r)| (*g * *r).abs().element_sum()).sum::<f64>()
        + camera.iter().map(|(g, r)| (*g * *r).abs().element_sum()).sum::<f64>()
        + (g.field_of_view * r.field_of_view).abs()
}

/// Of scenes whose derivative is 0 or almost: what a silhouette of a hundredth of a pixel is worth that
/// moves by a pixel before another radiance.
const LEAST_SIZE: f64 = 1e-2;

/// A scene with its exact derivative, and how large the terms are of which that is the sum.
#[derive(Debug)]
pub struct Sized {
    /// The scene.
    pub known: Known,
    /// Σ |weight · dI/dθ| over pixels and channels, or [`LEAST_SIZE`].
    pub size: f64,
}

impl Sized {
    /// A mesh whose triangles may pass through one another, by its exact coverage.
    ///
    /// # Panics
    /// If the case has no derivative.
    #[must_use]
    pub fn of_coverage(case: &CoverageCase, weights: Vec<DVec3>) -> Self {
        let CoverageCase { mesh, camera, motion, filter, label } = case;
        let projected = ProjectedScene::cut(mesh, camera, motion, *filter);
        let derivative = projected.and_then(|p| p.derivative()).unwrap_or_else(|e| panic!("{e}\n{label}"));
        let terms = || weights.iter().zip(derivative.pixels());
        let exact = terms().map(|(w, d)| w.dot(*d)).sum();
        let size = terms().map(|(w, d)| (*w * *d).abs().element_sum()).sum();
        let size = f64::max(size, LEAST_SIZE);
        let Moving { scene, change } = scenes::coverage(case, None);
        let label = label.clone();
        Self { known: Known { scene, change, weights, exact, error: 0.0, value: 0.0, label }, size }
    }
}

/// Light on a ground past bodies that cross, of some kinds, by quadrature; `count` of each with every motion.
///
/// # Panics
/// If some pixel cannot be had.
#[must_use]
pub fn lit(kinds: &[LitCrossingKind], movings: &[LitCrossingMoving], count: u64) -> Vec<Sized> {
    let pairs = kinds.iter().flat_map(|&kind| movings.iter().map(move |&moving| (kind, moving)));
    let knobs = pairs
        .flat_map(|(kind, moving)| (0..count).map(move |i| LitCrossing { seed: 81_000 + i, kind, moving }));
    let sized = |knobs: &LitCrossing| {
        let DirectCase { scene: direct, label } = knobs.build();
        let is_seen = LitCrossingKind::SEEN.contains(&knobs.kind);
        let image = if is_seen { direct.image_past_bodies(1e-3) } else { direct.image(1e-3) };
        let image = image.unwrap_or_else(|e| panic!("{e}\n{label}"));
        let weights = weights(image.len());
        let terms = || weights.iter().zip(&image);
        let exact = terms().map(|(w, p)| w.dot(p.derivative)).sum();
        // Where bodies touch the ground the stated error is short by up to a factor of three.
        let short = if is_seen { 3.0 } else { 1.0 };
        let error = terms().map(|(w, p)| short * w.element_sum() * p.derivative_error).sum();
        let value: f64 = terms().map(|(w, p)| w.dot(p.value)).sum();
        // Velocities are about one length of the world: an image that does not change in size by a
        // hundredth when everything moves by that hardly changes.
        let size: f64 = terms().map(|(w, p)| (*w * p.derivative).abs().element_sum()).sum();
        let size = size.max(1e-2 * value).max(1e-9);
        let Moving { scene, change } = scenes::direct(&direct);
        Sized { known: Known { scene, change, weights, exact, error, value, label }, size }
    };
    knobs.collect::<Vec<_>>().par_iter().map(sized).collect()
}

/// `per_pair` cases of every kind, each with every one of some motions.
#[must_use]
pub fn coverage(movings: &[CrossingMoving], per_pair: u64) -> Vec<Sized> {
    let pairs = CrossingKind::ALL.iter().flat_map(|&k| movings.iter().map(move |&m| (k, m)));
    let knobs = pairs.flat_map(|(k, m)| (0..per_pair).map(move |i| CrossingKnobs::random(80_000 + i, k, m)));
    let sized = |knobs: &CrossingKnobs| {
        let case = knobs.build();
        Sized::of_coverage(&case, weights(case.camera.width * case.camera.height))
    };
    knobs.collect::<Vec<_>>().par_iter().map(sized).collect()
}

/// Sums over the film that are 0 exactly: a black bar slides before a wall of one radiance, close to
/// where another wall, at rest as well, comes out of it.
///
/// # Panics
/// If a sum is not 0.
#[must_use]
pub fn zeros(count: u64) -> Vec<Sized> {
    let sized = |seed: u64| {
        let case = bar(seed);
        let mut this = Sized::of_coverage(&case, vec![DVec3::ONE; case.camera.width * case.camera.height]);
        assert!(this.known.exact.abs() < 1e-12 * this.size, "{} of {}", this.known.exact, this.size);
        this.known.exact = 0.0;
        this
    };
    (0..count).into_par_iter().map(sized).collect()
}

/// The scene of [`zeros`], on a film of 8 × 8 pixels whose pixel is a unit of length at the wall.
fn bar(seed: u64) -> CoverageCase {
    const DISTANCE: f64 = 10.0;
    let mut wave = (0..)
        .map(|k| (0.5 + 0.5 * (12.9898 * (seed as f64 + 1.0) + 78.233 * f64::from(k)).sin()).clamp(0.0, 1.0));
    let mut between = |low: f64, high: f64| low + (high - low) * wave.next().unwrap_or_default();
    let camera = Camera {
        origin: DVec3::new(0.0, 0.0, DISTANCE),
        right: DVec3::X,
        up: DVec3::Y,
        forward: -DVec3::Z,
        field_of_view: 2.0 * (4.0 / DISTANCE).atan(),
        width: 8,
        height: 8,
    };
    let turn = DVec2::from_angle(between(0.0, std::f64::consts::TAU));
    // x across the crossing, which is the line x = 0 of the wall.
    let place = |x: f64, y: f64, z: f64| turn.rotate(DVec2::new(x, y)).extend(z);
    let mut mesh =
        Mesh { positions: vec![], triangles: vec![], radiance: vec![], background: DVec3::splat(0.3) };
    let mut quad = |corners: [DVec3; 4], radiance: f64| {
        let start = mesh.positions.len();
        mesh.positions.extend(corners);
        mesh.triangles.extend([[0, 1, 2], [0, 2, 3]].map(|t| t.map(|v| v + start)));
        mesh.radiance.extend([DVec3::splat(radiance); 2]);
    };
    quad([place(-20., -20., 0.), place(20., -21., 0.), place(22., 20., 0.), place(-20., 20., 0.)], 0.4);
    let (slope, skew) = (between(0.3, 1.0), between(-0.2, 0.2));
    let wall = |x: f64, y: f64| place(x, y, slope * (x + skew * y));
    // It comes out of the wall where x + skew y > 0.
    quad([wall(-1.5, -2.7), wall(1.9, -2.9), wall(2.1, 2.3), wall(-1.4, 2.5)], 1.0);
    let (gap, height) = (between(0.15, 0.5), between(0.05, 0.3));
    let (right, left) = (-gap, -gap - between(0.8, 1.2));
    let (low, high) = (between(-1.2, -0.6), between(0.6, 1.2));
    let bar = |x: f64, y: f64| place(x - skew * y, y, height);
    quad([bar(left, low), bar(right, low), bar(right, high), bar(left, high)], 0.0);
    let velocity = turn.rotate(DVec2::new(1.0, between(-0.5, 0.5))).extend(0.0);
    let mut motion = Motion { positions: vec![DVec3::ZERO; 12], camera: CameraMotion::default() };
    motion.positions[8..].fill(velocity);
    // Whose sum over all pixels is the same everywhere.
    let filter = if seed.is_multiple_of(2) { Filter::Box } else { Filter::Tent };
    CoverageCase { mesh, camera, motion, filter, label: format!("bar {seed}") }
}

/// Both halves of the estimates of many scenes.
#[derive(Clone, Debug)]
pub struct Tried<'k> {
    scenes: &'k [Sized],
    halves: Vec<[Estimate; 2]>,
}

/// How estimates compare with exact numbers.
#[derive(Clone, Copy, Debug)]
pub struct Agreement<'k> {
    /// The largest |z| of a scene.
    pub worst: f64,
    /// Which scene that is.
    pub worst_label: &'k str,
    /// The largest standard error, as a share of [`Sized::size`].
    pub largest_error: f64,
    /// The slope of the regression of estimates on exact numbers through 0: 1 without bias.
    pub slope: f64,
    /// Its standard error.
    pub slope_error: f64,
}

impl<'k> Tried<'k> {
    /// Runs a method on all scenes.
    #[must_use]
    pub fn of(scenes: &'k [Sized], sampler: &Sampler) -> Self {
        let halves = |s: &Sized| [0, 1].map(|half| sampler.estimate(&s.known, half));
        Self { scenes, halves: scenes.par_iter().map(halves).collect() }
    }

    /// Compares `factor` times the estimates.
    ///
    /// In the slope each half is weighted by the variance of the other, but at least as if it were
    /// off by 30 % of [`Sized::size`]. Weights from its own variance would follow its error where
    /// that has heavy tails.
    #[must_use]
    pub fn agreement(&self, factor: f64) -> Agreement<'k> {
        let mut this =
            Agreement { worst: 0.0, worst_label: "", largest_error: 0.0, slope: 0.0, slope_error: 0.0 };
        let (mut xx, mut variance) = (0.0, 0.0);
        for (Sized { known, size }, halves) in self.scenes.iter().zip(&self.halves) {
            let scaled = |e: Estimate| [e.mean, e.standard_error].map(|x| factor * x);
            let ([a, da], [b, db]) = (scaled(halves[0]), scaled(halves[1]));
            // An estimate without any spread must be exact, but for rounding.
            let error = (0.5 * da.hypot(db)).max(1e-12 * size);
            let z = ((0.5 * (a + b) - known.exact) / error).abs();
            if z.is_nan() || z > this.worst {
                (this.worst, this.worst_label) = (if z.is_nan() { f64::INFINITY } else { z }, &known.label);
            }
            this.largest_error = this.largest_error.max(error / size);
            for (own, own_error, other_error) in [(a, da, db), (b, db, da)] {
                let weight = 1.0 / (other_error.powi(2) + (0.3 * size).powi(2));
                this.slope += weight * known.exact * own;
                xx += weight * known.exact.powi(2);
                variance += (weight * known.exact * own_error).powi(2);
            }
        }
        (this.slope, this.slope_error) = (this.slope / xx, variance.sqrt() / xx);
        this
    }
}

impl Agreement<'_> {
    /// Whether nothing speaks against the method being unbiased: no scene alone, and not the slope.
    #[must_use]
    pub fn passes(&self) -> bool {
        self.worst <= limit() && (self.slope - 1.0).abs() <= suite_threshold() * self.slope_error
    }

    /// The share of all references by which estimates may be off unnoticed.
    #[must_use]
    pub fn unnoticed(&self) -> f64 {
        suite_threshold() * self.slope_error
    }
}
