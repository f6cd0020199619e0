//! Primary visibility: pixels of a mesh of constant radiance and their derivatives, exactly.
//!
//! Under a pinhole camera the image of a triangle is a triangle of the film, and opaque triangles are a scene
//! of [`flatland::plane`] in painter's order. Its vertices move with the projected velocities, which dual
//! numbers give for any motion of mesh and camera. The rest is the plane's exact arrangement: I = ∫ h f du,
//! and dI/dθ = ∮ h Δf (v·ν) dl.
//!
//! Two facts make that complete. The radiance of a triangle is constant, so there is no interior term. And
//! the plane's boundary velocity, linear along an edge, has the right normal part, though the material points
//! of an edge move on the film at speeds that are *not* linear along it: the image of the edge is, for all θ,
//! the straight segment between the images of its end points, ((1 − s) p(θ) + s q(θ)) for 0 ≤ s ≤ 1.
//! Perspective only reparametrises that segment, by another s for the same material point, and a
//! reparametrisation changes the velocity along the segment but not across it.
//!
//! Triangles may pass through one another. Two of them cross in a segment of the line that their planes
//! share. Each is cut along that line, from border to border; no two of the resulting pieces cross, and
//! painter's order and the plane's arrangement follow as for triangles that never crossed. A cut beyond the
//! crossing is harmless: both its sides have the same radiance.
//!
//! The new corners move consistently. A corner of a piece is a vertex, or an edge pierced by a plane, or a
//! point of three planes, and is computed as such in dual numbers. It therefore stays on the line of both
//! planes for all θ. The image of a side of a piece is the segment between the images of its ends, and the
//! normal velocity of that segment is linear along it. Pieces of several triangles that meet along a crossing
//! share its velocity up to rounding.
//!
//! Coplanar triangles (the halves of a rectangle) cut as one plane. Where θ bends that plane, the crossing
//! would need one more corner, and the scene is refused.

mod camera;
mod crossing;
mod order;
mod piece;
mod plane;

use anyhow::{Context as _, Result, ensure};
use flatland::plane::exact::Arrangement;
use flatland::plane::{Film, Filter, Image, Polygon, Scene, Shade, Shape};
use glam::{DVec2, DVec3};

pub use camera::{Camera, CameraMotion};
pub use crossing::Crossing;
use order::Seen;
use piece::Piece;
use plane::Planes;

use crate::dual::Vector3;

/// Minimum depth relative to the distance from the camera; anything nearer counts as behind the camera: a
/// mesh must be strictly in front of it.
const IN_FRONT: f64 = 1e-4;

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
    /// The radiance where no triangle is visible.
    pub background: DVec3,
}

/// The motion of a mesh and a camera: the derivative of both at θ = 0.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Motion {
    /// One velocity per vertex.
    pub positions: Vec<DVec3>,
    /// The camera's motion.
    pub camera: CameraMotion,
}

impl Mesh {
    /// The mesh at θ: every vertex p at p + θ ṗ.
    pub fn displaced(&self, motion: &Motion, theta: f64) -> Self {
        assert_eq!(self.positions.len(), motion.positions.len(), "one velocity per vertex");
        let positions = self.positions.iter().zip(&motion.positions).map(|(p, v)| *p + theta * *v);
        Self { positions: positions.collect(), ..self.clone() }
    }
}

/// A mesh as the camera sees it: a scene of the plane whose unit of length is the pixel.
///
/// Any method of the plane may be run on it as well.
#[derive(Clone, Debug)]
pub struct ProjectedScene {
    scene: Scene,
    velocities: Vec<DVec2>,
    film: Film,
}

impl ProjectedScene {
    /// Cuts triangles where they pass through one another, projects all pieces and finds their order, in time
    /// O(n²) of the pieces.
    ///
    /// # Errors
    /// - A vertex is not in front of the camera.
    /// - A triangle is seen edge-on, or overlaps another in their plane.
    /// - A corner touches another triangle's plane.
    /// - A plane bends where another triangle crosses it.
    /// - Pieces occlude each other cyclically.
    /// - A number is not finite.
    pub fn new(mesh: &Mesh, camera: &Camera, motion: &Motion, filter: Filter) -> Result<Self> {
        check(mesh, motion)?;
        camera.check(&motion.camera)?;
        let film = Film::new(camera.width, camera.height, filter)?;
        check_in_front(mesh, camera, motion)?;
        let world = World::new(mesh, motion);
        let seen: Vec<Seen> = world
            .pieces()?
            .iter()
            .map(|piece| {
                let corners = piece.corners().map(|c| camera.project(&motion.camera, world.planes.place(c)));
                Seen::new(piece.triangle, corners.collect(), world.planes.of(piece.triangle), camera)
            })
            .collect::<Result<_, _>>()?;
        let order = order::painters(&seen)?;
        let ordered = || order.iter().map(|&k| &seen[k]);
        let shape = |s: &Seen| {
            let polygon = Polygon::simple(s.corners.clone());
            let polygon =
                polygon.with_context(|| format!("the image of triangle {} is no triangle", s.triangle))?;
            Ok(Shape::new(polygon, Shade::constant(mesh.radiance[s.triangle])))
        };
        let shapes: Vec<_> = ordered().map(shape).collect::<Result<_>>()?;
        let scene = Scene::new(mesh.background, shapes)?;
        let velocities = ordered().flat_map(|s| s.velocities.iter().copied()).collect();
        Ok(Self { scene, velocities, film })
    }

