//! What to do about the bias of a quotient of two means.

use rand::Rng;

use crate::random::open01;

/// How a finite number of auxiliary rays becomes an estimate of (V, ∇·V).
///
/// X(m) below is the quotient estimate from m rays. Its bias falls as 1/m. All three are linear in
/// the V_i.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Debias {
    /// X(rays): biased, consistent as `rays` grows.
    Consistent {
        /// Auxiliary rays per estimate.
        rays: usize,
    },
    /// X_1 + Σ_k (X_{k+1} − X_k) 1[K > k]/P(K > k), with X_k = X(k · rays) from the first k batches
    /// and P(K > k) = (k + 1)^−tail: the paper's (section 5; Rhee and Glynn 2015), untruncated.
    ///
    /// E|X_{k+1} − X_k|² falls as k⁻³ once the means have settled, so cost and variance are both
    /// finite exactly when 1 < tail < 2. A geometric K, as in released code, has infinite variance
    /// unless it is truncated, and then it is biased.
    RussianRoulette {
        /// Auxiliary rays in a batch.
        rays: usize,
        /// The exponent of the tail of K.
        tail: f64,
    },
    /// Levels l = 0, 1, … of 2ˡ blocks of `rays` each: the mean of X over the blocks, plus for
    /// each level up to L the mean of Δ_l = X(2m) − ½(X(m, first half) + X(m, second half)), m =
    /// 2ˡ⁻¹ `rays`, divided by P(L ≥ l) = `first` · `ratio`^(l−1) (Blanchet and Glynn 2015, in the
    /// coupled-sum form of Rhee and Glynn; every block of every level is used).
    ///
    /// Cost is finite when ratio < 1/2. The variance of Δ_l falls by a factor of 5 to 8 a level at
    /// γ = 3, and by 4 or less as γ nears its bound: it must fall faster than `ratio`.
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
        Self::Multilevel { rays: 8, first: 0.4, ratio: 0.35 }
    }
}

impl Debias {
    /// The expected number of auxiliary rays of one estimate.
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

    /// What is wrong with the parameters, if anything.
    pub(super) fn check(self) -> Result<(), &'static str> {
        match self {
            Self::Consistent { rays: 0 }
            | Self::RussianRoulette { rays: 0, .. }
            | Self::Multilevel { rays: 0, .. } => Err("at least one auxiliary ray is needed"),
            Self::RussianRoulette { tail, .. } if !(tail > 1.0 && tail < 2.0) => {
                Err("Russian roulette has finite cost and variance only for 1 < tail < 2")
            }
            Self::Multilevel { first, .. } if !(first > 0.0 && first <= 1.0) => {
                Err("the multilevel P(L ≥ 1) must be in (0, 1]")
            }
            Self::Multilevel { ratio, .. } if !(ratio > 0.0 && ratio < 0.5) => {
                Err("the multilevel estimate has finite cost only for 0 < ratio < 1/2")
            }
            _ => Ok(()),
        }
    }

    /// Draws how many rays, in how many batches, one estimate takes.
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

    /// Calls `combine(start, end, coefficient)` for each range of batches whose X enters the
    /// estimate; the coefficients sum to 1.
    pub(super) fn combine(self, batches: usize, mut combine: impl FnMut(usize, usize, f64)) {
        match self {
            Self::Consistent { .. } => combine(0, batches, 1.0),
            Self::RussianRoulette { tail, .. } => {
                // Σ by parts: X_k enters with 1/P(K > k−1) and, unless it is the last, −1/P(K > k).
                for k in 1..=batches {
                    let enters = (k as f64).powf(tail);
                    let leaves = if k < batches { (k as f64 + 1.0).powf(tail) } else { 0.0 };
                    combine(0, k, enters - leaves);
                }
            }
            Self::Multilevel { first, ratio, .. } => {
                let levels = batches.ilog2() as i32;
                for level in 0..=levels {
                    // Blocks of 2^level batches: the fine side of level, the coarse of level + 1.
                    let size = 1 << level;
                    let inverse = |l: i32| if l == 0 { 1.0 } else { 1.0 / (first * ratio.powi(l - 1)) };
                    let coarse = if level < levels { inverse(level + 1) } else { 0.0 };
                    let share = size as f64 / batches as f64;
                    let coefficient = (inverse(level) - coarse) * share;
                    (0..batches).step_by(size).for_each(|start| combine(start, start + size, coefficient));
                }
            }
        }
    }
}

/// How many rays one estimate takes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Plan {
    /// Rays in a batch.
    pub(super) rays: usize,
    /// Batches.
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
            for exponent in 0..5 {
                let batches = 1 << exponent;
                let mut sum = 0.0;
                debias.combine(batches, |_, _, c| sum += c);
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
            // K has infinite variance: the mean settles slowly, hence the width.
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
                debias.combine(plan.batches, |a, b, c| x += c * (1.0 + 1.0 / ((b - a) * plan.rays) as f64));
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
    fn bad_parameters_are_named() {
        assert!(Debias::Consistent { rays: 0 }.check().is_err());
        assert!(Debias::RussianRoulette { rays: 1, tail: 2.0 }.check().is_err());
        assert!(Debias::Multilevel { rays: 1, first: 0.5, ratio: 0.5 }.check().is_err());
        assert!(Debias::Multilevel { rays: 1, first: f64::NAN, ratio: 0.3 }.check().is_err());
        assert!(Debias::default().check().is_ok());
    }
}
