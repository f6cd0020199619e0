//! Scattering at a surface, over numbers that may carry derivatives: value, sampling, and density.

use std::f64::consts::{FRAC_1_PI, FRAC_PI_2, PI};

use glam::DVec2;

use super::{Gloss, Material};
use crate::calculus::{Number, Vec2};

/// Fraction of the diffuse samples that is uniform over the half circle. With cosine sampling alone, the
/// slope of the cosine divided by the density would have infinite variance at grazing angles: ∫ (sin φ/cos
/// φ)² cos φ dφ diverges.
const DEFENSIVE: f64 = 0.1;

/// A surface seen from a direction.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Scattering<T> {
    pub(crate) material: Material<T>,
    /// The unit normal on the side of ω_o, the direction in which light leaves.
    pub(crate) normal: Vec2<T>,
    /// The mirror direction of ω_o.
    mirror: Vec2<T>,
}

impl<T: Number> Scattering<T> {
    /// From a unit normal on either side and the unit direction ω_o.
    pub(crate) fn new(material: Material<T>, normal: Vec2<T>, outgoing: Vec2<T>) -> Self {
        let normal = if normal.dot(outgoing).value() < 0.0 { -normal } else { normal };
        let mirror = normal * (normal.dot(outgoing) * 2.0) - outgoing;
        Self { material, normal, mirror }
    }

    /// f cos φ of the direction ω_i from which light comes; 0 from below the surface.
    pub(crate) fn value(&self, incoming: Vec2<T>) -> T {
        let diffuse = self.material.reflectance * 0.5;
        let function = match &self.material.gloss {
            Some(gloss) => diffuse + gloss.strength * self.lobe(gloss, incoming),
            None => diffuse,
        };
        self.normal.dot(incoming).positive() * function
    }

    /// Density over directions of [`sample`](Scattering::sample). The choice between its parts carries no
    /// derivative.
    pub(crate) fn density(&self, incoming: Vec2<T>) -> T {
        let glossy = self.glossy_part();
        let cosine = self.normal.dot(incoming);
        let mut density = T::constant(0.0);
        if glossy < 1.0 && cosine.value() > 0.0 {
            density = cosine * ((1.0 - glossy) * (1.0 - DEFENSIVE) * 0.5)
                + T::constant((1.0 - glossy) * DEFENSIVE * FRAC_1_PI);
        }
        match &self.material.gloss {
            Some(gloss) if glossy > 0.0 => density + self.lobe(gloss, incoming) * glossy,
            _ => density,
        }
    }

    /// g_w(α): sin²(α/2) is a quarter of |ω_i − ω_mirror|².
    fn lobe(&self, gloss: &Gloss<T>, incoming: Vec2<T>) -> T {
        let chord = incoming - self.mirror;
        gloss.density_at_chord(chord.dot(chord) * 0.25)
    }

    /// Probability of sampling the lobe.
    fn glossy_part(&self) -> f64 {
        let strength = self.material.gloss.map_or(0.0, |g| g.strength.value());
        if strength > 0.0 { strength / (self.material.reflectance.value() + strength) } else { 0.0 }
    }
}

impl Scattering<f64> {
    /// A direction ω_i from two uniform numbers. It may be below the surface, where a part of the lobe is
    /// lost.
    pub(crate) fn sample(&self, [which, xi]: [f64; 2]) -> DVec2 {
        let glossy = self.glossy_part();
        if let Some(gloss) = self.material.gloss.filter(|_| which < glossy) {
            return DVec2::from_angle(gloss.quantile(xi)).rotate(self.mirror.value()).normalize();
        }
        let rest = (which - glossy) / (1.0 - glossy);
        let angle = if rest < DEFENSIVE {
            PI * (xi - 0.5)
        } else {
            (2.0 * xi - 1.0).asin().clamp(-FRAC_PI_2, FRAC_PI_2)
        };
        DVec2::from_angle(angle).rotate(self.normal.value()).normalize()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calculus::Dual;
    use crate::random::{open01, stream};

    fn materials() -> [Material; 4] {
        let gloss = |strength, width| Some(Gloss { strength, width });
        [
            Material::diffuse(0.7),
            Material { gloss: gloss(0.4, 0.2), ..Material::diffuse(0.5) },
            Material { gloss: gloss(0.9, 0.05), ..Material::default() },
            Material::default(),
        ]
    }

    fn unit<T: Number>(angle: T) -> Vec2<T> {
        Vec2::new(angle.cos(), angle.sin())
    }

    #[test]
    fn samples_have_their_density() {
        for material in materials() {
            let s = Scattering::new(material, unit(0.3), unit(1.1));
            let mut rng = stream(1, &[]);
            let n = 200_000;
            // Test function of the direction: its mean by sampling, and by quadrature.
            let g = |w: DVec2| (w.x + 0.3 * w.y).powi(2);
            let mean = (0..n).map(|_| g(s.sample([open01(&mut rng), open01(&mut rng)]))).sum::<f64>();
            let m = 20_000;
            let angle = |i| 2.0 * PI * (f64::from(i) + 0.5) / f64::from(m);
            let directions = (0..m).map(|i| DVec2::from_angle(angle(i)));
            let (mut sum, mut mass) = (0.0, 0.0);
            for w in directions {
                sum += g(w) * s.density(Vec2::constant(w)) * 2.0 * PI / f64::from(m);
                mass += s.density(Vec2::constant(w)) * 2.0 * PI / f64::from(m);
            }
            assert!((mass - 1.0).abs() < 1e-4, "{material:?} {mass}");
            assert!((mean / f64::from(n) - sum).abs() < 5e-3, "{material:?} {sum}");
        }
    }

    #[test]
    fn is_reciprocal_and_its_derivatives_are_those_of_differences() {
        fn value<T: Number>(material: &Material, [i, o, n]: [T; 3]) -> [T; 2] {
            let scattering = Scattering::new(material.with(|m| m.map(T::constant)), unit(n), unit(o));
            [scattering.value(unit(i)), scattering.density(unit(i))]
        }
        for material in materials() {
            let f = |i: f64, o: f64| value(&material, [i, o, 0.3])[0] / (i - 0.3).cos();
            assert!((f(1.4, 1.1) - f(1.1, 1.4)).abs() < 1e-14);
            let angles = [1.4, 1.1, 0.3];
            let units: [_; 3] = std::array::from_fn(|k| std::array::from_fn(|j| f64::from(u8::from(j == k))));
            let dual: [Dual<3>; 3] = std::array::from_fn(|k| Dual::new(angles[k], units[k]));
            let found = value(&material, dual);
            for k in 0..3 {
                let (mut plus, mut minus) = (angles, angles);
                plus[k] += 1e-6;
                minus[k] -= 1e-6;
                let (plus, minus) = (value(&material, plus), value(&material, minus));
                for ((p, m), found) in plus.into_iter().zip(minus).zip(found) {
                    let (expected, found) = ((p - m) / 2e-6, found.tangent[k]);
                    assert!((found - expected).abs() < 1e-7, "{material:?} {k}: {found} {expected}");
                }
            }
        }
    }
}
