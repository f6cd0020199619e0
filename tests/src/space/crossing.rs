//! Scenes whose triangles pass through one another, with exact derivatives, and what methods make of
//! them.

use flatland::plane::Filter;
use glam::{DVec2, DVec3};
use rayon::prelude::*;
use volume3d::gradient::{ActiveParameters, EdgeSampling, Gradient, Progress, Tangent, WarpedArea};

use super::campaign::Known;
use super::coverage::{Camera, CameraMotion, Mesh, Motion, ProjectedScene};
use super::scenes;
use super::worlds::{
    CoverageCase, CrossingKind, CrossingKnobs, CrossingMoving, DirectCase, LitCrossing, LitCrossingKind,
    LitCrossingMoving,
};
use crate::campaign::Estimate;

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
        let (active, progress) = (moving(known), Progress::none());
        let found = match self {
            Self::Warped(method) => {
                let method = WarpedArea { seed: SEED, ..method.clone() };
                method.reverse(&known.scene, &known.weights, &active, &progress)
            }
            Self::Edges(method) => {
                let method = EdgeSampling { seed: SEED, ..method.clone() };
                method.reverse(&known.scene, &known.weights, &active, &progress)
            }
        };
        let Gradient { by_parameter: change, .. } = found.unwrap_or_else(|e| panic!("{e}\n{}", known.label));
        let error = (change.dot(&known.change) - known.weighted(&image)).abs();
        error / scale.max(magnitude(&change, &known.change))
    }
}

/// What moves: edge sampling draws from the edges of that alone.
fn moving(known: &Known) -> ActiveParameters {
    let Known { scene, change, .. } = known;
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

/// Σ |gradient · rate| over positions and camera.
fn magnitude(gradient: &Tangent, change: &Tangent) -> f64 {
    let positions = gradient.positions.iter().zip(&change.positions);
    let (g, r) = (&gradient.camera, &change.camera);
    let camera = [(g.translation, r.translation), (g.rotation, r.rotation)];
    positions.map(|(g, r)| (*g * *r).abs().element_sum()).sum::<f64>()
        + camera.iter().map(|(g, r)| (*g * *r).abs().element_sum()).sum::<f64>()
        + (g.field_of_view * r.field_of_view).abs()
}

/// A mesh whose triangles may pass through one another, by its exact coverage.
///
/// # Panics
/// If the case has no derivative.
#[must_use]
pub fn of_coverage(case: &CoverageCase) -> Known {
    let CoverageCase { mesh, camera, motion, filter, label } = case;
    let projected = ProjectedScene::cut(mesh, camera, motion, *filter);
    let both = projected.and_then(|p| Ok((p.derivative()?, p.image()?)));
    let (derivative, image) = both.unwrap_or_else(|e| panic!("{e}\n{label}"));
    Known::new(scenes::coverage(case, None), derivative.pixels(), &[], image.pixels(), label.clone())
}

/// Light on a ground past bodies that cross, of some kinds, by quadrature; `count` of each with every motion.
///
/// # Panics
/// If some pixel cannot be had.
#[must_use]
pub fn lit(kinds: &[LitCrossingKind], movings: &[LitCrossingMoving], count: u64) -> Vec<Known> {
    let pairs = kinds.iter().flat_map(|&kind| movings.iter().map(move |&moving| (kind, moving)));
    let knobs = pairs
        .flat_map(|(kind, moving)| (0..count).map(move |i| LitCrossing { seed: 81_000 + i, kind, moving }));
    let known = |knobs: &LitCrossing| {
        let DirectCase { scene: direct, label } = knobs.build();
        let is_seen = LitCrossingKind::SEEN.contains(&knobs.kind);
        let pixels = if is_seen { direct.image_past_bodies(1e-3) } else { direct.image(1e-3) };
        let pixels = pixels.unwrap_or_else(|e| panic!("{e}\n{label}"));
        // Where bodies touch the ground the stated error is short by up to a factor of three.
        let short = if is_seen { 3.0 } else { 1.0 };
        let derivative: Vec<DVec3> = pixels.iter().map(|p| p.derivative).collect();
        let error: Vec<f64> = pixels.iter().map(|p| short * p.derivative_error).collect();
        let image: Vec<DVec3> = pixels.iter().map(|p| p.value).collect();
        Known::new(scenes::direct(&direct), &derivative, &error, &image, label)
    };
    knobs.collect::<Vec<_>>().par_iter().map(known).collect()
}

/// `per_pair` cases of every kind, each with every one of some motions.
#[must_use]
pub fn coverage(movings: &[CrossingMoving], per_pair: u64) -> Vec<Known> {
    let pairs = CrossingKind::ALL.iter().flat_map(|&k| movings.iter().map(move |&m| (k, m)));
    let knobs = pairs.flat_map(|(k, m)| (0..per_pair).map(move |i| CrossingKnobs::random(80_000 + i, k, m)));
    knobs.collect::<Vec<_>>().par_iter().map(|knobs| of_coverage(&knobs.build())).collect()
}

/// Sums over the film that are 0 exactly: a black bar slides before a wall of one radiance, close to
/// where another wall, at rest as well, comes out of it.
///
/// # Panics
/// If a sum is not 0.
#[must_use]
pub fn zeros(count: u64) -> Vec<Known> {
    let zero = |seed: u64| {
        let case = bar(seed);
        let mut this = of_coverage(&case);
        this.weights.fill(DVec3::ONE);
        let projected = ProjectedScene::cut(&case.mesh, &case.camera, &case.motion, case.filter);
        let exact = projected.and_then(|p| p.derivative()).unwrap_or_else(|e| panic!("{e}"));
        let terms = exact.pixels().iter().map(|d| d.abs().element_sum());
        this.scale = terms.sum();
        this.exact = exact.pixels().iter().map(|d| d.element_sum()).sum();
        assert!(this.exact.abs() < 1e-12 * this.scale, "{} of {}", this.exact, this.scale);
        this.exact = 0.0;
        this
    };
    (0..count).into_par_iter().map(zero).collect()
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
