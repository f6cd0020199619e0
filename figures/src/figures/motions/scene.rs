//! Cylinders and foliage rotating about a vertical axis, under an area light.

use std::f64::consts::{FRAC_PI_2, TAU};

use flatland::random::{Stream, open01, stream};
use glam::{DAffine3, DMat3, DQuat, DVec3};
use volume3d::geometry::Mesh;
use volume3d::gradient::Tangent;
use volume3d::scene::{Camera, Description, Film, Filter, Integrator, Material, Scene};

/// Number of cylinders, with their number of sides, radius and height.
const CYLINDERS: u64 = 20;
const SIDES: u32 = 48;
const RADII: [f64; 2] = [0.03, 0.06];
const HEIGHTS: [f64; 2] = [0.5, 1.2];
/// Height of their lower ends above the floor.
const FEET: [f64; 2] = [0.15, 0.4];
/// The number of leaves, and their length.
const LEAVES: u64 = 200;
const LENGTHS: [f64; 2] = [0.28, 0.46];
/// Maximum distance of their middles from the axis.
const SPREAD: f64 = 1.0;

/// A scene and the rotation that is its parameter.
pub(in crate::figures) struct Setting {
    pub(super) name: &'static str,
    pub(in crate::figures) scene: Scene,
    pub(super) change: Tangent,
    /// Angle in radians by which a point at unit distance from the axis moves one pixel.
    pub(super) pixel: f64,
}

impl Setting {
    /// Thin prisms that hang upright above the floor.
    pub(super) fn cylinders(side: usize, seed: u64) -> anyhow::Result<Self> {
        let mut soup = Soup::default();
        for index in 0..CYLINDERS {
            let mut dice = Dice(stream(seed, &[12, 0, index]));
            // A sunflower's spiral (Vogel 1979) spreads them evenly, so that none touches another.
            let from_axis = SPREAD * ((index as f64 + dice.between(0.3, 0.7)) / CYLINDERS as f64).sqrt();
            let angle = TAU * index as f64 / std::f64::consts::GOLDEN_RATIO;
            let foot = from_axis * DVec3::new(angle.cos(), 0.0, angle.sin())
                + dice.between(FEET[0], FEET[1]) * DVec3::Y;
            soup.prism(foot, dice.between(RADII[0], RADII[1]), dice.between(HEIGHTS[0], HEIGHTS[1]));
        }
        Self::new("rotating cylinders", side, soup)
    }

    /// Bent leaves of two triangles a side, anywhere in a ball.
    pub(in crate::figures) fn foliage(side: usize, seed: u64) -> anyhow::Result<Self> {
        let mut soup = Soup::default();
        for index in 0..LEAVES {
            let mut dice = Dice(stream(seed, &[12, 1, index]));
            let place = 0.85 * SPREAD * dice.between(0.0, 1.0).cbrt() * dice.direction() + 0.95 * DVec3::Y;
            let turn = DQuat::from_rotation_arc(DVec3::Z, dice.direction())
                * DQuat::from_rotation_z(dice.between(0.0, TAU));
            soup.leaf(place, turn, dice.between(LENGTHS[0], LENGTHS[1]));
        }
        Self::new("rotating foliage", side, soup)
    }

    fn new(name: &'static str, side: usize, soup: Soup) -> anyhow::Result<Self> {
        let (eye, target) = (DVec3::new(0.0, 2.8, 5.2), DVec3::new(-0.12, 0.72, 0.0));
        let camera = Camera::look_at(eye, target, DVec3::Y, 0.46);
        let pixel = 2.0 * (0.5 * camera.field_of_view).tan() * eye.distance(target) / side as f64;
        let film = Film {
            width: side,
            height: side,
            crop: None,
            sample_border: true,
            filter: Filter::Tent { radius: 1.0 },
        };
        let mut description = Description::new(camera, film);
        description.integrator = Integrator { max_depth: Some(2), rr_depth: 2 };
        let mut grey =
            |id: &str, albedo| description.add_material(Material::diffuse(id, DVec3::splat(albedo)));
        let (ground, paint) = (grey("ground", 0.5), grey("paint", 0.7));
        let floor = DAffine3::from_scale_rotation_translation(
            DVec3::splat(20.0),
            DQuat::from_rotation_x(-FRAC_PI_2),
            DVec3::ZERO,
        );
        description.add_shape("floor", Mesh::rectangle().transformed(&floor), ground);
        let shape = description.add_shape(name, Mesh::new(soup.positions, soup.triangles)?, paint);
        let down = DMat3::from_rotation_x(FRAC_PI_2) * DMat3::from_diagonal(DVec3::splat(0.6));
        let lamp = DAffine3::from_mat3_translation(down, DVec3::new(1.5, 5.0, 1.5));
        description.add_emitter("lamp", Mesh::rectangle().transformed(&lamp), DVec3::splat(48.0));
        let scene = Scene::new(description)?;
        let mut change = Tangent::still(&scene);
        change.rotate(&scene, shape, DVec3::ZERO, DVec3::Y);
        Ok(Self { name, scene, change, pixel })
    }

    /// Columns of the film, and rows.
    pub(super) fn side(&self) -> usize {
        self.scene.size().0
    }
}

/// Random numbers of one object, which do not depend on the other objects.
struct Dice(Stream);

impl Dice {
    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * open01(&mut self.0)
    }

    /// Uniform on the sphere.
    fn direction(&mut self) -> DVec3 {
        let (z, angle) = (self.between(-1.0, 1.0), self.between(0.0, TAU));
        let across = (1.0 - z * z).sqrt();
        DVec3::new(across * angle.cos(), across * angle.sin(), z)
    }
}

/// Unindexed triangles; [`Mesh::new`] joins their corners.
#[derive(Default)]
struct Soup {
    positions: Vec<DVec3>,
    triangles: Vec<[u32; 3]>,
}

impl Soup {
    fn add(&mut self, corners: [DVec3; 3]) {
        let first = self.positions.len() as u32;
        self.positions.extend(corners);
        self.triangles.push([first, first + 1, first + 2]);
    }

    /// A closed prism, facing outwards.
    fn prism(&mut self, foot: DVec3, radius: f64, height: f64) {
        let up = height * DVec3::Y;
        let rim = |side: u32| {
            let angle = TAU * f64::from(side % SIDES) / f64::from(SIDES);
            foot + radius * DVec3::new(angle.sin(), 0.0, angle.cos())
        };
        for side in 0..SIDES {
            let (p, q) = (rim(side), rim(side + 1));
            self.add([p, q, q + up]);
            self.add([p, q + up, p + up]);
            self.add([p + up, q + up, foot + up]);
            self.add([q, p, foot]);
        }
    }

    /// A leaf bent along its middle: two triangles on each side of it.
    fn leaf(&mut self, place: DVec3, turn: DQuat, length: f64) {
        let at = |x: f64, y: f64, z: f64| place + length * (turn * DVec3::new(x, y, z));
        let (stem, tip, middle) = (at(0.0, -0.5, 0.0), at(0.0, 0.5, 0.0), at(0.0, 0.0, -0.04));
        for side in [-1.0, 1.0] {
            let rim = at(0.26 * side, 0.03, 0.06);
            self.add([stem, rim, middle]);
            self.add([middle, rim, tip]);
        }
    }
}
