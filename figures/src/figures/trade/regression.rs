//! The bias of a gradient whose exact value is known.

use crate::figures::common::dot;
use crate::ratio::Ratio;

/// The mean of a method against the exact gradient.
#[derive(Clone, Copy, Debug)]
pub(in crate::figures) struct Bias {
    /// 1 − slope of the mean gradient on the exact one: the part of the gradient that is missing.
    pub(in crate::figures) missing: Ratio,
    /// ‖mean − exact‖²/‖exact‖², with the noise's own contribution subtracted.
    pub(in crate::figures) squared: f64,
}

impl Bias {
    /// [x, missing part, and its ends], for axes.
    pub(in crate::figures) fn at(&self, x: f64) -> [f64; 4] {
        let [low, high] = self.missing.ends();
        [x, self.missing.value, low, high]
    }
}

/// The regression on the exact gradient of the mean of independent, equally good estimates.
pub(in crate::figures) fn regress(exact: &[f64], estimates: &[Vec<f64>]) -> Bias {
    let count = estimates.len() as f64;
    let mean: Vec<f64> =
        (0..exact.len()).map(|i| estimates.iter().map(|x| x[i]).sum::<f64>() / count).collect();
    let norm = dot(exact, exact);
    let slope = |x: &[f64]| dot(x, exact) / norm;
    let distance = |x: &[f64], y: &[f64]| x.iter().zip(y).map(|(x, y)| (x - y) * (x - y)).sum::<f64>() / norm;
    let middle = slope(&mean);
    let of_mean = |sum: f64| sum / (count * (count - 1.0));
    let error = of_mean(estimates.iter().map(|x| (slope(x) - middle).powi(2)).sum()).sqrt();
    Bias {
        missing: Ratio { value: 1.0 - middle, error },
        squared: distance(&mean, exact) - of_mean(estimates.iter().map(|x| distance(x, &mean)).sum()),
    }
}

/// The regression of an estimate without noise.
pub(super) fn regress_exactly(exact: &[f64], estimate: &[f64]) -> Bias {
    regress(exact, &[estimate.to_vec(), estimate.to_vec()])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_scaled_gradient_lacks_its_part() {
        let exact = [1.0, -2.0, 0.5];
        let estimates = [[0.9, -1.4, 0.4], [0.7, -1.8, 0.4]].map(|e| e.to_vec());
        // Both have slope 0.8, and their mean is 0.8 of the gradient.
        let bias = regress(&exact, &estimates);
        assert!((bias.missing.value - 0.2).abs() < 0.02);
        assert!(bias.squared < 0.04 && bias.missing.error > 0.0);
        let bias = regress_exactly(&exact, &[0.8, -1.6, 0.4]);
        assert!((bias.missing.value - 0.2).abs() < 1e-15 && (bias.squared - 0.04).abs() < 1e-15);
    }
}
