//! Free-flight sampling in media.

use glam::DVec3;

use super::sequence::Draws;
use crate::scene::Medium;

/// Samples whether a path scatters within a length of a medium: the distance if it does, and the path's
/// throughput there or at the length's end; `throughput` is the current one, nonzero.
///
/// A channel k is chosen with probability qₖ = βₖ/Σβ, with β the throughput, and a distance t with the
/// density σₖ e^{−σₖ t}. The density of t is the mean over channels, and with T = e^{−σ t}
///
/// ```text
/// β′ = β σ α T(t)/Σ qₖ σₖ Tₖ(t)  if it scatters,
/// β′ = β T(l)/Σ qₖ Tₖ(l)         at the end of the length l.
/// ```
///
/// Σβ′ ≤ Σβ in both cases, however much the channels differ: weights never grow (hero wavelength sampling,
/// Wilkie and others 2014, with probabilities that follow the path). A medium that does not scatter is passed
/// with T, without sampling.
pub(super) fn free_flight(
    medium: &Medium,
    length: f64,
    throughput: DVec3,
    samples: &mut Draws<'_>,
) -> (Option<f64>, DVec3) {
    if !medium.scatters() {
        return (None, throughput * medium.transmittance(length));
    }
    let [choice, xi] = samples.pair();
    let part = throughput / throughput.element_sum();
    let channel = match choice {
        c if c < part.x => 0,
        c if c < part.x + part.y => 1,
        _ => 2,
    };
    let sigma = medium.extinction;
    // Infinite if the channel has no extinction.
    let distance = -(-xi).ln_1p() / sigma[channel];
    if distance < length {
        let lost = sigma * medium.transmittance(distance);
        (Some(distance), throughput * medium.albedo * lost / part.dot(lost))
    } else {
        let passed = medium.transmittance(length);
        (None, throughput * passed / part.dot(passed))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::path::Sequence;

    /// Over many flights the mean throughput at the end is the transmittance, and the mean throughput of
    /// scattered paths is the remainder times the albedo, by channel; the sum of weights never grows.
    #[test]
    fn flights_carry_what_the_medium_leaves() {
        let albedo = DVec3::new(0.9, 0.5, 1.0);
        for (extinction, length) in [
            (DVec3::new(0.2, 1.0, 5.0), 0.7),
            (DVec3::new(0.0, 1.0, 2.0), 1.3),
            (DVec3::new(0.0, 1.0, 2.0), f64::INFINITY),
            (DVec3::splat(3.0), f64::INFINITY),
        ] {
            let medium = Medium { id: String::new(), extinction, albedo, asymmetry: 0.0 };
            let before = DVec3::new(0.5, 1.0, 0.2);
            let n = 1 << 18;
            let (mut through, mut scattered) = (DVec3::ZERO, DVec3::ZERO);
            let mut squares = DVec3::ZERO;
            for seed in 0..n {
                let (event, after) = free_flight(&medium, length, before, &mut Sequence::new(seed, &[], 0));
                assert!(after.is_finite() && after.element_sum() <= before.element_sum() * (1.0 + 1e-12));
                squares += after * after / n as f64;
                let sum = if event.is_some() { &mut scattered } else { &mut through };
                *sum += after / n as f64;
            }
            let passed = medium.transmittance(length);
            let tolerance = 6.5 * (squares / n as f64).map(f64::sqrt) + 1e-15;
            for (found, expected) in
                [(through, before * passed), (scattered, before * albedo * (1.0 - passed))]
            {
                let off = (found - expected).abs();
                assert!(off.cmple(tolerance).all(), "{extinction} {length}: {found} for {expected}");
            }
            // Size of a detectable error: 5 % of the albedo.
            assert!((0.05 * scattered - tolerance).max_element() > 0.0, "{tolerance}");
        }
    }
}
