//! Distances again, after node values were changed.

mod band;
mod project;
mod slopes;
mod sweep;
#[cfg(test)]
mod tests;

use rayon::prelude::*;

pub(super) use self::band::band;
use self::slopes::MeanSlopes;
use super::{Grid, GridError};

/// Why a grid has no distances.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum RedistanceError {
    /// φ is nowhere 0, though nodes have both signs, or its slope there is 0.
    #[error("the interpolant of the nodes has no surface to measure distances from")]
    NoSurface,
    /// The new nodes make no grid: distances are not finite.
    #[error(transparent)]
    Grid(#[from] GridError),
}

/// Which slope becomes 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Slopes {
    /// The mean of |∇φ| over the whole surface, at the points nearest to the nodes beside it. The surface stays where it is, to rounding.
    Overall,
    /// Means over about 8 cells. The surface moves where these means vary along it: not for use again and again.
    Local,
}

/// The same surface with node values that are distances again: |∇φ| becomes 1 in the mean on the surface, and far away what optimisation
/// has left behind is forgotten.
///
/// A spline does not pass through its nodes, so that exact distances at all of them would move its surface: each time by a little, and in
/// the end by cells. Here the nodes that count in a cell where φ may be 0 are divided by the mean |∇φ| of the surface and
/// no more: with [`Slopes::Overall`] φ is multiplied by a number there. At all others |∇φ| = 1 is solved upwind by fast sweeping
/// (Zhao 2005), with those for a boundary. No node changes its sign.
///
/// Largest |φ| on the points of the old surface, in cells, with 64 cells, after one and after 100 times, or as many as said:
///
/// | nodes of the band | ball | trefoil | bunny |
/// |---|---|---|---|
/// | divided by one number | 10⁻¹⁴, 10⁻¹⁴ (30 times) | 10⁻¹⁴, 10⁻¹⁴ (10 times) | 2·10⁻¹⁴, 2·10⁻¹⁴ (10 times) |
/// | divided by means over 8 cells | below 10⁻⁷, below 10⁻⁷ | 10⁻⁶, 2·10⁻⁵ | 0.006, 0.3 |
/// | made distances, corrected for the spline | 10⁻⁵, 3·10⁻⁴ (30 times) | 6·10⁻⁴, 0.006 (10 times) | 0.1, 3 (10 times) |
///
/// So use [`Slopes::Overall`] after steps of an optimisation. What it leaves is how |∇φ| varies along the surface, which an eikonal term is for, and
/// what φ is along normals within about three cells. [`Slopes::Local`] is for use once, on smooth surfaces: where |∇φ| varied from 1 to 3 in waves
/// of 23 cells, it left 1 ± 0.16 and moved the ball by up to 0.001 of a cell; repeated on a bunny it moves creases and makes slopes
/// next to them ever steeper.
///
/// Distances far away are too large by about a cell. On one thread of a busy machine it took 0.2 s for 64³ cells and 1.6 s for 128³. Bits do not depend on
/// the number of threads.
///
/// # Errors
/// [`RedistanceError`].
pub fn redistance(grid: &Grid, slopes: Slopes) -> Result<Grid, RedistanceError> {
    Ok(distances(grid, slopes)?.0)
}

/// The same with the mean slope of the surface.
pub(super) fn distances(grid: &Grid, slopes: Slopes) -> Result<(Grid, f64), RedistanceError> {
    let nodes = grid.nodes();
    let band = band(grid);
    let kept: Vec<usize> = (0..nodes.len()).filter(|&node| band[node]).collect();
    let feet: Vec<_> = kept.par_iter().map(|&node| project::foot(grid, node)).collect();
    let (slopes, overall) = MeanSlopes::new(grid, slopes, &feet).ok_or(RedistanceError::NoSurface)?;
    let mut known = vec![None; nodes.len()];
    for (&node, foot) in kept.iter().zip(&feet) {
        // Where there is no foot, the node's own place serves: all that is lost is that the mean is constant along normals.
        let slope = slopes.at(foot.map_or_else(|| grid.position(node), |foot| foot.point));
        known[node] = Some(nodes[node].abs() / slope);
    }
    let distances = sweep::sweep(&known, grid.size(), grid.spacing());
    let signed = |(&node, distance): (&f64, f64)| if node > 0.0 { distance } else { -distance };
    let new = nodes.iter().zip(distances).map(signed).collect();
    let new = Grid::new(grid.interpolation(), grid.low(), grid.spacing(), grid.size(), new)?;
    Ok((new, overall))
}
