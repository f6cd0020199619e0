//! Warped-area sampling in space in two hundred lines, to be read, not used.
//!
//! A pixel is I = ∫ h(u) L(u; θ) du over film points u. L jumps at silhouettes, which move with θ, so dI/dθ
//! is not ∫ h dL/dθ du. Warped-area sampling (Bangaru, Li and Durand 2020) moves the samples with a field V
//! of velocities of directions, continuous, and equal to the silhouettes' velocity at silhouettes. With F = h
//! L |du/dω|, over directions ω,
//!
//! ```text
//! dI/dθ = ∫ ∂F/∂θ + ∇·(V F) dω = ∫ d/dε F(ω + ε V; θ + ε) (1 + ε ∇·V) dω        at ε = 0
//! ```
//!
//! and numbers that carry d/dε evaluate it. The light that a surface reflects is such an integral again, with
//! a field of its own.
//!
//! Here: direct light, diffuse surfaces, one channel, fields of auxiliary rays. `basic/world.rs` holds
//! triangles and rays. The library has other fields, materials and strategies; `tests/tests/basic.rs`
//! compares the two.

use std::f64::consts::{PI, TAU};

use flatland::calculus::{Number as _, Vec3};
use flatland::random::{Stream, open01, stream};
use glam::DVec3;
use volume3d::scene::{Description, Scene};

use world::{D, Eye, Surface, moving, rate};
pub(crate) use world::{World, table};

#[path = "basic/world.rs"]
mod world;

/// γ of the weights: the field is consistent above 1/p + ½ for a boundary function B ~ sᵖ; p is 2 here.
const GAMMA: f64 = 1.5;
/// a of the auxiliary rays' density: below 1 they crowd around u, where the weights are large.
const CROWDING: f64 = 0.3;
/// Pairs of auxiliary rays, and the probability of each doubling: with ½ or more the cost is not finite.
const PAIRS: usize = 2;
const DOUBLING: f64 = 0.3;
/// The kernel's concentration κ: on the film, for a pixel's solid angle 1; and for the light at a surface.
const FILM_KAPPA: f64 = 44.0;
const LIGHT_KAPPA: f64 = 100.0;

/// The finding of one auxiliary ray.
struct Auxiliary {
    /// Of the hit, as a direction.
    velocity: DVec3,
    /// w over the ray's density.
    weight: f64,
    /// ∇ ln w.
    slope: DVec3,
}

/// (V, ∇·V) at the direction u.
fn field(world: &World, eye: Eye, u: DVec3, kappa: f64, rng: &mut Stream) -> (DVec3, f64) {
    // A quotient of sums is biased at any number of rays. The differences between 2ʲ n rays and both halves
    // of them add up to its limit; Russian roulette draws one of them.
    let level = (open01(rng).ln() / DOUBLING.ln()) as u32;
    let probability = (1.0 - DOUBLING) * DOUBLING.powi(level as i32);
    let rays: Vec<_> = (0..PAIRS << level).flat_map(|_| auxiliary_pair(world, eye, u, kappa, rng)).collect();
    let (mut v, mut divergence) = quotient(u, &rays[..2 * PAIRS]);
    if level > 0 {
        let (first, second) = rays.split_at(rays.len() / 2);
        for (part, factor) in [(&rays[..], 1.0), (first, -0.5), (second, -0.5)] {
            let (a, b) = quotient(u, part);
            v += a * (factor / probability);
            divergence += b * (factor / probability);
        }
    }
    (v, divergence)
}

/// V = P Σ w v/Σ w, where P projects across u, and ∇·V.
fn quotient(u: DVec3, rays: &[Auxiliary]) -> (DVec3, f64) {
    let sum: f64 = rays.iter().map(|a| a.weight).sum();
    let mean: DVec3 = rays.iter().map(|a| a.slope * (a.weight / sum)).sum();
    let v: DVec3 = rays.iter().map(|a| a.velocity * (a.weight / sum)).sum();
    let divergence: f64 = rays.iter().map(|a| a.weight / sum * (a.slope - mean).dot(a.velocity)).sum();
    (v - v.dot(u) * u, divergence - 2.0 * u.dot(v))
}

/// Rays on opposite sides of u, at x = κ (1 − cos) from it, of density e^−x (1 − e^−x)^(a−1).
///
/// The weight is w = (eˣ − 1 + B)^−γ. B is 0 at the edges of the face that is hit and 1 far from them: near a
/// silhouette, rays that hit the face that ends there get all the weight, and V is that face's velocity.
fn auxiliary_pair(world: &World, eye: Eye, u: DVec3, kappa: f64, rng: &mut Stream) -> [Auxiliary; 2] {
    let within = open01(rng).powf(1.0 / CROWDING) * -(-2.0 * kappa).exp_m1();
    let x = -(-within).ln_1p();
    let versine = x / kappa;
    let (s, t) = u.any_orthonormal_pair();
    let (sin, cos) = (TAU * open01(rng)).sin_cos();
    let across = (versine * (2.0 - versine)).sqrt() * (cos * s + sin * t);
    [across, -across].map(|across| {
        let direction = u - versine * u + across;
        let (mut velocity, mut b) = (DVec3::ZERO, 1.0);
        if let Some(hit) = world.trace(eye, direction) {
            velocity = (world.velocity(&hit) - eye.rate) / hit.distance;
            b = (0.4 * world.distance_to_edge(eye, direction, &hit)).powi(2) * kappa;
        }
        let q = x.exp_m1() + b.min(1.0);
        let weight = q.powf(-GAMMA) * x.exp() * within.powf(1.0 - CROWDING);
        Auxiliary { velocity, weight, slope: across * (GAMMA * kappa * x.exp() / q) }
    })
}

