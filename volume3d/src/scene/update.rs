//! In-place updates of a scene's parameters.
//!
//! Only data that depend on the changed parameter are updated. Moved vertices refit the hierarchy, or rebuild
//! it if it has become too loose, and update computed normals, edge kinds and crossings; a material
//! reclassifies edges only if it gains or loses a texture; a light or the camera changes no geometry. Images
//! and gradients have the same bits as for a newly built scene. Moving all vertices takes 10 to 20 % of the
//! time of [`Scene::new`].

use std::sync::OnceLock;

use glam::DVec3;

use super::adjacency::{Coordinates, Shading};
use super::check;
use super::error::SceneError;
use super::offset::offset;
use super::{Camera, Description, Environment, Film, ImplicitShape, Light, Material, Scene, Texture, parts};
use crate::geometry::{Mesh, Normals};

impl Scene {
    /// Replaces the meshes of shapes.
    ///
    /// Meshes of unchanged topology, such as those of [`Mesh::with_positions`] and [`Mesh::transformed`],
    /// take time proportional to the number of triangles in the scene, plus a rebuild of the hierarchy if it
    /// has become too loose; others take the time of [`Scene::new`]. Crossings are recomputed on demand.
    ///
    /// # Errors
    /// A [`SceneError`] if a shape does not exist, a position is not finite, a textured shape would have no
    /// texture coordinates, or there are too many vertices. The scene is then unchanged.
    pub fn set_meshes(&mut self, meshes: impl IntoIterator<Item = (usize, Mesh)>) -> Result<(), SceneError> {
        let meshes: Vec<(usize, Mesh)> = meshes.into_iter().collect();
        let shapes = &self.description.shapes;
        for (shape, mesh) in &meshes {
            let old = self.existing("shape", *shape, shapes)?;
            check::mesh(&old.id, mesh)?;
            check::coordinates(&old.id, mesh, old.is_textured(&self.description.materials))?;
        }
        let same = meshes.iter().all(|(shape, mesh)| shapes[*shape].mesh.has_topology_of(mesh));
        if same {
            let moved: Vec<usize> = meshes.iter().map(|(shape, _)| *shape).collect();
            for (shape, mesh) in meshes {
                self.description.shapes[shape].mesh = mesh;
            }
            if offset(&self.description) == self.placed.offset {
                self.move_vertices(&moved);
            } else {
                self.assemble_anew();
            }
            return Ok(());
        }
        let mut old = Vec::with_capacity(meshes.len());
        for (shape, mesh) in meshes {
            old.push((shape, std::mem::replace(&mut self.description.shapes[shape].mesh, mesh)));
        }
        if let Err(error) = check::count(&self.description.shapes) {
            for (shape, mesh) in old.into_iter().rev() {
                self.description.shapes[shape].mesh = mesh;
            }
            return Err(error);
        }
        self.assemble_anew();
        Ok(())
    }

    /// Sets camera, implicit surfaces, lights, environment, materials and radiances to those of a description
    /// of this scene, which are valid. Takes the time of [`Scene::new`].
    pub(crate) fn restore(&mut self, saved: Description, radiances: Vec<Option<DVec3>>) {
        let Description { camera, implicits, lights, environment, materials, .. } = saved;
        let d = &mut self.description;
        d.shapes.iter_mut().zip(radiances).for_each(|(shape, radiance)| shape.radiance = radiance);
        (d.camera, d.implicits, d.lights) = (camera, implicits, lights);
        (d.environment, d.materials) = (environment, materials);
        self.assemble_anew();
    }

    fn assemble_anew(&mut self) {
        let Description { camera, film, .. } = &self.description;
        let nothing = Description::new(camera.clone(), *film);
        *self = Self::assemble(std::mem::replace(&mut self.description, nothing));
    }

