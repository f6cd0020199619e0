//! Positional encoding (Mildenhall et al. 2020), with the frequencies of IDR.

use glam::DVec3;

/// A component γ_j, which depends only on the coordinate j mod 3, and its derivatives by it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Feature {
    pub(super) value: f64,
    pub(super) slope: f64,
    pub(super) curvature: f64,
}

/// γ(x) = (x, sin x, cos x, sin 2x, cos 2x, …, sin 2^{L−1}x, cos 2^{L−1}x), three numbers each.
pub(super) fn encode(x: DVec3, frequencies: usize) -> impl Iterator<Item = Feature> {
    let plain = x.to_array().map(|value| Feature { value, slope: 1.0, curvature: 0.0 });
    let waves = (0..frequencies).flat_map(move |octave| {
        let f = 2.0_f64.powi(octave as i32);
        let turns = x.to_array().map(|x| (f * x).sin_cos());
        let wave = |value: f64, slope: f64| Feature { value, slope: f * slope, curvature: -f * f * value };
        let sines = turns.map(|(sin, cos)| wave(sin, cos));
        let cosines = turns.map(|(sin, cos)| wave(cos, -sin));
        sines.into_iter().chain(cosines)
    });
    plain.into_iter().chain(waves)
}

/// Jγᵀ p: the gradient in space from the gradient p by γ.
pub(super) fn pull(features: &[Feature], p: &[f64]) -> DVec3 {
    gather(features.iter().zip(p).map(|(feature, p)| feature.slope * p))
}

/// The diagonal of ∂²(p·γ)/∂x², whose other entries are 0.
pub(super) fn curved(features: &[Feature], p: &[f64]) -> DVec3 {
    gather(features.iter().zip(p).map(|(feature, p)| feature.curvature * p))
}

/// Jγ q: the velocity of γ for a point with velocity q.
pub(super) fn push(features: &[Feature], q: DVec3) -> Vec<f64> {
    features.iter().enumerate().map(|(j, feature)| feature.slope * q[j % 3]).collect()
}

fn gather(terms: impl Iterator<Item = f64>) -> DVec3 {
    terms.enumerate().fold(DVec3::ZERO, |mut sum, (j, term)| {
        sum[j % 3] += term;
        sum
    })
}
