//! Evaluation of networks at single points, in double precision.
//!
//! With a_{−1} = γ(x), layers z_k = W_k a_{k−1} + b_k and a_k = σ(z_k), and φ = z_n. All derivatives follow
//! from two sweeps, and no graph is stored.

use flatland::sdf::shapes::{Parametric, ShapeError};
use flatland::sdf::{Jet, Sdf, SecondOrder};
use glam::{DMat3, DVec3};

use super::Network;
use super::encoding::{Feature, curved, encode, pull, push};
use super::neurons::{Neurons, bend};

/// Intermediate values of a sweep from x to φ.
struct Sweep {
    features: Vec<Feature>,
    /// γ(x).
    encoded: Vec<f64>,
    hidden: Vec<Neurons>,
    value: f64,
}

impl Sweep {
    /// a_{k−1}, the inputs of layer k.
    fn inputs(&self, k: usize) -> &[f64] {
        k.checked_sub(1).map_or(&self.encoded, |before| &self.hidden[before].value)
    }
}

impl Network {
    fn sweep(&self, x: DVec3) -> Sweep {
        let features: Vec<Feature> = encode(x, self.architecture.frequencies).collect();
        let encoded = features.iter().map(|feature| feature.value).collect();
        let mut sweep = Sweep { features, encoded, hidden: vec![], value: 0.0 };
        for k in 0..self.architecture.layers() {
            let layer = self.layer(k);
            let mut z = layer.bias.to_vec();
            layer.weight.add(sweep.inputs(k), &mut z);
            if k == self.architecture.hidden {
                sweep.value = z[0];
            } else {
                sweep.hidden.push(Neurons::new(self.instructions, self.architecture.sharpness, z));
            }
        }
        sweep
    }

    /// ∂φ/∂a_{k−1} in entry k, from p = ∂φ/∂γ in entry 0 to the last weights.
    fn adjoints(&self, sweep: &Sweep) -> Vec<Vec<f64>> {
        let mut adjoints = vec![self.layer(self.architecture.hidden).weight.entries.to_vec()];
        for (k, neurons) in sweep.hidden.iter().enumerate().rev() {
            let by_z = scaled(neurons, &adjoints[adjoints.len() - 1]);
            adjoints.push(self.layer(k).weight.transpose_times(&by_z));
        }
        adjoints.reverse();
        adjoints
    }
}

/// σ′ times a vector.
fn scaled(neurons: &Neurons, by: &[f64]) -> Vec<f64> {
    neurons.slope.iter().zip(by).map(|(slope, y)| slope * y).collect()
}

/// σ′ y + σ″ ż u: the change of σ′u, where y is the change of u and ż the change of z.
fn turned(neurons: &Neurons, y: &[f64], moving: &[f64], u: &[f64]) -> Vec<f64> {
    let both = neurons.slope.iter().zip(&neurons.curvature).enumerate();
    both.map(|(i, (slope, curvature))| slope * y[i] + curvature * moving[i] * u[i]).collect()
}

impl Sdf<DVec3> for Network {
    fn jet(&self, x: DVec3) -> Jet<DVec3> {
        let sweep = self.sweep(x);
        Jet { value: sweep.value, gradient: pull(&sweep.features, &self.adjoints(&sweep)[0]) }
    }

    /// The forward sweep alone.
    fn value(&self, x: DVec3) -> f64 {
        let mut inputs: Vec<f64> = encode(x, self.architecture.frequencies).map(|f| f.value).collect();
        let mut z = vec![];
        for k in 0..self.architecture.layers() {
            let layer = self.layer(k);
            z.clear();
            z.extend_from_slice(layer.bias);
            layer.weight.add(&inputs, &mut z);
            if k < self.architecture.hidden {
                bend(self.instructions, self.architecture.sharpness, &mut z);
            }
            std::mem::swap(&mut inputs, &mut z);
        }
        inputs[0]
    }

    /// H = Σ_k Σ_i u_i σ″_i ∇z_i ∇z_iᵀ over all neurons, with u_i = ∂φ/∂a_i, plus the curvature of the
    /// encoding.
    fn second_order(&self, x: DVec3) -> SecondOrder<DVec3> {
        let sweep = self.sweep(x);
        let adjoints = self.adjoints(&sweep);
        let mut hessian = DMat3::from_diagonal(curved(&sweep.features, &adjoints[0]));
        let mut slopes = DVec3::AXES.map(|axis| push(&sweep.features, axis));
        for (k, neurons) in sweep.hidden.iter().enumerate() {
            slopes = slopes.map(|slopes| self.layer(k).weight.times(&slopes));
            let [x, y, z] = &mut slopes;
            for (i, u) in adjoints[k + 1].iter().enumerate() {
                let slope = DVec3::new(x[i], y[i], z[i]);
                let scale = slope * (u * neurons.curvature[i]);
                hessian += DMat3::from_cols(slope * scale.x, slope * scale.y, slope * scale.z);
                [x[i], y[i], z[i]] = (slope * neurons.slope[i]).to_array();
            }
        }
        let gradient = pull(&sweep.features, &adjoints[0]);
        SecondOrder { jet: Jet { value: sweep.value, gradient }, hessian }
    }