    /// Updates the data that depend on positions and given normals of some shapes.
    fn move_vertices(&mut self, shapes: &[usize]) {
        for &shape in shapes {
            let (positions, normals) = (self.position_range(shape), self.normal_range(shape));
            let mesh = &self.description.shapes[shape].mesh;
            let offset = self.placed.offset;
            let moved = mesh.positions().iter().map(|p| *p - offset);
            self.positions[positions].iter_mut().zip(moved).for_each(|(position, p)| *position = p);
            if let Normals::Given(given) = mesh.normals() {
                let values = given.values.iter().map(|n| n.normalize_or_zero());
                self.normals[normals].iter_mut().zip(values).for_each(|(normal, n)| *normal = n);
            }
        }
        self.vertex_normals.compute(&self.positions, &mut self.normals);
        let corners: Vec<[u32; 3]> = self.triangles.iter().map(|t| t.positions).collect();
        self.accelerator.refit(&self.positions, &corners);
        self.measure();
        self.shade_edges();
        self.crossings = OnceLock::new();
    }

    /// Reclassifies creases.
    fn shade_edges(&mut self) {
        let coordinates = self.description.coordinates();
        let shading = Shading { normals: &self.normals, uvs: &self.uvs, coordinates: &coordinates };
        let (positions, triangles, origin) = (&*self.positions, &*self.triangles, -self.placed.offset);
        let tables = super::triangle::Tables { positions, triangles, origin };
        self.adjacency.fit(tables, shading);
        self.derived.clear();
    }

    /// Replaces an implicit surface, its placement or its material.
    ///
    /// # Errors
    /// A [`SceneError`] if it does not exist, its placement is not a rotation with a positive scale, its
    /// material does not exist or has a texture, its name is in use, or the camera would be inside. The scene
    /// is then unchanged.
    pub fn set_implicit(&mut self, index: usize, shape: ImplicitShape) -> Result<(), SceneError> {
        let Description { implicits, shapes, materials, camera, .. } = &self.description;
        let old = self.existing("implicit surface", index, implicits)?;
        check::implicit(&shape, materials)?;
        check::outside(&shape, camera)?;
        let others = implicits.iter().map(|s| &s.id).chain(shapes.iter().map(|s| &s.id));
        check::renamed("shape", &old.id, &shape.id, others)?;
        self.description.implicits[index] = shape;
        if offset(&self.description) == self.placed.offset {
            self.placed.implicits[index] = self.description.implicits[index].moved(-self.placed.offset);
            self.measure();
        } else {
            self.assemble_anew();
        }
        Ok(())
    }

    /// The same scene through another camera and on another film.
    ///
    /// # Errors
    /// [`SceneError`]; see [`set_camera`](Self::set_camera) and [`set_film`](Self::set_film).
    pub fn seen_by(&self, camera: Camera, film: Film) -> Result<Self, SceneError> {
        let mut scene = self.clone();
        scene.set_film(film)?;
        scene.set_camera(camera)?;
        Ok(scene)
    }

    /// Replaces the camera.
    ///
    /// # Errors
    /// A [`SceneError`] if the camera's frame is not orthonormal, its field of view is out of range, or it is
    /// inside an implicit surface.
    pub fn set_camera(&mut self, camera: Camera) -> Result<(), SceneError> {
        check::camera(&camera)?;
        self.description.implicits.iter().try_for_each(|shape| check::outside(shape, &camera))?;
        self.placed.camera = camera.moved(-self.placed.offset);
        self.description.camera = camera;
        self.measure();
        Ok(())
    }

    /// Replaces the film.
    ///
    /// # Errors
    /// A [`SceneError`] if it has no pixels, or its filter is out of range.
    pub fn set_film(&mut self, film: Film) -> Result<(), SceneError> {
        check::film(&film)?;
        self.description.film = film;
        Ok(())
    }

