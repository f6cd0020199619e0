//! An edge as seen from a point, an arc of a great circle, and the integrals of the kernel along it.

use glam::DVec3;

/// Angular radius of the cap in which edges count, with its cosine, sine and 1 − cos.
///
/// Edges farther from a direction do not contribute to its field. The kernel falls to 0 continuously at the
/// radius, which may therefore be chosen freely, but must be the same for all directions of one integral.
#[derive(Clone, Copy, Debug)]
pub(crate) struct AngularSupport {
    pub(crate) angle: f64,
    pub(crate) cosine: f64,
    pub(crate) sine: f64,
    pub(crate) versine: f64,
    /// δ = (ε²/2)/(1 + ε²/2) for softened kernels; 0 for exact ones.
    pub(crate) shrinkage: f64,
}

impl AngularSupport {
    /// The empty cap.
    pub(crate) const NONE: Self = Self { angle: 0.0, cosine: 1.0, sine: 0.0, versine: 0.0, shrinkage: 0.0 };

    /// A cap with this angular radius, at most [`WIDEST`].
    pub(crate) fn new(angle: f64) -> Self {
        let angle = angle.min(WIDEST);
        let half = (0.5 * angle).sin();
        let versine = 2.0 * half * half;
        Self {
            angle,
            cosine: 1.0 - versine,
            sine: (versine * (2.0 - versine)).sqrt(),
            versine,
            shrinkage: 0.0,
        }
    }

    /// The cap with softened kernels: ε in radians, 0 for none.
    pub(crate) fn softened(self, softness: f64) -> Self {
        let half = 0.5 * softness * softness;
        Self { shrinkage: if half.is_finite() { half / (1.0 + half) } else { 1.0 }, ..self }
    }
}

/// Largest radius of a cap: less than half a sphere, or an arc could enter it twice.
pub(crate) const WIDEST: f64 = 1.2;

/// Precision of directions: one that seems to be exactly on an arc is treated as this far from it. The field
/// is continuous there, and its divergence has an error of order 1.
const ROUNDING: f64 = 1e-16;

/// Length, in radians, below which arcs are omitted: edges seen end-on, whose direction is lost in rounding.
const SHORTEST: f64 = 1e-12;

/// An arc from a to b, the shorter way, with its pole ν ∝ a × b.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Arc {
    pub(crate) ends: [DVec3; 2],
    pub(crate) pole: DVec3,
}

/// A function of a direction, and its gradient on the sphere.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Graded {
    pub(crate) value: f64,
    pub(crate) gradient: DVec3,
}

/// Integrals over the points b of an arc with the kernel
///
/// > K(u, b) = (1/(1 − u·b) − 1/(1 − cos R))₊,
///
/// and their gradients by u; softened, K(u, b) = (1/(1 − (1 − δ) u·b) − 1/(1 − cos R))₊, which is at most
/// about 2/ε² and differs from the exact kernel only at angles of about ε: see
/// [`Field::Softened`](crate::gradient::Field::Softened). The velocity of the arc at angle φ from its first
/// end is ḃ = \[sin(Φ − φ) ȧ + sin φ ḃ₁\]/sin Φ. It equals the velocity of the edge between the two ends in
/// the normal direction, as ν·ḃ is linear in b.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Moments {
    /// ∫ K.
    pub(crate) whole: Graded,
    /// The parts of ∫ K ḃ proportional to the velocity of each end.
    pub(crate) ends: [Graded; 2],
}

impl Graded {
    pub(super) fn times(self, factor: Self) -> Self {
        let gradient = factor.value * self.gradient + self.value * factor.gradient;
        Self { value: self.value * factor.value, gradient }
    }
}

impl Moments {
    /// Moments of the kernel times a function of the direction.
    pub(crate) fn times(self, factor: Graded) -> Self {
        Self { whole: self.whole.times(factor), ends: self.ends.map(|end| end.times(factor)) }
    }
}

