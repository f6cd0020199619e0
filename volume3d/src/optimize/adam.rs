//! Adam (Kingma and Ba 2015).

use serde::{Deserialize, Serialize};

/// Adam (Kingma and Ba 2015).
///
/// With g the gradient, and first and second moments
///
/// ```text
/// m ← β₁ m + (1 − β₁) g,   v ← β₂ v + (1 − β₂) g²,
/// step = −rate m̂ / (√v̂ + ε),   m̂ = m/(1 − β₁ᵗ),   v̂ = v/(1 − β₂ᵗ).
/// ```
///
/// A step is about `rate` in each number, whatever the size of the gradient, and about three times that where
/// one large gradient follows many small ones, seven times at most. Choose the rate in units of the
/// parameter, as a few hundredths of the total change expected, and lower it towards the end, because it
/// bounds the final accuracy. Steps are quotients of noisy numbers: with an unbiased gradient whose noise is
/// skewed, Adam may converge beside the zero of the gradient (Reddi, Kale and Kumar 2018). More samples
/// reduce this bias.
///
/// With [`uniform`](Self::uniform) all numbers share one v, the maximum (Nicolet, Jacobson and Jakob 2021):
/// numbers with small gradients then hardly move. Mesh vertices need this, because plain Adam would move
/// invisible vertices by their noise.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Adam {
    /// Learning rate: the step size, in units of the parameters.
    pub rate: f64,
    /// Decay of the first moment: 0.9 averages over about 10 steps.
    pub beta1: f64,
    /// Decay of the second moment: 0.999 averages over about 1,000 steps.
    pub beta2: f64,
    /// Regularisation ε of the denominator, which keeps steps small where all gradients are 0, in units of
    /// the gradient.
    pub epsilon: f64,
    /// Whether all numbers share one v.
    pub uniform: bool,
    state: State,
}

/// The moments so far.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
struct State {
    steps: u64,
    first: Vec<f64>,
    second: Vec<f64>,
}

impl Adam {
    /// Adam with β₁ = 0.9, β₂ = 0.999 and ε = 10⁻⁸.
    #[must_use]
    pub fn new(rate: f64) -> Self {
        let state = State::default();
        Self { rate, beta1: 0.9, beta2: 0.999, epsilon: 1e-8, uniform: false, state }
    }

    /// Sets one v for all numbers.
    #[must_use]
    pub fn uniform(self) -> Self {
        Self { uniform: true, ..self }
    }

    /// The next step down a gradient.
    ///
    /// # Panics
    /// If the gradient's length is not that of the one before.
    pub fn step(&mut self, gradient: &[f64]) -> Vec<f64> {
        let State { steps, first, second } = &mut self.state;
        if *steps == 0 {
            (*first, *second) = (vec![0.0; gradient.len()], vec![0.0; gradient.len()]);
        }
        assert_eq!(gradient.len(), first.len(), "a gradient by as many parameters as before");
        *steps += 1;
        for ((m, v), g) in first.iter_mut().zip(second.iter_mut()).zip(gradient) {
            *m += (1.0 - self.beta1) * (g - *m);
            *v += (1.0 - self.beta2) * (g * g - *v);
        }
        let correction = |beta: f64| 1.0 - beta.powf(*steps as f64);
        let (c1, c2) = (correction(self.beta1), correction(self.beta2));
        let greatest = second.iter().fold(0.0, |a: f64, &b| a.max(b));
        let size = |v: f64| (if self.uniform { greatest } else { v } / c2).sqrt() + self.epsilon;
        first.iter().zip(second.iter()).map(|(m, v)| -self.rate * (m / c1) / size(*v)).collect()
    }

    /// The number of parameters; `None` before the first step.
    pub(crate) fn len(&self) -> Option<usize> {
        (self.state.steps > 0).then_some(self.state.first.len())
    }

    /// Signal-to-noise measure of the gradients: Σ m̂²/Σ v̂ over all numbers, which is 1 if all gradients are
    /// equal, and about (1 − β₁)/(1 + β₁) = 0.05 if they are noise around 0. 0 before the first step.
    ///
    /// Far from a minimum a small value asks for more samples; near one it is to be expected.
    #[must_use]
    pub fn signal(&self) -> f64 {
        let State { steps, first, second } = &self.state;
        let squares = first.iter().map(|m| m * m).sum::<f64>();
        let correction = |beta: f64| 1.0 - beta.powf(*steps as f64);
        let mean_square = second.iter().sum::<f64>() / correction(self.beta2);
        if mean_square > 0.0 { squares / correction(self.beta1).powi(2) / mean_square } else { 0.0 }
    }

    /// Resets the moments.
    pub fn restart(&mut self) {
        self.state = State::default();
    }
}
