//! Tests that no ray passes between adjacent triangles.

use flatland::random::{open01, stream};
use glam::DVec3;

use super::meshes::{Mesh, cube, direction, icosphere, rock, uniform};
use crate::geometry::{Accelerator, Ray};

/// A point on an edge (even `i`) or a vertex (odd `i`) of a random triangle.
fn target(mesh: &Mesh, i: usize, rng: &mut flatland::random::Stream) -> DVec3 {
    let [a, b, _] = mesh.corners((open01(rng) * mesh.triangles.len() as f64) as usize);
    if i.is_multiple_of(2) { a.lerp(b, open01(rng)) } else { a }
}

fn unbounded(origin: DVec3, direction: DVec3) -> Ray {
    Ray { origin, direction, near: 0.0, far: f64::INFINITY, from: None }
}

/// Number of rays that miss a mesh that is star-shaped around `centre` with radius between 0.3 and 2 `scale`,
/// when aimed at its edges and vertices from inside and outside.
fn lost(mesh: &Mesh, centre: DVec3, scale: f64, count: usize) -> usize {
    let accelerator = Accelerator::build(&mesh.positions, &mesh.triangles);
    let mut rng = stream(5, &[]);
    (0..count)
        .filter(|&i| {
            let to = target(mesh, i / 2, &mut rng);
            let offset = if i.is_multiple_of(2) {
                0.2 * scale * direction(&mut rng)
            } else {
                // From outside, the ray goes on to the inside: the target is on the near side.
                (to - centre) + scale * (to - centre).normalize() + 0.1 * scale * direction(&mut rng)
            };
            let origin = centre + offset;
            let ray = unbounded(origin, (to - origin).normalize());
            let hit = accelerator.closest(&ray);
            hit.is_none() || !accelerator.occluded(&ray)
        })
        .count()
}

#[test]
fn a_million_rays_at_edges_and_vertices_hit() {
    let mut rng = stream(6, &[]);
    for mesh in [icosphere(5), rock(5, &mut rng)] {
        assert_eq!(lost(&mesh, DVec3::ZERO, 1.0, 1_000_000), 0);
    }
}

#[test]
fn at_every_scale_and_far_from_the_origin() {
    let mut rng = stream(7, &[]);
    for mesh in [icosphere(4), rock(3, &mut rng)] {
        for scale in [1e-6, 1e6, 1e-30, 1e30] {
            assert_eq!(lost(&mesh.map(|p| scale * *p), DVec3::ZERO, scale, 100_000), 0, "{scale}");
        }
        for offset in [DVec3::splat(1e6), DVec3::new(-1e6, 3.0, 1e5)] {
            assert_eq!(lost(&mesh.map(|p| *p + offset), offset, 1.0, 100_000), 0, "{offset}");
        }
    }
}

#[test]
fn slivers_are_no_gaps() {
    // Vertices compressed along z by a factor of 10⁶, which makes needles near the equator.
    let mut rng = stream(8, &[]);
    let mesh = rock(4, &mut rng);
    let turn = glam::DQuat::from_rotation_x(0.3) * glam::DQuat::from_rotation_y(1.1);
    let flat = mesh.map(|p| turn * DVec3::new(p.x, p.y, 1e-6 * p.z));
    let accelerator = Accelerator::build(&flat.positions, &flat.triangles);
    for i in 0..300_000 {
        let to = target(&flat, i, &mut rng);
        // From the inside: the origin is the centre moved within the flattened body.
        let origin =
            turn * (0.2 * DVec3::new(uniform(&mut rng), uniform(&mut rng), 1e-6 * uniform(&mut rng)));
        assert!(accelerator.closest(&unbounded(origin, (to - origin).normalize())).is_some(), "{i}");
    }
}

#[test]
fn axis_aligned_rays_hit_axis_aligned_boxes() {
    let mesh = cube();
    let accelerator = Accelerator::build(&mesh.positions, &mesh.triangles);
    // Along every axis through centres, edges and corners of the sides; from inside, from the surface and
    // from outside.
    for axis in 0..3 {
        for (a, b) in [(0.0, 0.0), (0.3, 0.3), (-1.0, 0.2), (1.0, 1.0), (-1.0, 1.0), (1.0, 0.0), (0.1, -0.4)]
        {
            for start in [-3.0, -1.0, 0.0, 0.5] {
                for sign in [-1.0, 1.0] {
                    let mut origin = DVec3::splat(a);
                    origin[(axis + 1) % 3] = b;
                    origin[axis] = sign * start;
                    let mut direction = DVec3::ZERO;
                    direction[axis] = sign;
                    let hit = accelerator.closest(&unbounded(origin, direction)).expect("hits");
                    let expected = if start < -1.0 { -1.0 - start } else { 1.0 - start };
                    assert_eq!(hit.distance, expected, "{origin} {direction}");
                    let negative_zero = Ray { direction: -(-direction), ..unbounded(origin, direction) };
                    assert!(accelerator.occluded(&negative_zero));
                }
            }
        }
    }
}

#[test]
fn a_ray_that_leaves_a_surface_does_not_return_to_it() {
    // Origins at hit points, on their triangle and on the edges to its neighbours, outward: a convex body is
    // not hit again.
    let mesh = icosphere(4);
    let accelerator = Accelerator::build(&mesh.positions, &mesh.triangles);
    let mut rng = stream(9, &[]);
    for _ in 0..200_000 {
        let hit = accelerator.closest(&unbounded(DVec3::ZERO, direction(&mut rng))).expect("inside");
        let [a, b, c] = mesh.corners(hit.triangle as usize);
        let [u, v, w] = hit.barycentric;
        let origin = u * a + v * b + w * c;
        let normal = (b - a).cross(c - a).normalize();
        let outward = normal * normal.dot(origin).signum();
        let slanted = (outward + 0.9 * direction(&mut rng)).normalize();
        let ray = Ray { near: 1e-12, from: Some(hit.triangle), ..unbounded(origin, slanted) };
        assert_eq!(accelerator.closest(&ray), None);
    }
}
