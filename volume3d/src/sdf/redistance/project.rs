//! Projection of nodes to the nearest points of the surface.

use flatland::sdf::Sdf as _;
use glam::DVec3;

use crate::sdf::Grid;

/// Convergence tolerance along the normal relative to a cell, in addition to four roundings of the position.
const EXACT: f64 = 1e-9;

/// The surface point nearest to a node.
#[derive(Clone, Copy, Debug)]
pub(super) struct Foot {
    pub(super) point: DVec3,
    /// |∇φ| there.
    pub(super) slope: f64,
}

/// Newton's method with a tangential component that keeps the foot below the node (Chopp 2001), to 10⁻⁹ of a
/// cell along the normal and 10⁻³ tangentially. `None` if it does not converge in 30 steps, or converges
/// farther away than nodes of a cell that the surface crosses can be.
pub(super) fn foot(grid: &Grid, node: usize) -> Option<Foot> {
    let (x, spacing) = (grid.position(node), grid.spacing());
    let least = spacing.min_element();
    let enough = EXACT * least + 4.0 * f64::EPSILON * x.abs().max_element();
    let mut point = x;
    for _ in 0..30 {
        let jet = grid.jet(point);
        let towards = jet.gradient * (-jet.value / jet.gradient.length_squared());
        let aside = (x - point).reject_from(jet.gradient);
        if !(towards.is_finite() && aside.is_finite()) {
            return None;
        }
        if towards.length() < enough && aside.length() < 1e-3 * least {
            let near = (x - point).length() <= 3.0 * spacing.length();
            return near.then(|| Foot { point, slope: jet.gradient.length() });
        }
        point += towards + aside;
    }
    None
}