    /// The triangles' images, the farthest first, in pixels.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// The velocity of every vertex of [`scene`](Self::scene), in pixels per unit of θ.
    pub fn velocities(&self) -> &[DVec2] {
        &self.velocities
    }

    /// The camera's pixels.
    pub fn film(&self) -> &Film {
        &self.film
    }

    /// I = ∫ h f du of every pixel.
    pub fn image(&self) -> Result<Image> {
        Ok(Arrangement::new(&self.scene, &self.film)?.primal(&self.film))
    }

    /// dI/dθ of every pixel.
    ///
    /// # Errors
    /// If there is none, in particular where an edge moves across the edge of a box pixel that it lies on.
    pub fn derivative(&self) -> Result<Image> {
        Ok(Arrangement::new(&self.scene, &self.film)?.boundary(&self.film, &self.velocities)?)
    }
}

/// The segments in which triangles of a mesh pass through one another.
///
/// # Errors
/// An error of [`ProjectedScene::new`] that does not depend on a camera.
pub fn crossings(mesh: &Mesh, motion: &Motion) -> Result<Vec<Crossing>> {
    check(mesh, motion)?;
    World::new(mesh, motion).crossings()
}

/// A mesh whose vertices are functions of θ.
struct World<'a> {
    triangles: &'a [[usize; 3]],
    planes: Planes<'a>,
}

impl<'a> World<'a> {
    fn new(mesh: &'a Mesh, motion: &Motion) -> Self {
        let points =
            mesh.positions.iter().zip(&motion.positions).map(|(p, v)| Vector3::new(*p, *v)).collect();
        Self { triangles: &mesh.triangles, planes: Planes::new(&mesh.triangles, points) }
    }

    fn crossings(&self) -> Result<Vec<Crossing>> {
        let mut found = vec![];
        for second in 0..self.triangles.len() {
            for first in 0..second {
                found.extend(Crossing::of(&self.planes, [first, second])?);
            }
        }
        Ok(found)
    }

    /// All triangles, each cut by the plane of every triangle that it crosses.
    fn pieces(&self) -> Result<Vec<Piece>> {
        let mut cuts: Vec<Vec<usize>> = vec![vec![]; self.triangles.len()];
        for Crossing { triangles: [a, b], .. } in self.crossings()? {
            for (cut, by) in [(a, b), (b, a)] {
                ensure!(
                    !self.planes.bends(by),
                    "the plane of triangle {by} bends where another passes through it"
                );
                cuts[cut].push(self.planes.plane_of(by));
            }
        }
        let mut all = vec![];
        for (triangle, mut cuts) in cuts.into_iter().enumerate() {
            cuts.sort_unstable();
            cuts.dedup();
            let mut pieces = vec![Piece::new(triangle, self.triangles[triangle])];
            for plane in cuts {
                let halves = pieces.iter().map(|p| p.cut(&self.planes, plane));
                pieces = halves.collect::<Result<Vec<_>, _>>()?.concat();
            }
            all.extend(pieces);
        }
        Ok(all)
    }
}

fn check(mesh: &Mesh, motion: &Motion) -> Result<()> {
    let count = mesh.positions.len();
    ensure!(motion.positions.len() == count, "{} velocities for {count} vertices", motion.positions.len());
    let (radiances, triangles) = (mesh.radiance.len(), mesh.triangles.len());
    ensure!(radiances == triangles, "{radiances} radiances for {triangles} triangles");
    for (triangle, corners) in mesh.triangles.iter().enumerate() {
        ensure!(corners.iter().all(|&v| v < count), "triangle {triangle}: {corners:?} of {count} vertices");
    }
    for (vertex, (p, v)) in mesh.positions.iter().zip(&motion.positions).enumerate() {
        ensure!(p.is_finite() && v.is_finite(), "position or velocity of vertex {vertex} is not finite");
    }
    Ok(())
}

fn check_in_front(mesh: &Mesh, camera: &Camera, motion: &Motion) -> Result<()> {
    for (vertex, (&position, &velocity)) in mesh.positions.iter().zip(&motion.positions).enumerate() {
        let depth = camera.project(&motion.camera, Vector3::new(position, velocity)).depth;
        ensure!(
            depth > IN_FRONT * position.distance(camera.origin),
            "vertex {vertex} is at a depth of {depth:e}"
        );
    }
    Ok(())
}

#[cfg(test)]
mod tests;
