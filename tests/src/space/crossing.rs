//! Scenes whose triangles pass through one another, with exact derivatives.

use flatland::plane::Filter;
use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::campaign::Known;
use super::coverage::{Camera, CameraMotion, Mesh, Motion, ProjectedScene};
use super::worlds::{
    CoverageCase, CrossingKind, CrossingKnobs, CrossingMoving, DirectCase, LitCrossing, LitCrossingKind,
    LitCrossingMoving,
};

/// Light on a ground past bodies of some kinds that cross, by quadrature; `count` of each with every motion.
pub fn lit(kinds: &[LitCrossingKind], movings: &[LitCrossingMoving], count: u64) -> Vec<Known> {
    let pairs = kinds.iter().flat_map(|&kind| movings.iter().map(move |&moving| (kind, moving)));
    let knobs = pairs
        .flat_map(|(kind, moving)| (0..count).map(move |i| LitCrossing { seed: 81_000 + i, kind, moving }));
    let known = |knobs: &LitCrossing| {
        let DirectCase { scene: direct, label } = knobs.build();
        let is_seen = LitCrossingKind::SEEN.contains(&knobs.kind);
        let pixels = if is_seen { direct.image_past_bodies(1e-3) } else { direct.image(1e-3) };
        let pixels = pixels.unwrap_or_else(|e| panic!("{e}\n{label}"));
        // Where bodies touch the ground, the stated error is too small by up to a factor of three.
        let short = if is_seen { 3.0 } else { 1.0 };
        Known::of_pixels(&direct, &pixels, short, &label)
    };
    knobs.collect::<Vec<_>>().par_iter().map(known).collect()
}

/// `per_pair` cases of every kind, each with every one of some motions.
pub fn coverage(movings: &[CrossingMoving], per_pair: u64) -> Vec<Known> {
    let pairs = CrossingKind::ALL.iter().flat_map(|&k| movings.iter().map(move |&m| (k, m)));
    let knobs = pairs.flat_map(|(k, m)| (0..per_pair).map(move |i| CrossingKnobs::random(80_000 + i, k, m)));
    knobs.collect::<Vec<_>>().par_iter().map(|knobs| Known::of_coverage(&knobs.build(), None)).collect()
}

/// Sums over the film that are exactly 0: a black bar slides in front of a wall of one radiance, close to the
/// crossing of that wall with another static one.
pub fn zeros(count: u64) -> Vec<Known> {
    let zero = |seed: u64| {
        let case = bar(seed);
        let mut this = Known::of_coverage(&case, None);
        this.weights.fill(DVec3::ONE);
        let projected = ProjectedScene::new(&case.mesh, &case.camera, &case.motion, case.filter);
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
    // x is measured across the crossing, which is the line x = 0 of the wall.
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
    // Filters whose sum over all pixels is the same everywhere.
    let filter = if seed.is_multiple_of(2) { Filter::Box } else { Filter::Tent };
    CoverageCase { mesh, camera, motion, filter, label: format!("bar {seed}") }
}
