//! Single-precision weights, in the layouts of the products.

use flatland::sdf::shapes::{Parametric, ShapeError};

use super::super::Network;
use super::product::Panels;

/// A hidden layer.
#[derive(Clone, Debug)]
pub(super) struct Layer {
    /// W.
    pub(super) forward: Panels,
    /// Wᵀ.
    pub(super) backward: Panels,
    /// b.
    pub(super) bias: Vec<f32>,
    pub(super) rows: usize,
    pub(super) columns: usize,
}

/// All layers.
#[derive(Clone, Debug)]
pub(super) struct Weights {
    pub(super) sharpness: f32,
    pub(super) frequencies: usize,
    pub(super) inputs: usize,
    pub(super) width: usize,
    pub(super) hidden: Vec<Layer>,
    /// w of φ = w·a + b.
    pub(super) last: Vec<f32>,
    pub(super) last_bias: f32,
    pub(super) count: usize,
}

impl Weights {
    /// Rounds the weights; refuses values beyond the range of single precision.
    pub(super) fn new(network: &Network) -> Result<Self, ShapeError> {
        let architecture = network.architecture();
        let single = |parameter, value: f64| match value as f32 {
            rounded if rounded.is_finite() => Ok(rounded),
            _ => Err(ShapeError::Parameter {
                shape: "network",
                parameter,
                value,
                wanted: "within single precision",
            }),
        };
        let sharpness = single("sharpness", architecture.sharpness)?;
        if !(sharpness.is_normal() && sharpness.recip().is_normal()) {
            let (parameter, value) = ("sharpness", architecture.sharpness);
            let wanted = "within single precision, as its reciprocal must be";
            return Err(ShapeError::Parameter { shape: "network", parameter, value, wanted });
        }
        let parameters: Vec<f32> =
            network.parameters().into_iter().map(|p| single("weight", p)).collect::<Result<_, _>>()?;
        let layer = |k| {
            let ((rows, columns), (weight, bias)) = (architecture.shape(k), architecture.ranges(k));
            let weight = &parameters[weight];
            Layer {
                forward: Panels::new(rows, columns, |i, j| weight[i * columns + j]),
                backward: Panels::new(columns, rows, |j, i| weight[i * columns + j]),
                bias: parameters[bias].to_vec(),
                rows,
                columns,
            }
        };
        let (last, last_bias) = architecture.ranges(architecture.hidden);
        Ok(Self {
            sharpness,
            frequencies: architecture.frequencies,
            inputs: architecture.inputs(),
            width: architecture.width,
            hidden: (0..architecture.hidden).map(layer).collect(),
            last: parameters[last].to_vec(),
            last_bias: parameters[last_bias.start],
            count: parameters.len(),
        })
    }
}