    /// Replaces a material. Edges are reclassified if it gains or loses a texture.
    ///
    /// # Errors
    /// A [`SceneError`] if it does not exist, a parameter is out of range, its texture does not exist, its
    /// name is in use, or a shape with it lacks the necessary texture coordinates. The scene is then
    /// unchanged.
    pub fn set_material(&mut self, index: usize, material: Material) -> Result<(), SceneError> {
        let Description { materials, textures, .. } = &self.description;
        let old = self.existing("material", index, materials)?;
        check::material(&material, textures.len())?;
        check::renamed("material", &old.id, &material.id, materials.iter().map(|m| &m.id))?;
        let reshade =
            Coordinates::of(old) != Coordinates::of(&material) || old.others().ne(material.others());
        let coating = material.bsdf.coating();
        let old = std::mem::replace(&mut self.description.materials[index], material);
        if let Err(error) = self.check_uses(index) {
            self.description.materials[index] = old;
            return Err(error);
        }
        self.coatings[index] = coating;
        if reshade {
            self.shade_edges();
        }
        Ok(())
    }

    /// Checks that a material, or a mixture of it, is admissible for everything that uses it.
    fn check_uses(&self, index: usize) -> Result<(), SceneError> {
        let Description { materials, shapes, implicits, .. } = &self.description;
        for (i, material) in materials.iter().enumerate() {
            if i == index || material.others().any(|other| other == index) {
                check::parts_of(i, material, materials)?;
            }
        }
        for shape in shapes.iter().filter(|shape| parts(materials, shape.material).contains(&index)) {
            check::coordinates(&shape.id, &shape.mesh, shape.is_textured(materials))?;
        }
        for shape in implicits.iter().filter(|shape| parts(materials, shape.material).contains(&index)) {
            check::on_implicit(shape, &materials[shape.material], materials)?;
        }
        Ok(())
    }

    /// Replaces a texture.
    ///
    /// # Errors
    /// A [`SceneError`] if it does not exist, the number of texels does not match its size, a texel is not
    /// finite, or its name is in use.
    pub fn set_texture(&mut self, index: usize, texture: Texture) -> Result<(), SceneError> {
        let textures = &self.description.textures;
        let old = self.existing("texture", index, textures)?;
        check::texture(&texture)?;
        check::renamed("texture", &old.id, &texture.id, textures.iter().map(|t| &t.id))?;
        self.description.textures[index] = texture;
        Ok(())
    }

    /// Sets the radiance of a shape's front, linear RGB, or `None`.
    ///
    /// # Errors
    /// A [`SceneError`] if the shape does not exist, or the radiance is negative or not finite.
    pub fn set_radiance(&mut self, shape: usize, radiance: Option<DVec3>) -> Result<(), SceneError> {
        let old = self.existing("shape", shape, &self.description.shapes)?;
        if let Some(radiance) = radiance {
            check::not_negative(&old.id, "the radiance", radiance)?;
        }
        self.description.shapes[shape].radiance = radiance;
        Ok(())
    }

    /// Replaces a light without a surface.
    ///
    /// # Errors
    /// A [`SceneError`] if it does not exist, a parameter is out of range, or its name is in use.
    pub fn set_light(&mut self, index: usize, light: Light) -> Result<(), SceneError> {
        let lights = &self.description.lights;
        let old = self.existing("light", index, lights)?;
        check::light(&light, self.description.textures.len())?;
        check::renamed("light", old.id(), light.id(), lights.iter().map(Light::id))?;
        self.placed.lights[index] = light.moved(-self.placed.offset);
        self.description.lights[index] = light;
        Ok(())
    }

    /// Replaces the environment.
    ///
    /// # Errors
    /// A [`SceneError`] if a parameter is out of range, or its texture does not exist.
    pub fn set_environment(&mut self, environment: Option<Environment>) -> Result<(), SceneError> {
        if let Some(environment) = &environment {
            check::environment(environment, self.description.textures.len())?;
        }
        self.description.environment = environment;
        Ok(())
    }

    fn existing<'t, T>(&self, what: &'static str, index: usize, table: &'t [T]) -> Result<&'t T, SceneError> {
        let id = || "the update".to_owned();
        table.get(index).ok_or_else(|| SceneError::Missing { id: id(), what, index, count: table.len() })
    }
}

#[cfg(test)]
mod tests;
