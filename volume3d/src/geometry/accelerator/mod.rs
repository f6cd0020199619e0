//! Ray–mesh intersection.
//!
//! A hierarchy of boxes, with eight children per node and up to eight triangles per leaf, is traversed in
//! single precision in eight lanes. It only rejects boxes and triangles, with derived error bounds. Hits are
//! decided in double precision by a watertight test, except that an occlusion query may accept a triangle
//! that is hit by more than the error bounds. The result is therefore a function of ray and mesh alone: the
//! accepted triangle of least distance, and among equals the one of lowest index, independent of the
//! instruction set, the number of threads, and the other rays of a bundle.
//!
//! Coordinates are expected below 10⁷⁵ in magnitude, so that products of two areas are finite.

mod build;
mod bundle;
mod collapse;
mod fan;
mod fan_filter;
mod frame;
mod frame_rays;
mod gather;
mod overlap;
mod packet;
mod ray_filter;
mod sheaf;
mod stream;
mod sweep;
#[cfg(test)]
mod tests;
mod traverse;
mod tree;
mod watertight;

use crate::lanes::Instructions;
use build::{Bounds, Reference};
use frame::{Depth, Frame};
use glam::{DVec3, Vec3A};
use rayon::prelude::*;
use robust::{Coord, orient2d};
pub use sheaf::{Goal, Sheaf};
pub use stream::Shadows;
use traverse::{Collect, Traversal};
use tree::Tree;
use watertight::Crossing;

/// A ray, or its piece between two distances.
#[derive(Clone, Copy, Debug)]
pub struct Ray {
    /// Origin of distances.
    pub origin: DVec3,
    /// Unit length.
    pub direction: DVec3,
    /// Lower bound (exclusive) on hit distances.
    pub near: f64,
    /// Upper bound (exclusive) on hit distances; may be infinite.
    pub far: f64,
    /// The triangle that contains the origin, which is never hit.
    pub from: Option<u32>,
}

/// Intersection of a ray with a mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Index of the triangle.
    pub triangle: u32,
    /// Distance from the ray's origin, in units of the direction's length.
    pub distance: f64,
    /// Weights of the three vertices, nonnegative, with sum 1.
    pub barycentric: [f64; 3],
}

/// Acceleration structure over the triangles of a mesh.
///
/// # Guarantees
///
/// - A ray through an edge or a vertex of a closed mesh hits one of its triangles.
/// - Of several triangles at the least distance the one of lowest index is hit.
/// - The same ray has the same hit, bit for bit, alone and in a bundle, on every machine.
/// - A triangle whose corners are exactly collinear, or not finite, is never hit.
#[derive(Clone, Debug)]
pub struct Accelerator {
    frame: Frame,
    tree: Tree,
    bounds: (DVec3, DVec3),
    /// Triangles that are never hit, which the hierarchy does not contain.
    left_out: Vec<u32>,
    /// Expected cost of a ray through the hierarchy, at the time of building.
    cost: f64,
    instructions: Instructions,
}

/// Cost increase, relative to the time of building, at which a hierarchy is rebuilt.
const WORST_COST: f64 = 1.5;

impl Accelerator {
    /// Largest number of triangles: 2²⁸ − 1.
    pub const MOST: usize = (1 << 28) - 1;

    /// Builds the hierarchy over `triangles`, which index `positions`.
    ///
    /// # Panics
    ///
    /// If an index is out of range, or there are 2²⁸ triangles or more.
    #[must_use]
    pub fn build(positions: &[DVec3], triangles: &[[u32; 3]]) -> Self {
        assert!(triangles.len() <= Self::MOST, "fewer than 2²⁸ triangles");
        let mesh = Mesh { positions, triangles };
        let Solid { left_out, bounds } = mesh.solid();
        let frame = Frame::around(bounds);
        let solid = |triangle: &u32| left_out.binary_search(triangle).is_err();
        let mut references: Vec<Reference> = (0..triangles.len() as u32)
            .into_par_iter()
            .filter(solid)
            .map(|triangle| {
                let [a, b, c] = mesh.corners(triangle).map(|p| frame.place(p));
                Reference { bounds: rounded_out(a.min(b).min(c), a.max(b).max(c)), triangle }
            })
            .collect();
        let root = build::build(&mut references);
        let mut tree = Tree::new(&root, &references, mesh);
        let cost = tree.fit(&frame, mesh);
        Self { frame, tree, bounds, left_out, cost, instructions: Instructions::detect() }
    }

