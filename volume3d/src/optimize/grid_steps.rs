//! Smoothed steps for the nodes of an SDF grid.

use crate::sdf::{Grid, RedistanceError, Slopes, redistance};

/// Step settings for the nodes of an SDF grid in a fit.
///
/// # Smooth steps
///
/// As [`LargeSteps`](super::LargeSteps) for meshes: the gradient is divided by M, [`Adam`](super::Adam) turns
/// it into a step, and this is divided by M again, with
///
/// ```text
/// M = (I + λ L_x) (I + λ L_y) (I + λ L_z),   (L c)_i = 2 c_i − c_{i−1} − c_{i+1},
/// ```
///
/// one axis after another. The change of one node spreads over about √λ nodes. Without smoothing, steps of
/// neighbours differ by noise, slopes grow with every step, and sphere tracing takes ever more steps: from a
/// ball to a bunny, the bound on |∇φ| was 8 after 40 steps, and 2 with λ = 1, at which a step took a fourth
/// of the time with equal accuracy. Each number keeps its own step size: with
/// [`Adam::uniform`](super::Adam::uniform) it took four times as many steps.
///
/// # Distances
///
/// After a step φ is no longer a distance. [`redistance()`] restores the distance and keeps the surface of
/// the step, except that the surface cannot leave the grid, which stays [closed](Grid::closed).
///
/// # From coarse to fine
///
/// Grids of 16 cells find the rough shape in a few dozen steps; grids of 64 do not. After the steps of
/// `refine` the grid has [half the spacing](Grid::subdivided), with the same surface, Adam begins anew, and
/// steps are half as long, the same number of cells. For a [network on a grid](crate::sdf::Baked) the grid is
/// refined, and the weights and their steps stay.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct GridSteps {
    /// Smoothing weight λ, at least 0: 1 is a good start.
    pub smoothing: f64,
    /// Whether the grid is redistanced after every step.
    pub redistance: bool,
    /// The numbers of steps after which the grid is refined, in increasing order.
    pub refine: Vec<u64>,
    /// For a network on a grid, the number of steps after which rays trace [the network
    /// itself](crate::sdf::Guided): its own surface is then fitted, not that of the interpolating spline, at
    /// a hundred times the cost of a sample.
    pub finish: Option<u64>,
}

impl GridSteps {
    /// The number of refinements after `steps` steps.
    #[must_use]
    pub fn refinements(&self, steps: u64) -> usize {
        self.refine.iter().filter(|&&step| step <= steps).count()
    }

    /// Whether the network is traced directly after `steps` steps.
    #[must_use]
    pub fn is_finishing(&self, steps: u64) -> bool {
        self.finish.is_some_and(|finish| finish <= steps)
    }

    /// Whether these settings suit a network on a grid: only refinement or `finish`, no smoothing or
    /// redistancing.
    #[must_use]
    pub fn is_for_networks(&self) -> bool {
        self.smoothing == 0.0 && !self.redistance
    }

    /// M⁻¹ times a number for each node, x fastest.
    ///
    /// # Panics
    /// If the number of values is not that of the nodes.
    #[must_use]
    pub fn solve(&self, size: [usize; 3], vector: &[f64]) -> Vec<f64> {
        assert_eq!(vector.len(), size.iter().product::<usize>(), "a number for each node");
        let mut solution = vector.to_vec();
        let mut step = 1;
        for count in size {
            let ratios = ratios(self.smoothing, count);
            for lines in solution.chunks_exact_mut(step * count) {
                solve_lines(self.smoothing, &ratios, step, lines);
            }
            step *= count;
        }
        solution
    }

    /// The grid with new node values, after a step.
    pub(super) fn stepped(&self, grid: &Grid, nodes: &[f64]) -> Result<Grid, RedistanceError> {
        let nodes = nodes.to_vec();
        let grid = Grid::new(grid.interpolation(), grid.low(), grid.spacing(), grid.size(), nodes)?;
        if self.redistance { redistance(&grid.closed()?, Slopes::Overall) } else { Ok(grid) }
    }

    /// The refined grid.
    pub(super) fn refined(&self, grid: &Grid) -> Result<Grid, RedistanceError> {
        let finer = grid.subdivided()?;
        if self.redistance { redistance(&finer, Slopes::Overall) } else { Ok(finer) }
    }
}

/// Superdiagonal of I + λL after each row is divided by its pivot (Thomas algorithm).
fn ratios(lambda: f64, count: usize) -> Vec<f64> {
    let mut before = 0.0;
    (0..count)
        .map(|i| {
            let neighbours = usize::from(i > 0) + usize::from(i + 1 < count);
            let pivot = 1.0 + lambda * neighbours as f64 - lambda * before;
            before = lambda / pivot;
            before
        })
        .collect()
}

/// Solves all lines along one axis, whose nodes are `step` apart, side by side.
fn solve_lines(lambda: f64, ratios: &[f64], step: usize, lines: &mut [f64]) {
    let count = ratios.len();
    for i in 0..count {
        let neighbours = usize::from(i > 0) + usize::from(i + 1 < count);
        let before = if i > 0 { ratios[i - 1] } else { 0.0 };
        let pivot = 1.0 + lambda * neighbours as f64 - lambda * before;
        let (done, rest) = lines.split_at_mut(i * step);
        let previous = done.len().saturating_sub(step);
        for (j, value) in rest[..step].iter_mut().enumerate() {
            let pulled = if i > 0 { lambda * done[previous + j] } else { 0.0 };
            *value = (*value + pulled) / pivot;
        }
    }
    for i in (0..count.saturating_sub(1)).rev() {
        let (done, rest) = lines.split_at_mut((i + 1) * step);
        for (value, next) in done[i * step..].iter_mut().zip(rest) {
            *value += ratios[i] * *next;
        }
    }
}

#[cfg(test)]
mod tests {
    use flatland::random::{open01, stream};
    use glam::DVec3;

    use super::*;
    use crate::sdf::Interpolation;

    #[test]
    fn solutions_are_those_of_the_definition() {
        let size = [5, 1, 4];
        let mut random = stream(1, &[]);
        let vector: Vec<f64> = (0..20).map(|_| open01(&mut random) - 0.5).collect();
        for smoothing in [0.0, 0.3, 19.0] {
            let mut back = GridSteps { smoothing, ..GridSteps::default() }.solve(size, &vector);
            let mut step = 1;
            for count in size {
                let before = back.clone();
                for (index, value) in back.iter_mut().enumerate() {
                    let at = index / step % count;
                    let neighbours = [(at > 0).then(|| index - step), (at + 1 < count).then(|| index + step)];
                    let differences = neighbours.into_iter().flatten().map(|n| before[index] - before[n]);
                    *value += smoothing * differences.sum::<f64>();
                }
                step *= count;
            }
            let error = back.iter().zip(&vector).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            assert!(error < 1e-13, "{smoothing}: {error}");
        }
    }

    #[test]
    fn surfaces_stay_within_the_grid() {
        let corners = (DVec3::NEG_ONE, DVec3::ONE);
        let ball = Grid::sampled(Interpolation::Cubic, corners, 12, |x| x.length() - 0.5).expect("a grid");
        let steps = GridSteps { redistance: true, ..GridSteps::default() };
        let mut nearly_all_inside = vec![-1.0; ball.nodes().len()];
        nearly_all_inside[0] = 1.0;
        let grid = steps.stepped(&ball, &nearly_all_inside).expect("a surface");
        assert!(flatland::sdf::Sdf::bounds(&grid).is_some());
    }
}
