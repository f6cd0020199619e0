//! What a scene is made of, before anything is checked or built.

use flatland::sdf::Tracer;
use glam::DVec3;

use super::adjacency::Coordinates;
use super::{
    Boundary, Camera, Environment, Film, Implicit, ImplicitShape, ImplicitSurface, Light, Material, Medium,
    Placement, Texture, parts,
};
use crate::geometry::Mesh;

/// A mesh with a material, and perhaps a radiance.
#[derive(Clone, Debug, PartialEq)]
pub struct Shape {
    /// Its name in messages and requests.
    pub id: String,
    /// Its surface, in the world.
    pub mesh: Mesh,
    /// Its material's index in the scene.
    pub material: usize,
    /// What its front emits, linear RGB, if anything.
    pub radiance: Option<DVec3>,
    /// A texture by which the radiance is multiplied, by its index in the scene; nothing is 1 everywhere.
    pub radiance_texture: Option<usize>,
    /// The media on its two sides. Nothing is a surface in the midst of one, whichever that is.
    pub boundary: Option<Boundary>,
}

impl Shape {
    /// Whether it looks up a texture, be it of its material or of what it emits.
    pub(super) fn is_textured(&self, materials: &[Material]) -> bool {
        let looks_up = |index: usize| materials.get(index).is_some_and(|m| m.textures().next().is_some());
        self.radiance_texture.is_some() || parts(materials, self.material).into_iter().any(looks_up)
    }
}

/// How rays are traced at implicit surfaces where nothing else is asked for: full steps, a tolerance of 10⁻⁷ radians, at
/// most 2,000 steps. As V jumps a little where a ray gets one more point, the default warp field of a box with rounded edges is off in the light that
/// a surface receives: by 1.0 ± 0.3 % with 10⁻⁶, by 0.6 ± 0.2 % with 10⁻⁷ and by 0.2 ± 0.3 % with 10⁻⁸. On films, and of other shapes, no bias of 0.5 %
/// was seen (figure 18); see [`fields`](flatland::sdf::fields). What is hit does not depend on the tolerance, which is of t or of the
/// surface's size if that is less: roots are looked for from there on.
pub const SPHERE_TRACING: Tracer = Tracer { step_scale: 1.0, tolerance: 1e-7, max_steps: 2000, far: 1e3 };

/// How far light is followed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Integrator {
    /// The number of segments of the longest path: 1 is what emits and is seen directly, 2 is direct light.
    /// `None` is no limit.
    pub max_depth: Option<usize>,
    /// The segment from which on Russian roulette may end a path.
    pub rr_depth: usize,
}

impl Default for Integrator {
    fn default() -> Self {
        Self { max_depth: None, rr_depth: 5 }
    }
}

/// Shapes that a scene file copied as one: those of an instance, or of all instances of a group.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Instances {
    /// Its name in messages and requests.
    pub id: String,
    /// The shapes, by their index in the scene.
    pub shapes: Vec<usize>,
    /// The implicit surfaces, by theirs.
    pub implicits: Vec<usize>,
}

/// A further name of a material: of a part of it that a scene file named, such as what is within "twosided".
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Alias {
    /// The name.
    pub id: String,
    /// The material, by its index in the scene.
    pub material: usize,
}

/// Everything a scene is made of. [`Scene::new`](super::Scene::new) checks it and builds what rendering needs.
#[derive(Clone, Debug, PartialEq)]
pub struct Description {
    /// Who looks.
    pub camera: Camera,
    /// Where the image arises.
    pub film: Film,
    /// How far light is followed.
    pub integrator: Integrator,
    /// Whether the camera sees nothing that emits: its rays pass shapes that do, and find black where they leave the scene. All
    /// else is lit as ever.
    pub hide_emitters: bool,
    /// Samples per pixel, where the one who renders does not say.
    pub samples: usize,
    /// Images that materials and the environment refer to by index.
    pub textures: Vec<Texture>,
    /// Materials that shapes refer to by index.
    pub materials: Vec<Material>,
    /// Media that shapes and the camera refer to by index.
    pub media: Vec<Medium>,
    /// The medium in which the camera stands, by its index; nothing is empty space.
    pub camera_medium: Option<usize>,
    /// All meshes.
    pub shapes: Vec<Shape>,
    /// All implicit surfaces.
    pub implicits: Vec<ImplicitShape>,
    /// How rays are traced at implicit surfaces, [`SPHERE_TRACING`] unless told. Its far limit is for those of which no
    /// bounds are known.
    pub tracer: Tracer,
    /// All lights without a surface.
    pub lights: Vec<Light>,
    /// What is seen where a ray leaves the scene; black if nothing is given.
    pub environment: Option<Environment>,
    /// Shapes that a file copied as one, by the names of instances and groups.
    pub instances: Vec<Instances>,
    /// Further names of materials.
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

    /// A material and those it is mixed with or has on its back, by their indices.
    #[must_use]
    pub fn parts_of_material(&self, index: usize) -> Vec<usize> {
        parts(&self.materials, index)
    }

    /// What each shape needs texture coordinates for.
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

    /// Adds a shape that does not emit and returns its index.
    pub fn add_shape(&mut self, id: &str, mesh: Mesh, material: usize) -> usize {
        let (id, radiance, radiance_texture, boundary) = (id.to_owned(), None, None, None);
        self.shapes.push(Shape { id, mesh, material, radiance, radiance_texture, boundary });
        self.shapes.len() - 1
    }

    /// Adds an implicit surface where it stands already, and returns its index among implicit surfaces.
    pub fn add_implicit(&mut self, id: &str, surface: impl Implicit, material: usize) -> usize {
        let (id, surface) = (id.to_owned(), ImplicitSurface::new(surface));
        self.implicits.push(ImplicitShape { id, surface, placement: Placement::default(), material });
        self.implicits.len() - 1
    }

    /// Adds a shape whose front emits and that reflects nothing, and returns its index.
    pub fn add_emitter(&mut self, id: &str, mesh: Mesh, radiance: DVec3) -> usize {
        let material = self.add_material(Material::diffuse(id, DVec3::ZERO));
        let (id, radiance) = (id.to_owned(), Some(radiance));
        self.shapes.push(Shape { id, mesh, material, radiance, radiance_texture: None, boundary: None });
        self.shapes.len() - 1
    }
}
