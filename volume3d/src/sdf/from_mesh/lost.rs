//! Parts of a mesh that the grid does not resolve.

use flatland::sdf::Sdf as _;
use glam::DVec3;
use rayon::prelude::*;

use crate::geometry::Mesh;
use crate::sdf::Grid;

/// Largest number of test points of a triangle along each edge.
const MOST: usize = 256;

/// Fraction of the area around which φ has one sign at all nodes, tested at points no farther apart than the
/// nodes.
///
/// A flat piece of surface has nodes on both sides at its own cell's corners. At corners and edges that point
/// into a cell, nodes one cell farther away do; where even those have one sign, the grid has no surface
/// within a cell.
pub(super) fn part(mesh: &Mesh, grid: &Grid) -> f64 {
    let step = grid.spacing().min_element();
    // A spline does not interpolate its nodes.
    let values: Vec<f64> =
        (0..grid.nodes().len()).into_par_iter().map(|index| grid.value(grid.position(index))).collect();
    let sums = mesh.triangles().par_iter().map(|triangle| {
        let [a, b, c] = triangle.map(|i| mesh.positions()[i as usize]);
        let area = 0.5 * (b - a).cross(c - a).length();
        let longest = a.distance(b).max(b.distance(c)).max(c.distance(a));
        let n = ((longest / step).ceil() as usize).clamp(1, MOST);
        let mut lost = 0;
        for i in 0..n {
            for j in 0..n - i {
                // Centres of the small triangles with the same orientation, and of the others.
                let at = |third: f64| {
                    let (s, t) = ((i as f64 + third) / n as f64, (j as f64 + third) / n as f64);
                    a + (b - a) * s + (c - a) * t
                };
                lost += usize::from(is_lost(grid, &values, at(1.0 / 3.0)));
                if i + j + 1 < n {
                    lost += usize::from(is_lost(grid, &values, at(2.0 / 3.0)));
                }
            }
        }
        (area, area * lost as f64 / (n * n) as f64)
    });
    // Collected first: sums in one order have the same bits on any number of threads.
    let sums: Vec<(f64, f64)> = sums.collect();
    let (area, lost) = sums.iter().fold((0.0, 0.0), |(a, b), (c, d)| (a + c, b + d));
    if area > 0.0 { lost / area } else { 0.0 }
}

fn is_lost(grid: &Grid, values: &[f64], x: DVec3) -> bool {
    let [nx, ny, nz] = grid.size();
    let cell = ((x - grid.low()) / grid.spacing()).floor();
    let range = |at: f64, n: usize| {
        let at = at.max(0.0) as usize;
        at.saturating_sub(1)..(at + 3).min(n)
    };
    let (mut inside, mut outside) = (false, false);
    for k in range(cell.z, nz) {
        for j in range(cell.y, ny) {
            for value in &values[(k * ny + j) * nx..][range(cell.x, nx)] {
                inside |= *value < 0.0;
                outside |= *value > 0.0;
            }
        }
    }
    !(inside && outside)
}
