//! All parameters of a scene in one table of vectors.

use glam::DVec3;

use crate::gradient::{CameraTangent, Tangent};
use crate::scene::Scene;

/// First row of each kind of parameter in a table with one vector per row, in the order of the fields of a
/// [`Tangent`]. A scalar is the first component of its row.
#[derive(Clone, Debug)]
pub(crate) struct Rows {
    normals: u32,
    reflectance: u32,
    roughness: u32,
    /// First row of each texture.
    texels: Vec<u32>,
    radiance: u32,
    intensity: u32,
    pose: u32,
    light_rotation: u32,
    environment: u32,
    count: u32,
}

impl Rows {
    pub(crate) fn new(scene: &Scene) -> Self {
        let d = scene.description();
        let mut count = scene.positions.len() as u32;
        let mut run = |rows: usize| {
            let first = count;
            count += rows as u32;
            first
        };
        Self {
            normals: run(scene.normals.len()),
            reflectance: run(d.materials.len()),
            roughness: run(d.materials.len()),
            texels: d.textures.iter().map(|t| run(t.texels.len())).collect(),
            radiance: run(d.shapes.len()),
            intensity: run(d.lights.len()),
            pose: run(d.lights.len()),
            light_rotation: run(d.lights.len()),
            // Radiance and rotation of the environment; translation, rotation and field of view of the
            // camera.
            environment: run(5),
            count,
        }
    }

    pub(crate) fn count(&self) -> usize {
        self.count as usize
    }

    /// Number of positions, which are the first rows.
    pub(crate) fn positions(&self) -> u32 {
        self.normals
    }

    pub(crate) fn normal(&self, index: u32) -> u32 {
        self.normals + index
    }

    pub(crate) fn reflectance(&self, material: usize) -> u32 {
        self.reflectance + material as u32
    }

    pub(crate) fn roughness(&self, material: usize) -> u32 {
        self.roughness + material as u32
    }

    pub(crate) fn texel(&self, texture: usize, index: usize) -> u32 {
        self.texels[texture] + index as u32
    }

    pub(crate) fn radiance(&self, shape: usize) -> u32 {
        self.radiance + shape as u32
    }

    pub(crate) fn intensity(&self, light: usize) -> u32 {
        self.intensity + light as u32
    }

    pub(crate) fn pose(&self, light: usize) -> u32 {
        self.pose + light as u32
    }

    pub(crate) fn light_rotation(&self, light: usize) -> u32 {
        self.light_rotation + light as u32
    }

    pub(crate) fn environment(&self) -> u32 {
        self.environment
    }

    pub(crate) fn environment_turn(&self) -> u32 {
        self.environment + 1
    }

    /// Rows of translation, rotation and field of view.
    pub(crate) fn camera(&self) -> [u32; 3] {
        [2, 3, 4].map(|k| self.environment + k)
    }

    /// The tangent (or gradient) in a table.
    pub(crate) fn tangent(&self, table: &[DVec3]) -> Tangent {
        let rows = |first: u32, end: u32| table[first as usize..end as usize].to_vec();
        let ends = self.texels.iter().skip(1).chain([&self.radiance]);
        let [translation, rotation, zoom] = self.camera().map(|row| table[row as usize]);
        Tangent {
            positions: rows(0, self.normals),
            normals: rows(self.normals, self.reflectance),
            implicits: vec![],
            reflectance: rows(self.reflectance, self.roughness),
            roughness: rows(self.roughness, self.first_texel()).iter().map(|r| r.x).collect(),
            texels: self.texels.iter().zip(ends).map(|(&first, &end)| rows(first, end)).collect(),
            radiance: rows(self.radiance, self.intensity),
            intensity: rows(self.intensity, self.pose),
            pose: rows(self.pose, self.light_rotation),
            light_rotation: rows(self.light_rotation, self.environment),
            environment: table[self.environment() as usize],
            environment_rotation: table[self.environment_turn() as usize],
            camera: CameraTangent { translation, rotation, field_of_view: zoom.x },
        }
    }

    fn first_texel(&self) -> u32 {
        self.texels.first().copied().unwrap_or(self.radiance)
    }
}
