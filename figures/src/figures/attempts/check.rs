//! V by quadrature, the reference for the estimates.

use glam::DVec2;
use rayon::prelude::*;

use super::edge::{Edge, KAPPA, Profile, Weight};

/// Half the side of the square over which weights are integrated, in kernel widths.
const SQUARE: f64 = 6.0;
/// Points of a rule on an interval.
const POINTS: u32 = 160;
/// Stride of checked readings.
const EVERY: usize = 7;

/// V·n of one attempt at one place by quadrature.
#[derive(Clone, Copy, Debug)]
pub(super) struct Check {
    /// Index of the profile.
    pub(super) attempt: usize,
    pub(super) x: f64,
    pub(super) exact: f64,
    pub(super) estimate: f64,
    pub(super) error: f64,
}

impl Check {
    /// The estimate's deviation in standard errors.
    pub(super) fn deviation(&self) -> f64 {
        (self.estimate - self.exact).abs() / self.error
    }
}

/// The moving side's share of ∫ w(u, u') du', which is V·n at u, and the integral itself, for a weight that
/// is even about the line across the silhouette.
pub(super) fn share(u: DVec2, w: impl Fn(DVec2) -> f64) -> (f64, f64) {
    // w is discontinuous at the silhouette and peaks there and at u: both are ends of intervals.
    let ends = [u.x - SQUARE, u.x.min(0.0), u.x.max(0.0), u.x + SQUARE];
    let (mut moving, mut all) = (0.0, 0.0);
    for interval in ends.windows(2) {
        crowded(interval[0], interval[1], |x, wx| {
            crowded(0.0, SQUARE, |y, wy| {
                let value = 2.0 * wx * wy * w(DVec2::new(x, y));
                all += value;
                moving += if x < 0.0 { value } else { 0.0 };
            });
        });
    }
    (moving / all, all)
}

/// The midpoint rule after x = a + (b − a)(10t³ − 15t⁴ + 6t⁵), which crowds points at both ends.
fn crowded(a: f64, b: f64, mut visit: impl FnMut(f64, f64)) {
    for i in 0..POINTS {
        let t = (f64::from(i) + 0.5) / f64::from(POINTS);
        let x = t * t * t * (10.0 + t * (6.0 * t - 15.0));
        let slope = 30.0 * (t * (1.0 - t)).powi(2);
        visit(a + (b - a) * x, (b - a) * slope / f64::from(POINTS));
    }
}

/// The Gaussian kernel, not normalised.
pub(super) fn kernel(u: DVec2, other: DVec2) -> f64 {
    (-0.5 * KAPPA * (other - u).length_squared()).exp()
}

/// Checks attempts 2 and 3 at some of their readings.
pub(super) fn all(edge: &Edge, profiles: &[Profile]) -> Vec<Check> {
    let checked = |attempt: usize, share_at: &(dyn Fn(DVec2) -> f64 + Sync)| -> Vec<Check> {
        let readings: Vec<_> = profiles[attempt].readings.iter().skip(EVERY / 2).step_by(EVERY).collect();
        let check = |r: &&super::edge::Reading| {
            let exact = share_at(DVec2::new(r.x, 0.0));
            Check { attempt, x: r.x, exact, estimate: r.value[0], error: r.error[0] }
        };
        readings.par_iter().map(check).collect()
    };
    let [quadratic, linear] = Weight::both();
    let scene = &edge.scene;
    let mut checks = checked(1, &|u| share(u, |p| kernel(u, p)).0);
    for (attempt, weight) in [(2, quadratic), (3, linear)] {
        checks.extend(checked(attempt, &|u| share(u, |p| weight.value(scene, u, p)).0));
    }
    checks
}
