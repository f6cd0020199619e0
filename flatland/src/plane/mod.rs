//! Opaque polygons over the image plane, M = R² (n = 2): the scenes of the derivation.
//!
//! A [`Scene`] is a list of [`Shape`]s in painter's order over a constant background. The image of a [`Film`]
//! is I_p = ∫ h_p(u) f(u) du, where f is the shade of the topmost polygon at u and h_p the pixel filter,
//! normalised to ∫ h_p = 1. Coordinates are those of the picture: x to the right, y **down**, as in SVG.
//!
//! A [`Motion`] moves vertices; a material point moves with the triangle of its polygon, by barycentric
//! interpolation. [`exact`] contains the arrangement of all edges, and with it every integral of the theory
//! in closed form.

mod box_tree;
mod edge_tree;
pub mod exact;
pub mod fields;
mod film;
mod hit;
mod motion;
mod polygon;
mod scene;
mod segments;
mod shade;
#[cfg(feature = "svg")]
pub mod svg;
mod triangulate;

pub(crate) use box_tree::{Aabb, BoxTree};
pub(crate) use edge_tree::{Edge, EdgeTree};
pub use film::{Film, FilmError, Filter, FilterCell, Image, PixelSample};
pub use hit::{Hit, MaterialPoint};
pub use motion::{Motion, MotionError};
pub use polygon::{Polygon, PolygonError};
pub use scene::{Scene, SceneError, Shape};
pub(crate) use segments::Meeting;
pub use shade::{Attachment, Shade, ShadeError};

use glam::DVec2;

/// Twice the signed area of the triangle abc, with the exact sign (Shewchuk 1997): positive if a, b, c turn
/// from +x towards +y.
#[must_use]
pub fn orient(a: DVec2, b: DVec2, c: DVec2) -> f64 {
    let coord = |p: DVec2| robust::Coord { x: p.x, y: p.y };
    robust::orient2d(coord(a), coord(b), coord(c))
}

/// Twice the signed area of the triangle abc, to full relative precision also for slivers for which
/// [`orient`] has the right sign but few correct digits.
///
/// Differences include their rounding errors (two-sum, Knuth 1969), and the determinant is Kahan's difference
/// of products.
pub(crate) fn twice_area(a: DVec2, b: DVec2, c: DVec2) -> f64 {
    let difference = |x: f64, y: f64| {
        let d = x - y;
        let back = d - x;
        (d, (x - (d - back)) - (y + back))
    };
    let ((ux, ux_tail), (uy, uy_tail)) = (difference(b.x, a.x), difference(b.y, a.y));
    let ((vx, vx_tail), (vy, vy_tail)) = (difference(c.x, a.x), difference(c.y, a.y));
    let product = uy * vx;
    let leading = ux.mul_add(vy, -product) - uy.mul_add(vx, -product);
    leading + (ux * vy_tail + ux_tail * vy - uy * vx_tail - uy_tail * vx)
}

/// Adds `from` to `to`, element by element.
pub(crate) fn add(to: &mut [DVec2], from: &[DVec2]) {
    to.iter_mut().zip(from).for_each(|(a, b)| *a += *b);
}
