//! Parameters of the warp estimate.

use super::auxiliary::AuxiliaryPoints;
use super::boundary::BoundaryFunction;
use super::debias::Debias;

/// The weight w(u, u').
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Weighting {
    /// w = (D + B)^−γ: continuous and boundary consistent. The published method ("attempt 3").
    BoundaryAware {
        /// γ. The larger, the more closely V follows the velocities near a boundary, and the larger its
        /// variance there. 3/2 is the default with a quadratic B, 3 is the paper's with a linear one.
        gamma: f64,
        /// B.
        boundary: BoundaryFunction,
    },
    /// w = e⁻ˣ, the kernel itself: continuous, not boundary consistent, biased ("attempt 2").
    Gaussian,
}

impl Default for Weighting {
    fn default() -> Self {
        Self::BoundaryAware { gamma: 1.5, boundary: BoundaryFunction::default() }
    }
}

/// All parameters of the warp estimate except the kernel's concentration, which depends on the place: the
/// pixel, the lobe, the emitter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Warp {
    /// The weight.
    pub weighting: Weighting,
    /// The pattern of auxiliary points.
    pub points: AuxiliaryPoints,
    /// Radial exponent: 1 distributes points as the kernel, as in the paper; smaller values place more of
    /// them near u, where the weight of a boundary is decided. The field is the same.
    pub radial_exponent: f64,
    /// Number of points, and the debiasing scheme.
    pub debias: Debias,
}

impl Default for Warp {
    fn default() -> Self {
        Self {
            weighting: Weighting::default(),
            points: AuxiliaryPoints::default(),
            radial_exponent: 0.3,
            debias: Debias::default(),
        }
    }
}

/// Invalid parameters of the warp estimate.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum WarpError {
    /// γ must be positive and finite.
    #[error("the exponent γ = {gamma} is not positive and finite")]
    Gamma {
        /// γ.
        gamma: f64,
    },
    /// The boundary function's scale must be positive and finite.
    #[error("the boundary function's scale {scale} is not positive and finite")]
    Scale {
        /// The scale.
        scale: f64,
    },
    /// The concentration κ must be positive and finite.
    #[error("the concentration κ = {kappa} is not positive and finite")]
    Kappa {
        /// κ.
        kappa: f64,
    },
    /// The reach of a mean over discontinuities must be positive and finite.
    #[error("the reach R = {reach} is not positive and finite")]
    Reach {
        /// R.
        reach: f64,
    },
    /// The radial exponent must be in [0.1, 1]: below, distances underflow.
    #[error("the radial exponent {radial_exponent} is not in [0.1, 1]")]
    RadialExponent {
        /// The radial exponent.
        radial_exponent: f64,
    },
    /// A debiasing scheme with infinite cost or no rays.
    #[error("{what}")]
    Debias {
        /// The violation.
        what: &'static str,
    },
}

impl Warp {
    /// The original estimate, γ = 3 and points distributed as the kernel, with a linear B in units of the
    /// kernel's width (the original's does not depend on it) and a fixed number of rays.
    #[must_use]
    pub fn original(rays: usize) -> Self {
        Self {
            weighting: Weighting::BoundaryAware {
                gamma: 3.0,
                boundary: BoundaryFunction::KernelScaled { scale: 0.6 },
            },
            points: AuxiliaryPoints::Antithetic,
            radial_exponent: 1.0,
            debias: Debias::Consistent { rays },
        }
    }

    /// Parameters with the least variance × rays on the line and the circle, for shadows and reflections in
    /// several worlds: strata fill one dimension evenly, so that larger blocks need fewer levels, and γ = 1
    /// with B ~ s², twice its bound for n = 1, makes V least steep.
    ///
    /// Its variance is *not* known to be finite in light transport: see [`Debias::Multilevel`].
    #[must_use]
    pub fn one_dimensional() -> Self {
        Self {
            weighting: Weighting::BoundaryAware { gamma: 1.0, boundary: BoundaryFunction::default() },
            points: AuxiliaryPoints::Stratified,
            radial_exponent: 0.5,
            debias: Debias::Multilevel { rays: 8, first: 0.15, ratio: 0.3 },
        }
    }

    /// 1 − B at a distance from the end of the object hit: 1 at the end, 0 far from it.
    #[must_use]
    pub fn falloff(&self, distance: f64, kappa: f64) -> f64 {
        match self.weighting {
            Weighting::BoundaryAware { boundary, .. } => 1.0 - boundary.value(distance, kappa),
            Weighting::Gaussian => 1.0,
        }
    }

    /// Checks the parameters once, so that [`stencil`](Self::stencil) need not.
    ///
    /// # Errors
    /// A [`WarpError`] that names the parameter.
    pub fn check(&self, kappa: f64) -> Result<(), WarpError> {
        let positive = |x: f64| x > 0.0 && x.is_finite();
        if !positive(kappa) {
            return Err(WarpError::Kappa { kappa });
        }
        if let Weighting::BoundaryAware { gamma, boundary } = self.weighting {
            if !positive(gamma) {
                return Err(WarpError::Gamma { gamma });
            }
            if !positive(boundary.scale()) {
                return Err(WarpError::Scale { scale: boundary.scale() });
            }
        }
        if !(self.radial_exponent >= 0.1 && self.radial_exponent <= 1.0) {
            return Err(WarpError::RadialExponent { radial_exponent: self.radial_exponent });
        }
        self.debias.check().map_err(|what| WarpError::Debias { what })
    }

    /// Distance beyond which boundaries are irrelevant: [`stencil`](Self::stencil)'s `trace` may stop
    /// searching there.
    #[must_use]
    pub fn reach(&self, kappa: f64) -> f64 {
        match self.weighting {
            Weighting::BoundaryAware { boundary, .. } => boundary.reach(kappa),
            Weighting::Gaussian => 0.0,
        }
    }
}
