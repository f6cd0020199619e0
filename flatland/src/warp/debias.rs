//! Debiasing of a quotient of two means (Theory 4).

use rand::Rng;

use crate::random::open01;

/// Scheme that turns a finite number of auxiliary rays into an estimate of (V, ∇·V).
///
/// X(m) below is the quotient estimate from m rays. Its bias falls as 1/m. All three schemes are linear in
/// the V_i.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Debias {
    /// X(rays): biased, consistent as `rays` grows.
    Consistent {
        /// Auxiliary rays per estimate.
        rays: usize,
    },
    /// X_1 + Σ (X_{k+1} − X_k)/P(K > k) over 1 ≤ k < K, with X_k = X(k · rays) from the first k batches and
    /// P(K > k) = (k + 1)^−tail: the published scheme (Rhee and Glynn 2015), untruncated.
    ///
    /// Unbiased. The expected number of rays is finite for tail > 1, the variance only for tail < 1: no tail
    /// has both properties, and errors fall more slowly than n^−½ (Theory 4). Prefer
    /// [`Multilevel`](Self::Multilevel).
    RussianRoulette {
        /// Auxiliary rays in a batch.
        rays: usize,
        /// Exponent of the tail of K.
        tail: f64,
    },
    /// X(rays), plus for each level l up to a random L the difference Δ_l = X(2m) − mean of X(m) over halves,
    /// m = 2ˡ⁻¹ `rays`, divided by P(L ≥ l) = `first` · `ratio`^(l−1) (Blanchet and Glynn 2015, in the
    /// coupled-sum form of Rhee and Glynn 2015). All rays serve all levels.
    ///
    /// Δ_l is averaged over up to 15 splits, along the rows of a Hadamard matrix. In blocks of up to 16 pairs
    /// every two are then together nearly as often as apart (7 times to 8), and products of two points nearly
    /// cancel, without additional rays.
    ///
    /// The cost is finite if ratio < 1/2. With a the radial exponent, the variance is finite if `ratio`
    /// exceeds 2^−1/(2a) for B ~ s² and γ = 3/2, and 2^−1/(3a) for B ~ s and γ = 3 (Theory 4). That holds for
    /// the default; points distributed as the kernel (a = 1) require `ratio` > 0.71 or 0.79, which no finite
    /// cost allows. Where silhouettes of *different* motions meet in a point (n = 2) or are close (n = 1, as
    /// in every penumbra), the variance is infinite, as for every scheme with finite cost: errors fall
    /// slightly more slowly than n^−½, and short runs underestimate both means and errors.
    Multilevel {
        /// Auxiliary rays in a block.
        rays: usize,
        /// P(L ≥ 1).
        first: f64,
        /// P(L ≥ l + 1)/P(L ≥ l) for l ≥ 1.
        ratio: f64,
    },
}

impl Default for Debias {
    fn default() -> Self {
        Self::Multilevel { rays: 4, first: 0.3, ratio: 0.4 }
    }
}

impl Debias {
    /// Expected number of auxiliary rays of one estimate.
    #[must_use]
    pub fn expected_rays(self) -> f64 {
        match self {
            Self::Consistent { rays } => rays as f64,
            Self::RussianRoulette { rays, tail } => rays as f64 * zeta(tail),
            Self::Multilevel { rays, first, ratio } => {
                // E 2ᴸ = 1 + Σ_l P(L ≥ l) (2ˡ − 2ˡ⁻¹)
                rays as f64 * (1.0 + first / (1.0 - 2.0 * ratio))
            }
        }
    }

    /// Whether the estimate is unbiased for every number of rays.
    #[must_use]
    pub fn is_unbiased(self) -> bool {
        !matches!(self, Self::Consistent { .. })
    }

