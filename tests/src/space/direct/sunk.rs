//! Pixels of a ground that black bodies partly occlude and pass through.
//!
//! A pixel's cell minus the images of the bodies in front of the ground is a set of convex polygons, Σ_p ∫_p
//! h(u) L(x(u)) du. Their corners move: where a body's edge hides the ground or pierces it, where images
//! cross, or where an image leaves the cell. Each polygon is a fan of triangles, each triangle the image of a
//! square, and the integral over the square is differentiated:
//!
//! ```text
//! ∫∫ h(u(s, t)) L(u(s, t)) |∂u/∂(s, t)| ds dt,   u = a + s ((1 − t) (b − a) + t (c − a)),
//! ```
//!
//! with corners a, b, c in dual numbers. No boundary term remains: the moving corners contain it. The part of
//! a body behind the ground's plane is cut away, by a plane that moves as well, so that a crossing with the
//! ground needs no special treatment.

use std::collections::BinaryHeap;

use anyhow::{Context as _, Result};
use flatland::plane::Film;
use glam::{DVec2, DVec3};
use num_dual::{Dual64, DualNum};
use rayon::prelude::*;

use super::{DirectScene, Pixel, SQUARES, Sample, Square, quarters};
use crate::dual::{Vector, Vector2, Vector3};
use crate::space::irradiance::{Corners, Receiver, area_vector, keep, unchecked, without_cone};

/// Area in pixels below which polygons are rounding: gaps between faces that share an edge.
const NO_AREA: f64 = 1e-12;

/// Minimum number of squares allowed for every triangle, however many a pixel has.
const LEAST_SQUARES: usize = 200;

impl DirectScene {
    /// All pixels to about `tolerance`, as [`image`](Self::image), but surfaces without radiance may stand in
    /// front of the ground and in it; they appear black. Emitters must still be outside the view.
    ///
    /// Where bodies touch the ground dE/dθ grows like the inverse distance from the ends of the crossing.
    /// That is integrable, but the difference between two rules may then be only a third of the error.
    pub fn image_past_bodies(&self, tolerance: f64) -> Result<Vec<Pixel>> {
        self.camera.check(&self.camera_motion)?;
        let (width, height) = (self.camera.width, self.camera.height);
        let film = Film::new(width, height, self.filter)?;
        self.world.check()?;
        let bodies = self.bodies();
        let pixel = |i: usize| self.pixel_past(&bodies, &film, [i % width, i / width], tolerance);
        (0..width * height).into_par_iter().map(pixel).collect()
    }

    /// The part in front of the ground of every black surface: corners in the camera's axes, counterclockwise
    /// around their cone.
    fn bodies(&self) -> Vec<Corners> {
        let (axes, _) = self.camera.moving(&self.camera_motion);
        let origin = Vector3::new(self.camera.origin, self.camera_motion.origin);
        let ground: [Vector3; 3] =
            std::array::from_fn(|k| Vector3::new(self.ground.corners[k], self.ground.velocities[k]) - origin);
        let normal = (ground[1] - ground[0]).cross(ground[2] - ground[0]);
        let behind = normal.dot(ground[0]).re.signum();
        let black = self.world.surfaces.iter().filter(|s| s.radiance == DVec3::ZERO);
        let before = black.filter_map(|surface| {
            let corners = keep(&surface.seen_from(origin), |d| normal.dot(ground[0] - d) * behind);
            let mut turned: Corners = corners.iter().map(|d| Vector(axes.map(|a| a.dot(*d)))).collect();
            if turned.len() < 3 {
                return None;
            }
            if area_vector(&turned).dot(turned[0]).re < 0.0 {
                turned.reverse();
            }
            Some(turned)
        });
        before.collect()
    }

