//! Construction of a scene from its description.

use std::any::Any;
use std::sync::{Arc, OnceLock};

use flatland::sdf::Sdf;
use glam::{DVec2, DVec3};

use super::adjacency::{Adjacency, Shading};
use super::crossing::Crossings;
use super::derived::Derived;
use super::error::SceneError;
use super::normals::VertexNormals;
use super::offset::Placed;
use super::trace_counts::Counters;
use super::triangle::{NONE, Tables, Triangle};
use super::{Camera, Description, ImplicitShape, Light};
use crate::geometry::{Accelerator, Normals};
use crate::optics::Coating;

/// A scene: a validated description, with the data needed for tracing and shading.
///
/// A clone is independent: it copies all tables, and counts lost rays from 0.
#[derive(Clone, Debug)]
pub struct Scene {
    pub(crate) description: Description,
    /// Camera, implicit surfaces and lights in the scene's internal coordinates, which all fields below use.
    pub(super) placed: Placed,
    /// Positions of all shapes, shape by shape.
    pub(crate) positions: Vec<DVec3>,
    pub(crate) triangles: Vec<Triangle>,
    /// Shading normals, given or computed; unit length or zero.
    pub(crate) normals: Vec<DVec3>,
    /// Dependence of computed normals on positions.
    pub(crate) vertex_normals: VertexNormals,
    pub(crate) uvs: Vec<DVec2>,
    /// First position, triangle and normal of each shape, and the end.
    pub(crate) first_position: Vec<u32>,
    pub(crate) first_triangle: Vec<u32>,
    pub(crate) first_normal: Vec<u32>,
    pub(crate) accelerator: Accelerator,
    pub(crate) adjacency: Adjacency,
    /// Transmittance tables of each material's coating, if it has one.
    pub(crate) coatings: Vec<Option<Coating>>,
    /// Bounding box of each implicit surface, if it has one.
    pub(super) implicit_bounds: Vec<Option<(DVec3, DVec3)>>,
    /// Counts of implicit-surface rays that were lost.
    pub(super) trace_counters: Counters,
    /// Largest coordinate of the camera and of all surfaces.
    pub(super) extent: f64,
    /// Computed on demand: an image needs none.
    pub(super) crossings: OnceLock<Crossings>,
    pub(super) derived: Derived,
}

impl Scene {
    /// Validates a description and builds a scene from it.
    ///
    /// # Errors
    /// A [`SceneError`] that names the violation.
    pub fn new(description: Description) -> Result<Self, SceneError> {
        super::check::check(&description)?;
        super::check_media::check(&description)?;
        Ok(Self::assemble(description))
    }

    pub(super) fn assemble(description: Description) -> Self {
        let placed = Placed::new(&description);
        let mut positions = vec![];
        let mut triangles = vec![];
        let mut normals = vec![];
        let mut uvs = vec![];
        let mut vertex_normals = VertexNormals::default();
        let (mut first_position, mut first_triangle, mut first_normal) = (vec![0], vec![0], vec![0]);
        for (s, shape) in description.shapes.iter().enumerate() {
            let mesh = &shape.mesh;
            let [p0, n0, t0] = [positions.len(), normals.len(), uvs.len()].map(|n| n as u32);
            triangles.reserve_exact(mesh.triangles().len());
            positions.extend(mesh.positions().iter().map(|p| *p - placed.offset));
            let normal_triangles = match mesh.normals() {
                Normals::Face => None,
                Normals::AngleWeighted { triangles, count } => {
                    vertex_normals.add(mesh.triangles(), triangles, p0, n0, *count);
                    normals.resize(normals.len() + count, DVec3::ZERO);
                    Some(triangles)
                }
                Normals::Given(given) => {
                    normals.extend(given.values.iter().map(|n| n.normalize_or_zero()));
                    Some(&given.triangles)
                }
            };
            if let Some(given) = mesh.uvs() {
                uvs.extend_from_slice(&given.values);
            }
            for (i, corners) in mesh.triangles().iter().enumerate() {
                triangles.push(Triangle {
                    positions: corners.map(|k| k + p0),
                    normals: normal_triangles.map_or([NONE; 3], |n| n[i].map(|k| k + n0)),
                    uvs: mesh.uvs().map_or([NONE; 3], |uv| uv.triangles[i].map(|k| k + t0)),
                    shape: s as u32,
                });
            }
            first_position.push(positions.len() as u32);
            first_triangle.push(triangles.len() as u32);
            first_normal.push(normals.len() as u32);
        }
        vertex_normals.compute(&positions, &mut normals);
        let corners: Vec<[u32; 3]> = triangles.iter().map(|t| t.positions).collect();
        let accelerator = Accelerator::build(&positions, &corners);
        drop(corners);
        let coordinates = description.coordinates();
        let tables = Tables { positions: &positions, triangles: &triangles, origin: -placed.offset };
        let shading = Shading { normals: &normals, uvs: &uvs, coordinates: &coordinates };
        let adjacency = Adjacency::build(tables, shading);
        let coatings = description.materials.iter().map(|m| m.bsdf.coating()).collect();
        let mut scene = Self {
            description,
            placed,
            coatings,
            positions,
            triangles,
            normals,
            vertex_normals,
            uvs,
            first_position,
            first_triangle,
            first_normal,
            accelerator,
            adjacency,
            implicit_bounds: vec![],
            trace_counters: Counters::default(),
            extent: 0.0,
            crossings: OnceLock::new(),
            derived: Derived::default(),
        };
        scene.measure();
        scene
    }

