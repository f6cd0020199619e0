//! Boundary functions B, which map the distance to the nearest discontinuity to a weight.

/// B(s) of the distance s from an auxiliary hit to the end of the object hit: 0 at the end and 1 far from it.
///
/// The quadratic one is the default: w = (D + B)^−γ is then a power of a quadratic form around a boundary,
/// equal at all scales. Resolving a strip of width s about it takes only s⁻² rays instead of s⁻³. Existing
/// renderers use the functions scaled by the scene, provided for comparison: they do not depend on κ, so
/// their bias at a fixed number of rays depends on the scale of the scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum BoundaryFunction {
    /// min(1, c s √κ): the distance in units of the kernel's width. Linear, p = 1.
    KernelScaled {
        /// c; 0.6 keeps the bias of 16 rays smallest at γ = 3.
        scale: f64,
    },
    /// min(1, c s): the distance in the scene's unit, as the edge distance of Bangaru et al. (2020) and, with
    /// p = 1 at a smooth silhouette, Mitsuba's (n·d)². Linear, p = 1.
    SceneScaled {
        /// c, per unit of length.
        scale: f64,
    },
    /// min(1, √(c s)), as |n·d| behaves near a smooth silhouette. p = 1/2, so it requires γ ≥ 5/2 in two
    /// dimensions.
    Grazing {
        /// c, per unit of length.
        scale: f64,
    },
    /// min(1, (c s √κ)²): quadratic, p = 2, in units of the kernel's width. Allows γ > 1 in two dimensions.
    KernelScaledSquared {
        /// c; between 0.1 and 0.6 the variance of the unbiased estimate hardly changes.
        scale: f64,
    },
}

impl Default for BoundaryFunction {
    fn default() -> Self {
        Self::KernelScaledSquared { scale: 0.4 }
    }
}

impl BoundaryFunction {
    /// B at `distance`, for a kernel of concentration `kappa`.
    #[must_use]
    pub fn value(self, distance: f64, kappa: f64) -> f64 {
        let relative = distance / self.reach(kappa);
        match self {
            Self::KernelScaled { .. } | Self::SceneScaled { .. } => relative.min(1.0),
            Self::Grazing { .. } => relative.sqrt().min(1.0),
            Self::KernelScaledSquared { .. } => (relative * relative).min(1.0),
        }
    }

    /// Distance from which B = 1: nothing beyond it need be searched.
    #[must_use]
    pub fn reach(self, kappa: f64) -> f64 {
        match self {
            Self::KernelScaled { scale } | Self::KernelScaledSquared { scale } => {
                1.0 / (scale * kappa.sqrt())
            }
            Self::SceneScaled { scale } | Self::Grazing { scale } => 1.0 / scale,
        }
    }

    /// p, with B ~ sᵖ at the boundary. The field is boundary consistent if and only if pγ ≥ 1 for
    /// n = 1 and γ ≥ 1/p + 1/2 for n = 2.
    #[must_use]
    pub fn order(self) -> f64 {
        match self {
            Self::KernelScaled { .. } | Self::SceneScaled { .. } => 1.0,
            Self::Grazing { .. } => 0.5,
            Self::KernelScaledSquared { .. } => 2.0,
        }
    }

    pub(super) fn scale(self) -> f64 {
        match self {
            Self::KernelScaled { scale }
            | Self::SceneScaled { scale }
            | Self::Grazing { scale }
            | Self::KernelScaledSquared { scale } => scale,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reaches_one_at_its_reach_and_vanishes_with_its_order() {
        let all = [
            BoundaryFunction::default(),
            BoundaryFunction::SceneScaled { scale: 2.0 },
            BoundaryFunction::Grazing { scale: 2.0 },
            BoundaryFunction::KernelScaledSquared { scale: 0.6 },
        ];
        for b in all {
            let (kappa, reach) = (400.0, b.reach(400.0));
            assert_eq!(b.value(0.0, kappa), 0.0);
            assert_eq!(b.value(reach, kappa), 1.0);
            assert_eq!(b.value(9.0 * reach, kappa), 1.0);
            let ratio = b.value(0.02 * reach, kappa) / b.value(0.01 * reach, kappa);
            assert!((ratio - 2.0_f64.powf(b.order())).abs() < 1e-12);
        }
    }
}
