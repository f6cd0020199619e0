//! Neural signed distance functions: φ(x) = MLP(γ(x)), with derivatives by hand.
//!
//! A [`Network`] is fully connected, with softplus of sharpness β between its layers (Gropp et al. 2020; IDR: Yariv et al. 2020) and,
//! if asked for, the positional encoding γ before them. It is an implicit shape like any other, [`Sdf`], one
//! point at a time and in double precision. A [`SingleNetwork`] is its copy for many points at once, in single precision.

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

/// The slope bound of a network for which none was stated.
const SLOPE_BOUND: f64 = 1.5;

/// A fully connected network φ(x) = W_n σ(… σ(W_0 γ(x) + b_0) …) + b_n with softplus σ: an implicit shape.
///
/// # Its slope bound
///
/// A sphere tracer steps by φ over a bound on |∇φ|. Of a network no useful bound is known: the product of its layers' norms is
/// one, and so large that rays would not arrive. So the bound here is **what the user states**, 1.5 if nothing, and
/// not a guarantee: where |∇φ| is larger, rays may pass through. [`greatest_slope`](Self::greatest_slope) measures |∇φ| at given points,
/// say those at which rays stopped: it tells of every excess that was visited, and not of others. The eikonal term keeps |∇φ|
/// near 1 where it is sampled.
#[derive(Clone, Debug)]
pub struct Network {
    architecture: Architecture,
    parameters: Vec<f64>,
    slope_bound: f64,
    /// Those of the machine.
    instructions: Instructions,
}

impl Network {
    /// A network with the given weights: layer by layer W_k row by row (row = output), then b_k.
    ///
    /// # Errors
    /// If a size is out of range, their number is not [`Architecture::parameter_count`], or one is not finite.
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

    /// The same network with another stated bound on |∇φ|.
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

    /// Its sizes.
    #[must_use]
    pub fn architecture(&self) -> Architecture {
        self.architecture
    }

    /// The greatest |∇φ| at the given points; NaN if one is, 0 if there are none.
    #[must_use]
    pub fn greatest_slope(&self, points: &[DVec3]) -> f64 {
        points.iter().map(|&x| self.jet(x).gradient.length()).max_by(f64::total_cmp).unwrap_or(0.0)
    }

    fn layer(&self, k: usize) -> Layer<'_> {
        self.architecture.layer(&self.parameters, k, self.instructions)
    }
}

/// All machines find the same bits.
impl PartialEq for Network {
    fn eq(&self, other: &Self) -> bool {
        (self.architecture, &self.parameters, self.slope_bound)
            == (other.architecture, &other.parameters, other.slope_bound)
    }
}
