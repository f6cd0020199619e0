//! Images and gradient images of scenes in space as pictures.

use glam::{DVec2, DVec3};
use volume3d::scene::{Camera, Scene};

use crate::plot::{Canvas, Color, Filter, Pen, Raster, Rect, Shading};

/// Luminance, by Rec. 709's weights.
pub(crate) const LUMINANCE: DVec3 = DVec3::new(0.2126, 0.7152, 0.0722);

/// The luminance of every pixel.
#[must_use]
pub(crate) fn luminance(pixels: &[DVec3]) -> Vec<f64> {
    pixels.iter().map(|pixel| pixel.dot(LUMINANCE)).collect()
}

/// Linear radiance as a picture of `width` columns.
#[must_use]
pub(crate) fn radiance(pixels: &[DVec3], width: usize) -> Raster {
    let encoded = pixels.iter().map(|pixel| pixel.as_vec3().to_array()).collect();
    Raster::new(width, pixels.len() / width, encoded).encoded()
}

/// Draws a picture as large as `space` allows, in a frame, and returns its place.
pub(crate) fn framed(canvas: &mut Canvas, raster: &Raster, space: Rect) -> Rect {
    let place = canvas.image_fit(raster, space, Filter::Nearest);
    canvas.frame(place, &Pen::new(Color::SPINE, 0.5));
    place
}

/// Draws the luminance of a gradient image of `width` columns.
pub(crate) fn gradient(
    canvas: &mut Canvas,
    pixels: &[DVec3],
    width: usize,
    shading: &Shading,
    space: Rect,
) -> Rect {
    let raster = shading.raster(width, pixels.len() / width, &luminance(pixels));
    framed(canvas, &raster, space)
}

/// Where a point of the world lies on a picture of the whole film.
#[must_use]
pub(crate) fn on_film(scene: &Scene, place: Rect, point: DVec3) -> DVec2 {
    let Camera { origin, right, up, forward, field_of_view } = &scene.description().camera;
    let toward = point - *origin;
    let half = (0.5 * field_of_view).tan() * toward.dot(*forward);
    let across = DVec2::new(toward.dot(*right), -toward.dot(*up)) / half;
    place.centre() + 0.5 * place.width * across
}
