//! Dielectric boundaries: smooth ones, thin plates, and rough ones.
//!
//! Refraction compresses radiance: light transmitted into a medium of relative index η is scaled by η⁻² along
//! a camera path (Veach 1997, section 5.2).

use flatland::calculus::{Number, Rgb, Vec3};
use glam::DVec3;

use super::shading::Passage;
use super::{Ideal, Shading};
use crate::optics::fresnel;
use crate::scene::Dielectric;

/// Relative index of refraction: beyond the boundary over the viewer's side.
pub(super) fn relative<T: Number>(shading: &Shading<'_, T>, dielectric: &Dielectric) -> f64 {
    if shading.behind { 1.0 / dielectric.eta } else { dielectric.eta }
}

/// The reflected or refracted direction at a smooth boundary, sampled with the probability of its share of
/// the light.
pub(super) fn smooth<T: Number>(shading: &Shading<'_, T>, dielectric: &Dielectric, choice: f64) -> Ideal<T> {
    let eta = relative(shading, dielectric);
    let (reflected, towards) = refracted(shading, eta);
    choose(shading, dielectric, choice, reflected, (towards, 1.0 / (eta * eta)))
}

/// The reflected share of the light, and the refracted direction; meaningless if all is reflected.
fn refracted<T: Number>(shading: &Shading<'_, T>, eta: f64) -> (T, Vec3<T>) {
    let cosine = shading.normal.dot(shading.viewer);
    let (reflected, beyond) = fresnel::dielectric(cosine, eta);
    let towards = shading.normal * (cosine * (1.0 / eta) - beyond) - shading.viewer * T::constant(1.0 / eta);
    (reflected, towards)
}

/// The refracted direction at a smooth boundary; `None` if all light is reflected.
pub(super) fn towards<T: Number>(shading: &Shading<'_, T>, dielectric: &Dielectric) -> Option<Vec3<T>> {
    let (reflected, towards) = refracted(shading, relative(shading, dielectric));
    (reflected.value() < 1.0).then_some(towards)
}

/// Reflection or straight transmission at a thin plate, with all internal reflections: R = 2F/(1 + F).
pub(super) fn thin<T: Number>(shading: &Shading<'_, T>, dielectric: &Dielectric, choice: f64) -> Ideal<T> {
    let (once, _) = fresnel::dielectric(shading.normal.dot(shading.viewer), dielectric.eta);
    let reflected = once * 2.0 / (T::constant(1.0) + once);
    choose(shading, dielectric, choice, reflected, (-shading.viewer, 1.0))
}

fn choose<T: Number>(
    shading: &Shading<'_, T>,
    dielectric: &Dielectric,
    choice: f64,
    reflected: T,
    (towards, scale): (Vec3<T>, f64),
) -> Ideal<T> {
    let part = reflected.value();
    if choice < part {
        let colour = Rgb::constant(dielectric.specular_reflectance);
        let factor = colour * (reflected * (1.0 / part));
        Ideal { branch: Passage::Mirrored.alone(), direction: shading.mirrored(), factor }
    } else {
        let passed = (T::constant(1.0) - reflected) * (scale / (1.0 - part));
        Ideal { branch: Passage::Refracted.alone(), direction: towards, factor: shading.reflectance * passed }
    }
}

/// f |cos θ| of a rough boundary, for reflection and transmission.
pub(super) fn rough<T: Number>(
    shading: &Shading<'_, T>,
    dielectric: &Dielectric,
    direction: Vec3<T>,
) -> Rgb<T> {
    let (eta, facets) = (relative(shading, dielectric), shading.facets());
    if shading.normal.dot(direction).value() > 0.0 {
        let (value, cosine) = facets.reflect(direction);
        return Rgb::constant(dielectric.specular_reflectance) * (value * fresnel::dielectric(cosine, eta).0);
    }
    let Some((value, cosine)) = facets.refract(direction, eta) else { return Rgb::constant(DVec3::ZERO) };
    shading.reflectance * (value * (T::constant(1.0) - fresnel::dielectric(cosine, eta).0))
}

/// Probability density of [`rough_sample`].
pub(super) fn rough_density<T: Number>(
    shading: &Shading<'_, T>,
    dielectric: &Dielectric,
    direction: DVec3,
) -> f64 {
    let (eta, facets) = (relative(shading, dielectric), shading.facets());
    let viewer = shading.viewer.value();
    if shading.normal.value().dot(direction) > 0.0 {
        let cosine = viewer.dot((viewer + direction).normalize());
        return facets.reflection_density(direction) * fresnel::dielectric(cosine, eta).0;
    }
    let density = facets.refraction_density(direction, eta);
    density.map_or(0.0, |(density, cosine)| density * (1.0 - fresnel::dielectric(cosine, eta).0))
}

/// A direction reflected or refracted by a facet, sampled with the probability of its share of the light;
/// `None` if the facet faces away, or the direction ends on the wrong side of the surface.
pub(super) fn rough_sample<T: Number>(
    shading: &Shading<'_, T>,
    dielectric: &Dielectric,
    [a, b, c]: [f64; 3],
) -> Option<DVec3> {
    let (eta, viewer) = (relative(shading, dielectric), shading.viewer.value());
    let half = shading.facets().sample([a, b]);
    refracted_or_reflected(viewer, half, eta, c)
        .filter(|(direction, reflects)| (shading.normal.value().dot(*direction) > 0.0) == *reflects)
        .map(|(direction, _)| direction)
}

/// The direction reflected or refracted by a facet, and whether it is reflected.
pub(super) fn refracted_or_reflected(
    viewer: DVec3,
    half: DVec3,
    eta: f64,
    choice: f64,
) -> Option<(DVec3, bool)> {
    let cosine = viewer.dot(half);
    if cosine <= 0.0 {
        return None;
    }
    let (reflected, beyond) = fresnel::dielectric(cosine, eta);
    Some(if choice < reflected {
        (2.0 * cosine * half - viewer, true)
    } else {
        ((cosine / eta - beyond) * half - viewer / eta, false)
    })
}
