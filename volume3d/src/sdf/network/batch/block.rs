//! Intermediate values of the sweeps over one block of points.

use flatland::sdf::Jet;
use glam::DVec3;

use super::outer::OuterSum;
use super::product::{BLOCK, Row, TALL};
use super::weights::Weights;

/// Per-thread memory, reused for every block.
#[derive(Debug)]
pub(super) struct Block {
    /// γ(x).
    pub(super) features: Vec<Row>,
    /// Derivative of each component by the single coordinate on which it depends.
    pub(super) feature_slopes: Vec<Row>,
    /// a_k of every hidden layer.
    pub(super) values: Vec<Vec<Row>>,
    /// σ′.
    pub(super) slopes: Vec<Vec<Row>>,
    /// ȧ_{k−1}, from the features to the last hidden layer.
    pub(super) tangents: Vec<Vec<Row>>,
    /// u = ∂φ/∂a, and its scratch space.
    pub(super) adjoint: [Vec<Row>; 2],
    /// v, and its scratch space.
    pub(super) bent: [Vec<Row>; 2],
}

/// Intermediate values that a task needs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Needs {
    Values,
    Jets,
    Gradient,
}

impl Block {
    pub(super) fn new(weights: &Weights, needs: Needs) -> Self {
        let rows = |count: usize| vec![[0.0; BLOCK]; count.next_multiple_of(TALL)];
        let layers = |count: usize| vec![rows(weights.width); count];
        let (hidden, widest) = (weights.hidden.len(), weights.width.max(weights.inputs));
        let some = |needed, count| if needed { count } else { 0 };
        let (slopes, tangents) = (needs != Needs::Values, needs == Needs::Gradient);
        let mut all_tangents = layers(some(tangents, hidden));
        all_tangents.insert(0, rows(some(tangents, weights.inputs)));
        Self {
            features: rows(weights.inputs),
            feature_slopes: rows(weights.inputs),
            values: layers(if slopes { hidden } else { 2 }),
            slopes: layers(some(slopes, hidden)),
            tangents: all_tangents,
            adjoint: [(); 2].map(|()| rows(some(slopes, widest))),
            bent: [(); 2].map(|()| rows(some(tangents, widest))),
        }
    }

    /// Loads a nonempty block of points; unused lanes repeat the last one.
    pub(super) fn load(&mut self, points: &[DVec3], frequencies: usize) {
        for p in 0..BLOCK {
            let x = points[p.min(points.len() - 1)];
            for axis in 0..3 {
                self.features[axis][p] = x[axis] as f32;
                self.feature_slopes[axis][p] = 1.0;
                self.load_waves(p, axis, x[axis], frequencies);
            }
        }
    }

    /// sin 2^k x and cos 2^k x, by angle doubling in double precision: the error doubles with each frequency,
    /// to less than 10⁻⁶ at 2³¹.
    fn load_waves(&mut self, p: usize, axis: usize, x: f64, frequencies: usize) {
        if frequencies == 0 {
            return;
        }
        let ((mut sin, mut cos), mut f) = (x.sin_cos(), 1.0);
        for octave in 0..frequencies {
            let j = 3 + 6 * octave + axis;
            (self.features[j][p], self.feature_slopes[j][p]) = (sin as f32, (f * cos) as f32);
            (self.features[j + 3][p], self.feature_slopes[j + 3][p]) = (cos as f32, (-f * sin) as f32);
            (sin, cos) = (2.0 * sin * cos, (cos - sin) * (cos + sin));
            f *= 2.0;
        }
    }
}

/// c and q of a block of covectors; 0 in unused lanes.
pub(super) fn covectors(covectors: &[Jet<DVec3>]) -> (Row, [Row; 3]) {
    let (mut c, mut q) = ([0.0; BLOCK], [[0.0; BLOCK]; 3]);
    for (p, covector) in covectors.iter().enumerate() {
        c[p] = covector.value as f32;
        for (row, q) in q.iter_mut().zip(covector.gradient.to_array()) {
            row[p] = q as f32;
        }
    }
    (c, q)
}

/// Gradient by all weights, summed over the blocks of one group.
#[derive(Debug)]
pub(super) struct Sums {
    pub(super) weights: Vec<OuterSum>,
    pub(super) biases: Vec<Vec<f32>>,
    pub(super) last: Vec<f32>,
    pub(super) last_bias: f32,
}

impl Sums {
    pub(super) fn new(weights: &Weights) -> Self {
        let hidden = &weights.hidden;
        Self {
            weights: hidden.iter().map(|layer| OuterSum::new(layer.rows, layer.columns)).collect(),
            biases: hidden.iter().map(|layer| vec![0.0; layer.rows]).collect(),
            last: vec![0.0; weights.width],
            last_bias: 0.0,
        }
    }

    pub(super) fn clear(&mut self) {
        self.weights.iter_mut().for_each(OuterSum::clear);
        self.biases.iter_mut().for_each(|bias| bias.fill(0.0));
        self.last.fill(0.0);
        self.last_bias = 0.0;
    }

    /// In the order of the network's parameters.
    pub(super) fn parameters(&self, count: usize) -> Vec<f32> {
        let mut all = Vec::with_capacity(count);
        for (weights, bias) in self.weights.iter().zip(&self.biases) {
            all.extend(weights.entries());
            all.extend(bias);
        }
        all.extend(&self.last);
        all.push(self.last_bias);
        all
    }
}
