//! Globally adaptive Gauss–Legendre quadrature of several functions at once.

use std::collections::BinaryHeap;
use std::sync::LazyLock;

/// Points of the rule on a panel: enough that analytic integrands converge in one or two bisections, few
/// enough that panels at near-singularities are not wasted.
const POINTS: usize = 12;
/// Largest number of panels; beyond it, the error estimate includes the remainder.
const MOST_PANELS: usize = 20_000;
/// Width of panels, relative to their coordinate, below which they are not halved: their points would
/// coincide.
const NARROWEST: f64 = 64.0 * f64::EPSILON;

/// Nodes and weights on [0, 1].
static RULE: LazyLock<Vec<(f64, f64)>> = LazyLock::new(|| gauss_legendre(POINTS));

/// The n-point Gauss–Legendre rule on [0, 1], by Newton's method on the Legendre polynomial.
pub(crate) fn gauss_legendre(n: usize) -> Vec<(f64, f64)> {
    let degree = n as f64;
    let legendre = |x: f64| {
        let (mut p, mut previous) = (x, 1.0);
        for k in 2..=n {
            let k = k as f64;
            (p, previous) = (((2.0 * k - 1.0) * x * p - (k - 1.0) * previous) / k, p);
        }
        (p, degree * (x * p - previous) / (x * x - 1.0))
    };
    let node = |i: usize| {
        let mut x = -(std::f64::consts::PI * (i as f64 + 0.75) / (degree + 0.5)).cos();
        for _ in 0..8 {
            let (p, slope) = legendre(x);
            x -= p / slope;
        }
        let slope = legendre(x).1;
        (0.5 * (1.0 + x), 1.0 / ((1.0 - x * x) * slope * slope))
    };
    (0..n).map(node).collect()
}

/// Integrals, the integral of the integrands' scale, and the estimated sum of the errors.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Quadrature<const N: usize> {
    pub(crate) value: [f64; N],
    pub(crate) scale: f64,
    pub(crate) error: f64,
}

#[derive(Clone, Copy, Debug)]
struct Panel<const N: usize> {
    ends: [f64; 2],
    halves: [[f64; N]; 2],
    scales: [f64; 2],
    error: f64,
}

/// ∫ f over all pieces, on each of which f is analytic, to `tolerance` times the integral of the scale.
///
/// The panel with the largest error is halved. A panel's error is the difference between the rule on the
/// panel and on its halves: this is the error of the coarser value, so the result is better than estimated.
pub(crate) fn adaptive<const N: usize>(
    pieces: &[[f64; 2]],
    mut f: impl FnMut(f64) -> ([f64; N], f64),
    tolerance: f64,
) -> Quadrature<N> {
    let mut heap: BinaryHeap<Panel<N>> = BinaryHeap::with_capacity(2 * pieces.len());
    let (mut error, mut scale) = (0.0, 0.0);
    for &ends in pieces {
        if ends[0] < ends[1] {
            let panel = Panel::new(ends, None, &mut f);
            error += panel.error;
            scale += panel.scales[0] + panel.scales[1];
            heap.push(panel);
        }
    }
    let mut done = vec![];
    // Sums updated once per panel are sufficiently exact: rounding is far below any tolerance in use.
    while error > tolerance * scale && heap.len() + done.len() < MOST_PANELS {
        let Some(panel) = heap.pop() else { break };
        let [a, b] = panel.ends;
        if b - a < NARROWEST * a.abs().max(b.abs()) {
            done.push(panel);
            continue;
        }
        let middle = 0.5 * (a + b);
        error -= panel.error;
        scale -= panel.scales[0] + panel.scales[1];
        for (k, ends) in [[a, middle], [middle, b]].into_iter().enumerate() {
            let half = Panel::new(ends, Some((panel.halves[k], panel.scales[k])), &mut f);
            error += half.error;
            scale += half.scales[0] + half.scales[1];
            heap.push(half);
        }
    }
    done.extend(heap);
    sum(&mut done)
}

/// Sums from left to right, whatever the order of refinement.
fn sum<const N: usize>(panels: &mut [Panel<N>]) -> Quadrature<N> {
    panels.sort_unstable_by(|a, b| a.ends[0].total_cmp(&b.ends[0]));
    let mut total = Quadrature { value: [0.0; N], scale: 0.0, error: 0.0 };
    for panel in panels.iter() {
        for half in panel.halves {
            total.value.iter_mut().zip(half).for_each(|(t, v)| *t += v);
        }
        total.scale += panel.scales[0] + panel.scales[1];
        total.error += panel.error;
    }
    total
}

impl<const N: usize> Panel<N> {
    fn new(
        ends @ [a, b]: [f64; 2],
        whole: Option<([f64; N], f64)>,
        f: &mut impl FnMut(f64) -> ([f64; N], f64),
    ) -> Self {
        let middle = 0.5 * (a + b);
        let (whole, _) = whole.unwrap_or_else(|| rule(ends, f));
        let ((left, s), (right, t)) = (rule([a, middle], f), rule([middle, b], f));
        let error = (0..N).map(|i| (whole[i] - left[i] - right[i]).abs()).sum();
        Self { ends, halves: [left, right], scales: [s, t], error }
    }
}

fn rule<const N: usize>([a, b]: [f64; 2], f: &mut impl FnMut(f64) -> ([f64; N], f64)) -> ([f64; N], f64) {
    let (mut value, mut scale) = ([0.0; N], 0.0);
    for &(t, weight) in RULE.iter() {
        // From the nearer end, for functions that are steep there.
        let x = if t < 0.5 { a + t * (b - a) } else { b - (1.0 - t) * (b - a) };
        let (v, s) = f(x);
        value.iter_mut().zip(v).for_each(|(t, v)| *t += weight * (b - a) * v);
        scale += weight * (b - a) * s;
    }
    (value, scale)
}

impl<const N: usize> PartialEq for Panel<N> {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other).is_eq()
    }
}

impl<const N: usize> Eq for Panel<N> {}

impl<const N: usize> PartialOrd for Panel<N> {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

impl<const N: usize> Ord for Panel<N> {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        self.error.total_cmp(&other.error)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_integrals() {
        let smooth = adaptive(&[[0.0, 2.0]], |x| ([x.exp(), x.powi(3)], x.exp()), 1e-13);
        assert!((smooth.value[0] - (2.0_f64.exp() - 1.0)).abs() < 1e-13);
        assert!((smooth.value[1] - 4.0).abs() < 1e-13);
        let root = adaptive(&[[0.0, 1.0]], |x| ([x.sqrt()], x.sqrt()), 1e-12);
        assert!((root.value[0] - 2.0 / 3.0).abs() < 1e-12, "{root:?}");
        let w = 1e-7_f64;
        let peak = adaptive(&[[0.0, 1.0]], |x| ([w / (x * x + w * w)], w / (x * x + w * w)), 1e-12);
        assert!((peak.value[0] - (1.0 / w).atan()).abs() < 1e-11, "{peak:?}");
    }
}