    /// Refits the hierarchy to new positions of its triangles. It is rebuilt instead if triangles become or
    /// cease to be degenerate, or if the expected cost of rays has grown by half since it was built.
    ///
    /// Hits are those of a new hierarchy, bit for bit.
    ///
    /// # Panics
    ///
    /// If an index is out of range, or the triangles are not those it was built over.
    pub fn refit(&mut self, positions: &[DVec3], triangles: &[[u32; 3]]) {
        let mesh = Mesh { positions, triangles };
        let Solid { left_out, bounds } = mesh.solid();
        if left_out == self.left_out {
            self.bounds = bounds;
            self.frame = Frame::around(self.bounds);
            if self.tree.fit(&self.frame, mesh) <= WORST_COST * self.cost {
                return;
            }
        }
        *self = Self::build(positions, triangles);
    }

    /// Lower and upper corner of the bounding box of all triangles that can be hit; without any, the lower
    /// one is +∞ and the upper one −∞.
    #[must_use]
    pub fn bounds(&self) -> (DVec3, DVec3) {
        self.bounds
    }

    /// The first hit of a ray.
    #[must_use]
    #[inline]
    pub fn closest(&self, ray: &Ray) -> Option<Hit> {
        let mut closest = Closest::new(ray);
        self.traverse(ray, &mut closest);
        closest.hit()
    }

    /// Whether a ray hits anything.
    #[must_use]
    pub fn occluded(&self, ray: &Ray) -> bool {
        self.occluded_before(ray, None)
    }

    /// Whether a ray that ends in front of a triangle, which is never hit, hits anything.
    #[must_use]
    #[inline]
    pub fn occluded_before(&self, ray: &Ray, target: Option<u32>) -> bool {
        let mut any = Any { ray, target, found: false };
        self.traverse(ray, &mut any);
        any.found
    }

    #[inline(always)]
    fn traverse<C: Collect>(&self, ray: &Ray, collect: &mut C) {
        if !self.tree.leaves.is_empty() {
            self.instructions.run(Traversal { accelerator: self, ray, collect });
        }
    }
}

/// Input of a hierarchy.
#[derive(Clone, Copy)]
struct Mesh<'a> {
    positions: &'a [DVec3],
    triangles: &'a [[u32; 3]],
}

impl Mesh<'_> {
    fn corners(&self, triangle: u32) -> [DVec3; 3] {
        self.triangles[triangle as usize].map(|vertex| self.positions[vertex as usize])
    }

    fn len(&self) -> u32 {
        self.triangles.len() as u32
    }

    /// Classification of triangles as hittable or not.
    fn solid(&self) -> Solid {
        let add = |mut sum: Solid, triangle: u32| {
            let corners = self.corners(triangle);
            if is_solid(&corners) {
                let [a, b, c] = corners;
                let (lower, upper) = sum.bounds;
                sum.bounds = (lower.min(a).min(b).min(c), upper.max(a).max(b).max(c));
            } else {
                sum.left_out.push(triangle);
            }
            sum
        };
        (0..self.len()).into_par_iter().fold(Solid::default, add).reduce(Solid::default, Solid::followed_by)
    }
}

/// The triangles that no ray hits, in order, and the bounding box of all others.
struct Solid {
    left_out: Vec<u32>,
    bounds: (DVec3, DVec3),
}

