//! Scenes that contain a shape, and the cameras around it.

use std::f64::consts::{FRAC_PI_2, PI};

use glam::{DAffine3, DVec3};
use volume3d::geometry::Mesh;
use volume3d::scene::{Camera, Description, Environment, Film, Filter, Integrator, Material, Scene};

/// Distance of the cameras from the middle of the shape.
const DISTANCE: f64 = 4.0;
/// Fields of view: of the shape alone, and with its shadow.
const FIELDS_OF_VIEW: [f64; 2] = [0.5, 0.62];
/// Height of the floor; the shape hovers over it.
const FLOOR: f64 = -1.1;

/// Surroundings of the shape.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Light {
    /// Nothing: the shape alone in an even light from everywhere.
    Even,
    /// A floor, with the shape's shadow from a lamp, and a dim even light.
    Lamp,
}

impl Light {
    pub(super) const ALL: [Self; 2] = [Self::Even, Self::Lamp];

    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Even => "alone",
            Self::Lamp => "with shadows",
        }
    }

    /// Cameras that look at the shape, spread evenly: around a shape alone from everywhere, over a floor from
    /// above and a little from below. `turn` rotates them all about the vertical, in radians.
    pub(super) fn cameras(self, count: usize, turn: f64) -> Vec<Camera> {
        let (heights, at, field_of_view) = match self {
            Self::Even => ([-0.95, 0.95], DVec3::ZERO, FIELDS_OF_VIEW[0]),
            Self::Lamp => ([-0.15, 0.9], -0.15 * DVec3::Y, FIELDS_OF_VIEW[1]),
        };
        (0..count)
            .map(|i| {
                let part = (i as f64 + 0.5) / count as f64;
                let y = heights[0] + (heights[1] - heights[0]) * part;
                let angle = PI * (3.0 - 5.0_f64.sqrt()) * i as f64 + turn;
                let ring = (1.0 - y * y).sqrt();
                let eye = DISTANCE * DVec3::new(ring * angle.cos(), y, ring * angle.sin());
                Camera::look_at(eye, at, DVec3::Y, field_of_view)
            })
            .collect()
    }

    /// The scene, seen by some camera on a film of `side` × `side` pixels, with the index of the shape in it.
    pub(super) fn scene(self, shape: Mesh, camera: Camera, side: usize) -> anyhow::Result<(Scene, usize)> {
        let film = Film {
            width: side,
            height: side,
            crop: None,
            sample_border: true,
            filter: Filter::Tent { radius: 1.0 },
        };
        let mut description = Description::new(camera, film);
        // Light from lamp or sky to a surface and into the camera.
        description.integrator = Integrator { max_depth: Some(2), rr_depth: 2 };
        let clay = description.add_material(Material::diffuse("clay", DVec3::new(0.75, 0.55, 0.4)));
        let index = description.add_shape("shape", shape, clay);
        let radiance = if self == Self::Even {
            DVec3::ONE
        } else {
            let white = description.add_material(Material::diffuse("white", DVec3::splat(0.7)));
            let floor = DAffine3::from_translation(FLOOR * DVec3::Y)
                * DAffine3::from_rotation_x(-FRAC_PI_2)
                * DAffine3::from_scale(DVec3::splat(6.0));
            description.add_shape("floor", Mesh::rectangle().transformed(&floor), white);
            let above = DAffine3::from_translation(DVec3::new(1.2, 4.0, 1.0))
                * DAffine3::from_rotation_x(FRAC_PI_2)
                * DAffine3::from_scale(DVec3::splat(0.5));
            description.add_emitter("lamp", Mesh::rectangle().transformed(&above), DVec3::splat(40.0));
            DVec3::splat(0.3)
        };
        description.environment = Some(Environment::Constant { id: "sky".to_owned(), radiance });
        Ok((Scene::new(description)?, index))
    }
}
