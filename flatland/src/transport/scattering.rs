//! Scattering at a surface: its value, its sampling, and its slopes.

use std::f64::consts::{FRAC_1_PI, FRAC_PI_2, PI};

use glam::DVec2;

use super::{Material, MaterialTangent};

/// The part of the diffuse samples that is uniform over the half circle. Drawn by the cosine alone,
/// the slope of the cosine, divided by the density, would have infinite variance at grazing angles:
/// ∫ (sin φ/cos φ)² cos φ dφ diverges.
const DEFENSIVE: f64 = 0.1;

/// A surface seen from a direction.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Scattering<'a> {
    pub(crate) material: &'a Material,
    /// The unit normal on the side of `outgoing`.
    pub(crate) normal: DVec2,
    /// ω_o, the unit direction in which light leaves.
    pub(crate) outgoing: DVec2,
}

/// The derivatives of f cos φ.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Slopes {
    /// By the angle of ω_i.
    pub(crate) incoming: f64,
    /// By the angle of ω_o.
    pub(crate) outgoing: f64,
    /// By the angle of the normal.
    pub(crate) normal: f64,
    /// By the material's parameters.
    pub(crate) material: MaterialTangent,
}

impl Slopes {
    /// The slopes of `value` · `weight`, divided by `weight`, if 1/weight had the slopes of a density.
    pub(crate) fn attached(self, density: [f64; 3], weight: f64, value: f64) -> Self {
        let [incoming, outgoing, normal] = density.map(|d| d * weight * value);
        Self {
            incoming: self.incoming - incoming,
            outgoing: self.outgoing - outgoing,
            normal: self.normal - normal,
            ..self
        }
    }
}

impl Scattering<'_> {
    /// f cos φ of the direction ω_i from which light comes; 0 from below the surface.
    pub(crate) fn value(&self, incoming: DVec2) -> f64 {
        let cosine = self.normal.dot(incoming);
        if cosine <= 0.0 { 0.0 } else { cosine * self.function(incoming) }
    }

    /// f.
    fn function(&self, incoming: DVec2) -> f64 {
        let gloss = self.material.gloss.map_or(0.0, |g| g.strength * g.density(self.alpha(incoming)));
        0.5 * self.material.reflectance + gloss
    }

    /// The slopes of f cos φ.
    pub(crate) fn slopes(&self, incoming: DVec2) -> Slopes {
        let cosine = self.normal.dot(incoming).max(0.0);
        let mut material = MaterialTangent { reflectance: 0.5 * cosine, ..MaterialTangent::default() };
        let mut by_alpha = 0.0;
        if let Some(gloss) = self.material.gloss {
            let alpha = self.alpha(incoming);
            let [by_angle, by_width] = gloss.density_gradient(alpha);
            by_alpha = cosine * gloss.strength * by_angle;
            material.gloss_strength = cosine * gloss.density(alpha);
            material.gloss_width = cosine * gloss.strength * by_width;
        }
        // Turning ω_i by dψ changes the cosine by n·τ dψ, turning the normal by as much the other way.
        let turned = self.normal.dot(incoming.perp()) * self.function(incoming);
        Slopes { incoming: turned + by_alpha, outgoing: by_alpha, normal: -turned - 2.0 * by_alpha, material }
    }

    /// The density of [`sample`](Self::sample) over directions.
    pub(crate) fn density(&self, incoming: DVec2) -> f64 {
        let cosine = self.normal.dot(incoming);
        let glossy = self.glossy_part();
        let mut density = 0.0;
        if glossy < 1.0 && cosine > 0.0 {
            density += (1.0 - glossy) * ((1.0 - DEFENSIVE) * 0.5 * cosine + DEFENSIVE * FRAC_1_PI);
        }
        if let Some(gloss) = self.material.gloss.filter(|_| glossy > 0.0) {
            density += glossy * gloss.density(self.alpha(incoming));
        }
        density
    }

    /// The slopes of [`density`](Self::density) by the angles of ω_i, of ω_o and of the normal: only
    /// for the mistake of differentiating it.
    pub(crate) fn density_slopes(&self, incoming: DVec2) -> [f64; 3] {
        let glossy = self.glossy_part();
        let turned = if self.normal.dot(incoming) > 0.0 {
            (1.0 - glossy) * (1.0 - DEFENSIVE) * 0.5 * self.normal.dot(incoming.perp())
        } else {
            0.0
        };
        let gloss = self.material.gloss.filter(|_| glossy > 0.0);
        let by_alpha = gloss.map_or(0.0, |g| glossy * g.density_gradient(self.alpha(incoming))[0]);
        [turned + by_alpha, by_alpha, -turned - 2.0 * by_alpha]
    }

    /// A direction ω_i from two uniform numbers. It may lie below the surface, where a part of the
    /// lobe is lost.
    pub(crate) fn sample(&self, [which, xi]: [f64; 2]) -> DVec2 {
        let glossy = self.glossy_part();
        if let Some(gloss) = self.material.gloss.filter(|_| which < glossy) {
            // As complex numbers the mirror direction is n²/ω_o.
            let mirror = self.normal.rotate(self.normal).rotate(conjugate(self.outgoing));
            return DVec2::from_angle(gloss.quantile(xi)).rotate(mirror).normalize();
        }
        let rest = (which - glossy) / (1.0 - glossy);
        let angle = if rest < DEFENSIVE {
            PI * (xi - 0.5)
        } else {
            (2.0 * xi - 1.0).asin().clamp(-FRAC_PI_2, FRAC_PI_2)
        };
        DVec2::from_angle(angle).rotate(self.normal).normalize()
    }

    /// The probability of drawing from the lobe.
    fn glossy_part(&self) -> f64 {
        let strength = self.material.gloss.map_or(0.0, |g| g.strength);
        if strength > 0.0 { strength / self.material.albedo() } else { 0.0 }
    }

    /// α = ψ_i + ψ_o − 2ψ_n, in [−π, π].
    fn alpha(&self, incoming: DVec2) -> f64 {
        let n = conjugate(self.normal);
        incoming.rotate(n).rotate(self.outgoing.rotate(n)).to_angle()
    }
}

