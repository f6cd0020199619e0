//! Reflection and refraction at the facets of a rough surface (Walter et al. 2007).

use flatland::calculus::{Number, Vec3};
use glam::DVec3;

use crate::optics::Microfacets;

/// The facets of a rough surface, as a viewer above it sees them.
#[derive(Clone, Copy, Debug)]
pub(super) struct Facets<T> {
    pub(super) distribution: Microfacets,
    pub(super) alpha: T,
    /// On the viewer's side.
    pub(super) normal: Vec3<T>,
    pub(super) viewer: Vec3<T>,
}

impl<T: Number> Facets<T> {
    /// D G/(4 cos θᵢ) for a direction above, which times Fresnel's F is f cos θₒ, and the cosine that F depends on.
    pub(super) fn reflect(&self, direction: Vec3<T>) -> (T, T) {
        let half = (self.viewer + direction).normalized();
        let facet = |v: Vec3<T>| self.normal.dot(v);
        let normals = self.distribution.density(facet(half), self.alpha);
        let shadowing = self.distribution.unshadowed(facet(self.viewer), self.alpha)
            * self.distribution.unshadowed(facet(direction), self.alpha);
        (normals * shadowing / (facet(self.viewer) * 4.0), self.viewer.dot(half))
    }

    /// The density of directions that are reflected at a sampled facet.
    pub(super) fn reflection_density(&self, direction: DVec3) -> f64 {
        let viewer = self.viewer.value();
        let half = (viewer + direction).normalize();
        self.density_of_normals(half) / (4.0 * viewer.dot(half))
    }

    /// D G |v·m| |ω·m|/(cos θᵢ (v·m + η ω·m)²) for a direction below, which times 1 − F is f cos θₒ of radiance, η⁻² for its
    /// compression included, and the cosine that F depends on. Nothing where no facet refracts one into the other.
    pub(super) fn refract(&self, direction: Vec3<T>, eta: f64) -> Option<(T, T)> {
        let half = self.refracting(direction, eta)?;
        let [in_cosine, out_cosine] = [self.viewer, direction].map(|v| v.dot(half));
        let [above, below] = [self.viewer, -direction].map(|v| self.normal.dot(v));
        let normals = self.distribution.density(self.normal.dot(half), self.alpha);
        let shadowing =
            self.distribution.unshadowed(above, self.alpha) * self.distribution.unshadowed(below, self.alpha);
        let stretch = (in_cosine + out_cosine * eta).squared();
        Some((-(normals * shadowing * in_cosine * out_cosine) / (above * stretch), in_cosine))
    }

    /// The density of directions that are refracted at a sampled facet, and the cosine at it.
    pub(super) fn refraction_density(&self, direction: DVec3, eta: f64) -> Option<(f64, f64)> {
        let half = self.refracting(Vec3::constant(direction), eta)?.value();
        let [in_cosine, out_cosine] = [self.viewer.value(), direction].map(|v| v.dot(half));
        let stretch = (in_cosine + eta * out_cosine).powi(2);
        Some((self.density_of_normals(half) * eta * eta * -out_cosine / stretch, in_cosine))
    }

    /// The facet that refracts the viewer's direction into one below: along v + ηω, on the viewer's side, with the two
    /// on its two sides.
    fn refracting(&self, direction: Vec3<T>, eta: f64) -> Option<Vec3<T>> {
        let half = (self.viewer + direction * T::constant(eta)).normalized();
        let half = if self.normal.dot(half).value() < 0.0 { -half } else { half };
        let sides = [self.viewer, direction].map(|v| v.dot(half).value());
        (sides[0] > 0.0 && sides[1] < 0.0).then_some(half)
    }

    /// A facet's normal.
    pub(super) fn sample(&self, numbers: [f64; 2]) -> DVec3 {
        let (n, viewer) = (self.normal.value(), self.viewer.value());
        let (s, t) = n.any_orthonormal_pair();
        let local = DVec3::new(viewer.dot(s), viewer.dot(t), viewer.dot(n));
        let half = self.distribution.sample(local, self.alpha.value(), numbers);
        half.x * s + half.y * t + half.z * n
    }

    fn density_of_normals(&self, half: DVec3) -> f64 {
        let (n, viewer) = (self.normal.value(), self.viewer.value());
        let alpha = self.alpha.value();
        self.distribution.sampling_density(n.dot(viewer), viewer.dot(half), n.dot(half), alpha)
    }
}
