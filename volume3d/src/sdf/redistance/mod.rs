//! Redistancing by fast sweeping.

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

/// Reason why a grid cannot be redistanced.
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

/// Choice of the mean slope that becomes 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Slopes {
    /// The mean of |∇φ| over the whole surface, at the points nearest to the nodes near it. The surface is
    /// unchanged, up to rounding.
    Overall,
    /// Means over about 8 cells. The surface moves where these means vary along it: not for repeated use.
    Local,
}

/// Redistances a grid with its surface preserved: |∇φ| becomes 1 in the mean on the surface, and values far
/// away, distorted by optimisation, are recomputed.
///
/// A spline does not interpolate its nodes, so that exact distances at all of them would move its surface:
/// each time by a little, and eventually by cells. Instead, the nodes that affect a cell in which φ may be 0
/// are only divided by the mean |∇φ| of the surface: with [`Slopes::Overall`] φ is multiplied by a constant
/// there. At all others |∇φ| = 1 is solved upwind by fast sweeping (Zhao 2005), with these nodes as boundary
/// values. No node changes its sign.
///
/// Use [`Slopes::Overall`] after steps of an optimisation: it moves the surface by about 10⁻¹⁴ cells,
/// repeated or not. It does not remove the variation of |∇φ| along the surface, for which an eikonal term
/// serves, nor the variation of φ along normals within about three cells. [`Slopes::Local`] is for a single
/// use on smooth surfaces, where it moves the surface by up to 10⁻³ of a cell. On a bunny it moves the
/// surface by 0.006 cells once and by 0.3 cells in 100 repetitions, as it moves creases and makes slopes next
/// to them ever steeper. Exact distances at the nodes, corrected for the spline, would move it by 0.1 cells
/// once and by 3 cells in 10 repetitions.
///
/// Distances far away are too large by about a cell. Bits do not depend on the number of threads.
///
/// # Errors
/// [`RedistanceError`].
pub fn redistance(grid: &Grid, slopes: Slopes) -> Result<Grid, RedistanceError> {
    Ok(distances(grid, slopes)?.0)
}

/// [`redistance`], also returning the mean slope of the surface.
pub(super) fn distances(grid: &Grid, slopes: Slopes) -> Result<(Grid, f64), RedistanceError> {
    let nodes = grid.nodes();
    let band = band(grid);
    let kept: Vec<usize> = (0..nodes.len()).filter(|&node| band[node]).collect();
    let feet: Vec<_> = kept.par_iter().map(|&node| project::foot(grid, node)).collect();
    let (slopes, overall) = MeanSlopes::new(grid, slopes, &feet).ok_or(RedistanceError::NoSurface)?;
    let mut known = vec![None; nodes.len()];
    for (&node, foot) in kept.iter().zip(&feet) {
        // Without a foot, the node's own position is used: only the property that the mean is constant along
        // normals is lost.
        let slope = slopes.at(foot.map_or_else(|| grid.position(node), |foot| foot.point));
        known[node] = Some(nodes[node].abs() / slope);
    }
    let distances = sweep::sweep(&known, grid.size(), grid.spacing());
    let signed = |(&node, distance): (&f64, f64)| if node > 0.0 { distance } else { -distance };
    let new = nodes.iter().zip(distances).map(signed).collect();
    let new = Grid::new(grid.interpolation(), grid.low(), grid.spacing(), grid.size(), new)?;
    Ok((new, overall))
}