/// The complex conjugate.
fn conjugate(v: DVec2) -> DVec2 {
    DVec2::new(v.x, -v.y)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::{open01, stream};
    use crate::transport::Gloss;

    fn materials() -> [Material; 4] {
        let gloss = |strength, width| Some(Gloss { strength, width });
        [
            Material::diffuse(0.7),
            Material { gloss: gloss(0.4, 0.2), ..Material::diffuse(0.5) },
            Material { gloss: gloss(0.9, 0.05), ..Material::default() },
            Material::default(),
        ]
    }

    fn scattering(material: &Material) -> Scattering<'_> {
        let (normal, outgoing) = (DVec2::from_angle(0.3), DVec2::from_angle(1.1));
        Scattering { material, normal, outgoing }
    }

    #[test]
    fn samples_have_their_density() {
        for material in materials() {
            let s = scattering(&material);
            let mut rng = stream(1, &[]);
            let n = 200_000;
            // Any function of the direction will do: its mean by sampling, and by quadrature.
            let g = |w: DVec2| (w.x + 0.3 * w.y).powi(2);
            let mean = (0..n).map(|_| g(s.sample([open01(&mut rng), open01(&mut rng)]))).sum::<f64>();
            let m = 20_000;
            let angle = |i| 2.0 * PI * (f64::from(i) + 0.5) / f64::from(m);
            let directions = (0..m).map(|i| DVec2::from_angle(angle(i)));
            let (mut sum, mut mass) = (0.0, 0.0);
            for w in directions {
                sum += g(w) * s.density(w) * 2.0 * PI / f64::from(m);
                mass += s.density(w) * 2.0 * PI / f64::from(m);
            }
            assert!((mass - 1.0).abs() < 1e-4, "{material:?} {mass}");
            assert!((mean / f64::from(n) - sum).abs() < 5e-3, "{material:?} {sum}");
        }
    }

    #[test]
    fn is_reciprocal_and_its_slopes_are_derivatives() {
        for material in materials() {
            let angles = [1.4, 1.1, 0.3];
            let value = |a: [f64; 3]| {
                let [normal, outgoing] = [a[2], a[1]].map(DVec2::from_angle);
                Scattering { material: &material, normal, outgoing }.value(DVec2::from_angle(a[0]))
            };
            let f = |i: f64, o: f64| value([i, o, 0.3]) / (i - 0.3).cos();
            assert!((f(1.4, 1.1) - f(1.1, 1.4)).abs() < 1e-14);
            let slopes = scattering(&material).slopes(DVec2::from_angle(angles[0]));
            let found = [slopes.incoming, slopes.outgoing, slopes.normal];
            for (k, found) in found.into_iter().enumerate() {
                let (mut plus, mut minus) = (angles, angles);
                plus[k] += 1e-6;
                minus[k] -= 1e-6;
                let expected = (value(plus) - value(minus)) / 2e-6;
                assert!((found - expected).abs() < 1e-7, "{material:?} {k}: {found} {expected}");
            }
        }
    }
}
