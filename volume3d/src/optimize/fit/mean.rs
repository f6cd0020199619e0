//! Running average of the parameters over the last steps.
//!
//! With noisy gradients and a rate that does not fall to 0, parameters end somewhere around a minimum, and
//! their mean nearer to it (Polyak and Juditsky 1992). The average does not influence the steps.

use glam::{DQuat, DVec3};

use super::super::parameters::Parameters;
use super::super::pose::rotation_vector;

/// x̄ after step t, counted from 1, which led to x: x̄ + w (x − x̄) with w = max(1 − β, 1/t).
///
/// This is the plain mean of all steps at first, without the start, and an exponential average from step 1/(1
/// − β) on. Rotations move by the fraction w of the turn from their mean to their current value.
pub(super) fn after(parameters: &Parameters, mean: &[f64], x: &[f64], decay: f64, t: u64) -> Vec<f64> {
    let weight = (1.0 - decay).max(1.0 / t as f64);
    if weight == 1.0 {
        return x.to_vec();
    }
    let mut step: Vec<f64> = x.iter().zip(mean).map(|(x, m)| weight * (x - m)).collect();
    for group in parameters.groups().iter().filter(|group| group.turns()) {
        let range = group.range.clone();
        let [to, from] = [x, mean].map(|w| DQuat::from_scaled_axis(DVec3::from_slice(&w[range.clone()])));
        let turn = rotation_vector((to * from.inverse()).normalize());
        step[range].copy_from_slice(&(weight * turn).to_array());
    }
    let mut next = mean.to_vec();
    parameters.retract(&mut next, &step);
    next
}

/// The mean after some groups of parameters were resized: for these it begins anew with x.
pub(super) fn resized(before: &Parameters, mean: &[f64], after: &Parameters, x: &[f64]) -> Vec<f64> {
    let pairs = before.groups().iter().zip(after.groups());
    let of = |(old, new): (&super::super::Group, &super::super::Group)| {
        let same = old.range.len() == new.range.len();
        if same { mean[old.range.clone()].to_vec() } else { x[new.range.clone()].to_vec() }
    };
    pairs.flat_map(of).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::optimize::tests::scene;

    /// Compares with the sum of all x with their weights, which is a product.
    #[test]
    fn the_mean_is_plain_at_first_and_then_forgets() {
        let scene = scene();
        let parameters = Parameters::new(&scene, &["block.translation"]).unwrap();
        let steps: Vec<Vec<f64>> =
            (0..40).map(|t| (0..3).map(|i| f64::sin(1.3 * f64::from(t) + f64::from(i))).collect()).collect();
        let decay = 0.9;
        let mut mean = vec![100.0; 3];
        for (t, x) in (1..).zip(&steps) {
            mean = after(&parameters, &mean, x, decay, t);
            for i in 0..3 {
                let expected = if t <= 10 {
                    steps[..t as usize].iter().map(|x| x[i]).sum::<f64>() / t as f64
                } else {
                    let plain = steps[..10].iter().map(|x| x[i]).sum::<f64>() / 10.0;
                    let age = |s: usize| (t as usize - 1 - s) as i32;
                    let late = (10..t as usize).map(|s| 0.1 * decay.powi(age(s)) * steps[s][i]).sum::<f64>();
                    plain * decay.powi(t as i32 - 10) + late
                };
                assert!((mean[i] - expected).abs() < 1e-13, "{t} {i}: {} {expected}", mean[i]);
            }
        }
    }

    /// Half a turn one way and half a turn the other are next to one another; the mean of their vectors would
    /// be no turn.
    #[test]
    fn rotations_are_averaged_as_turns() {
        let scene = scene();
        let parameters = Parameters::new(&scene, &["block.rotation"]).unwrap();
        let turns = [3.1, -3.1].map(|angle| [0.0, angle, 0.0]);
        let mean = after(&parameters, &turns[0], &turns[1], 0.5, 2);
        assert!((mean[1].abs() - std::f64::consts::PI).abs() < 1e-12, "{mean:?}");
        let further = after(&parameters, &[0.0, 0.2, 0.0], &[0.0, 0.6, 0.0], 0.75, 9);
        assert!((further[1] - 0.3).abs() < 1e-14, "{further:?}");
    }
}
