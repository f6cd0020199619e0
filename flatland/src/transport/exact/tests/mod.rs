//! Tests of the closed forms against tracing, quadrature, central differences and known constants.

mod extremes;
mod limits;
mod pixels;
mod radiosity;
mod surfaces;

use glam::DVec2;

use super::Surface;
use crate::plane::Filter;
use crate::quadrature::adaptive;
use crate::random::{Stream, open01, stream};
use crate::transport::{
    Camera, CameraTangent, Film, Gloss, Material, MaterialTangent, Shape, Tangent, World,
};

fn between(rng: &mut Stream, low: f64, high: f64) -> f64 {
    low + (high - low) * open01(rng)
}

fn point(rng: &mut Stream, reach: f64) -> DVec2 {
    DVec2::new(between(rng, -reach, reach), between(rng, -reach, reach))
}

fn random_material(rng: &mut Stream, glossy: bool) -> Material {
    let kind = open01(rng);
    if kind < 0.3 {
        return Material::diffuse(0.5 * open01(rng)).with_emission(between(rng, 0.5, 3.0));
    }
    let gloss = Gloss { strength: between(rng, 0.1, 0.5), width: between(rng, 0.02, 1.0) };
    let reflectance = between(rng, 0.1, 0.5);
    Material { reflectance, gloss: (glossy && kind < 0.65).then_some(gloss), emission: 0.0 }
}

fn random_shape(rng: &mut Stream, glossy: bool) -> Shape {
    let material = random_material(rng, glossy);
    let centre = point(rng, 3.0);
    if open01(rng) < 0.4 {
        let to = centre + point(rng, 1.5);
        return Shape::open([centre, to], material);
    }
    let corners = 3 + (3.0 * open01(rng)) as usize;
    let (radius, phase) = (between(rng, 0.2, 0.9), between(rng, 0.0, 6.0));
    let corner = |k: usize| {
        let angle = phase + std::f64::consts::TAU * k as f64 / corners as f64;
        centre + radius * DVec2::from_angle(angle)
    };
    Shape::closed((0..corners).map(corner), material)
}

/// Disjoint polygons and segments: shapes that intersect others are redrawn.
fn random_world(rng: &mut Stream, shapes: usize, glossy: bool) -> World {
    let environment = if open01(rng) < 0.5 { between(rng, 0.1, 1.0) } else { 0.0 };
    let mut kept: Vec<Shape> = vec![];
    while kept.len() < shapes {
        let mut tried = kept.clone();
        tried.push(random_shape(rng, glossy));
        if World::new(environment, tried.clone()).is_ok() {
            kept = tried;
        }
    }
    World::new(environment, kept).expect("checked")
}

fn random_camera(rng: &mut Stream, filter: Filter) -> Camera {
    let angle = between(rng, -3.0, 3.0);
    let position = point(rng, 0.5) - between(rng, 3.0, 6.0) * DVec2::from_angle(angle);
    Camera { position, angle, field_of_view: between(rng, 0.6, 1.6), film: Film { pixels: 6, filter } }
}

fn random_vertices(rng: &mut Stream, world: &World) -> Tangent {
    let mut change = Tangent::none(world);
    change.vertices.iter_mut().for_each(|v| *v = point(rng, 1.0));
    change
}

fn random_camera_tangent(rng: &mut Stream, world: &World) -> Tangent {
    let position = point(rng, 1.0);
    let (angle, field_of_view) = (between(rng, -0.5, 0.5), between(rng, -0.5, 0.5));
    Tangent::of_camera(world, CameraTangent { position, angle, field_of_view })
}

fn random_materials(rng: &mut Stream, world: &World) -> Tangent {
    let mut change = Tangent::none(world);
    for (material, shape) in change.materials.iter_mut().zip(world.shapes()) {
        let rate = |rng: &mut Stream| between(rng, -1.0, 1.0);
        // An emission of 0 cannot decrease, and the central difference needs both sides.
        let emission = if shape.material().emission > 0.0 { rate(rng) } else { 0.0 };
        let width = shape.material().gloss.map_or(0.0, |g| g.width) * rate(rng);
        *material = MaterialTangent {
            reflectance: rate(rng),
            emission,
            gloss_strength: rate(rng),
            gloss_width: width,
        };
    }
    change.environment = if world.environment() > 0.0 { between(rng, -1.0, 1.0) } else { 0.0 };
    change
}

/// L after two bounces at a point of a segment: quadrature over directions of the closed form for one bounce,
/// in pieces that shrink geometrically in `levels` steps towards the ends of each visible interval.
fn two_bounces(world: &World, segment: usize, s: f64, outgoing: DVec2, levels: i32, tolerance: f64) -> f64 {
    let surface = Surface::new(world, segment, s, outgoing);
    let (view, material, mut gathered) = (*surface.view(), world.material(segment), 0.0);
    for interval in surface.intervals() {
        let radiance = |angle: f64| {
            let direction = angle.cos() * view.axis() + angle.sin() * view.tangent();
            let value = interval.seen.map_or(world.environment(), |seen| {
                let other = &world.segments()[seen];
                let from = other.start - view.point();
                let s = -direction.perp_dot(from) / direction.perp_dot(other.edge);
                Surface::new(world, seen, s.clamp(0.0, 1.0), -direction).radiance()
            });
            ([value * angle.cos()], value * angle.cos())
        };
        let [a, b] = [interval.start.angle, interval.end.angle];
        let offsets = (0..levels).map(|k| 0.5 * (b - a) * 0.4_f64.powi(k));
        let mut ends: Vec<f64> = offsets.flat_map(|o| [a + o, b - o]).chain([a, b]).collect();
        ends.sort_unstable_by(f64::total_cmp);
        let pieces: Vec<[f64; 2]> = ends.windows(2).map(|w| [w[0], w[1]]).collect();
        gathered += adaptive(&pieces, radiance, tolerance).value[0];
    }
    material.emission + 0.5 * material.reflectance * gathered
}
