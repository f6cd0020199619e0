//! Torus knots as curves: derivatives, reach, and the globally nearest point.

use std::f64::consts::TAU;

use glam::DVec3;

/// Samples of the curve per winding.
const SAMPLES: f64 = 20.0;
/// Relative difference of squared distances that counts as rounding.
const ROUNDING: f64 = 1e-15;

/// γ(t) = R γ_R(t) + a γ_a(t) around the origin.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Curve {
    /// p and q.
    windings: [f64; 2],
    /// R and a.
    radii: [f64; 2],
    /// γ at equal steps of t.
    samples: Vec<DVec3>,
    /// Bounds on |γ′|, |γ″| and |γ‴|.
    bounds: [f64; 3],
}

/// A stretch of the curve that may contain the nearest point.
#[derive(Clone, Copy)]
struct Piece {
    middle: f64,
    /// Half its length in t.
    half: f64,
}

/// The nearest point found so far.
struct Nearest {
    t: f64,
    distance: f64,
}

impl Nearest {
    fn offer(&mut self, t: f64, distance: f64) {
        if distance < self.distance {
            *self = Self { t, distance };
        }
    }
}

impl Curve {
    pub(super) fn new(windings: [f64; 2], major: f64, minor: f64) -> Self {
        let [p, q] = windings;
        // In the plane γ is R e^{ipt} + a/2 (e^{i(p+q)t} + e^{i(p−q)t}), and a sin qt orthogonal to it.
        let bounds = [1, 2, 3].map(|k| {
            let plane = major * p.powi(k) + 0.5 * minor * ((p + q).powi(k) + (p - q).abs().powi(k));
            plane.hypot(minor * q.powi(k))
        });
        let mut curve = Self { windings, radii: [major, minor], samples: vec![], bounds };
        let count = (SAMPLES * (p + q)) as usize;
        curve.samples = (0..count).map(|i| curve.point(TAU * i as f64 / count as f64)).collect();
        curve
    }

    pub(super) fn windings(&self) -> [f64; 2] {
        self.windings
    }

    pub(super) fn radii(&self) -> [f64; 2] {
        self.radii
    }

    /// ∂γ/∂R and ∂γ/∂a at t, with their first two derivatives by t.
    pub(super) fn basis(&self, t: f64) -> [[DVec3; 3]; 2] {
        let [p, q] = self.windings;
        let ((sin_p, cos_p), (sin_q, cos_q)) = ((p * t).sin_cos(), (q * t).sin_cos());
        let (out, round) = (DVec3::new(cos_p, 0.0, sin_p), DVec3::new(-sin_p, 0.0, cos_p));
        let major = [out, p * round, -(p * p) * out];
        let minor = [
            cos_q * out + sin_q * DVec3::Y,
            p * cos_q * round + q * (cos_q * DVec3::Y - sin_q * out),
            -(p * p + q * q) * cos_q * out - 2.0 * p * q * sin_q * round - q * q * sin_q * DVec3::Y,
        ];
        [major, minor]
    }

    /// γ, γ′ and γ″.
    fn at(&self, t: f64) -> [DVec3; 3] {
        let [by_major, by_minor] = self.basis(t);
        std::array::from_fn(|k| by_major[k] * self.radii[0] + by_minor[k] * self.radii[1])
    }

    fn point(&self, t: f64) -> DVec3 {
        self.at(t)[0]
    }

    /// The parameter t of the point nearest to x.
    pub(super) fn nearest(&self, x: DVec3) -> f64 {
        let step = TAU / self.samples.len() as f64;
        let half = 0.5 * step;
        let mut best = Nearest { t: 0.0, distance: f64::INFINITY };
        let distances: Vec<f64> = self.samples.iter().map(|sample| sample.distance(x)).collect();
        for (i, &distance) in distances.iter().enumerate() {
            best.offer(step * i as f64, distance);
        }
        // The piece around the nearest sample first, which excludes most others.
        let first = (best.t / step).round() as usize;
        let count = distances.len();
        let mut pieces = vec![];
        for i in (0..count).map(|k| (first + k) % count) {
            if self.may_beat(distances[i], half, &best) {
                pieces.push(Piece { middle: step * i as f64, half });
            }
            while let Some(piece) = pieces.pop() {
                self.search(x, piece, &mut best, &mut pieces);
            }
        }
        best.t
    }

