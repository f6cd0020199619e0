//! Camera paths, without derivatives: the shading points from which edges are looked for.

use glam::{DVec2, DVec3};

use super::sensor::{Chain, Sensor, Vertex};
use crate::calculus::{Number, Rgb, Vec3};
use crate::path::{Plain, Sequence, Shading, SurfacePoint};

/// Paths are continued with no more than this probability where there is no limit to their length.
const SURVIVAL: f64 = 0.95;

/// Calls with every shading point of a path from a uniform point of the film, of at most `longest` segments. The
/// weight of the chain is Π f cos θ over the density of all but the last point, which is yet to reflect.
pub(super) fn walk(
    sensor: &Sensor<'_>,
    longest: usize,
    numbers: &mut Sequence,
    mut f: impl FnMut(&Chain<'_>, &Shading<'_, f64>, &mut Sequence),
) {
    let Sensor { paths, film, frame } = *sensor;
    let scene = paths.scene;
    let plain = Plain { scene };
    let (low, high) = film.bounds();
    let at = low + (high - low) * DVec2::from(numbers.pair());
    if film.cell(at).is_none() {
        return;
    }
    let area = (high - low).element_product();
    let mut throughput = DVec3::ONE;
    let mut origin = frame.origin.value();
    let mut direction = film.direction(&frame, [at.x, at.y]).value();
    let mut from = None;
    let mut vertices: Vec<Vertex> = vec![];
    while let Some(hit) = paths.closest(origin, direction, from) {
        let (o, d) = (Vec3::constant(origin), Vec3::constant(direction));
        let point = SurfacePoint::new(scene, &plain, o, d, hit.triangle);
        let Some(shading) = point.shading(scene, &plain) else { return };
        (origin, from) = (point.position.value(), Some(hit.triangle));
        vertices.insert(0, Vertex { position: origin, triangle: hit.triangle });
        f(&Chain { at, vertices: &vertices, weight: throughput * area }, &shading, numbers);
        if vertices.len() >= longest {
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
        let Some(sampled) = shading.sample([a, b, c]) else { return };
        let Rgb(reflected) = shading.evaluate(Vec3::constant(sampled.direction));
        throughput *= DVec3::from_array(reflected.map(Number::value)) / sampled.density;
        if throughput == DVec3::ZERO {
            return;
        }
        direction = sampled.direction;
    }
}
