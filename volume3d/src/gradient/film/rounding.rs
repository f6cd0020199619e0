//! Rounding of points on the film.

use glam::DVec2;

use crate::scene::Scene;

/// Width of a border in roundings: several hundred times the rounding of a film point, so that an edge on a
/// border is equally often on either side of it, to 10⁻³.
const ROUNDINGS: f64 = 1024.0;

/// Rounding of a position on a pixel's border, in pixels.
pub(super) fn width(scene: &Scene, focal: f64) -> f64 {
    let (film, camera) = (&scene.description.film, &scene.description.camera);
    let size = DVec2::new(film.width as f64, film.height as f64);
    let numbers = (size * (1.0 + camera.principal_point.abs())).max_element();
    // Rounding of scene points seen from a distance of about the scene's size.
    let (low, high) = scene.bounds().unwrap_or((camera.origin, camera.origin));
    let away = (camera.origin - 0.5 * (low + high)).length().max(0.5 * (high - low).length());
    let seen = if away > 0.0 { focal * scene.rounding() / away } else { 0.0 };
    ROUNDINGS * f64::EPSILON * numbers + seen
}