    /// Checks the parameters; returns the violation.
    pub(super) fn check(self) -> Result<(), &'static str> {
        match self {
            Self::Consistent { rays: 0 }
            | Self::RussianRoulette { rays: 0, .. }
            | Self::Multilevel { rays: 0, .. } => Err("at least one auxiliary ray is needed"),
            Self::RussianRoulette { tail, .. } if !(tail > 1.0 && tail < 2.0) => Err(
                "Russian roulette takes 1 < tail < 2: a finite number of rays, and not more noise than need be",
            ),
            Self::Multilevel { first, .. } if !(first > 0.0 && first <= 1.0) => {
                Err("the multilevel P(L ≥ 1) must be in (0, 1]")
            }
            Self::Multilevel { ratio, .. } if !(ratio > 0.0 && ratio < 0.5) => {
                Err("the multilevel estimate has finite cost only for 0 < ratio < 1/2")
            }
            _ => Ok(()),
        }
    }

    /// Draws the number of rays and batches of one estimate.
    pub(super) fn plan(self, rng: &mut impl Rng) -> Plan {
        match self {
            Self::Consistent { rays } => Plan { rays, batches: 1 },
            Self::RussianRoulette { rays, tail } => {
                // K > k if and only if ξ < (k + 1)^−tail, so K = ⌈ξ^(−1/tail)⌉ − 1 rounded up to 1.
                let reach = open01(rng).powf(-1.0 / tail);
                Plan { rays, batches: (reach.ceil() as usize - 1).max(1) }
            }
            Self::Multilevel { rays, first, ratio } => {
                let mut levels = 0;
                let mut survival = first;
                let xi = open01(rng);
                while xi < survival {
                    levels += 1;
                    survival *= ratio;
                }
                Plan { rays, batches: 1 << levels }
            }
        }
    }

    /// Calls `combine` for each subset of the rays whose X enters the estimate, with its coefficient; the
    /// coefficients sum to 1. `unit` rays are drawn jointly and stay together.
    pub(super) fn combine(self, plan: Plan, unit: usize, mut combine: impl FnMut(Subset, f64)) {
        let Plan { rays, batches } = plan;
        match self {
            Self::Consistent { .. } => combine(Subset::all(0, rays * batches), 1.0),
            Self::RussianRoulette { tail, .. } => {
                // Summation by parts: X_k enters with 1/P(K > k−1) and, unless it is the last, −1/P(K > k).
                for k in 1..=batches {
                    let enters = (k as f64).powf(tail);
                    let leaves = if k < batches { (k as f64 + 1.0).powf(tail) } else { 0.0 };
                    combine(Subset::all(0, k * rays), enters - leaves);
                }
            }
            Self::Multilevel { first, ratio, .. } => {
                let total = rays * batches;
                for start in (0..total).step_by(rays) {
                    combine(Subset::all(start, start + rays), 1.0 / batches as f64);
                }
                let mut inverse = 1.0 / first;
                let mut size = 2 * rays;
                while size <= total {
                    let share = inverse * size as f64 / total as f64;
                    for start in (0..total).step_by(size) {
                        Subset::difference(start, size, unit, share, &mut combine);
                    }
                    inverse /= ratio;
                    size *= 2;
                }
            }
        }
    }
}

/// Rays start .. end, or the half of them whose unit, counted from the start, has bits of the given parity in
/// the mask.
#[derive(Clone, Copy, Debug)]
pub(super) struct Subset {
    start: usize,
    end: usize,
    unit: usize,
    mask: usize,
    parity: u32,
}

impl Subset {
    pub(super) fn all(start: usize, end: usize) -> Self {
        Self { start, end, unit: 1, mask: 0, parity: 0 }
    }

    /// Calls `combine` for the terms of `share` · Δ over `size` rays from `start`: X of all of them, less the
    /// mean over splits of X of their halves.
    pub(super) fn difference(
        start: usize,
        size: usize,
        unit: usize,
        share: f64,
        mut combine: impl FnMut(Self, f64),
    ) {
        // Rows of a Hadamard matrix: halves by the parity of the bits in a mask.
        let rows = (1 << (size / unit).trailing_zeros()).min(16);
        let whole = Self::all(start, start + size);
        combine(whole, share);
        for mask in 1..rows {
            for parity in [0, 1] {
                combine(Self { mask, parity, unit, ..whole }, -0.5 * share / (rows - 1) as f64);
            }
        }
    }

    /// Indices of the rays in it.
    pub(super) fn indices(self) -> impl Iterator<Item = usize> + Clone {
        let Self { start, end, unit, mask, parity } = self;
        (start..end)
            .step_by(unit)
            .filter_map(move |i| {
                let inside = (((i - start) / unit) & mask).count_ones() & 1 == parity;
                inside.then(|| i..i + unit)
            })
            .flatten()
    }
}