    /// The bound [stated](Network::with_slope_bound) by the user.
    fn slope_bound(&self) -> f64 {
        self.slope_bound
    }

    fn parameter_count(&self) -> usize {
        self.parameters.len()
    }

    /// Forward δz_k = δW_k a + δb_k + W_k δa; then, with p_k = ∂φ/∂a_{k−1}, backward
    /// δp_k = δW_kᵀ(σ′p) + W_kᵀ(σ′δp + σ″δz p).
    fn rate(&self, x: DVec3, direction: &[f64]) -> Jet<DVec3> {
        let sweep = self.sweep(x);
        let adjoints = self.adjoints(&sweep);
        let change = |k| self.architecture.layer(direction, k, self.instructions);
        let mut moving: Vec<Vec<f64>> = vec![];
        for k in 0..self.architecture.layers() {
            let mut z = change(k).weight.times(sweep.inputs(k));
            z.iter_mut().zip(change(k).bias).for_each(|(z, b)| *z += b);
            if k > 0 {
                let inner = self.layer(k).weight.times(&scaled(&sweep.hidden[k - 1], &moving[k - 1]));
                z.iter_mut().zip(inner).for_each(|(z, inner)| *z += inner);
            }
            moving.push(z);
        }
        let last = self.architecture.hidden;
        let mut bent = change(last).weight.entries.to_vec();
        for (k, neurons) in sweep.hidden.iter().enumerate().rev() {
            let u = &adjoints[k + 1];
            let inner = self.layer(k).weight.transpose_times(&turned(neurons, &bent, &moving[k], u));
            bent = change(k).weight.transpose_times(&scaled(neurons, u));
            bent.iter_mut().zip(inner).for_each(|(p, inner)| *p += inner);
        }
        Jet { value: moving[last][0], gradient: pull(&sweep.features, &bent) }
    }

    /// Gradient of c φ + q·∇φ, where q·∇φ = φ̇ for a point with velocity q. Forward, ż_k = W_k ȧ_{k−1} and
    /// ȧ = σ′ż from ȧ_{−1} = Jγ q. Backward, from z̄ = c and ż̄ = 1 at φ: W̄ = z̄ aᵀ + ż̄ ȧᵀ, b̄ = z̄, v = Wᵀ
    /// z̄, u = Wᵀ ż̄ at each layer, and z̄ = σ′v + σ″ż u, ż̄ = σ′u before it.
    fn add_parameter_gradient(&self, x: DVec3, covector: Jet<DVec3>, gradient: &mut [f64]) {
        let sweep = self.sweep(x);
        let (mut moving, mut tangents) = (vec![], vec![push(&sweep.features, covector.gradient)]);
        for (k, neurons) in sweep.hidden.iter().enumerate() {
            let z = self.layer(k).weight.times(&tangents[k]);
            tangents.push(scaled(neurons, &z));
            moving.push(z);
        }
        let (mut z, mut z_moving) = (vec![covector.value], vec![1.0]);
        for k in (0..self.architecture.layers()).rev() {
            let (inputs, tangent) = (sweep.inputs(k), &tangents[k]);
            let (weight, bias) = self.architecture.ranges(k);
            for ((row, z), z_moving) in gradient[weight].chunks_exact_mut(inputs.len()).zip(&z).zip(&z_moving)
            {
                let terms = inputs.iter().zip(tangent).map(|(a, t)| z * a + z_moving * t);
                row.iter_mut().zip(terms).for_each(|(entry, term)| *entry += term);
            }
            gradient[bias].iter_mut().zip(&z).for_each(|(entry, z)| *entry += z);
            if k > 0 {
                let (v, u) = (
                    self.layer(k).weight.transpose_times(&z),
                    self.layer(k).weight.transpose_times(&z_moving),
                );
                let neurons = &sweep.hidden[k - 1];
                z = turned(neurons, &v, &moving[k - 1], &u);
                z_moving = scaled(neurons, &u);
            }
        }
    }
}

impl Parametric<DVec3> for Network {
    /// Layer by layer W_k row by row (row = output), then b_k.
    fn parameters(&self) -> Vec<f64> {
        self.parameters.clone()
    }

    fn with_parameters(&self, parameters: &[f64]) -> Result<Self, ShapeError> {
        let other = Self::new(self.architecture, parameters.to_vec())?;
        Ok(Self { slope_bound: self.slope_bound, ..other })
    }
}
