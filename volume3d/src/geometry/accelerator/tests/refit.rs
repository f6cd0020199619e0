//! Tests that a refitted hierarchy gives the same hits as a new one.

use flatland::random::{Stream, open01, stream};
use glam::DVec3;
use rayon::prelude::*;

use super::exact::{meshes, one_by_one, random_ray};
use super::meshes::{Mesh, in_cube, rock};
use crate::geometry::Accelerator;

/// Deformations of meshes: rounding, new positions for all vertices, other scales, and collapse to a plane or
/// a point.
fn deformations() -> Vec<fn(&Mesh, &mut Stream) -> Mesh> {
    vec![
        |mesh, rng| mesh.map(|p| *p * (1.0 + 1e-12 * open01(rng))),
        |mesh, rng| mesh.map(|p| *p + 0.05 * in_cube(rng)),
        |mesh, rng| mesh.map(|_| in_cube(rng)),
        |mesh, _| mesh.map(|p| 1e5 * *p + DVec3::new(1e7, 0.0, -3.0)),
        |mesh, _| mesh.map(|p| DVec3::new(p.x, p.y, 0.5)),
        |mesh, _| mesh.map(|_| DVec3::ONE),
    ]
}

#[test]
fn hits_after_a_refit_are_those_of_all_triangles_one_by_one() {
    for (index, mesh) in meshes().iter().enumerate() {
        let mut accelerator = Accelerator::build(&mesh.positions, &mesh.triangles);
        for (which, deform) in deformations().into_iter().enumerate() {
            let moved = deform(mesh, &mut stream(31, &[index as u64, which as u64]));
            accelerator.refit(&moved.positions, &moved.triangles);
            (0..1_000_usize).into_par_iter().for_each(|i| {
                let ray = random_ray(&moved, i, &mut stream(32, &[i as u64]));
                let expected = one_by_one(&moved, &ray);
                assert_eq!(accelerator.closest(&ray), expected, "{index} {which} {i} {ray:?}");
                assert_eq!(accelerator.occluded(&ray), expected.is_some(), "{index} {which} {i} {ray:?}");
            });
        }
    }
}

#[test]
fn the_hierarchy_is_kept_under_small_motions_and_built_anew_once_rays_would_cost_half_as_much_again() {
    let mesh = rock(5, &mut stream(33, &[]));
    let mut accelerator = Accelerator::build(&mesh.positions, &mesh.triangles);
    let (order, cost) = (accelerator.tree.triangles.clone(), accelerator.cost);
    let turned = mesh.map(|p| DVec3::new(p.y, p.z, p.x) * 3.0);
    accelerator.refit(&turned.positions, &turned.triangles);
    assert_eq!((&accelerator.tree.triangles, accelerator.cost), (&order, cost));
    accelerator.refit(&mesh.positions, &mesh.triangles);
    let new = Accelerator::build(&mesh.positions, &mesh.triangles);
    assert_eq!(accelerator.tree.leaf_size, new.tree.leaf_size);
    let mut rng = stream(34, &[]);
    let scattered = mesh.map(|p| *p + 0.3 * in_cube(&mut rng));
    accelerator.refit(&scattered.positions, &scattered.triangles);
    assert_ne!(accelerator.tree.triangles, order);
}