impl Arc {
    /// The moments around u; `None` if the arc does not enter the cap.
    ///
    /// With c the length of the projection of u on the plane of the arc and ψ the angle from it, u·b = c cos
    /// ψ, and all integrals are elementary in τ = tan(ψ/2). Softened, c (1 − δ) takes the place of c, and
    /// gradients have a factor 1 − δ.
    pub(crate) fn moments(&self, u: DVec3, reach: AngularSupport) -> Option<Moments> {
        let s = u.dot(self.pole);
        let s = s.abs().max(ROUNDING).copysign(s);
        let squared = s * s;
        let true_c = (1.0 - squared).sqrt();
        let (shrinkage, kept) = (reach.shrinkage, 1.0 - reach.shrinkage);
        let c = true_c * kept;
        let versine = squared / (1.0 + true_c) + shrinkage * true_c;
        // sin² of half the angle at which the great circle leaves the cap.
        let per_c = 1.0 / c;
        let half = 0.5 * (reach.versine - versine) * per_c;
        // NaN if u is the pole itself.
        if half.is_nan() || half <= 0.0 {
            return None;
        }
        let limit = (half / (1.0 - half)).sqrt();
        let per_true_c = 1.0 / true_c;
        let m = (u - s * self.pole) * per_true_c;
        let n = self.pole.cross(m);
        let [a, b] = self.ends.map(|e| [e.dot(m), e.dot(n)]);
        let (mut low, mut high) = (half_tangent(a), half_tangent(b));
        if low > high {
            // Around the far side, at most one of the ends is within the cap.
            if low < limit {
                high = limit;
            } else {
                low = -limit;
            }
        }
        (low, high) = (low.max(-limit), high.min(limit));
        if low.partial_cmp(&high) != Some(std::cmp::Ordering::Less) {
            return None;
        }
        // √(1 − c²): the distance of u from the arc, unless softened.
        let apart = if shrinkage > 0.0 { (versine * (1.0 + c)).sqrt() } else { s.abs() };
        let i = Integrals::new(apart, [c, per_c], versine, [low, high]);
        let level = 1.0 / reach.versine;
        // Component of m tangent at u, exactly: m itself is nearly u, and projecting it would leave an error
        // of rounding/s².
        let across = (kept * s * per_true_c) * (s * u - self.pole);
        let n = kept * n;
        let graded = |value: f64, [x, y]: [f64; 2]| Graded { value, gradient: x * across + y * n };
        // ∫ cos ψ K and ∫ sin ψ K.
        let cosine = (i.j0 - i.angle) * per_c - level * i.sines;
        let sine = i.logarithm * per_c - level * i.versines;
        let sine_of_arc = a[0] * b[1] - a[1] * b[0];
        if sine_of_arc <= SHORTEST {
            return None;
        }
        let turn = 1.0 / sine_of_arc;
        let end = |x: f64, y: f64| {
            graded(
                x * cosine + y * sine,
                [x * i.cosine_squared + y * i.cosine_sine, x * i.cosine_sine + y * i.sine_squared],
            )
        };
        Some(Moments {
            whole: graded(i.j0 - level * i.angle, [i.cosine, i.sine]),
            ends: [end(b[1] * turn, -b[0] * turn), end(-a[1] * turn, a[0] * turn)],
        })
    }
}

/// tan(ψ/2) of the angle of a vector; ±∞ on the far side.
fn half_tangent([x, y]: [f64; 2]) -> f64 {
    if x <= 0.0 { f64::INFINITY.copysign(y) } else { y / ((x * x + y * y).sqrt() + x) }
}

/// Integrals over ψ, with e = 1 − c cos ψ.
struct Integrals {
    /// ∫ dψ.
    angle: f64,
    /// ∫ dψ/e.
    j0: f64,
    /// ∫ sin ψ/e times c: log e between the ends.
    logarithm: f64,
    /// ∫ cos ψ and ∫ sin ψ.
    sines: f64,
    versines: f64,
    /// ∫ cos ψ/e², ∫ sin ψ/e².
    cosine: f64,
    sine: f64,
    /// ∫ cos² ψ/e², ∫ cos ψ sin ψ/e², ∫ sin² ψ/e².
    cosine_squared: f64,
    cosine_sine: f64,
    sine_squared: f64,
}

impl Integrals {
    /// Integrals between two half tangents. `s` is √(1 − c²), `per_c` 1/c (a division costs as much as many
    /// products), and `versine` 1 − c.
    fn new(s: f64, [c, per_c]: [f64; 2], versine: f64, [low, high]: [f64; 2]) -> Self {
        let wide = 1.0 + c;
        // e = (1 − c + (1 + c) τ²)/(1 + τ²), without cancellation.
        let at = |t: f64| {
            let (t2, scale) = (t * t, 1.0 / (1.0 + t * t));
            let e = (versine + wide * t2) * scale;
            (2.0 * t * scale, 2.0 * t2 * scale, e, 1.0 / e)
        };
        let (sin_low, versine_low, _, per_e_low) = at(low);
        let (sin_high, versine_high, e_high, per_e_high) = at(high);
        let per_s = 1.0 / s;
        let between = high - low;
        let angle = 2.0 * between.atan2(1.0 + low * high);
        let j0 = 2.0 * per_s * (s * wide * between).atan2(s * s + wide * wide * low * high);
        let logarithm = (e_high * per_e_low).ln();
        let slopes = sin_high * per_e_high - sin_low * per_e_low;
        let j1 = inverse_square(s, c, low, high, || (c * slopes + j0) * per_s * per_s);
        let sine = (per_e_low - per_e_high) * per_c;
        Self {
            angle,
            j0,
            logarithm,
            sines: sin_high - sin_low,
            versines: versine_high - versine_low,
            cosine: (j1 - j0) * per_c,
            sine,
            cosine_squared: (j1 - 2.0 * j0 + angle) * per_c * per_c,
            cosine_sine: (sine - logarithm * per_c) * per_c,
            // By parts.
            sine_squared: ((j0 - angle) * per_c - slopes) * per_c,
        }
    }
}

