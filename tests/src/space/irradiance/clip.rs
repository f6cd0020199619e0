//! Clipping of convex polygons with moving corners by planes.

use num_dual::Dual64;

use crate::dual::Vector3;

/// The corners of a convex polygon in order.
pub(in crate::space) type Corners = Vec<Vector3>;

/// The part of a convex polygon where a function that is affine on its plane is not negative (Sutherland and
/// Hodgman 1974); empty where that is no polygon. Real parts decide the cut; corners made by the cut move
/// with it.
pub(in crate::space) fn keep(polygon: &[Vector3], side: impl Fn(Vector3) -> Dual64) -> Corners {
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

/// Sines of angles to a plane below this are rounding.
const ON: f64 = 1e-14;

/// Convex polygons whose union is a convex polygon minus the cone over another, both counterclockwise around
/// their cones: (d_k × d_{k+1})·d > 0 inside. With planes h_1 … h_m of the cone, the parts are {h_1 < 0},
/// {h_1 ≥ 0, h_2 < 0}, and so on.
pub(in crate::space) fn without_cone(polygon: Corners, cone: &[Vector3]) -> Vec<Corners> {
    let mut parts = vec![];
    let mut rest = polygon.clone();
    for (k, &a) in cone.iter().enumerate() {
        let plane = a.cross(cone[(k + 1) % cone.len()]);
        let side = |d: Vector3| {
            let side = plane.dot(d);
            // A corner on the plane up to rounding, as of a face that shares this edge, counts as on it: the
            // cut of an edge almost in the plane would have an arbitrary position and an equally large
            // velocity.
            let is_on = side.re.abs() <= ON * plane.value().length() * d.value().length();
            if is_on { Dual64::from(0.0) } else { side }
        };
        parts.push(keep(&rest, |d| -side(d)));
        rest = keep(&rest, side);
        if rest.is_empty() {
            // No overlap: no cut needed.
            return vec![polygon];
        }
    }
    parts.retain(|part| !part.is_empty());
    parts
}
