//! Reconstruction subjects: clay shapes under an even light, and cameras around them.

use std::f64::consts::{PI, SQRT_2};

use glam::{DAffine2, DAffine3, DMat3, DVec3};
use volume3d::Image;
use volume3d::geometry::Mesh;
use volume3d::gradient::{Progress, render};
use volume3d::scene::{
    Camera, Description, Environment, Film, Filter, Integrator, Material, Scene, Texture, Wrap,
};
use volume3d::sdf::analytic::Knot;
use volume3d::sdf::isosurface;

use super::target;
use crate::seeds::seed_of;

/// A shape to be reconstructed from its views, from an initial ball.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Subject {
    Bunny,
    /// A knotted ring, of another topology than the ball.
    Knot,
    /// A chair with legs as thick as two cells of the finest grid.
    Chair,
    /// A chair with legs of one cell.
    ThinChair,
}

impl Subject {
    pub(crate) const ALL: [Self; 4] = [Self::Bunny, Self::Knot, Self::Chair, Self::ThinChair];

    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Bunny => "bunny",
            Self::Knot => "trefoil",
            Self::Chair => "chair",
            Self::ThinChair => "thin chair",
        }
    }

    pub(crate) fn target(self) -> anyhow::Result<Mesh> {
        match self {
            Self::Bunny => target::bunny(),
            Self::Knot => {
                let knot = Knot::new(DVec3::ZERO, (2, 3), (0.6, 0.25), 0.15)?;
                target::placed(isosurface(&knot, (DVec3::splat(-1.1), DVec3::splat(1.1)), 64)?)
            }
            Self::Chair => chair(2.0 * CELL),
            Self::ThinChair => chair(CELL),
        }
    }
}

/// Side of a cell of the finest grid: of 64 along a side of 2.
const CELL: f64 = 1.0 / 32.0;

/// A seat, a back and four legs of width `leg`, of the size of targets: its box of 1 × √2 × 1 has the
/// diagonal 2. Parts overlap slightly.
fn chair(leg: f64) -> anyhow::Result<Mesh> {
    const WITHIN: f64 = 0.01;
    let (half, height) = (0.5, SQRT_2);
    let seat = [-0.1, 0.06];
    let (bottom, top) = (-0.5 * height, 0.5 * height);
    let mut boxes = vec![
        (DVec3::new(-half, seat[0], -half), DVec3::new(half, seat[1], half)),
        (DVec3::new(-half, seat[1] - WITHIN, -half), DVec3::new(half, top, -half + 0.12)),
    ];
    for [x, z] in [[-half, -half], [-half, half - leg], [half - leg, -half], [half - leg, half - leg]] {
        boxes.push((DVec3::new(x, bottom, z), DVec3::new(x + leg, seat[0] + WITHIN, z + leg)));
    }
    let (mut positions, mut triangles) = (vec![], vec![]);
    for (low, high) in boxes {
        let place = DAffine3::from_translation(0.5 * (low + high)) * DAffine3::from_scale(0.5 * (high - low));
        let part = Mesh::cube().transformed(&place);
        let first = positions.len() as u32;
        positions.extend_from_slice(part.positions());
        triangles.extend(part.triangles().iter().map(|t| t.map(|i| first + i)));
    }
    Ok(Mesh::new(positions, triangles)?)
}

/// A square film.
pub(crate) fn film(side: usize) -> Film {
    Film { width: side, height: side, crop: None, sample_border: true, filter: Filter::Tent { radius: 1.0 } }
}

/// Cameras around the origin, spread evenly; `turn` rotates them all about the vertical, in radians.
pub(crate) fn cameras(count: usize, turn: f64) -> Vec<Camera> {
    const DISTANCE: f64 = 5.0;
    const FIELD_OF_VIEW: f64 = 0.45;
    let camera = |i: usize| {
        let y = 0.95 * (2.0 * (i as f64 + 0.5) / count as f64 - 1.0);
        let angle = PI * (3.0 - 5.0_f64.sqrt()) * i as f64 + turn;
        let ring = (1.0 - y * y).sqrt();
        let eye = DISTANCE * DVec3::new(ring * angle.cos(), y, ring * angle.sin());
        Camera::look_at(eye, DVec3::ZERO, DVec3::Y, FIELD_OF_VIEW)
    };
    (0..count).map(camera).collect()
}

/// Illumination of the subjects.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Light {
    /// Uniform light, in which points are darker only where the subject hides the sky from itself.
    Even,
    /// A dimmer sky with a sun, in which subjects cast shadows on themselves.
    Sun,
}

/// The radiance of the sky beside the sun, and of the sun; a surface that faces the sun receives as much as
/// under an even light.
const SKY: f64 = 0.4;
const SUN: f64 = 0.6 / (SUN_SINE * SUN_SINE);
/// The sine of the sun's angular radius, which is about 15 degrees.
const SUN_SINE: f64 = 0.26;
/// Rows of the environment map with the sun.
const ROWS: usize = 64;

impl Light {
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Even => "even light",
            Self::Sun => "sun",
        }
    }

    /// Adds the light to a scene.
    fn shine(self, description: &mut Description) {
        let id = "sky".to_owned();
        description.environment = Some(match self {
            Self::Even => Environment::Constant { id, radiance: DVec3::ONE },
            Self::Sun => {
                let texture = description.add_texture(sunny());
                Environment::Map { id, texture, scale: 1.0, to_world: DMat3::IDENTITY }
            }
        });
    }
}

/// A longitude–latitude map of a sky with a sun in it.
fn sunny() -> Texture {
    let sun = DVec3::new(0.6, 0.7, 0.5).normalize();
    let texel = |i: usize| {
        let (u, v) = ((i % (2 * ROWS)) as f64 + 0.5, (i / (2 * ROWS)) as f64 + 0.5);
        let ((sin, cos), (height, y)) = ((PI * u / ROWS as f64).sin_cos(), (PI * v / ROWS as f64).sin_cos());
        let cosine = DVec3::new(height * sin, y, -height * cos).dot(sun);
        DVec3::splat(if cosine > (1.0 - SUN_SINE * SUN_SINE).sqrt() { SUN } else { SKY })
    };
    Texture {
        id: "sunny".to_owned(),
        width: 2 * ROWS,
        height: ROWS,
        texels: (0..2 * ROWS * ROWS).map(texel).collect(),
        wrap: Wrap::Repeat,
        to_uv: DAffine2::IDENTITY,
    }
}

/// An empty scene with a light.
pub(crate) fn empty(film: Film, light: Light) -> Description {
    let mut description = Description::new(cameras(1, 0.0).remove(0), film);
    description.integrator = Integrator { max_depth: Some(2), rr_depth: 2 };
    light.shine(&mut description);
    description
}

/// A material of one colour.
pub(crate) fn clay(description: &mut Description) -> usize {
    description.add_material(Material::diffuse("clay", DVec3::new(0.75, 0.55, 0.4)))
}

/// A scene's images.
pub(crate) fn look(
    cameras: &[Camera],
    scene: &mut Scene,
    samples: usize,
    seed: u64,
) -> anyhow::Result<Vec<Image>> {
    let mut images = vec![];
    for (i, camera) in (0..).zip(cameras) {
        scene.set_camera(camera.clone())?;
        images.push(render(scene, samples, seed_of(seed, &[i]), &Progress::none())?.image);
    }
    Ok(images)
}
