//! Scenes: one object above a floor, whose pose is to be found.

use std::f64::consts::{FRAC_PI_2, PI};

use flatland::random::{open01, stream};
use glam::{DAffine3, DQuat, DVec3};
use volume3d::geometry::Mesh;
use volume3d::optimize::Parameters;
use volume3d::scene::{
    Bsdf, Camera, Description, Environment, Film, Filter, Integrator, Material, Microfacets, Reflectance,
    Scene,
};

use crate::figures::mesh::standing_bunny;
use crate::figures::motions::Setting;

/// The longest side of every object's bounding box, except for the one seen only by its shadows.
const EXTENT: f64 = 1.0;
/// The longest side for that one, so that it stays out of the picture.
const SMALL: f64 = 0.6;
/// Height of an object's middle: it cannot touch the floor from any start.
const HEIGHT: f64 = 0.95;
const ALBEDO: f64 = 0.7;
/// Above the glossy floor, so that the object's reflection stands out from that of the sky.
const DARK: f64 = 0.25;
/// The object's albedo in the target that cannot be reached.
const OTHER_ALBEDO: f64 = 0.6;
/// The bar that hides part of the object in that target: its middle and the half of its sides.
const BAR: [DVec3; 2] = [DVec3::new(-0.06, 1.62, 1.65), DVec3::new(0.035, 0.4, 0.035)];
/// Number of cylinders, and number of their sides.
const CYLINDERS: u64 = 16;
const SIDES: u32 = 12;
/// Circles and meridians of the sphere.
const RINGS: u32 = 16;

/// The object to be found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Stage {
    Cylinders,
    Foliage,
    Bunny,
    Sphere,
    /// A bracket outside the picture, and its shadows by two lamps.
    Shadow,
    /// A bracket above a floor of rough metal, which reflects it.
    Glossy,
}

impl Stage {
    pub(super) const ALL: [Self; 6] =
        [Self::Cylinders, Self::Foliage, Self::Bunny, Self::Sphere, Self::Shadow, Self::Glossy];

    /// Scenes with a target that cannot be reached.
    pub(super) const UNREACHABLE: [Self; 2] = [Self::Cylinders, Self::Bunny];

