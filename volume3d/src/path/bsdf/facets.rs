//! Microfacet reflection and refraction (Walter et al. 2007).

use flatland::calculus::{Number, Vec3};
use glam::{DVec2, DVec3};

use crate::optics::Microfacets;

/// Microfacets of a rough surface, for a viewer above it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Facets<T> {
    pub(super) distribution: Microfacets,
    pub(super) alpha: T,
    /// Normal on the viewer's side.
    pub(super) normal: Vec3<T>,
    pub(super) viewer: Vec3<T>,
    /// Anisotropy, if any.
    pub(super) stretch: Option<Stretch<T>>,
}

/// Anisotropic roughness, along two axes of the surface.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stretch<T> {
    /// Unit vectors orthogonal to the normal and to one another.
    pub(super) axes: [Vec3<T>; 2],
    /// α along each axis.
    pub(super) alphas: [T; 2],
}

impl<T: Number> Stretch<T> {
    /// Axes along a direction of the surface and orthogonal to it.
    pub(super) fn new(normal: Vec3<T>, along: Vec3<T>, alphas: [T; 2]) -> Self {
        Self { axes: [along, normal.cross(along)], alphas }
    }

    /// Σ f(α) (v·axis)².
    fn sum(&self, v: Vec3<T>, f: impl Fn(T) -> T) -> T {
        let [s, t] = self.axes.map(|axis| v.dot(axis).squared());
        s * f(self.alphas[0]) + t * f(self.alphas[1])
    }
}

impl<T: Number> Facets<T> {
    /// D G/(4 cos θᵢ) for a direction above, which times Fresnel's F is f cos θₒ, and the cosine on which F
    /// depends.
    pub(super) fn reflect(&self, direction: Vec3<T>) -> (T, T) {
        let half = (self.viewer + direction).normalized();
        let normals = self.normals(half);
        let shadowing = self.unshadowed(self.viewer) * self.unshadowed(direction);
        (normals * shadowing / (self.normal.dot(self.viewer) * 4.0), self.viewer.dot(half))
    }

    /// Probability density of directions reflected at a sampled facet.
    pub(super) fn reflection_density(&self, direction: DVec3) -> f64 {
        let viewer = self.viewer.value();
        let half = (viewer + direction).normalize();
        self.density_of_normals(half) / (4.0 * viewer.dot(half))
    }

    /// D G |v·m| |ω·m|/(cos θᵢ (v·m + η ω·m)²) for a direction below, which times 1 − F is f cos θₒ for
    /// radiance, with its compression η⁻², and the cosine on which F depends. `None` if no facet refracts one
    /// into the other.
    pub(super) fn refract(&self, direction: Vec3<T>, eta: f64) -> Option<(T, T)> {
        let half = self.refracting(direction, eta)?;
        let [in_cosine, out_cosine] = [self.viewer, direction].map(|v| v.dot(half));
        let above = self.normal.dot(self.viewer);
        let normals = self.normals(half);
        let shadowing = self.unshadowed(self.viewer) * self.unshadowed(-direction);
        let stretch = (in_cosine + out_cosine * eta).squared();
        Some((-(normals * shadowing * in_cosine * out_cosine) / (above * stretch), in_cosine))
    }

    /// Probability density of directions refracted at a sampled facet, and the cosine there.
    pub(super) fn refraction_density(&self, direction: DVec3, eta: f64) -> Option<(f64, f64)> {
        let half = self.refracting(Vec3::constant(direction), eta)?.value();
        let [in_cosine, out_cosine] = [self.viewer.value(), direction].map(|v| v.dot(half));
        let stretch = (in_cosine + eta * out_cosine).powi(2);
        Some((self.density_of_normals(half) * eta * eta * -out_cosine / stretch, in_cosine))
    }

    /// Normal of the facet that refracts the viewer's direction into one below: along v + ηω, on the viewer's
    /// side, with the two directions on its two sides.
    fn refracting(&self, direction: Vec3<T>, eta: f64) -> Option<Vec3<T>> {
        let half = (self.viewer + direction * T::constant(eta)).normalized();
        let half = if self.normal.dot(half).value() < 0.0 { -half } else { half };
        let sides = [self.viewer, direction].map(|v| v.dot(half).value());
        (sides[0] > 0.0 && sides[1] < 0.0).then_some(half)
    }

    /// Samples a facet normal.
    pub(super) fn sample(&self, numbers: [f64; 2]) -> DVec3 {
        let (n, viewer) = (self.normal.value(), self.viewer.value());
        let ((s, t), alpha) = match &self.stretch {
            None => (n.any_orthonormal_pair(), DVec2::splat(self.alpha.value())),
            Some(Stretch { axes, alphas }) => {
                ((axes[0].value(), axes[1].value()), DVec2::from(alphas.map(Number::value)))
            }
        };
        let local = DVec3::new(viewer.dot(s), viewer.dot(t), viewer.dot(n));
        let half = self.distribution.sample(local, alpha, numbers);
        half.x * s + half.y * t + half.z * n
    }

    fn density_of_normals(&self, half: DVec3) -> f64 {
        let (n, viewer) = (self.normal.value(), self.viewer.value());
        let still = self.still();
        let (facets, unshadowed) =
            (still.normals(Vec3::constant(half)), still.unshadowed(Vec3::constant(viewer)));
        self.distribution.sampling_density(facets, unshadowed, [n.dot(viewer), viewer.dot(half), n.dot(half)])
    }

    /// D of a facet normal.
    fn normals(&self, half: Vec3<T>) -> T {
        let cosine = self.normal.dot(half);
        let Some(stretch) = &self.stretch else { return self.distribution.density(cosine, self.alpha) };
        if cosine.value() <= 0.0 {
            return T::constant(0.0);
        }
        let cos2 = cosine.squared();
        let slope = stretch.sum(half, |alpha| T::constant(1.0) / alpha.squared()) / cos2;
        self.distribution.density_at(slope, cos2, stretch.alphas[0] * stretch.alphas[1])
    }

    /// Smith's G₁ of a direction above.
    fn unshadowed(&self, v: Vec3<T>) -> T {
        let cosine = self.normal.dot(v);
        let Some(stretch) = &self.stretch else { return self.distribution.unshadowed(cosine, self.alpha) };
        if cosine.value() <= 0.0 {
            return T::constant(0.0);
        }
        self.distribution.unshadowed_at(stretch.sum(v, Number::squared) / cosine.squared())
    }

    /// The facets without derivatives.
    fn still(&self) -> Facets<f64> {
        let still = |v: Vec3<T>| Vec3::constant(v.value());
        let stretch = self.stretch.as_ref().map(|stretch| Stretch {
            axes: stretch.axes.map(still),
            alphas: stretch.alphas.map(Number::value),
        });
        let (normal, viewer) = (still(self.normal), still(self.viewer));
        Facets { distribution: self.distribution, alpha: self.alpha.value(), normal, viewer, stretch }
    }
}