    /// The convex polygons of a cell in which the ground is visible.
    fn visible(&self, bodies: &[Corners], min: DVec2, max: DVec2) -> Vec<Vec<Vector2>> {
        let (_, scale) = self.camera.moving(&self.camera_motion);
        let middle = 0.5 * DVec2::new(self.camera.width as f64, self.camera.height as f64);
        let corner = |u: DVec2| {
            let offset = u - middle;
            Vector([scale.recip() * offset.x, scale.recip() * -offset.y, 1.0.into()])
        };
        let cell = [min, DVec2::new(max.x, min.y), max, DVec2::new(min.x, max.y)].map(corner);
        let mut pieces = vec![cell.to_vec()];
        for body in bodies {
            pieces = pieces.into_iter().flat_map(|piece| without_cone(piece, body)).collect();
        }
        let image = |d: &Vector3| {
            let [x, y, z] = d.0;
            Vector([scale * x / z, -(scale * y / z)]) + Vector2::still(middle)
        };
        let images = pieces.iter().map(|piece| piece.iter().map(image).collect::<Vec<_>>());
        images.filter(|polygon| area(polygon) > NO_AREA).collect()
    }

    fn pixel_past(
        &self,
        bodies: &[Corners],
        film: &Film,
        [x, y]: [usize; 2],
        tolerance: f64,
    ) -> Result<Pixel> {
        let centre = film.centre(x, y);
        let mut triangles: Vec<[Vector2; 3]> = vec![];
        for cell in film.cells(x, y) {
            for piece in self.visible(bodies, cell.min, cell.max) {
                triangles.extend((2..piece.len()).map(|k| [piece[0], piece[k - 1], piece[k]]));
            }
        }
        let mut parts = vec![];
        for corners in &triangles {
            let integrand = |at: DVec2| self.integrand(film, centre, corners, at);
            let squares =
                quarters(DVec2::ZERO, DVec2::ONE).map(|[min, max]| Square::new(&integrand, min, max));
            parts.push(squares.into_iter().collect::<Result<BinaryHeap<_>, _>>()?);
        }
        // Each triangle has its share of the tolerance.
        let magnitude: f64 = parts.iter().flatten().map(|s| s.magnitude).sum();
        let allowed = tolerance * magnitude / triangles.len().max(1) as f64;
        let most = (SQUARES / triangles.len().max(1)).max(LEAST_SQUARES);
        let mut pixel = Pixel::default();
        for (corners, squares) in triangles.iter().zip(parts) {
            let integrand = |at: DVec2| self.integrand(film, centre, corners, at);
            pixel.add(&integrand, squares, allowed, most)?;
        }
        Ok(pixel)
    }

    /// h L |∂u/∂(s, t)| and its derivative.
    fn integrand(&self, film: &Film, centre: DVec2, [a, b, c]: &[Vector2; 3], at: DVec2) -> Result<Sample> {
        let [p, q] = [b, c].map(|corner| *corner - *a);
        let u = *a + p.lerp(q, at.y.into()) * at.x.into();
        let area = p.cross(q) * at.x;
        let area = if area.re < 0.0 { -area } else { area };
        let (place, velocity) = (u.value(), u.rate());
        let filter =
            Dual64::new(film.filter_value(centre, place), film.filter_gradient(centre, place).dot(velocity));
        let mut ray = self.camera.ray(&self.camera_motion, place);
        let slope = velocity / self.camera.pixels_per_slope();
        ray.direction_rate += slope.x * self.camera.right - slope.y * self.camera.up;
        let light = Receiver::on_ray(&ray, &self.ground).and_then(|x| unchecked(&self.world, &x));
        let light = light.with_context(|| format!("at the film's point {place}"))?;
        let (light, weight) = (light.outgoing(self.albedo), filter * area);
        Ok(Sample {
            value: weight.re * light.value,
            derivative: weight.eps * light.value + weight.re * light.derivative,
        })
    }
}

fn area(polygon: &[Vector2]) -> f64 {
    let at = |k: usize| (polygon[k] - polygon[0]).value();
    (2..polygon.len()).map(|k| 0.5 * at(k - 1).perp_dot(at(k))).sum::<f64>().abs()
}

#[cfg(test)]
mod tests;