    /// Key in files of results.
    pub(super) fn key(self) -> &'static str {
        ["cylinders", "foliage", "bunny", "sphere", "shadow", "glossy"][self as usize]
    }

    /// Name on pages.
    pub(super) fn name(self) -> &'static str {
        ["cylinders", "foliage", "bunny", "sphere", "shadow only", "glossy floor"][self as usize]
    }

    /// Whether every rotation looks the same, so that only the translation can be found.
    pub(super) fn is_round(self) -> bool {
        self == Self::Sphere
    }

    /// The unit of translation errors: the longest side of the object's bounding box.
    pub(super) fn extent(self) -> f64 {
        if self == Self::Shadow { SMALL } else { EXTENT }
    }

    /// The scene with the object at its true pose.
    pub(super) fn scene(self, side: usize, seed: u64) -> anyhow::Result<Scene> {
        let albedo = if self == Self::Glossy { DARK } else { ALBEDO };
        Ok(Scene::new(self.description(side, seed, albedo)?)?)
    }

    /// The scene with an object of another material, half hidden by a bar: a target that no pose of the
    /// object reproduces.
    pub(super) fn unreachable(self, side: usize, seed: u64) -> anyhow::Result<Scene> {
        let mut description = self.description(side, seed, OTHER_ALBEDO)?;
        let black = description.add_material(Material::diffuse("bar", DVec3::splat(0.1)));
        let place = DAffine3::from_scale_rotation_translation(BAR[1], DQuat::IDENTITY, BAR[0]);
        description.add_shape("bar", Mesh::cube().transformed(&place), black);
        Ok(Scene::new(description)?)
    }

    /// The six numbers of the object's pose.
    pub(super) fn parameters(scene: &Scene) -> anyhow::Result<Parameters> {
        Ok(Parameters::new(scene, &["object.translation", "object.rotation"])?)
    }

    fn description(self, side: usize, seed: u64, albedo: f64) -> anyhow::Result<Description> {
        let film = Film {
            width: side,
            height: side,
            crop: None,
            sample_border: true,
            filter: Filter::Tent { radius: 1.0 },
        };
        let mut description = Description::new(self.camera(), film);
        let depth = if self == Self::Glossy { 3 } else { 2 };
        description.integrator = Integrator { max_depth: Some(depth), rr_depth: depth };
        let ground = description.add_material(self.ground());
        let floor = DAffine3::from_scale_rotation_translation(
            DVec3::splat(20.0),
            DQuat::from_rotation_x(-FRAC_PI_2),
            DVec3::ZERO,
        );
        description.add_shape("floor", Mesh::rectangle().transformed(&floor), ground);
        let paint = description.add_material(Material::diffuse("paint", DVec3::splat(albedo)));
        let place = DVec3::new(0.0, HEIGHT, 0.0);
        description.add_shape("object", fitted(self.mesh(seed)?, self.extent(), place), paint);
        for (i, at) in self.lamps().iter().enumerate() {
            let half = if self == Self::Shadow { 0.1 } else { 0.25 };
            let brightness = [1.0, 1.0, 1.0, 1.0, 0.8, 0.3][self as usize];
            let radiance = brightness * at.length_squared() / (half * half);
            let towards = DQuat::from_rotation_arc(DVec3::Z, (place - *at).normalize());
            let lamp = DAffine3::from_scale_rotation_translation(DVec3::splat(half), towards, *at);
            let name = format!("lamp{i}");
            description.add_emitter(&name, Mesh::rectangle().transformed(&lamp), DVec3::splat(radiance));
        }
        if self == Self::Glossy {
            let radiance = DVec3::splat(0.8);
            description.environment = Some(Environment::Constant { id: "sky".to_owned(), radiance });
        }
        Ok(description)
    }

    fn camera(self) -> Camera {
        let [eye, target] = match self {
            Self::Shadow => [DVec3::new(-2.6, 4.0, 0.0), DVec3::new(-1.25, 0.0, 0.0)],
            Self::Glossy => [DVec3::new(0.0, 1.9, 4.0), DVec3::new(0.0, 0.3, 0.0)],
            _ => [DVec3::new(0.0, 2.7, 4.0), DVec3::new(0.12, 0.66, 0.0)],
        };
        let view = [0.42, 0.42, 0.42, 0.42, 0.52, 0.52][self as usize];
        Camera::look_at(eye, target, DVec3::Y, view)
    }

    fn lamps(self) -> Vec<DVec3> {
        match self {
            Self::Shadow => vec![DVec3::new(2.6, 3.2, 1.3), DVec3::new(2.6, 3.2, -1.3)],
            _ => vec![DVec3::new(-1.4, 4.0, 1.6)],
        }
    }

    fn ground(self) -> Material {
        if self != Self::Glossy {
            return Material::diffuse("ground", DVec3::splat(0.5));
        }
        let bsdf = Bsdf::RoughConductor {
            distribution: Microfacets::Ggx,
            alpha: 0.12,
            stretch: 1.0,
            eta: DVec3::ZERO,
            k: DVec3::ONE,
            specular_reflectance: Reflectance::Constant(DVec3::splat(0.8)),
        };
        Material::new("ground", bsdf, true)
    }

    fn mesh(self, seed: u64) -> anyhow::Result<Mesh> {
        Ok(match self {
            Self::Cylinders => cylinders(seed)?,
            Self::Foliage => Setting::foliage(1, seed)?.scene.description().shapes[1].mesh.clone(),
            Self::Bunny => standing_bunny()?,
            Self::Sphere => sphere()?,
            Self::Shadow | Self::Glossy => bracket()?,
        })
    }
}

/// A mesh moved and scaled so that its bounding box has a middle and a longest side.
fn fitted(mesh: Mesh, extent: f64, middle: DVec3) -> Mesh {
    let [low, high] = mesh
        .positions()
        .iter()
        .fold([DVec3::INFINITY, DVec3::NEG_INFINITY], |[low, high], p| [low.min(*p), high.max(*p)]);
    let scale = extent / (high - low).max_element();
    let there = middle - scale * 0.5 * (low + high);
    mesh.transformed(&DAffine3::from_scale_rotation_translation(DVec3::splat(scale), DQuat::IDENTITY, there))
}

