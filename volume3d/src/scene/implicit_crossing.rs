//! Crossings of implicit surfaces with meshes and with one another: no field follows these curves.

use flatland::sdf::Sdf;
use glam::DVec3;

use super::{ImplicitShape, Scene};

/// Smallest size to which triangles and boxes are divided, relative to the implicit surface. Penetration
/// below it is not detected.
const SMALLEST: f64 = 2e-3;

/// An implicit surface crossed by another surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImplicitCrossing {
    /// Index of the implicit surface.
    pub implicit: usize,
    /// The other surface.
    pub with: CrossedBy,
    /// A point inside the implicit surface that is on, or inside, the other.
    pub at: DVec3,
}

/// Surface that crosses an implicit surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CrossedBy {
    /// Index of a mesh with points on both sides.
    Mesh(usize),
    /// Index of another implicit surface: both have points inside one another, or one is within the other.
    Implicit(usize),
}

impl Scene {
    /// Implicit surfaces crossed by meshes or other implicit surfaces. If anything moves near the curve of
    /// intersection, gradients are biased.
    ///
    /// Bounds on |∇φ| exclude everything farther away; the remainder is subdivided until an inside point is
    /// found or it is smaller than 0.2 % of the surface.
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

    /// A point of a mesh inside an implicit surface, if the mesh also has points outside.
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

/// A point inside two surfaces, within the intersection of their boxes.
fn inside_of_both(
    pair: [&ImplicitShape; 2],
    boxes: [Option<(DVec3, DVec3)>; 2],
    smallest: f64,
) -> Option<DVec3> {
    let [(low, high), (other_low, other_high)] = match boxes {
        [Some(a), Some(b)] => [a, b],
        // An unbounded surface meets the other only within the other's box.
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
        // The corners of the floor are far outside the ball; corners of a small floor may be inside.
        assert_eq!(crossings(-0.9, None, 50.0), [CrossedBy::Mesh(0)]);
        assert_eq!(crossings(-0.99, None, 1.0), [CrossedBy::Mesh(0)]);
        assert_eq!(crossings(-1.001, None, 50.0), []);
        // A mesh entirely inside has no curve of intersection.
        assert_eq!(crossings(0.0, None, 0.2), []);
        assert_eq!(crossings(-2.0, Some((1.9, 1.0)), 1.0), [CrossedBy::Implicit(1)]);
        assert_eq!(crossings(-2.0, Some((2.01, 1.0)), 1.0), []);
        assert_eq!(crossings(-2.0, Some((0.1, 0.2)), 1.0), [CrossedBy::Implicit(1)]);
    }
}
