//! Scene descriptions, before validation.

use flatland::sdf::Tracer;
use glam::DVec3;

use super::adjacency::Coordinates;
use super::{
    Boundary, Camera, Environment, Film, Implicit, ImplicitShape, ImplicitSurface, Light, Material, Medium,
    Placement, Texture, parts,
};
use crate::geometry::Mesh;

/// A mesh with a material and an optional radiance.
#[derive(Clone, Debug, PartialEq)]
pub struct Shape {
    /// Name in messages and queries.
    pub id: String,
    /// The surface, in world coordinates.
    pub mesh: Mesh,
    /// Index of its material in the scene.
    pub material: usize,
    /// Radiance emitted by the front, linear RGB, if any.
    pub radiance: Option<DVec3>,
    /// Index of a texture that multiplies the radiance; `None` for 1 everywhere.
    pub radiance_texture: Option<usize>,
    /// The media on its two sides; `None` for a surface surrounded by one medium.
    pub boundary: Option<Boundary>,
}

impl Shape {
    /// Whether it uses a texture, of its material or its emission.
    pub(super) fn is_textured(&self, materials: &[Material]) -> bool {
        let looks_up = |index: usize| materials.get(index).is_some_and(|m| m.textures().next().is_some());
        self.radiance_texture.is_some() || parts(materials, self.material).into_iter().any(looks_up)
    }
}

/// Default tracer of implicit surfaces: full steps, tolerance 10⁻⁷ radians, at most 2,000 steps. As V has a
/// small discontinuity where a ray gains a point, the default warp field is biased in the light received by a
/// surface: for a box with rounded edges by 1.0 ± 0.3 % with 10⁻⁶, 0.6 ± 0.2 % with 10⁻⁷ and 0.2 ± 0.3 % with
/// 10⁻⁸. On films, and for other shapes, no bias of 0.5 % was observed (figure `levels`); see
/// [`fields`](flatland::sdf::fields). Hits do not depend on the tolerance, which is relative to t or to the
/// surface's size, whichever is less: root finding starts from there.
pub const SPHERE_TRACING: Tracer = Tracer { step_scale: 1.0, tolerance: 1e-7, max_steps: 2000, far: 1e3 };

/// Length of light paths.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Integrator {
    /// Number of segments of the longest path: 1 is directly visible emission, 2 direct light. `None` for no
    /// limit.
    pub max_depth: Option<usize>,
    /// Segment from which Russian roulette is applied.
    pub rr_depth: usize,
}

impl Default for Integrator {
    fn default() -> Self {
        Self { max_depth: None, rr_depth: 5 }
    }
}

/// Shapes copied together in a scene file: those of one instance, or of all instances of a group.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Instances {
    /// Name in messages and queries.
    pub id: String,
    /// Indices of the shapes in the scene.
    pub shapes: Vec<usize>,
    /// Indices of the implicit surfaces, among implicit surfaces.
    pub implicits: Vec<usize>,
}

/// An additional name of a material, from a nested part that a scene file named, such as the BSDF within
/// "twosided".
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Alias {
    /// The name.
    pub id: String,
    /// Index of the material in the scene.
    pub material: usize,
}

/// Everything that defines a scene. [`Scene::new`](super::Scene::new) validates it and builds the data for
/// rendering.
#[derive(Clone, Debug, PartialEq)]
pub struct Description {
    /// The camera.
    pub camera: Camera,
    /// The film.
    pub film: Film,
    /// Length of light paths.
    pub integrator: Integrator,
    /// Whether emitters are invisible to the camera: its rays pass emitting shapes, and are black if they
    /// leave the scene. Illumination is unchanged.
    pub hide_emitters: bool,
    /// Default number of samples per pixel.
    pub samples: usize,
    /// Images that materials and the environment refer to by index.
    pub textures: Vec<Texture>,
    /// Materials that shapes refer to by index.
    pub materials: Vec<Material>,
    /// Media that shapes and camera refer to by index.
    pub media: Vec<Medium>,
    /// Index of the medium around the camera; `None` for empty space.
    pub camera_medium: Option<usize>,
    /// All meshes.
    pub shapes: Vec<Shape>,
    /// All implicit surfaces.
    pub implicits: Vec<ImplicitShape>,
    /// Tracer of implicit surfaces, by default [`SPHERE_TRACING`]. Its far limit applies to unbounded
    /// surfaces.
    pub tracer: Tracer,
    /// All lights without a surface.
    pub lights: Vec<Light>,
    /// Radiance of rays that leave the scene; black if `None`.
    pub environment: Option<Environment>,
    /// Shapes copied together in a file, by the names of instances and groups.
    pub instances: Vec<Instances>,
    /// Additional names of materials.
    pub aliases: Vec<Alias>,
}

impl Description {
    /// An empty scene.
    #[must_use]
    pub fn new(camera: Camera, film: Film) -> Self {
        Self {
            camera,
            film,
            integrator: Integrator::default(),
            hide_emitters: false,
            samples: 16,
            textures: vec![],
            materials: vec![],
            media: vec![],
            camera_medium: None,
            shapes: vec![],
            implicits: vec![],
            tracer: SPHERE_TRACING,
            lights: vec![],
            environment: None,
            instances: vec![],
            aliases: vec![],
        }
    }

    /// Indices of a material, of the materials it is mixed with, and of the material of its back.
    #[must_use]
    pub fn parts_of_material(&self, index: usize) -> Vec<usize> {
        parts(&self.materials, index)
    }

    /// Use of texture coordinates by each shape.
    pub(super) fn coordinates(&self) -> Vec<Coordinates> {
        let of = |shape: &Shape| {
            let emits =
                if shape.radiance_texture.is_some() { Coordinates::Places } else { Coordinates::Nothing };
            let parts = parts(&self.materials, shape.material).into_iter();
            parts.map(|part| Coordinates::of(&self.materials[part])).fold(emits, Coordinates::max)
        };
        self.shapes.iter().map(of).collect()
    }

    /// Adds a material and returns its index.
    pub fn add_material(&mut self, material: Material) -> usize {
        self.materials.push(material);
        self.materials.len() - 1
    }

    /// Adds a texture and returns its index.
    pub fn add_texture(&mut self, texture: Texture) -> usize {
        self.textures.push(texture);
        self.textures.len() - 1
    }

    /// Adds a shape that does not emit, and returns its index.
    pub fn add_shape(&mut self, id: &str, mesh: Mesh, material: usize) -> usize {
        let (id, radiance, radiance_texture, boundary) = (id.to_owned(), None, None, None);
        self.shapes.push(Shape { id, mesh, material, radiance, radiance_texture, boundary });
        self.shapes.len() - 1
    }

    /// Adds an implicit surface with identity placement, and returns its index among implicit surfaces.
    pub fn add_implicit(&mut self, id: &str, surface: impl Implicit, material: usize) -> usize {
        let (id, surface) = (id.to_owned(), ImplicitSurface::new(surface));
        self.implicits.push(ImplicitShape { id, surface, placement: Placement::default(), material });
        self.implicits.len() - 1
    }

    /// Adds a black shape whose front emits, and returns its index.
    pub fn add_emitter(&mut self, id: &str, mesh: Mesh, radiance: DVec3) -> usize {
        let material = self.add_material(Material::diffuse(id, DVec3::ZERO));
        let (id, radiance) = (id.to_owned(), Some(radiance));
        self.shapes.push(Shape { id, mesh, material, radiance, radiance_texture: None, boundary: None });
        self.shapes.len() - 1
    }
}
