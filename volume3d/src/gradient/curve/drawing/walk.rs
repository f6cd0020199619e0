//! Camera paths without derivatives: shading points from which edges are searched.

use flatland::calculus::{Number, Rgb, Vec3};
use glam::{DVec2, DVec3};

use super::sensor::{CameraSubpath, Sensor, Vertex};
use super::table::Table;
use crate::gradient::curve::moving::Moving;
use crate::path::{Bounce, Plain, Sequence, Shading, SurfacePoint};
use crate::scene::{Hit, Reflectance, Scene, Surface, parts};

/// Largest continuation probability of paths of unlimited length.
const SURVIVAL: f64 = 0.95;

/// Fraction of first shading points that are sampled from moving surfaces by area instead of from the film.
const BY_AREA: f64 = 0.5;

/// Path starts: uniform film points, or points of moving surfaces by area.
///
/// At a fixed film point, a moving surface slides with speed ∝ 1/cos θ, θ the angle between its normal and
/// the ray. Near a silhouette the cosine falls as the root of the distance on the film, and the mean of
/// 1/cos²θ diverges; but a unit of area covers an area ∝ cos θ on the film.
#[derive(Debug)]
pub(in crate::gradient::curve) struct Walk<'a> {
    pub(in crate::gradient::curve) sensor: Sensor<'a>,
    longest: usize,
    /// Triangles by area; empty for static surfaces.
    moving: Table,
}

impl<'a> Walk<'a> {
    /// Paths of at most `longest` segments.
    pub(in crate::gradient::curve) fn new(sensor: Sensor<'a>, moving: &Moving, longest: usize) -> Self {
        let scene = sensor.paths.scene;
        let area = |t: usize| {
            let [a, b, c] = scene.corners(t as u32);
            let moves = moving.camera || moving.shapes[scene.triangles[t].shape as usize];
            if moves && reflects(scene, t as u32) { 0.5 * (b - a).cross(c - a).length() } else { 0.0 }
        };
        Self { sensor, longest, moving: Table::new((0..scene.triangles.len()).map(area)) }
    }

    /// Film point, first hit, and one over the density.
    fn begin(&self, sensor: &Sensor<'_>, numbers: &mut Sequence) -> Option<(DVec2, Hit, f64)> {
        let Sensor { paths, film, frame } = *sensor;
        let scene = paths.scene;
        let (choice, which, pair) = (numbers.one(), numbers.one(), numbers.pair());
        let origin = frame.origin.value();
        let by_area = if self.moving.total() > 0.0 { BY_AREA } else { 0.0 };
        let (low, high) = film.bounds();
        let drawn = (choice < by_area).then(|| self.moving.at(which).index as u32);
        let at = match drawn {
            Some(triangle) => {
                let root = pair[0].sqrt();
                let [a, b, c] = scene.corners(triangle);
                let x = a * (1.0 - root) + b * (root * (1.0 - pair[1])) + c * (root * pair[1]);
                if (x - origin).dot(frame.forward.value()) <= 0.0 {
                    return None;
                }
                DVec2::from(film.project(&frame, Vec3::constant(x)))
            }
            None => low + (high - low) * DVec2::from(pair),
        };
        film.cell(at)?;
        let direction = film.direction(&frame, [at.x, at.y]).value();
        let hit = scene.closest(origin, direction, None)?;
        if drawn.is_some_and(|triangle| hit.surface != Surface::Triangle(triangle)) {
            return None;
        }
        let mut density = (1.0 - by_area) / (high - low).element_product();
        if let Surface::Triangle(seen) = hit.surface
            && by_area > 0.0
            && self.moving.weight(seen as usize) > 0.0
        {
            let x = Vertex { position: origin + direction * hit.distance, surface: hit.surface };
            density += by_area / (self.moving.total() * sensor.film_area(&x));
        }
        Some((at, hit, 1.0 / density))
    }

    /// Calls back with every shading point of a path. The subpath's weight is Π f cos θ divided by the
    /// density, for all but the last point, which has not reflected yet.
    pub(in crate::gradient::curve) fn each(
        &self,
        numbers: &mut Sequence,
        f: impl FnMut(&CameraSubpath<'_>, &Shading<'_, f64>, &mut Sequence),
    ) {
        let sensor = self.sensor.through(numbers);
        if let Some((at, hit, area)) = self.begin(&sensor, numbers) {
            self.follow(&sensor, at, hit, DVec3::splat(area), numbers, f);
        }
    }

    fn follow(
        &self,
        sensor: &Sensor<'_>,
        at: DVec2,
        hit: Hit,
        mut throughput: DVec3,
        numbers: &mut Sequence,
        mut f: impl FnMut(&CameraSubpath<'_>, &Shading<'_, f64>, &mut Sequence),
    ) {
        let Sensor { paths, film, frame } = *sensor;
        let scene = paths.scene;
        let plain = Plain { scene };
        let mut origin = frame.origin.value();
        let mut direction = film.direction(&frame, [at.x, at.y]).value();
        let mut vertices: Vec<Vertex> = vec![];
        let mut next = Some(hit);
        while let Some(hit) = next {
            let (o, d) = (Vec3::constant(origin), Vec3::constant(direction));
            let point = SurfacePoint::new(scene, &plain, o, d, hit.surface, hit.distance);
            let Some(shading) = point.shading(scene, &plain) else { return };
            origin = point.position.value();
            vertices.insert(0, Vertex { position: origin, surface: hit.surface });
            f(&CameraSubpath { film: &film, at, vertices: &vertices, weight: throughput }, &shading, numbers);
            if vertices.len() >= self.longest {
                return;
            }
            if vertices.len() > 2 {
                let survival = throughput.max_element().clamp(0.0, SURVIVAL);
                if numbers.one() >= survival {
                    return;
                }
                throughput /= survival;
            }
            let (c, [a, b]) = (numbers.one(), numbers.pair());
            let Some(Bounce::Smooth(sampled)) = shading.sample([a, b, c]) else { return };
            let Rgb(reflected) = shading.evaluate(Vec3::constant(sampled.direction));
            throughput *= DVec3::from_array(reflected.map(Number::value)) / sampled.density;
            if throughput == DVec3::ZERO {
                return;
            }
            direction = sampled.direction;
            next = scene.closest(origin, direction, Some(hit.surface));
        }
    }
}

/// Whether a triangle reflects light.
pub(in crate::gradient::curve) fn reflects(scene: &Scene, triangle: u32) -> bool {
    let material = scene.material_of(Surface::Triangle(triangle));
    parts(&scene.description.materials, material).into_iter().any(|part| {
        let bsdf = &scene.description.materials[part].bsdf;
        !bsdf.is_scaled() || *bsdf.reflectance() != Reflectance::Constant(DVec3::ZERO)
    })
}
