//! Convex polygons cut by planes, with corners that move.

use num_dual::Dual64;

use crate::space::vector::Vector;

/// The corners of a convex polygon in order.
pub(super) type Corners = Vec<Vector>;

/// The part of a convex polygon where a function that is affine on its plane is not negative
/// (Sutherland and Hodgman 1974); empty where that is no polygon. What is cut is decided by real
/// parts; corners made by the cut move with it.
pub(super) fn keep(polygon: &[Vector], side: impl Fn(Vector) -> Dual64) -> Corners {
    let mut kept = Vec::with_capacity(polygon.len() + 1);
    for (i, &a) in polygon.iter().enumerate() {
        let b = polygon[(i + 1) % polygon.len()];
        let (da, db) = (side(a), side(b));
        if da.re >= 0.0 {
            kept.push(a);
        }
        if (da.re > 0.0 && db.re < 0.0) || (da.re < 0.0 && db.re > 0.0) {
            kept.push(a.lerp(b, da / (da - db)));
        }
    }
    if kept.len() < 3 { vec![] } else { kept }
}

/// Convex polygons that together are a convex polygon less the cone over another, both counterclockwise
/// around their cones: (d_k × d_{k+1})·d > 0 inside. With planes h_1 … h_m of the cone, the parts
/// are {h_1 < 0}, {h_1 ≥ 0, h_2 < 0}, and so on.
pub(super) fn without_cone(polygon: Corners, cone: &[Vector]) -> Vec<Corners> {
    let mut parts = vec![];
    let mut rest = polygon.clone();
    for (k, &a) in cone.iter().enumerate() {
        let plane = a.cross(cone[(k + 1) % cone.len()]);
        parts.push(keep(&rest, |d| -plane.dot(d)));
        rest = keep(&rest, |d| plane.dot(d));
        if rest.is_empty() {
            // They do not overlap: nothing need be cut.
            return vec![polygon];
        }
    }
    parts.retain(|part| !part.is_empty());
    parts
}
