//! Network architecture: layers, sizes, and the layout of weights.

use std::ops::Range;

use flatland::sdf::shapes::ShapeError;

use super::products::Matrix;
use crate::lanes::Instructions;

/// Largest number of frequencies: 2³² rotations per unit exceed the resolution of single precision.
const MAX_FREQUENCIES: usize = 32;

/// Largest numbers of hidden layers, and of neurons per layer.
const MAX_SIZES: [usize; 2] = [64, 4096];

/// Sizes and fixed hyperparameters of a network.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Architecture {
    /// Number of hidden layers, 1 to 64: 4 suffice for a smooth object; IDR has 8.
    pub hidden: usize,
    /// Neurons per hidden layer, 1 to 4096.
    pub width: usize,
    /// β > 0, the sharpness of softplus σ(z) = ln(1 + e^{βz})/β. Second derivatives grow with β, as creases
    /// require.
    pub sharpness: f64,
    /// L, the number of frequencies 1, 2, …, 2^{L−1} of the encoding, at most 32. 0 for the coordinates
    /// alone; IDR has 6, for detail in an object of about unit size.
    pub frequencies: usize,
}

impl Default for Architecture {
    /// 4 layers of 64 neurons, β = 100, no frequencies.
    fn default() -> Self {
        Self { hidden: 4, width: 64, sharpness: 100.0, frequencies: 0 }
    }
}

impl Architecture {
    /// Refuses invalid sizes.
    pub(crate) fn check(&self) -> Result<(), ShapeError> {
        let Self { hidden, width, sharpness, frequencies } = *self;
        let refuse = |parameter, value, wanted| {
            Err(ShapeError::Parameter { shape: "network", parameter, value, wanted })
        };
        if !(1..=MAX_SIZES[0]).contains(&hidden) {
            return refuse("hidden", hidden as f64, "1 to 64");
        }
        if !(1..=MAX_SIZES[1]).contains(&width) {
            return refuse("width", width as f64, "1 to 4096");
        }
        if !(sharpness.is_finite() && sharpness > 0.0) {
            return refuse("sharpness", sharpness, "positive and finite");
        }
        if frequencies > MAX_FREQUENCIES {
            return refuse("frequencies", frequencies as f64, "at most 32");
        }
        Ok(())
    }

    /// Number of components of γ(x).
    pub(super) fn inputs(&self) -> usize {
        3 + 6 * self.frequencies
    }

    /// Number of layers with weights: the hidden ones, and the output.
    pub(crate) fn layers(&self) -> usize {
        self.hidden + 1
    }

    /// Rows (outputs) and columns (inputs) of W_k.
    pub(crate) fn shape(&self, k: usize) -> (usize, usize) {
        let rows = if k == self.hidden { 1 } else { self.width };
        let columns = if k == 0 { self.inputs() } else { self.width };
        (rows, columns)
    }

    /// p, the number of all weights and biases.
    #[must_use]
    pub fn parameter_count(&self) -> usize {
        (0..self.layers()).map(|k| self.shape(k)).map(|(rows, columns)| rows * (columns + 1)).sum()
    }

    /// Ranges of W_k and b_k in the parameters: layer by layer, W_k row by row, then b_k.
    pub(crate) fn ranges(&self, k: usize) -> (Range<usize>, Range<usize>) {
        let inner = (0..k).map(|k| self.shape(k)).map(|(rows, columns)| rows * (columns + 1)).sum::<usize>();
        let (rows, columns) = self.shape(k);
        let bias = inner + rows * columns;
        (inner..bias, bias..bias + rows)
    }

    /// A layer of the given parameters.
    pub(super) fn layer<'p>(&self, parameters: &'p [f64], k: usize, instructions: Instructions) -> Layer<'p> {
        let (weight, bias) = self.ranges(k);
        let columns = self.shape(k).1;
        let weight = Matrix { entries: &parameters[weight], columns, instructions };
        Layer { weight, bias: &parameters[bias] }
    }
}

/// W and b.
#[derive(Clone, Copy)]
pub(super) struct Layer<'p> {
    pub(super) weight: Matrix<'p>,
    pub(super) bias: &'p [f64],
}