    /// Whether a point within `half` of one at the given distance can be nearer than the best.
    fn may_beat(&self, distance: f64, half: f64, best: &Nearest) -> bool {
        distance - self.bounds[0] * half < best.distance
    }

    /// Finds the nearest point of a piece, or bisects it.
    fn search(&self, x: DVec3, piece: Piece, best: &mut Nearest, pieces: &mut Vec<Piece>) {
        let Piece { middle, half } = piece;
        let [point, tangent, turn] = self.at(middle);
        let (offset, distance) = (point - x, point.distance(x));
        best.offer(middle, distance);
        // First two derivatives of |γ − x|²/2, and the largest change of the second within the piece.
        let [speed, bend, third] = self.bounds;
        let slope = offset.dot(tangent);
        let convexity = tangent.dot(tangent) + offset.dot(turn);
        let change = half * (3.0 * speed * bend + (distance + speed * half) * third);
        let gain = (slope.abs() + 0.5 * (convexity.abs() + change) * half) * half;
        let least = 0.5 * distance * distance - gain;
        let wanted = 0.5 * best.distance * best.distance * (1.0 - ROUNDING);
        // Nothing is nearer here; also if a number is not finite.
        if !(least < wanted && self.may_beat(distance, half, best)) {
            return;
        }
        if convexity > change {
            let t = self.minimum(x, middle - half, middle + half);
            best.offer(t, self.point(t).distance(x));
        } else {
            let half = 0.5 * half;
            pieces.extend([middle - half, middle + half].map(|middle| Piece { middle, half }));
        }
    }

    /// The least |γ − x| over an interval in which its square is convex: Newton's method safeguarded by
    /// bisection.
    fn minimum(&self, x: DVec3, mut low: f64, mut high: f64) -> f64 {
        let derivatives = |t: f64| {
            let [point, tangent, turn] = self.at(t);
            let offset = point - x;
            (offset.dot(tangent), tangent.dot(tangent) + offset.dot(turn))
        };
        if derivatives(low).0 >= 0.0 {
            return low;
        }
        if derivatives(high).0 <= 0.0 {
            return high;
        }
        let mut t = 0.5 * (low + high);
        loop {
            let (slope, convexity) = derivatives(t);
            if slope > 0.0 {
                high = t;
            } else {
                low = t;
            }
            let newton = t - slope / convexity;
            let next = if newton > low && newton < high { newton } else { 0.5 * (low + high) };
            // A step below rounding, or an interval without a number inside.
            if (next - t).abs() <= 2.0 * f64::EPSILON * (1.0 + t.abs()) || next <= low || next >= high {
                return next;
            }
            t = next;
        }
    }

    /// The least radius of a circle that is tangent to the curve and meets it again.
    pub(super) fn reach(&self) -> f64 {
        let [p, q] = self.windings;
        let count = (96.0 * (p + q)) as usize;
        let step = TAU / count as f64;
        let points: Vec<DVec3> = (0..count).map(|i| self.point(step * i as f64)).collect();
        // A shift of t by 2π/q is a rotation about the axis, and t ↦ −t one by π: half of that interval
        // suffices.
        let part = (count as f64 / (2.0 * q)).ceil() as usize;
        let mut least = f64::INFINITY;
        for i in 0..=part {
            let [point, tangent, turn] = self.at(step * i as f64);
            let along = tangent.normalize();
            least = least.min(tangent.length_squared() / turn.reject_from_normalized(along).length());
            for other in points.iter().map(|&other| other - point).filter(|o| *o != DVec3::ZERO) {
                let beside = other.reject_from_normalized(along).length();
                least = least.min(0.5 * other.length_squared() / beside);
            }
        }
        least
    }
}
