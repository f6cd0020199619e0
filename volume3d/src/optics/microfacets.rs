//! Microfacet distributions: normals, masking and sampling.

use std::f64::consts::{PI, TAU};

use flatland::calculus::Number;
use glam::{DVec2, DVec3};

/// Distribution of a rough surface's microfacet normals.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Microfacets {
    /// Beckmann and Spizzichino (1963).
    #[default]
    Beckmann,
    /// Trowbridge and Reitz (1975); GGX.
    Ggx,
}

impl Microfacets {
    /// D(cos θ), per solid angle of normals and area of the surface.
    pub(crate) fn density<T: Number>(self, cosine: T, alpha: T) -> T {
        if cosine.value() <= 0.0 {
            return T::constant(0.0);
        }
        let (cos2, alpha2) = (cosine.squared(), alpha.squared());
        self.density_at((T::constant(1.0) - cos2) / (cos2 * alpha2), cos2, alpha2)
    }

    /// D from tan²θ/α² in the direction of the slope, cos²θ, and the product of the α of both axes.
    pub(crate) fn density_at<T: Number>(self, slope: T, cos2: T, alpha2: T) -> T {
        let scale = alpha2 * cos2.squared() * PI;
        match self {
            Self::Beckmann => (-slope).exp() / scale,
            Self::Ggx => T::constant(1.0) / (scale * (T::constant(1.0) + slope).squared()),
        }
    }

    /// Smith's G₁(cos θ): the unmasked fraction of facets. Beckmann's as approximated by Walter et al.
    /// (2007).
    pub(crate) fn unshadowed<T: Number>(self, cosine: T, alpha: T) -> T {
        if cosine.value() <= 0.0 {
            return T::constant(0.0);
        }
        let cos2 = cosine.squared();
        self.unshadowed_at(alpha.squared() * ((T::constant(1.0) - cos2) / cos2))
    }

    /// G₁ from α² tan²θ, with the α of the direction.
    pub(crate) fn unshadowed_at<T: Number>(self, slope2: T) -> T {
        let one = T::constant(1.0);
        if slope2.value() <= 0.0 {
            return one;
        }
        match self {
            Self::Ggx => T::constant(2.0) / (one + (one + slope2).sqrt()),
            Self::Beckmann => {
                let a = one / slope2.sqrt();
                if a.value() >= 1.6 {
                    return one;
                }
                (a * 3.535 + a.squared() * 2.181) / (one + a * 2.276 + a.squared() * 2.577)
            }
        }
    }

    /// Samples a facet normal, in the frame in which the surface's normal is z, for a viewer above: visible
    /// normals for GGX, all normals for Beckmann. `alpha` is α along both axes.
    pub(crate) fn sample(self, viewer: DVec3, alpha: DVec2, numbers: [f64; 2]) -> DVec3 {
        match self {
            Self::Beckmann => beckmann_normal(alpha, numbers),
            Self::Ggx => visible_normal(viewer, alpha, numbers),
        }
    }

    /// Density of [`sample`](Self::sample) per solid angle of normals, from D, G₁ of the viewer, the viewer's
    /// cosines with the surface's normal and with the facet's, and the cosine between these two normals.
    pub(crate) fn sampling_density(
        self,
        facets: f64,
        unshadowed: f64,
        [viewer, visible, cosine]: [f64; 3],
    ) -> f64 {
        match self {
            Self::Beckmann => facets * cosine,
            Self::Ggx => facets * unshadowed * visible / viewer,
        }
    }
}

/// A facet normal with density D cos θ (Beckmann): slopes are normally distributed, with variances α²/2.
fn beckmann_normal(alpha: DVec2, [a, b]: [f64; 2]) -> DVec3 {
    let (sin, cos) = (TAU * b).sin_cos();
    if alpha.x == alpha.y {
        let cosine = 1.0 / (1.0 - alpha.x * alpha.x * a.ln()).sqrt();
        let sine = (1.0 - cosine * cosine).max(0.0).sqrt();
        return DVec3::new(sine * cos, sine * sin, cosine);
    }
    let slope = (-a.ln()).sqrt();
    DVec3::new(alpha.x * slope * cos, alpha.y * slope * sin, 1.0).normalize()
}

/// A facet normal of GGX that is visible from `viewer` (Heitz 2018).
fn visible_normal(viewer: DVec3, alpha: DVec2, [a, b]: [f64; 2]) -> DVec3 {
    let stretched = DVec3::new(alpha.x * viewer.x, alpha.y * viewer.y, viewer.z).normalize();
    let (r, (sin, cos)) = (a.sqrt(), (TAU * b).sin_cos());
    let disc = DVec2::new(r * cos, r * sin);
    let lift = 0.5 * (1.0 + stretched.z);
    // One axis of the disc lies in the surface.
    let side = DVec3::Z.cross(stretched).try_normalize().unwrap_or(DVec3::X);
    let other = stretched.cross(side);
    let y = (1.0 - lift) * (1.0 - disc.x * disc.x).max(0.0).sqrt() + lift * disc.y;
    let z = (1.0 - disc.x * disc.x - y * y).max(0.0).sqrt();
    let h = disc.x * side + y * other + z * stretched;
    DVec3::new(alpha.x * h.x, alpha.y * h.y, h.z.max(0.0)).normalize()
}