    /// Updates the extent.
    pub(super) fn measure(&mut self) {
        self.implicit_bounds = self.placed.implicits.iter().map(Sdf::bounds).collect();
        let surfaces = self.bounds().map_or(0.0, |(low, high)| low.abs().max(high.abs()).max_element());
        let camera = self.placed.camera.origin;
        self.extent = camera.abs().max_element().max(surfaces);
        // An unbounded surface is at least as far from the camera as φ implies.
        for shape in self.placed.implicits.iter().filter(|shape| shape.bounds().is_none()) {
            let reach = camera.abs().max_element() + shape.value(camera).abs() / shape.slope_bound();
            self.extent = self.extent.max(reach);
        }
    }

    /// The scene's description.
    #[must_use]
    pub fn description(&self) -> &Description {
        &self.description
    }

    /// Index of the shape with this name.
    #[must_use]
    pub fn shape(&self, id: &str) -> Option<usize> {
        self.description.shapes.iter().position(|s| s.id == id)
    }

    /// Index of the implicit surface with this name, among implicit surfaces.
    #[must_use]
    pub fn implicit(&self, id: &str) -> Option<usize> {
        self.description.implicits.iter().position(|s| s.id == id)
    }

    /// Index of the material with this name.
    #[must_use]
    pub fn material(&self, id: &str) -> Option<usize> {
        self.description.materials.iter().position(|m| m.id == id)
    }

    /// Range of a shape's positions among all positions.
    #[must_use]
    pub fn position_range(&self, shape: usize) -> std::ops::Range<usize> {
        self.first_position[shape] as usize..self.first_position[shape + 1] as usize
    }

    /// The corners of a triangle.
    #[inline]
    pub(crate) fn corners(&self, triangle: u32) -> [DVec3; 3] {
        self.tables().corners(triangle)
    }

    /// Lower and upper corner of the bounding box of all bounded surfaces, if there are any.
    pub(crate) fn bounds(&self) -> Option<(DVec3, DVec3)> {
        let meshes = (!self.triangles.is_empty()).then(|| self.accelerator.bounds());
        let all = meshes.into_iter().chain(self.implicit_bounds.iter().copied().flatten());
        all.reduce(|(low, high), (a, b)| (low.min(a), high.max(b)))
    }

    /// The camera, in internal coordinates.
    #[inline]
    pub(crate) fn camera(&self) -> &Camera {
        &self.placed.camera
    }

    /// All implicit surfaces, in internal coordinates.
    #[inline]
    pub(crate) fn implicits(&self) -> &[ImplicitShape] {
        &self.placed.implicits
    }

    /// All lights without a surface, in internal coordinates.
    #[inline]
    pub(crate) fn lights(&self) -> &[Light] {
        &self.placed.lights
    }

    /// Origin of the internal coordinates.
    #[inline]
    pub(crate) fn offset(&self) -> DVec3 {
        self.placed.offset
    }

    /// A position in the coordinates of the description.
    pub(super) fn given(&self, at: DVec3) -> DVec3 {
        at + self.offset()
    }

    /// Position and index tables of the triangles.
    #[inline]
    pub(crate) fn tables(&self) -> Tables<'_> {
        Tables { positions: &self.positions, triangles: &self.triangles, origin: -self.offset() }
    }

    /// Smallest radius of curvature around a triangle; infinite if the surface is flat.
    pub(crate) fn radius(&self, triangle: u32) -> f64 {
        self.adjacency.radius(self.tables(), triangle)
    }

    /// A cached value, which must depend only on positions, topology, normals and edge kinds of the meshes.
    pub(crate) fn derived<T: Any + Send + Sync>(&self, make: impl FnOnce(&Self) -> T) -> Arc<T> {
        self.derived.get(|| make(self))
    }

    /// The curves along which surfaces cross.
    pub(crate) fn crossings(&self) -> &Crossings {
        self.crossings.get_or_init(|| Crossings::build(self.tables(), &self.adjacency, &self.accelerator))
    }

    pub(crate) fn normal_range(&self, shape: usize) -> std::ops::Range<usize> {
        self.first_normal[shape] as usize..self.first_normal[shape + 1] as usize
    }

    /// Columns and rows of an image.
    #[must_use]
    pub fn size(&self) -> (usize, usize) {
        let film = &self.description.film;
        film.crop.map_or((film.width, film.height), |c| (c.width, c.height))
    }
}
