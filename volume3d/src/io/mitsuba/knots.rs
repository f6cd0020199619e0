//! Control points of curves, in files and in segments.

use glam::DVec3;

use crate::geometry::TOLERANCE;
use crate::io::error::excerpt;
use crate::io::{At, MeshProblem};

/// Maximum number of rings of one segment of a curve.
const MOST_RINGS: f64 = 256.0;

/// A control point: its position, and the radius of the curve.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Knot {
    pub(super) position: DVec3,
    pub(super) radius: f64,
}

/// Parses one control point per line, as x y z and a radius; curves are separated by an empty line. A curve
/// has at least `fewest` points.
pub(super) fn parse(bytes: &[u8], fewest: usize) -> Result<Vec<Vec<Knot>>, (At, MeshProblem)> {
    let expected = |number: usize, expected: &'static str, found: &str| {
        (At::Line(number), MeshProblem::Expected { expected, found: excerpt(found) })
    };
    let text = String::from_utf8_lossy(bytes);
    let (mut curves, mut curve) = (vec![], vec![]);
    // The end of the file ends a curve, too.
    for (number, line) in text.lines().chain([""]).enumerate() {
        let number = number + 1;
        if line.trim().is_empty() {
            if (1..fewest).contains(&curve.len()) {
                let least =
                    if fewest == 4 { "four control points a curve" } else { "two control points a curve" };
                return Err(expected(number, least, &curve.len().to_string()));
            }
            if !curve.is_empty() {
                curves.push(std::mem::take(&mut curve));
            }
            continue;
        }
        let numbers: Result<Vec<f64>, _> = line.split_whitespace().map(str::parse).collect();
        match numbers.as_deref() {
            Ok(&[x, y, z, radius, ..])
                if DVec3::new(x, y, z).is_finite() && radius >= 0.0 && radius.is_finite() =>
            {
                curve.push(Knot { position: DVec3::new(x, y, z), radius });
            }
            _ => return Err(expected(number, "three coordinates and a radius of at least 0", line)),
        }
    }
    if curves.is_empty() {
        return Err((At::Whole, MeshProblem::Missing { what: "control points" }));
    }
    Ok(curves)
}

/// A segment of a uniform cubic B-spline.
pub(super) struct Spline(pub(super) [Knot; 4]);

impl Spline {
    /// The weighted sum of the control points.
    fn sum(&self, weights: [f64; 4]) -> Knot {
        let mut sum = Knot { position: DVec3::ZERO, radius: 0.0 };
        for (knot, weight) in self.0.iter().zip(weights) {
            sum.position += weight * knot.position;
            sum.radius += weight * knot.radius;
        }
        sum
    }

    /// The point at v in [0, 1], and its first and second derivative.
    pub(super) fn at(&self, v: f64) -> [Knot; 3] {
        let (v2, v3) = (v * v, v * v * v);
        let value = [
            1.0 - 3.0 * v + 3.0 * v2 - v3,
            4.0 - 6.0 * v2 + 3.0 * v3,
            1.0 + 3.0 * v + 3.0 * v2 - 3.0 * v3,
            v3,
        ];
        let slope = [-3.0 + 6.0 * v - 3.0 * v2, -12.0 * v + 9.0 * v2, 3.0 + 6.0 * v - 9.0 * v2, 3.0 * v2];
        let bend = [1.0 - v, 3.0 * v - 2.0, 1.0 - 3.0 * v, v];
        [self.sum(value.map(|w| w / 6.0)), self.sum(slope.map(|w| w / 6.0)), self.sum(bend)]
    }

    /// The number of rings that keeps the polygon within the tolerance of the curve: a chord of length h
    /// deviates by |c″| h²/8.
    pub(super) fn rings(&self) -> u32 {
        let bend = [0.0, 1.0].map(|v| self.at(v)[2]);
        let bend = bend.iter().map(|b| b.position.length() + b.radius.abs()).fold(0.0, f64::max);
        let radius = self.0.iter().map(|knot| knot.radius).fold(0.0, f64::max);
        if bend == 0.0 || radius == 0.0 {
            return 1;
        }
        (bend / (8.0 * TOLERANCE * radius)).sqrt().ceil().clamp(1.0, MOST_RINGS) as u32
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_of_curves() {
        let knots = |text: &str, fewest| parse(text.as_bytes(), fewest).unwrap();
        let two = knots("\n0 0 0 1\n1 0 0 1\n\n \n0 0 0 2\n0 1 0 2\n0 1 1 0\n", 2);
        assert_eq!(two.iter().map(Vec::len).collect::<Vec<_>>(), [2, 3]);
        let refused = |text: &str, fewest| parse(text.as_bytes(), fewest).unwrap_err();
        assert!(matches!(refused("", 2), (At::Whole, MeshProblem::Missing { .. })));
        assert!(matches!(refused("0 0 0 1\n0 0 1 1\n", 4), (At::Line(3), MeshProblem::Expected { .. })));
        for bad in ["0 0 0", "0 0 0 -1", "0 0 x 1", "0 0 nan 1", "0 0 0 inf"] {
            assert!(matches!(refused(bad, 2), (At::Line(1), MeshProblem::Expected { .. })), "{bad}");
        }
    }
}
