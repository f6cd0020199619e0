//! Eikonal loss.

use flatland::random::{open01, stream};
use flatland::sdf::Jet;
use glam::DVec3;

use super::SingleNetwork;

/// The eikonal term (Gropp et al. 2020), mean (|∇φ| − 1)² over points, and its covectors ∂/∂(φ, ∇φ) at each,
/// 2/n (1 − 1/|∇φ|) ∇φ, for [`add_parameter_gradient`](flatland::sdf::Sdf::add_parameter_gradient). Where
/// ∇φ = 0 it is not differentiable, and the covector is 0. NaN without points.
///
/// In units of |∇φ|²: 1 for a constant function. It is usually weighted by 0.1 relative to a loss of
/// distances.
#[must_use]
pub fn eikonal_loss(jets: &[Jet<DVec3>]) -> (f64, Vec<Jet<DVec3>>) {
    let share = 1.0 / jets.len() as f64;
    let excess = |jet: &Jet<DVec3>| jet.gradient.length() - 1.0;
    let loss = jets.iter().map(|jet| share * excess(jet).powi(2)).sum::<f64>();
    let covector = |jet: &Jet<DVec3>| match jet.gradient.length() {
        0.0 => Jet::ZERO,
        slope => Jet { value: 0.0, gradient: jet.gradient * (2.0 * share * excess(jet) / slope) },
    };
    (if jets.is_empty() { f64::NAN } else { loss }, jets.iter().map(covector).collect())
}

impl SingleNetwork {
    /// Adds a weight times the derivative of the [eikonal term](eikonal_loss) by the weights, at random
    /// points between two corners, and returns the term.
    ///
    /// # Panics
    /// If there are not as many entries as weights.
    pub fn add_eikonal(
        &self,
        (low, high): (DVec3, DVec3),
        weight: f64,
        points: usize,
        seed: u64,
        gradient: &mut [f64],
    ) -> f64 {
        let mut random = stream(seed, &[]);
        let mut point = || low + (high - low) * DVec3::from_array([(); 3].map(|()| open01(&mut random)));
        let points: Vec<DVec3> = (0..points).map(|_| point()).collect();
        let (term, mut covectors) = eikonal_loss(&self.jets(&points));
        covectors.iter_mut().for_each(|covector| *covector = *covector * weight);
        let added = self.add_parameter_gradient(&points, &covectors, gradient);
        added.expect("an entry for each weight");
        term
    }
}
