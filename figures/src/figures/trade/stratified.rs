//! Bias of a warp, accurate to a few parts in a thousand.

use flatland::plane::fields::scene_stencil;
use flatland::random::{open01, stream};
use flatland::warp::{LinearField as _, Warp};
use glam::DVec2;
use rayon::prelude::*;

use super::regression::{Bias, regress};
use super::target::{Ask, SIDE, Target};

/// Number of cells per task.
const TASK: usize = 64;

/// The warp of a bias and the concentration of its kernel, in 1/pixel².
#[derive(Clone, Copy)]
pub(super) struct Kernel {
    pub(super) warp: Warp,
    pub(super) kappa: f64,
}

impl Target {
    /// The bias of the area integral with a warp of auxiliary rays, from `batches` independent means
    /// of one sample in every cell of a partition that is finer towards silhouettes.
    ///
    /// Stratified samples that serve all pixels at once have the same mean as the method's own and far less
    /// variance, which would otherwise mask the bias of hundreds of rays.
    pub(super) fn bias(&self, kernel: Kernel, batches: usize, seed: u64) -> Bias {
        let edges: Vec<[DVec2; 2]> =
            self.scene.edges().map(|(_, edge)| edge.map(|v| self.scene.vertices()[v])).collect();
        let cells = graded(self.film.extent(), &edges, kernel.kappa);
        let tasks: Vec<&[Cell]> = cells.chunks(TASK).collect();
        let parts: Vec<Vec<f64>> = (0..batches * tasks.len())
            .into_par_iter()
            .map(|i| self.part(kernel, tasks[i % tasks.len()], (seed, i as u64)))
            .collect();
        let sum = |parts: &[Vec<f64>]| {
            (0..self.exact.len()).map(|i| parts.iter().fold(0.0, |sum, part| sum + part[i])).collect()
        };
        let estimates: Vec<Vec<f64>> = parts.chunks(tasks.len()).map(sum).collect();
        regress(&self.exact, &estimates)
    }

    /// Contribution of one sample in each of the cells to every component.
    fn part(&self, kernel: Kernel, cells: &[Cell], (seed, address): (u64, u64)) -> Vec<f64> {
        let mut rng = stream(seed, &[address]);
        let mut out = vec![0.0; self.exact.len()];
        let mut vertices = vec![DVec2::ZERO; self.scene.vertices().len()];
        for cell in cells {
            let u = cell.low + cell.size * DVec2::new(open01(&mut rng), open01(&mut rng));
            let stencil = scene_stencil(&self.scene, &kernel.warp, kernel.kappa, u, &mut rng);
            // ∇·(V h f), f constant except for its discontinuity; less ½ everywhere, since ∫ ∇·(V h) du = 0.
            let f = self.scene.value(self.scene.hit(u).as_ref(), u).x - 0.5;
            let weight = cell.size.x * cell.size.y * f;
            // The pixels' (∇h, h) times the weight.
            let pixels = (0..SIDE * SIDE).map(|i| {
                let centre = self.film.centre(i % SIDE, i / SIDE);
                (weight * self.film.filter_gradient(centre, u), weight * self.film.filter_value(centre, u))
            });
            match &self.ask {
                Ask::Pixels { velocities, .. } => {
                    let v = stencil.field(|point| point.map_or(DVec2::ZERO, |p| p.velocity(velocities)));
                    for (value, (a, b)) in out.iter_mut().zip(pixels) {
                        *value += a.dot(v.value) + b * v.divergence;
                    }
                }
                Ask::Vertices { adjoint } => {
                    let (mut a, mut b) = (DVec2::ZERO, 0.0);
                    for (delta, pixel) in adjoint.pixels().iter().zip(pixels) {
                        a += delta.x * pixel.0;
                        b += delta.x * pixel.1;
                    }
                    stencil.scatter(a, b, |point, covector| {
                        if let Some(point) = point {
                            point.scatter(covector, |vertex, part| vertices[vertex] += part);
                        }
                    });
                }
            }
        }
        if matches!(self.ask, Ask::Vertices { .. }) {
            out = vertices.iter().flat_map(DVec2::to_array).collect();
        }
        out
    }
}

/// Sides of cells, in units of the kernel's width, at the edges.
const FINEST: f64 = 0.36;
/// Sides of cells relative to their distance from the edges.
const GRADING: f64 = 0.6;
/// The largest side.
const COARSEST: f64 = 0.3;

/// A rectangle from its least corner.
#[derive(Clone, Copy, Debug)]
struct Cell {
    low: DVec2,
    size: DVec2,
}

/// A quadtree over the box from `low` to `high`, for a kernel of concentration `kappa`.
fn graded((low, high): (DVec2, DVec2), edges: &[[DVec2; 2]], kappa: f64) -> Vec<Cell> {
    let finest = FINEST / kappa.sqrt();
    let mut done = vec![];
    let mut open = vec![Cell { low, size: high - low }];
    while let Some(cell) = open.pop() {
        let centre = cell.low + 0.5 * cell.size;
        let distance = edges.iter().map(|&edge| distance(centre, edge)).fold(f64::INFINITY, f64::min);
        if cell.size.max_element() <= (GRADING * distance).clamp(finest, COARSEST.max(finest)) {
            done.push(cell);
            continue;
        }
        let size = 0.5 * cell.size;
        for corner in [DVec2::ZERO, DVec2::X, DVec2::Y, DVec2::ONE] {
            open.push(Cell { low: cell.low + corner * size, size });
        }
    }
    done
}

fn distance(u: DVec2, [a, b]: [DVec2; 2]) -> f64 {
    let along = b - a;
    let t = ((u - a).dot(along) / along.length_squared()).clamp(0.0, 1.0);
    u.distance(a + t * along)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_fill_the_box_and_are_finest_at_edges() {
        let cells = graded((DVec2::ZERO, DVec2::ONE), &[[DVec2::splat(0.2), DVec2::splat(0.7)]], 100.0);
        let area: f64 = cells.iter().map(|cell| cell.size.x * cell.size.y).sum();
        assert!((area - 1.0).abs() < 1e-12);
        let size_at = |u: DVec2| {
            let inside = |cell: &&Cell| u.cmpge(cell.low).all() && u.cmplt(cell.low + cell.size).all();
            cells.iter().find(inside).map(|cell| cell.size.x)
        };
        assert!(size_at(DVec2::splat(0.5)) < size_at(DVec2::new(0.95, 0.05)));
    }
}
