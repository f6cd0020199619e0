//! Triangles that pass through one another: cut along their crossings, they have an order of depth.
//!
//! Two triangles cross in a segment of the line that their planes share. Each is cut along that
//! line, from border to border; of what is left, no two pieces cross, and painter's order and the
//! plane's arrangement follow as for triangles that never crossed. That a cut reaches beyond the
//! crossing does no harm: the two sides of it have one radiance.
//!
//! All that is new moves as it must. A corner of a piece is a vertex, or an edge pierced by a plane,
//! or a point of three planes, and is computed as such in dual numbers: so it stays on the line of
//! both planes for all θ, the image of a side of a piece is the segment between the images of its
//! ends, and the normal velocity of that segment is linear along it. Pieces of several triangles
//! that meet along a crossing share its velocity but for rounding.
//!
//! Triangles of one plane (the halves of a rectangle) cut as one plane. Where θ bends that plane the
//! crossing would need one more corner, and the scene is refused.

mod crossing;
mod order;
mod piece;
mod plane;

use flatland::plane::{Film, Filter, Polygon, Scene, Shade, Shape};

pub use crossing::Crossing;

use super::{Camera, CoverageError, Mesh, Motion, ProjectedScene, check, project};
use crate::space::vector::Vector;
use order::Seen;
use piece::Piece;
use plane::Planes;

impl ProjectedScene {
    /// As [`new`](Self::new), of triangles that may pass through one another, in time O(n²) of the
    /// pieces. [`order`](Self::order) names the triangle that each shape is a piece of.
    ///
    /// # Errors
    /// Any [`CoverageError`] but `Exact`. Pieces may hide each other in a ring even so.
    pub fn cut(mesh: &Mesh, camera: &Camera, motion: &Motion, filter: Filter) -> Result<Self, CoverageError> {
        check(mesh, motion)?;
        camera.check(&motion.camera)?;
        let film = Film::new(camera.width, camera.height, filter)?;
        project(mesh, camera, motion)?;
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
            let polygon = polygon.map_err(|source| CoverageError::EdgeOn { triangle: s.triangle, source })?;
            Ok(Shape::new(polygon, Shade::constant(mesh.radiance[s.triangle])))
        };
        let shapes: Vec<_> = ordered().map(shape).collect::<Result<_, CoverageError>>()?;
        let scene = Scene::new(mesh.background, shapes)?;
        let velocities = ordered().flat_map(|s| s.velocities.iter().copied()).collect();
        Ok(Self { scene, velocities, film, order: ordered().map(|s| s.triangle).collect() })
    }
}

/// Where triangles of a mesh pass through one another.
///
/// # Errors
/// Those of [`ProjectedScene::cut`] that do not depend on a camera.
pub fn crossings(mesh: &Mesh, motion: &Motion) -> Result<Vec<Crossing>, CoverageError> {
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
        let points = mesh.positions.iter().zip(&motion.positions).map(|(p, v)| Vector::new(*p, *v)).collect();
        Self { triangles: &mesh.triangles, planes: Planes::new(&mesh.triangles, points) }
    }

    fn crossings(&self) -> Result<Vec<Crossing>, CoverageError> {
        let mut found = vec![];
        for second in 0..self.triangles.len() {
            for first in 0..second {
                found.extend(Crossing::of(&self.planes, [first, second])?);
            }
        }
        Ok(found)
    }

    /// All triangles, each cut by the plane of every triangle that it crosses.
    fn pieces(&self) -> Result<Vec<Piece>, CoverageError> {
        let mut cuts: Vec<Vec<usize>> = vec![vec![]; self.triangles.len()];
        for Crossing { triangles: [a, b], .. } in self.crossings()? {
            for (cut, by) in [(a, b), (b, a)] {
                if self.planes.bends(by) {
                    return Err(CoverageError::Bends { triangle: by });
                }
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

#[cfg(test)]
mod tests;
