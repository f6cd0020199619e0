//! Images and gradient images of scenes in space as pictures.

use glam::{DVec2, DVec3};
use volume3d::scene::{Camera, Scene};

use crate::plot::{Canvas, Raster, Rect, Shading};

/// Luminance, by Rec. 709's weights.
pub(crate) const LUMINANCE: DVec3 = DVec3::new(0.2126, 0.7152, 0.0722);

/// The luminance of every pixel.
pub(crate) fn luminance(pixels: &[DVec3]) -> Vec<f64> {
    pixels.iter().map(|pixel| pixel.dot(LUMINANCE)).collect()
}

/// Linear radiance as a picture of `width` columns.
pub(crate) fn radiance(pixels: &[DVec3], width: usize) -> Raster {
    Raster::new(width, pixels.iter().map(|pixel| pixel.as_vec3().to_array()).collect()).encoded()
}

/// Draws the luminance of a gradient image of `width` columns.
pub(crate) fn gradient(canvas: &mut Canvas, pixels: &[DVec3], width: usize, shading: &Shading, space: Rect) {
    canvas.picture(&shading.raster(width, &luminance(pixels)), space);
}

/// Position of a world point on a picture of the whole film.
pub(crate) fn on_film(scene: &Scene, place: Rect, point: DVec3) -> DVec2 {
    let Camera { origin, right, up, forward, field_of_view, .. } = &scene.description().camera;
    let toward = point - *origin;
    let half = (0.5 * field_of_view).tan() * toward.dot(*forward);
    let across = DVec2::new(toward.dot(*right), -toward.dot(*up)) / half;
    place.centre() + 0.5 * place.width * across
}