/// ∫ dψ/e² = ∫ 2 (1 + τ²)/((1 + c)² (g² + τ²)²) dτ with g² = (1 − c)/(1 + c).
///
/// The closed form cancels as g²/τ² if the arc is on u's great circle but far along it; there the series in
/// g²/τ² replaces it.
fn inverse_square(s: f64, c: f64, low: f64, high: f64, closed: impl FnOnce() -> f64) -> f64 {
    let wide = 1.0 + c;
    let g2 = (s / wide).powi(2);
    let nearest = if low * high > 0.0 { low.abs().min(high.abs()) } else { 0.0 };
    if g2 > SERIES * nearest * nearest {
        return closed();
    }
    // (1 + τ²)/(g² + τ²)² = (1 + τ²) τ⁻⁴ (1 − 2x + 3x² − …), x = g²/τ².
    let antiderivative = |t: f64| {
        let (r, x) = (1.0 / t, g2 / (t * t));
        let (mut sum, mut power) = (0.0, 1.0);
        for k in 0..TERMS {
            let k = k as f64;
            sum -= (k + 1.0) * power * (r * r * r / (2.0 * k + 3.0) + r / (2.0 * k + 1.0));
            power *= -x;
        }
        sum
    };
    2.0 / (wide * wide) * (antiderivative(high) - antiderivative(low))
}

/// g²/τ² below which the series is used: the closed form has lost three of sixteen digits there.
const SERIES: f64 = 1e-3;
/// Terms of the series: (10⁻³)⁶ is below rounding.
const TERMS: usize = 6;

#[cfg(test)]
mod tests {
    use flatland::random::{open01, stream};

    use super::*;

    fn unit(rng: &mut flatland::random::Stream) -> DVec3 {
        loop {
            let v = DVec3::from_array(std::array::from_fn(|_| 2.0 * open01(rng) - 1.0));
            if v.length() > 0.1 && v.length() < 1.0 {
                return v.normalize();
            }
        }
    }

    fn arc(a: DVec3, b: DVec3) -> Arc {
        Arc { ends: [a, b], pole: a.cross(b).normalize() }
    }

    /// Reference by the midpoint rule: ∫ K, and the parts of both ends.
    fn by_quadrature(arc: &Arc, u: DVec3, reach: AngularSupport) -> [f64; 3] {
        let [a, b] = arc.ends;
        let whole = a.cross(b).length().atan2(a.dot(b));
        let n = 100_000;
        let mut sums = [0.0; 3];
        for i in 0..n {
            let phi = whole * (f64::from(i) + 0.5) / f64::from(n);
            let parts = [(whole - phi).sin() / whole.sin(), phi.sin() / whole.sin()];
            let point = parts[0] * a + parts[1] * b;
            let apart = 0.5 * (u - point).length_squared();
            // 1 − (1 − δ) u·b
            let apart = apart + reach.shrinkage * (1.0 - apart);
            let kernel = (1.0 / apart - 1.0 / reach.versine).max(0.0);
            sums[0] += kernel;
            sums[1] += kernel * parts[0];
            sums[2] += kernel * parts[1];
        }
        sums.map(|x| x * whole / f64::from(n))
    }

    fn values(m: &Moments) -> [f64; 3] {
        [m.whole.value, m.ends[0].value, m.ends[1].value]
    }

    #[test]
    fn moments_are_the_integrals() {
        let mut rng = stream(5, &[]);
        let mut met = 0;
        for _ in 0..300 {
            let (a, b, u) = (unit(&mut rng), unit(&mut rng), unit(&mut rng));
            let arc = arc(a, b);
            if u.dot(arc.pole).abs() < 0.02 {
                continue;
            }
            let reach = AngularSupport::new(0.2 + open01(&mut rng));
            let reach = if open01(&mut rng) < 0.5 { reach } else { reach.softened(0.3 * open01(&mut rng)) };
            let expected = by_quadrature(&arc, u, reach);
            let found = arc.moments(u, reach).map_or([0.0; 3], |m| values(&m));
            met += usize::from(found[0] > 0.0);
            for (f, e) in found.into_iter().zip(expected) {
                assert!((f - e).abs() <= 1e-6 * (1.0 + expected[0].abs()), "{found:?} {expected:?}");
            }
        }
        assert!(met > 40, "only {met} arcs entered the cap");
    }

