//! Where implicit surfaces pass through meshes, and through one another: no field follows the curves in which they meet.

use flatland::sdf::Sdf;
use glam::DVec3;

use super::{ImplicitShape, Scene};

/// How far triangles and boxes are divided: to this part of the implicit surface's size. What touches without passing through by more is not
/// seen.
const SMALLEST: f64 = 2e-3;

/// An implicit surface that something passes through.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImplicitCrossing {
    /// The implicit surface, by its index.
    pub implicit: usize,
    /// What passes through it.
    pub with: CrossedBy,
    /// A point inside of the surface and of, or inside, the other.
    pub at: DVec3,
}

/// What passes through an implicit surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CrossedBy {
    /// A mesh, by its index: it has points on both sides.
    Mesh(usize),
    /// Another implicit surface, by its index: both have points inside of each other, or one is within the other.
    Implicit(usize),
}

impl Scene {
    /// The implicit surfaces that meshes or other implicit surfaces pass through. Where anything moves near the curve in which they meet, gradients
    /// are biased.
    ///
    /// Bounds on |∇φ| rule out all that is farther away; what remains is divided until a point inside is found, or it is smaller than 0.2 % of the
    /// surface's size.
    #[must_use]
    pub fn implicit_crossings(&self) -> Vec<ImplicitCrossing> {
        let mut found = vec![];
        for (implicit, shape) in self.implicits().iter().enumerate() {
            let smallest = SMALLEST * self.implicit_size(implicit as u32);
            for mesh in 0..self.description.shapes.len() {
                if let Some(at) = self.passes_through(mesh, shape, smallest) {
                    found.push(ImplicitCrossing {
                        implicit,
                        with: CrossedBy::Mesh(mesh),
                        at: self.given(at),
                    });
                }
            }
            for other in implicit + 1..self.description.implicits.len() {
                let pair = [shape, &self.implicits()[other]];
                let boxes = [implicit, other].map(|i| self.implicit_bounds[i]);
                if let Some(at) = inside_of_both(pair, boxes, smallest) {
                    found.push(ImplicitCrossing {
                        implicit,
                        with: CrossedBy::Implicit(other),
                        at: self.given(at),
                    });
                }
            }
        }
        found
    }

    /// A point of a mesh inside of an implicit surface, if the mesh has points outside, too.
    fn passes_through(&self, mesh: usize, shape: &ImplicitShape, smallest: f64) -> Option<DVec3> {
        let corners = |t: usize| self.triangles[t].positions.map(|i| self.positions[i as usize]);
        let is_outside = |x: &DVec3| shape.value(*x) > 0.0;
        if !self.positions[self.position_range(mesh)].iter().any(is_outside) {
            return None;
        }
        let first = self.first_triangle[mesh] as usize;
        let count = self.description.shapes[mesh].mesh.triangles().len();
        (first..first + count).find_map(|t| inside(corners(t), shape, smallest))
    }
}

/// A point of a triangle at which φ < 0.
fn inside(triangle: [DVec3; 3], shape: &ImplicitShape, smallest: f64) -> Option<DVec3> {
    let bound = shape.slope_bound_everywhere();
    let mut waiting = vec![triangle];
    while let Some([a, b, c]) = waiting.pop() {
        let centre = (a + b + c) / 3.0;
        let radius = [a, b, c].map(|p| p.distance(centre)).into_iter().fold(0.0, f64::max);
        let value = shape.value(centre);
        if value < 0.0 {
            return Some(centre);
        }
        if value <= bound * radius && radius > smallest {
            let [ab, bc, ca] = [(a + b) / 2.0, (b + c) / 2.0, (c + a) / 2.0];
            waiting.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
        }
    }
    None
}

/// A point inside of two surfaces, in what their boxes have in common.
fn inside_of_both(
    pair: [&ImplicitShape; 2],
    boxes: [Option<(DVec3, DVec3)>; 2],
    smallest: f64,
) -> Option<DVec3> {
    let [(low, high), (other_low, other_high)] = match boxes {
        [Some(a), Some(b)] => [a, b],
        // The inside of what has no box is within that of the other, if they meet.
        [Some(a), None] | [None, Some(a)] => [a, a],
        [None, None] => return None,
    };
    let (low, high) = (low.max(other_low), high.min(other_high));
    let bounds = pair.map(Sdf::slope_bound_everywhere);
    let mut waiting = if low.cmple(high).all() { vec![(low, high)] } else { vec![] };
    while let Some((low, high)) = waiting.pop() {
        let (centre, radius) = (0.5 * (low + high), 0.5 * high.distance(low));
        let values = pair.map(|shape| shape.value(centre));
        if values.iter().all(|value| *value < 0.0) {
            return Some(centre);
        }
        let is_near = values.iter().zip(bounds).all(|(value, bound)| *value <= bound * radius);
        if is_near && radius > smallest {
            for corner in 0..8 {
                let side = |axis: usize| f64::from(corner >> axis & 1);
                let at = DVec3::new(side(0), side(1), side(2));
                let low = low + (centre - low) * at;
                waiting.push((low, low + (high - centre)));
            }
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use flatland::sdf::shapes::Ball;
    use glam::{DAffine3, DQuat};

    use super::*;
    use crate::geometry::Mesh;
    use crate::scene::{Camera, Description, Film, Filter, Material};

    fn crossings(floor: f64, second: Option<(f64, f64)>, size: f64) -> Vec<CrossedBy> {
        let camera = Camera::look_at(DVec3::new(0.0, 3.0, 9.0), DVec3::ZERO, DVec3::Y, 0.9);
        let film = Film { width: 4, height: 4, crop: None, sample_border: true, filter: Filter::Box };
        let mut description = Description::new(camera, film);
        let clay = description.add_material(Material::diffuse("clay", DVec3::splat(0.5)));
        let ball = |x: f64, radius: f64| Ball::new(DVec3::X * x, radius).expect("a ball");
        description.add_implicit("ball", ball(0.0, 1.0), clay);
        let flat = DQuat::from_rotation_x(-std::f64::consts::FRAC_PI_2);
        let place = DAffine3::from_scale_rotation_translation(DVec3::splat(size), flat, DVec3::Y * floor);
        description.add_shape("floor", Mesh::rectangle().transformed(&place), clay);
        if let Some((x, radius)) = second {
            description.add_implicit("second", ball(x, radius), clay);
        }
        let scene = Scene::new(description).expect("a scene");
        let found = scene.implicit_crossings();
        for ImplicitCrossing { implicit, with, at } in &found {
            assert!(scene.description().implicits[*implicit].value(*at) < 0.0, "{with:?} {at}");
        }
        found.into_iter().map(|crossing| crossing.with).collect()
    }

    #[test]
    fn what_passes_through_is_found_and_what_is_beside_is_not() {
        // The corners of the floor are far outside of the ball, and those of a small one may be inside.
        assert_eq!(crossings(-0.9, None, 50.0), [CrossedBy::Mesh(0)]);
        assert_eq!(crossings(-0.99, None, 1.0), [CrossedBy::Mesh(0)]);
        assert_eq!(crossings(-1.001, None, 50.0), []);
        // All of it within is no curve.
        assert_eq!(crossings(0.0, None, 0.2), []);
        assert_eq!(crossings(-2.0, Some((1.9, 1.0)), 1.0), [CrossedBy::Implicit(1)]);
        assert_eq!(crossings(-2.0, Some((2.01, 1.0)), 1.0), []);
        assert_eq!(crossings(-2.0, Some((0.1, 0.2)), 1.0), [CrossedBy::Implicit(1)]);
    }
}
