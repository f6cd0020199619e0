//! Primary visibility: pixels of a mesh of constant radiance and their derivatives, exactly.
//!
//! Seen by a pinhole camera, a triangle is a triangle of the film, and opaque triangles are a scene
//! of [`flatland::plane`] in painter's order. Its vertices move with the projected velocities,
//! which dual numbers give for any motion of mesh and camera. All that follows is the plane's exact
//! arrangement: I = ∫ h f du, and dI/dθ = ∮ h Δf (v·ν) dl.
//!
//! Two things make that complete. The radiance of a triangle is constant, so that there is no
//! interior term. And the plane's boundary velocity, linear along an edge, has the right normal
//! part, though the material points of an edge move on the film at speeds that are *not* linear
//! along it: the image of the edge is, for all θ, the straight segment between the images of its
//! end points, ((1 − s) p(θ) + s q(θ)) for 0 ≤ s ≤ 1. Perspective only relabels the points of that
//! segment, by another s for the same material point, and relabelling changes the velocity along
//! the segment but not across it.

mod camera;
mod cut;
mod order;

use flatland::plane::exact::{Arrangement, ExactError};
use flatland::plane::{
    Film, FilmError, Filter, Image, Polygon, PolygonError, Scene, SceneError, Shade, Shape,
};
use glam::{DVec2, DVec3};

use camera::Projection;
pub use camera::{Camera, CameraError, CameraMotion};
pub use cut::{Crossing, crossings};

use crate::space::vector::Vector;

/// Depths below this, relative to the distance from the camera, are behind the camera: a mesh must
/// be strictly in front of it.
const IN_FRONT: f64 = 1e-3;

/// Opaque triangles of constant radiance over a background of constant radiance.
///
/// A triangle looks the same from both sides.
#[derive(Clone, Debug, PartialEq)]
pub struct Mesh {
    /// The vertices; triangles that share one move together there.
    pub positions: Vec<DVec3>,
    /// Three vertices each.
    pub triangles: Vec<[usize; 3]>,
    /// One radiance per triangle, linear RGB.
    pub radiance: Vec<DVec3>,
    /// What is seen where no triangle is.
    pub background: DVec3,
}

/// What θ does to a mesh and a camera: the derivative of both at θ = 0.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Motion {
    /// One velocity per vertex.
    pub positions: Vec<DVec3>,
    /// The camera's.
    pub camera: CameraMotion,
}

impl Mesh {
    /// The mesh at θ: every vertex p at p + θ ṗ.
    ///
    /// # Panics
    /// If there is not one velocity per vertex.
    #[must_use]
    pub fn displaced(&self, motion: &Motion, theta: f64) -> Self {
        assert_eq!(self.positions.len(), motion.positions.len(), "one velocity per vertex");
        let positions = self.positions.iter().zip(&motion.positions).map(|(p, v)| *p + theta * *v);
        Self { positions: positions.collect(), ..self.clone() }
    }
}