    #[test]
    fn gradients_are_those_of_differences() {
        let mut rng = stream(6, &[]);
        for _ in 0..2000 {
            let (a, b, u) = (unit(&mut rng), unit(&mut rng), unit(&mut rng));
            let arc = arc(a, b);
            let reach = AngularSupport::new(0.3 + open01(&mut rng));
            let reach = if open01(&mut rng) < 0.5 { reach } else { reach.softened(0.1) };
            let s = u.dot(arc.pole);
            if s.abs() < 1e-3 {
                continue;
            }
            let Some(m) = arc.moments(u, reach) else { continue };
            let t = u.any_orthonormal_vector();
            let h = 1e-5 * s.abs();
            let at = |h: f64| arc.moments((u + h * t).normalize(), reach).map_or([0.0; 3], |m| values(&m));
            let (plus, minus) = (at(h), at(-h));
            for (i, g) in [m.whole, m.ends[0], m.ends[1]].into_iter().enumerate() {
                let difference = (plus[i] - minus[i]) / (2.0 * h);
                let scale = m.whole.gradient.length() + m.whole.value + 1.0;
                assert!((g.gradient.dot(t) - difference).abs() < 1e-5 * scale, "{g:?} {difference}");
            }
        }
    }

    /// ∇·V of a triangle around u is stable as u approaches one of its edges.
    #[test]
    fn divergence_does_not_lose_its_digits_near_an_edge() {
        let corners =
            [(0.01, 0.003), (-0.012, 0.008), (0.004, -0.02)].map(|(x, y)| DVec3::new(x, y, 1.0).normalize());
        let velocities = [(1.0, 0.3), (0.9, -0.5), (0.2, 0.7)].map(|(x, y)| DVec3::new(x, y, 0.0));
        let middle = (0.6 * corners[0] + 0.4 * corners[1]).normalize();
        let divergence = |distance: f64| {
            let u = (middle + distance * (corners[2] - middle).normalize()).normalize();
            let (mut whole, mut slope) = (600.0, DVec3::ZERO);
            let moments = [0, 1, 2].map(|i| {
                let side = arc(corners[i], corners[(i + 1) % 3]);
                side.moments(u, AngularSupport::new(0.01)).expect("it is within reach")
            });
            for m in &moments {
                whole += m.whole.value;
                slope += m.whole.gradient;
            }
            let mut sum = 0.0;
            for (i, m) in moments.iter().enumerate() {
                for (j, end) in m.ends.iter().enumerate() {
                    let part = end.value / whole;
                    let slope = (end.gradient - part * slope) / whole - 2.0 * part * u;
                    sum += slope.dot(velocities[(i + j) % 3]);
                }
            }
            sum
        };
        let reference = divergence(1e-8);
        for (distance, tolerance) in [(1e-9, 1e-5), (1e-11, 1e-5), (1e-13, 1e-3)] {
            let found = divergence(distance);
            assert!(
                (found - reference).abs() < tolerance * reference.abs(),
                "{distance}: {found} {reference}"
            );
        }
    }

    #[test]
    fn on_an_arc_everything_is_finite() {
        let arc = arc(DVec3::X, DVec3::Y);
        let m = arc.moments(DVec3::new(0.6, 0.8, 0.0), AngularSupport::new(0.5)).expect("it is within reach");
        let ends = m.ends.map(|e| e.value / m.whole.value);
        assert!(m.whole.gradient.is_finite() && m.ends.iter().all(|e| e.gradient.is_finite()));
        assert!((ends[0] - 0.6).abs() < 1e-12 && (ends[1] - 0.8).abs() < 1e-12, "{ends:?}");
    }

    #[test]
    fn along_its_own_great_circle_an_arc_keeps_its_digits() {
        let (a, b) = (DVec3::new(0.3, 0.1, 1.0).normalize(), DVec3::new(0.5, 0.15, 1.0).normalize());
        let arc = arc(a, b);
        let along = (a - 2.0 * (b - a)).normalize();
        let on_circle = (along - along.dot(arc.pole) * arc.pole).normalize();
        let at = |height: f64| {
            let u = (on_circle + height * arc.pole).normalize();
            let m = arc.moments(u, AngularSupport::new(1.0)).expect("it is within reach");
            m.ends.map(|e| e.gradient)
        };
        let reference = at(1e-5);
        for height in [1e-7, 1e-9, 1e-11, 1e-13] {
            for (g, r) in at(height).into_iter().zip(reference) {
                assert!((g - r).length() < 1e-4 * r.length(), "{height}: {g} {r}");
            }
        }
    }
}