/// One sample of the radiance along a moving ray. Without warps of the light's directions, shadows do not
/// move.
fn radiance(world: &World, eye: Eye, direction: Vec3<D>, warp_light: bool, rng: &mut Stream) -> D {
    let Some(hit) = world.trace(eye, direction.value()) else { return D::constant(0.0) };
    let Surface { reflectance, emitted, point, normal } = world.surface(&hit, eye, direction);
    let eye = Eye { at: point.value(), rate: rate(point), on: Some(hit.triangle) };
    // A point of a light, uniform by area, in the direction ω.
    let light = world.lights[(open01(rng) * world.lights.len() as f64) as usize];
    let [a, b, c] = world.corners(light).map(Vec3::value);
    let to = a + open01(rng).sqrt() * (b - a + open01(rng) * (c - b)) - eye.at;
    let (omega, area) = (to.normalize(), 0.5 * (b - a).cross(c - a));
    let Some(seen) = world.trace(eye, omega) else { return D::constant(emitted) };
    let warp = if warp_light { field(world, eye, omega, LIGHT_KAPPA, rng) } else { (DVec3::ZERO, 0.0) };
    let warped = moving(omega, warp.0);
    let incident = world.surface(&seen, eye, warped).emitted;
    // One over the density of ω, which is held fixed.
    let solid_angle = world.lights.len() as f64 * area.dot(omega).abs() / to.length_squared();
    let reflected = normal.dot(warped).positive() * D::new(1.0, [warp.1]);
    D::constant(emitted) + reflected * (reflectance / PI * incident * solid_angle)
}

/// Value and derivative of one sample of a pixel with a tent filter of radius 1, less `control` for the
/// radiance.
fn sample(
    (world, scene): (&World, &Scene),
    [px, py]: [usize; 2],
    control: f64,
    warp_light: bool,
    rng: &mut Stream,
) -> [f64; 2] {
    let Description { camera, film, .. } = scene.description();
    let (width, height) = (film.width as f64, film.height as f64);
    let focal = 0.5 * width / (0.5 * camera.field_of_view).tan();
    // A film point, uniform over the filter's support (density ¼), and the field at its direction.
    let centre = [px as f64 + 0.5 - 0.5 * width, 0.5 * height - py as f64 - 0.5];
    let [x, y] = centre.map(|c| (c + 2.0 * open01(rng) - 1.0) / focal);
    let direction = (camera.forward + x * camera.right + y * camera.up).normalize();
    let eye = Eye { at: camera.origin, rate: DVec3::ZERO, on: None };
    let (v, divergence) = field(world, eye, direction, FILM_KAPPA * focal * focal, rng);
    // The film point that belongs to the moving direction, and |du/dω| = f²/cos³.
    let direction = moving(direction, v);
    let axes = [camera.right, camera.up, camera.forward];
    let [right, up, depth] = axes.map(|axis| direction.dot(Vec3::constant(axis)));
    let tent = |at: D, centre: f64| D::constant(1.0) - (at / depth * focal - D::constant(centre)).abs();
    let spread = D::constant(depth.value()) / depth;
    let jacobian = spread * spread * spread * D::new(1.0, [divergence]);
    let radiance = radiance(world, eye, direction, warp_light, rng) - D::constant(control);
    let value = tent(right, centre[0]) * tent(up, centre[1]) * jacobian * radiance * 4.0;
    [value.value(), value.slope()]
}

/// dI/dθ of a pixel. Its approximate radiance is a control variate: ∫ ∇·(V h |du/dω|) dω = 0.
pub(crate) fn pixel(
    scene: (&World, &Scene),
    at: [usize; 2],
    samples: usize,
    warp_light: bool,
    seed: u64,
) -> f64 {
    let rng = &mut stream(seed, &at.map(|i| i as u64));
    let control: f64 = (0..16).map(|_| sample(scene, at, 0.0, false, rng)[0] / 16.0).sum();
    (0..samples).map(|_| sample(scene, at, control, warp_light, rng)[1] / samples as f64).sum()
}

fn main() {
    let (scene, change) = table();
    let world = World::new(&scene, &change);
    println!("dI/dθ of every pixel, in hundredths, as the block moves to the right:");
    for y in 0..scene.description().film.height {
        for x in 0..scene.description().film.width {
            print!("{:5.0}", 100.0 * pixel((&world, &scene), [x, y], 10_000, true, 1));
        }
        println!();
    }
}