/// Thin upright prisms of different heights, spread in a disc so that none touches another.
fn cylinders(seed: u64) -> anyhow::Result<Mesh> {
    let mut corners = vec![];
    for index in 0..CYLINDERS {
        let mut dice = stream(seed, &[13, 100, index]);
        let mut between = |low: f64, high: f64| low + (high - low) * open01(&mut dice);
        // A sunflower's spiral (Vogel 1979).
        let from_axis = 0.46 * ((index as f64 + between(0.3, 0.7)) / CYLINDERS as f64).sqrt();
        let angle = 2.0 * PI * index as f64 / std::f64::consts::GOLDEN_RATIO;
        let foot = from_axis * DVec3::new(angle.cos(), 0.0, angle.sin()) + between(-0.1, 0.1) * DVec3::Y;
        let (radius, up) = (between(0.025, 0.04), between(0.35, 0.75) * DVec3::Y);
        let rim = |side: u32| {
            let angle = 2.0 * PI * f64::from(side % SIDES) / f64::from(SIDES);
            foot + radius * DVec3::new(angle.sin(), 0.0, angle.cos())
        };
        for side in 0..SIDES {
            let (p, q) = (rim(side), rim(side + 1));
            corners.extend([p, q, q + up, p, q + up, p + up, p + up, q + up, foot + up, q, p, foot]);
        }
    }
    soup(corners)
}

/// A faceted ball.
fn sphere() -> anyhow::Result<Mesh> {
    let at = |ring: u32, meridian: u32| {
        let polar = PI * f64::from(ring) / f64::from(RINGS);
        let around = 2.0 * PI * f64::from(meridian % (2 * RINGS)) / f64::from(2 * RINGS);
        // At the poles all meridians meet in one point, to the last bit.
        let across = if ring == 0 || ring == RINGS { 0.0 } else { polar.sin() };
        DVec3::new(across * around.sin(), polar.cos(), across * around.cos())
    };
    let mut corners = vec![];
    for ring in 0..RINGS {
        for meridian in 0..2 * RINGS {
            let [a, b] = [at(ring, meridian), at(ring, meridian + 1)];
            let [c, d] = [at(ring + 1, meridian), at(ring + 1, meridian + 1)];
            if ring > 0 {
                corners.extend([a, c, b]);
            }
            if ring + 1 < RINGS {
                corners.extend([b, c, d]);
            }
        }
    }
    soup(corners)
}

/// An angle of two arms of unequal length, without rotational symmetry.
fn bracket() -> anyhow::Result<Mesh> {
    let outline = [[0.0, 0.0], [1.0, 0.0], [1.0, 0.3], [0.35, 0.3], [0.35, 0.7], [0.0, 0.7]];
    let at = |i: usize, z: f64| DVec3::new(outline[i % 6][0], outline[i % 6][1], z);
    let mut corners = vec![];
    for i in 0..6 {
        let [p, q, r, s] = [at(i, 0.0), at(i + 1, 0.0), at(i + 1, 0.4), at(i, 0.4)];
        corners.extend([p, q, r, p, r, s]);
    }
    // The inner corner, 3, sees all others.
    for [a, b] in [[4, 5], [5, 0], [0, 1], [1, 2]] {
        corners.extend([at(3, 0.4), at(a, 0.4), at(b, 0.4)]);
        corners.extend([at(3, 0.0), at(b, 0.0), at(a, 0.0)]);
    }
    // Tilted, so that no face is seen edge on.
    let askew = DQuat::from_rotation_x(0.35) * DQuat::from_rotation_y(0.6);
    Ok(soup(corners)?.transformed(&DAffine3::from_quat(askew)))
}

/// A mesh of unindexed triangles, three corners each.
fn soup(corners: Vec<DVec3>) -> anyhow::Result<Mesh> {
    let triangles = (0..corners.len() as u32).collect::<Vec<_>>();
    Ok(Mesh::new(corners, triangles.as_chunks::<3>().0.to_vec())?)
}
