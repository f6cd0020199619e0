//! Fresnel's equations for unpolarised light.

use flatland::calculus::{Number, Rgb};
use glam::DVec3;

/// Reflectance of a conductor at an angle, by channel.
pub(crate) fn conductor_rgb<T: Number>(cosine: T, eta: DVec3, k: DVec3) -> Rgb<T> {
    Rgb(std::array::from_fn(|i| conductor(cosine, eta[i], k[i])))
}

fn conductor<T: Number>(cosine: T, eta: f64, k: f64) -> T {
    let cos2 = cosine.squared();
    let sin2 = T::constant(1.0) - cos2;
    // a² + b² = |η² − k² − sin² + 2iηk|, 2a² = that plus the real part.
    let real = T::constant(eta * eta - k * k) - sin2;
    let modulus = (real.squared() + T::constant(4.0 * eta * eta * k * k)).sqrt();
    let a = ((modulus + real).positive() * 0.5).sqrt();
    let (sum, cross) = (modulus + cos2, a * cosine * 2.0);
    let perpendicular = (sum - cross) / (sum + cross);
    let (sum, cross) = (cos2 * modulus + sin2.squared(), cross * sin2);
    let parallel = perpendicular * ((sum - cross) / (sum + cross));
    (perpendicular + parallel) * 0.5
}

/// Reflectance of a boundary between two dielectrics, and the cosine of the refracted direction: 1 and 0 for
/// total reflection. `eta` is the index of refraction beyond the boundary relative to that on the side of the
/// light.
pub(crate) fn dielectric<T: Number>(cosine: T, eta: f64) -> (T, T) {
    let one = T::constant(1.0);
    let beyond2 = one - (one - cosine.squared()) * (1.0 / (eta * eta));
    if beyond2.value() <= 0.0 {
        return (one, T::constant(0.0));
    }
    let beyond = beyond2.sqrt();
    let perpendicular = (cosine - beyond * eta) / (cosine + beyond * eta);
    let parallel = (cosine * eta - beyond) / (cosine * eta + beyond);
    ((perpendicular.squared() + parallel.squared()) * 0.5, beyond)
}

/// Reflectance of the boundary for diffuse light, 2 ∫₀¹ F(μ) μ dμ, with `eta` as in [`dielectric`].
pub(crate) fn diffuse(eta: f64) -> f64 {
    if eta < 1.0 {
        // Transmittances in both directions are in the ratio of the squared indices (Duntley 1942).
        return 1.0 - (1.0 - diffuse(1.0 / eta)) * eta * eta;
    }
    // Simpson's rule; the integrand is smooth towards the denser medium.
    const INTERVALS: usize = 256;
    let term = |i: usize| {
        let mu = i as f64 / INTERVALS as f64;
        let weight = if i == 0 || i == INTERVALS { 1.0 } else { 2.0 * (1 + i % 2) as f64 };
        weight * 2.0 * mu * dielectric(mu, eta).0
    };
    (0..=INTERVALS).map(term).sum::<f64>() / (3 * INTERVALS) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dielectrics_reflect_what_is_known() {
        // Normal incidence: ((η − 1)/(η + 1))²; zero at Brewster's angle for parallel polarisation; total
        // beyond the critical angle.
        assert!((dielectric(1.0, 1.5).0 - 0.04).abs() < 1e-15);
        let brewster = 1.0 / (1.0 + 1.5_f64 * 1.5).sqrt();
        let (reflected, beyond) = dielectric(brewster, 1.5);
        assert!((reflected - 0.5 * ((1.0 - 2.25) / (1.0 + 2.25_f64)).powi(2)).abs() < 1e-15);
        assert!((beyond * beyond + brewster * brewster - 1.0).abs() < 1e-15);
        assert_eq!(dielectric(0.5, 1.0 / 1.5), (1.0, 0.0));
        // The two sides reflect equally along one refracted path.
        let (there, beyond) = dielectric(0.7, 1.5);
        let (back, cosine) = dielectric(beyond, 1.0 / 1.5);
        assert!((there - back).abs() < 1e-15 && (cosine - 0.7).abs() < 1e-15);
    }

    #[test]
    fn diffuse_reflectances_are_those_of_tables() {
        // Egan and Hilgeman (1973), table for n = 1.5: 0.0918 from outside and 0.5963 from inside.
        assert!((diffuse(1.5) - 0.0918).abs() < 1e-4, "{}", diffuse(1.5));
        assert!((diffuse(1.0 / 1.5) - 0.5963).abs() < 1e-4, "{}", diffuse(1.0 / 1.5));
    }

    #[test]
    fn a_conductor_that_absorbs_nothing_mirrors_all() {
        assert!((conductor(0.3, 0.0, 1.0) - 1.0).abs() < 1e-12);
        // Normal incidence: ((η − 1)² + k²)/((η + 1)² + k²).
        let (eta, k) = (0.2, 3.9);
        let expected = ((eta - 1.0f64).powi(2) + k * k) / ((eta + 1.0f64).powi(2) + k * k);
        assert!((conductor(1.0, eta, k) - expected).abs() < 1e-12);
    }
}
