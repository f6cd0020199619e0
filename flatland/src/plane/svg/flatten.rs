//! Approximation of curves by chords. The bounds are derived in [`super`].

use glam::DVec2;
use usvg::tiny_skia_path::{PathSegment, Point};

use super::MAX_COORDINATE;

/// Closed rings of a path in the image, with curves within `tolerance` of their chords, without repeated
/// vertices or rings of zero area. `None` if a coordinate is beyond ±[`MAX_COORDINATE`].
pub(super) fn rings(path: &usvg::Path, tolerance: f64) -> Option<Vec<Vec<DVec2>>> {
    let t = path.abs_transform();
    let [sx, kx, tx, ky, sy, ty] = [t.sx, t.kx, t.tx, t.ky, t.sy, t.ty].map(f64::from);
    let place = |p: Point| {
        let (x, y) = (f64::from(p.x), f64::from(p.y));
        let q = DVec2::new(sx * x + kx * y + tx, ky * x + sy * y + ty);
        // Polygons refuse subnormal coordinates: values that cancel to almost 0 become 0.
        let q = DVec2::from(q.to_array().map(|x| if x.abs() < 1e-30 { 0.0 } else { x }));
        // False for NaN.
        q.abs().cmple(DVec2::splat(MAX_COORDINATE)).all().then_some(q)
    };
    let mut rings = vec![];
    let mut ring: Vec<DVec2> = vec![];
    for segment in path.data().segments() {
        let start = ring.last().copied();
        match segment {
            PathSegment::MoveTo(p) => {
                rings.push(std::mem::replace(&mut ring, vec![place(p)?]));
            }
            PathSegment::LineTo(p) => ring.push(place(p)?),
            PathSegment::QuadTo(b, c) => {
                let (b, c) = (place(b)?, place(c)?);
                let a = start.unwrap_or(c);
                let bend = (a - 2.0 * b + c).length();
                chords(&mut ring, bend / 4.0, tolerance, c, |t| {
                    let s = 1.0 - t;
                    s * s * a + 2.0 * s * t * b + t * t * c
                });
            }
            PathSegment::CubicTo(b, c, d) => {
                let (b, c, d) = (place(b)?, place(c)?, place(d)?);
                let a = start.unwrap_or(d);
                let bend = (a - 2.0 * b + c).length().max((b - 2.0 * c + d).length());
                chords(&mut ring, 0.75 * bend, tolerance, d, |t| {
                    let s = 1.0 - t;
                    s * s * (s * a + 3.0 * t * b) + t * t * (3.0 * s * c + t * d)
                });
            }
            PathSegment::Close => {}
        }
    }
    rings.push(ring);
    Some(rings)
}

/// Appends the chords of a curve whose deviation is `deviation` / n² with n of them.
fn chords(ring: &mut Vec<DVec2>, deviation: f64, tolerance: f64, end: DVec2, curve: impl Fn(f64) -> DVec2) {
    let count = (deviation / tolerance).sqrt().ceil().max(1.0);
    // At most 3·10⁶ by the bounds on coordinates and tolerance.
    let steps = count as u32;
    ring.extend((1..steps).map(|i| curve(f64::from(i) / count)));
    ring.push(end);
}
