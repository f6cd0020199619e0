//! The flat world of the figure: a light, a moving occluder, a floor and a wall.

use std::f64::consts::TAU;

use flatland::plane::Filter;
use flatland::transport::{Camera, Film, Hit, Material, Origin, Shape, Tangent, World};
use glam::DVec2;

use crate::plot::{Color, Palette};

/// Shapes by their index.
pub(super) const FLOOR: usize = 0;
pub(super) const WALL: usize = 1;
pub(super) const LIGHT: usize = 2;
pub(super) const OCCLUDER: usize = 3;

/// Pixels of the film.
const PIXELS: usize = 48;
/// The occluder: a regular polygon.
const CORNERS: usize = 6;
const RADIUS: f64 = 0.55;
const CENTRE: DVec2 = DVec2::new(4.9, 1.8);
/// The pivot of its rotation.
pub(super) const PIVOT: DVec2 = DVec2::new(4.9, 3.4);

/// A world before its camera, and the requested derivative.
pub(super) struct Setting {
    pub(super) world: World,
    pub(super) camera: Camera,
    pub(super) change: Tangent,
}

impl Setting {
    /// The occluder swings to the right, θ in radians.
    pub(super) fn new() -> anyhow::Result<Self> {
        let corner = |i: usize| CENTRE + RADIUS * DVec2::from_angle((i as f64 + 0.3) * TAU / CORNERS as f64);
        let line =
            |a: [f64; 2], b: [f64; 2], material| Shape::open([DVec2::from(a), DVec2::from(b)], material);
        let shapes = vec![
            line([0.4, 0.0], [9.2, 0.0], Material::diffuse(0.8)),
            line([9.3, 0.1], [9.3, 4.6], Material::diffuse(0.7)),
            line([4.4, 5.8], [5.9, 5.8], Material::emitter(6.0)),
            Shape::closed((0..CORNERS).map(corner), Material::diffuse(0.6)),
        ];
        let world = World::new(0.15, shapes)?;
        let film = Film { pixels: PIXELS, filter: Filter::Tent };
        let camera = Camera { position: DVec2::new(0.7, 3.4), angle: -0.48, field_of_view: 1.0, film };
        let change = Tangent::rotate(&world, [OCCLUDER], PIVOT);
        Ok(Self { world, camera, change })
    }

    /// The middle of the occluder.
    pub(super) fn occluder(&self) -> DVec2 {
        let points = self.world.shapes()[OCCLUDER].points();
        points.iter().sum::<DVec2>() / points.len() as f64
    }

    /// The shape hit, if any.
    pub(super) fn shape(&self, hit: Option<&Hit>) -> Option<usize> {
        hit.map(|h| self.world.segments()[h.segment].shape)
    }

    /// The smallest and the largest angle at which a shape is seen from a point. It must not lie across the
    /// direction −x.
    pub(super) fn silhouette(&self, shape: usize, from: DVec2) -> [f64; 2] {
        let points = self.world.shapes()[shape].points();
        let angles = || points.iter().map(|p| (p - from).to_angle());
        [angles().fold(f64::INFINITY, f64::min), angles().fold(f64::NEG_INFINITY, f64::max)]
    }

    /// The part of the direct light without any occluder that arrives at a point of the floor.
    pub(super) fn lit(&self, x: f64) -> f64 {
        const RAYS: usize = 64;
        let point = DVec2::new(x, 0.0);
        let [low, high] = self.silhouette(LIGHT, point);
        let floor = self.world.segments().iter().position(|s| s.shape == FLOOR);
        let origin = Origin { point, segment: floor };
        let (mut sum, mut all) = (0.0, 0.0);
        for i in 0..RAYS {
            let angle = low + (high - low) * (i as f64 + 0.5) / RAYS as f64;
            let seen = self.world.trace(origin, DVec2::from_angle(angle));
            let cosine = angle.sin();
            all += cosine;
            sum += if self.shape(seen.as_ref()) == Some(LIGHT) { cosine } else { 0.0 };
        }
        sum / all
    }
}

/// Name and colour of a shape, or of the environment.
pub(super) fn looks(shape: Option<usize>) -> (&'static str, Color) {
    match shape {
        Some(FLOOR) => ("floor", Color::hex(0x8a_8f_96)),
        Some(WALL) => ("wall", Color::hex(0xb0_8d_6b)),
        Some(LIGHT) => ("light", Palette::ORANGE),
        Some(OCCLUDER) => ("occluder", Palette::BLUE),
        _ => ("sky", Color::hex(0xd6_ea_f5)),
    }
}
