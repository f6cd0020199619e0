//! Neural signed distance functions: φ(x) = MLP(γ(x)), with hand-written derivatives.
//!
//! A [`Network`] is fully connected, with softplus of sharpness β between its layers (Gropp et al. 2020; IDR:
//! Yariv et al. 2020) and an optional positional encoding γ. It is an implicit shape, [`Sdf`], evaluated one
//! point at a time in double precision. A [`SingleNetwork`] is its copy for many points at once, in single
//! precision.

mod architecture;
mod batch;
mod eikonal;
mod encoding;
mod neurons;
mod pointwise;
mod products;
mod sphere;

#[cfg(test)]
mod tests;

pub use architecture::Architecture;
pub use batch::SingleNetwork;
pub use eikonal::eikonal_loss;

use flatland::sdf::Sdf;
use flatland::sdf::shapes::ShapeError;
use glam::DVec3;

use self::architecture::Layer;
use crate::lanes::Instructions;

/// Default slope bound of a network.
const SLOPE_BOUND: f64 = 1.5;

/// A fully connected network φ(x) = W_n σ(… σ(W_0 γ(x) + b_0) …) + b_n with softplus σ: an implicit shape.
///
/// # The slope bound
///
/// A sphere tracer steps by φ divided by a bound on |∇φ|. No useful bound is known for networks: the product
/// of the layers' norms is one, but so large that rays would not arrive. The bound is therefore **stated by
/// the user**, 1.5 by default, and not a guarantee: where |∇φ| is larger, rays may pass through the surface.
/// [`greatest_slope`](Self::greatest_slope) measures |∇φ| at given points, for example those at which rays
/// stopped; it detects an excess only at those. The eikonal term keeps |∇φ| near 1 where it is sampled.
#[derive(Clone, Debug)]
pub struct Network {
    architecture: Architecture,
    parameters: Vec<f64>,
    slope_bound: f64,
    /// Instruction set of the machine.
    instructions: Instructions,
}

impl Network {
    /// A network with the given weights: layer by layer, W_k row by row (row = output), then b_k.
    ///
    /// # Errors
    /// If a size is out of range, the number of weights is not [`Architecture::parameter_count`], or one is
    /// not finite.
    pub fn new(architecture: Architecture, parameters: Vec<f64>) -> Result<Self, ShapeError> {
        architecture.check()?;
        let (expected, found) = (architecture.parameter_count(), parameters.len());
        if expected != found {
            return Err(ShapeError::Count { expected, found });
        }
        if let Some(&value) = parameters.iter().find(|p| !p.is_finite()) {
            let (shape, parameter, wanted) = ("network", "weight", "finite");
            return Err(ShapeError::Parameter { shape, parameter, value, wanted });
        }
        Ok(Self { architecture, parameters, slope_bound: SLOPE_BOUND, instructions: Instructions::detect() })
    }

    /// Sets the stated bound on |∇φ|.
    ///
    /// # Errors
    /// If it is not positive and finite.
    pub fn with_slope_bound(self, slope_bound: f64) -> Result<Self, ShapeError> {
        if !(slope_bound.is_finite() && slope_bound > 0.0) {
            let (shape, parameter, wanted) = ("network", "slope_bound", "positive and finite");
            return Err(ShapeError::Parameter { shape, parameter, value: slope_bound, wanted });
        }
        Ok(Self { slope_bound, ..self })
    }

    /// Its architecture.
    #[must_use]
    pub fn architecture(&self) -> Architecture {
        self.architecture
    }

    /// Greatest |∇φ| at the given points; NaN if one is NaN, 0 without points.
    #[must_use]
    pub fn greatest_slope(&self, points: &[DVec3]) -> f64 {
        points.iter().map(|&x| self.jet(x).gradient.length()).max_by(f64::total_cmp).unwrap_or(0.0)
    }

    fn layer(&self, k: usize) -> Layer<'_> {
        self.architecture.layer(&self.parameters, k, self.instructions)
    }
}

/// Results have the same bits on all machines.
impl PartialEq for Network {
    fn eq(&self, other: &Self) -> bool {
        (self.architecture, &self.parameters, self.slope_bound)
            == (other.architecture, &other.parameters, other.slope_bound)
    }
}
