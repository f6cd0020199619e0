//! Adaptive quadrature of a function with its derivative over the fixed interval [0, 1].

use std::collections::VecDeque;

use super::term::Term;

/// Kronrod's nodes in [0, 1) and weights on [−1, 1], and Gauss's weights of every second node: 7 and
/// 15 points (Piessens et al. 1983, QUADPACK, routine QK15). Exact for degrees 13 and 22.
const NODES: [f64; 8] = [
    0.0,
    0.207_784_955_007_898_48,
    0.405_845_151_377_397_2,
    0.586_087_235_467_691_1,
    0.741_531_185_599_394_5,
    0.864_864_423_359_769_1,
    0.949_107_912_342_758_5,
    0.991_455_371_120_812_6,
];
const KRONROD: [f64; 8] = [
    0.209_482_141_084_727_82,
    0.204_432_940_075_298_89,
    0.190_350_578_064_785_42,
    0.169_004_726_639_267_9,
    0.140_653_259_715_525_92,
    0.104_790_010_322_250_19,
    0.063_092_092_629_978_56,
    0.022_935_322_010_529_224,
];
const GAUSS: [f64; 8] = [
    0.417_959_183_673_469_4,
    0.0,
    0.381_830_050_505_118_9,
    0.0,
    0.279_705_391_489_276_64,
    0.0,
    0.129_484_966_168_869_7,
    0.0,
];

/// Acceptance criteria of a piece.
#[derive(Clone, Copy, Debug)]
pub(super) struct Precision {
    /// Tolerated difference between both rules, relative to the integral of the absolute values over all
    /// pieces: of the value, and of value and derivative. The error of the rule of 15 points is far below the
    /// difference.
    pub(super) relative: f64,
    /// Maximum number of halvings of a piece.
    pub(super) halvings: u32,
    /// Maximum number of pieces: beyond it the rest is accepted with its error.
    pub(super) pieces: usize,
}

/// The results of both rules on a piece.
struct Piece<const M: usize> {
    from: f64,
    to: f64,
    integral: [Term; M],
    /// ∫ |value|.
    size: f64,
    /// The differences between both rules, of value and derivative.
    differences: [f64; 2],
}

impl<const M: usize> Piece<M> {
    fn new(from: f64, to: f64, f: &impl Fn(f64) -> [Term; M]) -> Self {
        let (centre, half) = (0.5 * (from + to), 0.5 * (to - from));
        let mut integral = [Term::default(); M];
        let mut gauss = [[0.0; 2]; M];
        let mut size = 0.0;
        for (i, node) in NODES.into_iter().enumerate() {
            for sign in [-1.0, 1.0] {
                if i == 0 && sign > 0.0 {
                    continue;
                }
                for (channel, term) in f(centre + sign * half * node).into_iter().enumerate() {
                    integral[channel] += term * (KRONROD[i] * half).into();
                    gauss[channel][0] += GAUSS[i] * half * term.value.re;
                    gauss[channel][1] += GAUSS[i] * half * term.value.eps;
                    size += KRONROD[i] * half * term.value.re.abs();
                }
            }
        }
        let mut differences = [0.0; 2];
        for (term, gauss) in integral.iter_mut().zip(gauss) {
            let found = [term.value.re - gauss[0], term.value.eps - gauss[1]].map(f64::abs);
            differences[0] += found[0];
            differences[1] += found[1];
            term.error += estimate(found[1], term.absolute);
        }
        Self { from, to, integral, size, differences }
    }

    /// Scales of value and derivative. The value takes part in both: a derivative that is pure rounding has
    /// no scale of its own.
    fn scales(&self) -> [f64; 2] {
        let absolute: f64 = self.integral.iter().map(|t| t.absolute).sum();
        [self.size, self.size + absolute]
    }

    /// Whether both differences are small, or rounding.
    fn is_fine(&self, allowed: [f64; 2]) -> bool {
        let scales = self.scales();
        (0..2).all(|i| self.differences[i] <= allowed[i].max(ROUNDING * scales[i]))
    }
}

