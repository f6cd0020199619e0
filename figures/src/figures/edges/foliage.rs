//! Foliage: leaves that hide one another, each rotating about its own stem.

use flatland::plane::{Film, Filter, Motion, Polygon, Scene, Shade, Shape};
use flatland::random::{Stream, open01, stream};
use glam::{DVec2, DVec3};

/// Pixels along each side of the film.
pub(super) const SIDE: usize = 32;
/// A leaf's length in pixels; its stem turns at one pixel a unit of θ at the tip.
const LENGTH: f64 = 11.0;
/// A leaf's outline: (place along it, half its width there), both as parts of its length.
const OUTLINE: [(f64, f64); 4] = [(0.15, 0.10), (0.40, 0.19), (0.65, 0.17), (0.85, 0.09)];

/// A plant of `count` leaves.
pub(super) struct Foliage {
    pub(super) scene: Scene,
    pub(super) motion: Motion,
    pub(super) film: Film,
}

struct Leaf {
    stem: DVec2,
    outline: Vec<DVec2>,
    color: DVec3,
}

impl Foliage {
    /// The frontmost `count` leaves of an endless plant: a smaller plant is the front of a larger one, so
    /// that more leaves mean more depth, and in the end the same picture.
    pub(super) fn new(count: usize, seed: u64) -> anyhow::Result<Self> {
        let film = Film::new(SIDE, SIDE, Filter::Tent)?;
        let leaves: Vec<Leaf> = (0..count).rev().map(|i| leaf(&mut stream(seed, &[i as u64]))).collect();
        let shapes = leaves
            .iter()
            .map(|leaf| Ok(Shape::new(Polygon::simple(leaf.outline.clone())?, Shade::constant(leaf.color))));
        let scene = Scene::new(DVec3::new(0.75, 0.84, 0.93), shapes.collect::<anyhow::Result<_>>()?)?;
        let motion = leaves
            .iter()
            .enumerate()
            .map(|(shape, leaf)| Motion::rotate([shape], leaf.stem))
            .fold(Motion::default(), Motion::and);
        Ok(Self { scene, motion, film })
    }
}

fn leaf(rng: &mut Stream) -> Leaf {
    let mut between = |low: f64, high: f64| low + (high - low) * open01(rng);
    let margin = 0.6 * LENGTH;
    let far = SIDE as f64 + margin;
    let middle = DVec2::new(between(-margin, far), between(-margin, far));
    let length = LENGTH * between(0.75, 1.25);
    let along = DVec2::from_angle(between(0.0, std::f64::consts::TAU));
    let stem = middle - 0.5 * length * along;
    let at = |(place, width): (f64, f64)| stem + length * (place * along + width * along.perp());
    let right = OUTLINE.into_iter().map(|(place, width)| at((place, width)));
    let left = OUTLINE.into_iter().rev().map(|(place, width)| at((place, -width)));
    let outline = std::iter::once(stem).chain(right).chain([at((1.0, 0.0))]).chain(left).collect();
    let light = between(0.25, 1.0);
    let autumn = between(0.0, 1.0).powi(3);
    let green = DVec3::new(0.10, 0.42, 0.07);
    let color = light * green.lerp(DVec3::new(0.80, 0.42, 0.04), autumn);
    Leaf { stem, outline, color }
}