impl Default for Solid {
    fn default() -> Self {
        Self { left_out: vec![], bounds: (DVec3::INFINITY, DVec3::NEG_INFINITY) }
    }
}

impl Solid {
    /// The union with that of later triangles.
    fn followed_by(mut self, mut later: Self) -> Self {
        self.left_out.append(&mut later.left_out);
        let ((a, b), (c, d)) = (self.bounds, later.bounds);
        Self { left_out: self.left_out, bounds: (a.min(c), b.max(d)) }
    }
}

/// Whether three corners are finite and span an area, decided exactly.
fn is_solid(corners: &[DVec3; 3]) -> bool {
    let flat = |x: usize, y: usize| {
        let [a, b, c] = corners.map(|p| Coord { x: p[x], y: p[y] });
        orient2d(a, b, c) == 0.0
    };
    corners.iter().all(|p| p.is_finite()) && !(flat(0, 1) && flat(1, 2) && flat(2, 0))
}

/// A single-precision box that contains a double-precision one.
fn rounded_out(lower: DVec3, upper: DVec3) -> Bounds {
    let down = |x: f64| if f64::from(x as f32) <= x { x as f32 } else { (x as f32).next_down() };
    let up = |x: f64| if f64::from(x as f32) >= x { x as f32 } else { (x as f32).next_up() };
    Bounds {
        lower: Vec3A::from_array(lower.to_array().map(down)),
        upper: Vec3A::from_array(upper.to_array().map(up)),
    }
}

/// The nearest hit so far, by distance and then by index.
struct Closest<'a> {
    ray: &'a Ray,
    depth: Option<Depth>,
    distance: f64,
    triangle: u32,
    crossing: Option<Crossing>,
}

impl<'a> Closest<'a> {
    #[inline]
    fn new(ray: &'a Ray) -> Self {
        Self { ray, depth: None, distance: ray.far, triangle: 0, crossing: None }
    }

    #[inline]
    fn hit(&self) -> Option<Hit> {
        let crossing = self.crossing?;
        Some(Hit {
            triangle: self.triangle,
            distance: crossing.distance,
            barycentric: crossing.barycentric(),
        })
    }
}

impl Collect for Closest<'_> {
    const ANY: bool = false;

    #[inline(always)]
    fn prepare(&mut self, depth: Depth) {
        self.depth = Some(depth);
    }

    #[inline(always)]
    fn counts(&self, triangle: u32) -> bool {
        self.ray.from != Some(triangle)
    }

    #[inline(always)]
    fn take_any(&mut self) {}

    #[inline(always)]
    fn take(&mut self, triangle: u32, crossing: Crossing) -> Option<f32> {
        let distance = crossing.distance;
        let tie = self.crossing.is_some() && distance == self.distance && triangle < self.triangle;
        let closer = distance < self.distance || tie;
        if !(closer && distance > self.ray.near) {
            return None;
        }
        (self.distance, self.triangle, self.crossing) = (distance, triangle, Some(crossing));
        self.depth.map(|depth| depth.above(distance))
    }
}

/// Occlusion query.
struct Any<'a> {
    ray: &'a Ray,
    /// A triangle that is ignored.
    target: Option<u32>,
    found: bool,
}

impl Collect for Any<'_> {
    const ANY: bool = true;

    #[inline(always)]
    fn prepare(&mut self, _: Depth) {}

    #[inline(always)]
    fn counts(&self, triangle: u32) -> bool {
        self.ray.from != Some(triangle) && self.target != Some(triangle)
    }

    #[inline(always)]
    fn take_any(&mut self) {
        self.found = true;
    }

    #[inline(always)]
    fn take(&mut self, _: u32, crossing: Crossing) -> Option<f32> {
        if !(self.ray.near < crossing.distance && crossing.distance < self.ray.far) {
            return None;
        }
        self.found = true;
        // No hit can be that near: the traversal ends.
        Some(f32::NEG_INFINITY)
    }
}