/// Bound on the difference between both rules, relative to the terms summed, below which it is rounding.
const ROUNDING: f64 = 100.0 * f64::EPSILON;

/// QUADPACK's estimate of the error of the rule of 15 points from the difference of both rules.
fn estimate(difference: f64, scale: f64) -> f64 {
    if scale == 0.0 { difference } else { difference.min(scale * (200.0 * difference / scale).powf(1.5)) }
}

/// ∫₀¹ f, where f is smooth except at `breaks`, given in any order.
pub(super) fn integrate<const M: usize>(
    mut breaks: Vec<f64>,
    precision: Precision,
    f: impl Fn(f64) -> [Term; M],
) -> [Term; M] {
    breaks.retain(|x| *x > 0.0 && *x < 1.0);
    breaks.extend([0.0, 1.0]);
    breaks.sort_by(f64::total_cmp);
    breaks.dedup();
    let first: Vec<_> = breaks.windows(2).map(|w| Piece::new(w[0], w[1], &f)).collect();
    let mut allowed = [0.0, 0.0];
    for piece in &first {
        let scales = piece.scales();
        (0..2).for_each(|i| allowed[i] += precision.relative * scales[i]);
    }
    let mut sum = [Term::default(); M];
    let mut pieces = first.len();
    let mut open: VecDeque<_> = first.into_iter().map(|piece| (piece, 0)).collect();
    while let Some((piece, halvings)) = open.pop_front() {
        let middle = 0.5 * (piece.from + piece.to);
        let divisible = piece.from < middle && middle < piece.to && halvings < precision.halvings;
        if !divisible || pieces > precision.pieces || piece.is_fine(allowed) {
            sum.iter_mut().zip(piece.integral).for_each(|(sum, term)| *sum += term);
            continue;
        }
        for [from, to] in [[piece.from, middle], [middle, piece.to]] {
            open.push_back((Piece::new(from, to, &f), halvings + 1));
            pieces += 1;
        }
    }
    sum
}

#[cfg(test)]
mod tests {
    use num_dual::{Dual64, DualNum};

    use super::*;

    const FINE: Precision = Precision { relative: 1e-11, halvings: 60, pieces: 10_000 };

    #[test]
    fn monomials_are_exact_up_to_their_degree() {
        for power in 0..=22 {
            let piece = Piece::new(0.0, 1.0, &|x: f64| [Term::new(x.powi(power).into())]);
            let exact = 1.0 / (f64::from(power) + 1.0);
            assert!((piece.integral[0].value.re - exact).abs() < 1e-15, "{power}");
            assert!(power > 13 || piece.differences[0] < 1e-15, "{power}");
        }
    }

    #[test]
    fn peaks_and_kinks_are_found() {
        // ∫₀¹ w/(w² + (x − a)²) dx, and its derivative with respect to a.
        let (w, a) = (1e-5, Dual64::new(0.3, 1.0));
        let exact = ((-a + 1.0) / w).atan() + (a / w).atan();
        let peak = |x: f64| [Term::new(((a - x).powi(2) + w * w).recip() * w)];
        let [found] = integrate(vec![0.3], FINE, peak);
        assert!((found.value.re - exact.re).abs() < 1e-12, "{found:?} {exact}");
        assert!((found.value.eps - exact.eps).abs() < 1e-12 * found.absolute, "{found:?} {exact}");
        // ∫₀¹ |x − a| dx, whose kink is not announced: to 10⁻¹¹ of value and derivative together.
        let [found] = integrate(vec![], FINE, |x| {
            let d = a - x;
            [Term::new(d * d.re.signum())]
        });
        let exact = (a * a + (-a + 1.0).powi(2)) * 0.5;
        assert!((found.value.re - exact.re).abs() < 2e-11 && (found.value.eps - exact.eps).abs() < 2e-11);
    }
}