/// Number of rays of one estimate.
#[derive(Clone, Copy, Debug)]
pub(super) struct Plan {
    /// Rays in a batch.
    pub(super) rays: usize,
    /// Number of batches.
    pub(super) batches: usize,
}

/// Riemann's ζ(s) for s > 1: the mean of K, Σ P(K > k), by Euler–Maclaurin summation.
fn zeta(s: f64) -> f64 {
    let n = 20.0_f64;
    let head: f64 = (1..20).map(|k| f64::from(k).powf(-s)).sum();
    head + n.powf(1.0 - s) / (s - 1.0) + 0.5 * n.powf(-s) + s / 12.0 * n.powf(-s - 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::stream;

    const ALL: [Debias; 3] = [
        Debias::Consistent { rays: 6 },
        Debias::RussianRoulette { rays: 4, tail: 1.75 },
        Debias::Multilevel { rays: 4, first: 0.5, ratio: 0.2 },
    ];

    #[test]
    fn coefficients_sum_to_one() {
        for debias in ALL {
            for exponent in 0..8 {
                let batches = 1 << exponent;
                let mut sum = 0.0;
                debias.combine(Plan { rays: 4, batches }, 2, |_, c| sum += c);
                assert!((sum - 1.0).abs() < 1e-9, "{debias:?} {batches} {sum}");
            }
        }
    }

    #[test]
    fn plans_cost_what_is_expected() {
        for debias in ALL {
            let mut rng = stream(11, &[]);
            let n = 400_000;
            let rays = |p: Plan| (p.rays * p.batches) as f64;
            let mean = (0..n).map(|_| rays(debias.plan(&mut rng))).sum::<f64>() / f64::from(n);
            // K has infinite variance: the mean converges slowly, hence the tolerance.
            assert!((mean / debias.expected_rays() - 1.0).abs() < 0.05, "{debias:?} {mean}");
        }
    }

    #[test]
    fn telescopes_to_the_limit() {
        // With X(m) = 1 + 1/m, a bias of 1/m, the mean over plans must be 1.
        for debias in ALL.into_iter().filter(|d| d.is_unbiased()) {
            let mut rng = stream(12, &[]);
            let n = 400_000;
            let (mut sum, mut squares) = (0.0, 0.0);
            for _ in 0..n {
                let plan = debias.plan(&mut rng);
                let mut x = 0.0;
                debias.combine(plan, 2, |s, c| x += c * (1.0 + 1.0 / s.indices().count() as f64));
                sum += x;
                squares += x * x;
            }
            let n = f64::from(n);
            let error = ((squares / n - (sum / n).powi(2)) / n).sqrt();
            assert!((sum / n - 1.0).abs() < 5.0 * error, "{debias:?} {} ± {error}", sum / n);
            assert!(error < 2e-3, "{debias:?} {error}");
        }
    }

    #[test]
    fn halves_are_halves_and_every_two_units_meet_equally_often() {
        let debias = Debias::Multilevel { rays: 4, first: 0.5, ratio: 0.3 };
        let mut together = [[0; 16]; 16];
        debias.combine(Plan { rays: 4, batches: 4 }, 1, |s, _| {
            let members: Vec<_> = s.indices().collect();
            if members.len() == 8 && s.mask != 0 {
                for &i in &members {
                    members.iter().for_each(|&j| together[i][j] += 1);
                }
            }
        });
        let expected: [[i32; 16]; 16] =
            std::array::from_fn(|i| std::array::from_fn(|j| if i == j { 15 } else { 7 }));
        assert_eq!(together, expected);
    }

    #[test]
    fn bad_parameters_are_named() {
        assert!(Debias::Consistent { rays: 0 }.check().is_err());
        assert!(Debias::RussianRoulette { rays: 1, tail: 2.0 }.check().is_err());
        assert!(Debias::Multilevel { rays: 1, first: 0.5, ratio: 0.5 }.check().is_err());
        assert!(Debias::Multilevel { rays: 1, first: f64::NAN, ratio: 0.3 }.check().is_err());
        assert!(Debias::default().check().is_ok());
    }
}