/// A mesh whose image is not a scene of the plane.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CoverageError {
    /// No camera.
    #[error(transparent)]
    Camera(#[from] CameraError),
    /// Not one velocity per vertex or not one radiance per triangle.
    #[error("{found} {what} for {expected}")]
    Count {
        /// Of what.
        what: &'static str,
        /// How many there should be.
        expected: usize,
        /// How many there are.
        found: usize,
    },
    /// A triangle with a vertex that the mesh does not have.
    #[error("triangle {triangle} names vertex {vertex}; the mesh has {count}")]
    NoSuchVertex {
        /// Which triangle.
        triangle: usize,
        /// The vertex named.
        vertex: usize,
        /// How many there are.
        count: usize,
    },
    /// A vertex that is not finite, or whose velocity is not.
    #[error("the position or velocity of vertex {vertex} is not finite")]
    NotFinite {
        /// Which vertex.
        vertex: usize,
    },
    /// A vertex that is not strictly in front of the camera.
    #[error("vertex {vertex} is not in front of the camera: its depth is {depth:e}")]
    Behind {
        /// Which vertex.
        vertex: usize,
        /// Along the direction of view.
        depth: f64,
    },
    /// A triangle seen exactly from its edge, or without area: its image may grow to either side.
    #[error("the image of triangle {triangle} is no triangle: {source}")]
    EdgeOn {
        /// Which triangle.
        triangle: usize,
        /// What is wrong with the image.
        source: PolygonError,
    },
    /// Two triangles that meet inside their images, or lie in one plane and overlap.
    #[error("triangles {first} and {second} intersect, and have no order of depth")]
    Intersect {
        /// One triangle.
        first: usize,
        /// The other.
        second: usize,
    },
    /// Triangles that hide each other in a ring.
    #[error("triangle {triangle} is in a ring of triangles that hide each other")]
    Cycle {
        /// One of them.
        triangle: usize,
    },
    /// A vertex so close to the plane of another triangle that the side it is on is rounding.
    #[error("a corner of triangle {triangle} touches the plane of triangle {plane}")]
    Touch {
        /// The triangle with the corner.
        triangle: usize,
        /// The other.
        plane: usize,
    },
    /// Triangles of one plane that part from it, one of which something passes through: the crossing
    /// gets a kink that it does not have yet.
    #[error("the plane of triangle {triangle} bends where another triangle passes through it")]
    Bends {
        /// One of its triangles.
        triangle: usize,
    },
    /// A film that cannot be.
    #[error(transparent)]
    Film(#[from] FilmError),
    /// A radiance that is not finite.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// A derivative that does not exist, or an arrangement that cannot be had.
    #[error(transparent)]
    Exact(#[from] ExactError),
}

/// A mesh as the camera sees it: a scene of the plane whose unit of length is the pixel.
///
/// Any method of the plane may be run on it, too.
#[derive(Clone, Debug)]
pub struct ProjectedScene {
    scene: Scene,
    velocities: Vec<DVec2>,
    film: Film,
    order: Vec<usize>,
}

impl ProjectedScene {
    /// Projects all triangles and finds their order, in time O(n²).
    ///
    /// # Errors
    /// Any [`CoverageError`] but `Exact`.
    pub fn new(mesh: &Mesh, camera: &Camera, motion: &Motion, filter: Filter) -> Result<Self, CoverageError> {
        check(mesh, motion)?;
        camera.check(&motion.camera)?;
        let film = Film::new(camera.width, camera.height, filter)?;
        let projections = project(mesh, camera, motion)?;
        let polygons: Vec<_> = mesh
            .triangles
            .iter()
            .enumerate()
            .map(|(triangle, corners)| {
                Polygon::simple(corners.map(|v| projections[v].at))
                    .map_err(|source| CoverageError::EdgeOn { triangle, source })
            })
            .collect::<Result<_, _>>()?;
        let order = order::painters(&mesh.triangles, &projections)?;
        let shape = |&t: &usize| Shape::new(polygons[t].clone(), Shade::constant(mesh.radiance[t]));
        let scene = Scene::new(mesh.background, order.iter().map(shape).collect())?;
        let velocity = |&t: &usize| mesh.triangles[t].map(|v| projections[v].velocity);
        let velocities = order.iter().flat_map(velocity).collect();
        Ok(Self { scene, velocities, film, order })
    }

    /// The triangles' images, the farthest first, in pixels.
    #[must_use]
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// The velocity of every vertex of [`scene`](Self::scene), in pixels per unit of θ.
    #[must_use]
    pub fn velocities(&self) -> &[DVec2] {
        &self.velocities
    }

    /// The camera's pixels.
    #[must_use]
    pub fn film(&self) -> &Film {
        &self.film
    }

    /// Which triangle each shape of the scene is.
    #[must_use]
    pub fn order(&self) -> &[usize] {
        &self.order
    }

    /// I = ∫ h f du of every pixel.
    ///
    /// # Errors
    /// [`CoverageError::Exact`].
    pub fn image(&self) -> Result<Image, CoverageError> {
        Ok(Arrangement::new(&self.scene, &self.film)?.primal(&self.film))
    }

    /// dI/dθ of every pixel.
    ///
    /// # Errors
    /// [`CoverageError::Exact`], in particular where an edge moves across the edge of a box pixel
    /// that it lies on.
    pub fn derivative(&self) -> Result<Image, CoverageError> {
        Ok(Arrangement::new(&self.scene, &self.film)?.boundary(&self.film, &self.velocities)?)
    }
}

/// The gradient of Σ adjoint · I with respect to every vertex, one derivative a coordinate: slow,
/// but it lets triangles share vertices.
///
/// # Errors
/// Any [`CoverageError`].
///
/// # Panics
/// If the adjoint is smaller than the film.
pub fn vertex_gradient(
    mesh: &Mesh,
    camera: &Camera,
    filter: Filter,
    adjoint: &Image,
) -> Result<Vec<DVec3>, CoverageError> {
    let still = Motion { positions: vec![DVec3::ZERO; mesh.positions.len()], ..Motion::default() };
    let projected = ProjectedScene::new(mesh, camera, &still, filter)?;
    let arrangement = Arrangement::new(&projected.scene, &projected.film)?;
    let mut gradient = vec![DVec3::ZERO; mesh.positions.len()];
    for (vertex, gradient) in gradient.iter_mut().enumerate() {
        for axis in 0..3 {
            let moving = Vector::new(mesh.positions[vertex], DVec3::AXES[axis]);
            let velocity = camera.project(&CameraMotion::default(), moving).velocity;
            let corners = projected.order.iter().flat_map(|&t| mesh.triangles[t]);
            let velocities: Vec<_> =
                corners.map(|v| if v == vertex { velocity } else { DVec2::ZERO }).collect();
            gradient[axis] = arrangement.boundary(&projected.film, &velocities)?.dot(adjoint);
        }
    }
    Ok(gradient)
}

fn check(mesh: &Mesh, motion: &Motion) -> Result<(), CoverageError> {
    let count = |what, found, expected| {
        if found == expected { Ok(()) } else { Err(CoverageError::Count { what, expected, found }) }
    };
    count("velocities of vertices", motion.positions.len(), mesh.positions.len())?;
    count("radiances of triangles", mesh.radiance.len(), mesh.triangles.len())?;
    let count = mesh.positions.len();
    for (triangle, corners) in mesh.triangles.iter().enumerate() {
        if let Some(&vertex) = corners.iter().find(|&&v| v >= count) {
            return Err(CoverageError::NoSuchVertex { triangle, vertex, count });
        }
    }
    let mut vertices = mesh.positions.iter().zip(&motion.positions);
    match vertices.position(|(p, v)| !(p.is_finite() && v.is_finite())) {
        Some(vertex) => Err(CoverageError::NotFinite { vertex }),
        None => Ok(()),
    }
}

fn project(mesh: &Mesh, camera: &Camera, motion: &Motion) -> Result<Vec<Projection>, CoverageError> {
    let one = |(vertex, (&position, &velocity))| {
        let projection = camera.project(&motion.camera, Vector::new(position, velocity));
        let depth = projection.depth;
        // Not "depth < …": NaN must fail too.
        let is_in_front = depth > IN_FRONT * position.distance(camera.origin);
        if is_in_front { Ok(projection) } else { Err(CoverageError::Behind { vertex, depth }) }
    };
    mesh.positions.iter().zip(&motion.positions).enumerate().map(one).collect()
}

#[cfg(test)]
mod tests;
