//! Pixels near silhouettes.

use glam::DVec3;
use rayon::prelude::*;

use crate::Image;
use crate::gradient::FilmPlane;
use crate::scene::Scene;

/// Weights that restrict a loss to silhouettes: 1 in pixels within `reach` pixels, along rows and columns, of
/// a pixel next to which some of these shapes begin or end, 0 in all others.
///
/// Each pixel is sampled once, through its centre and the middle of a lens, so that features thinner than
/// pixels may be missed. Weights are those of the scene as it is, not functions of its parameters: a loss
/// with them has no derivative through them.
#[must_use]
pub fn silhouette_weights(scene: &Scene, shapes: &[usize], reach: usize) -> Image {
    let film = FilmPlane::new(scene);
    let (width, height) = scene.size();
    let origin = scene.camera().origin;
    let seen = |x: usize, y: usize| -> Option<u32> {
        let direction = film.ray(film.point(x + film.reach, y + film.reach, [0.5; 2]));
        let shape = scene.shape_of(scene.closest(origin, direction, None)?.surface);
        shapes.contains(&(shape as usize)).then_some(shape)
    };
    let places = || (0..width * height).into_par_iter().map(|i| (i % width, i / width));
    let shown: Vec<Option<u32>> = places().map(|(x, y)| seen(x, y)).collect();
    let around = |at: usize, by: usize, count: usize| at.saturating_sub(by)..(at + by + 1).min(count);
    let ends = |(x, y): (usize, usize)| {
        let rows = around(y, 1, height);
        rows.flat_map(|v| around(x, 1, width).map(move |u| v * width + u))
            .any(|i| shown[i] != shown[y * width + x])
    };
    let ends: Vec<bool> = places().map(ends).collect();
    let weight = |(x, y): (usize, usize)| {
        let mut near =
            around(y, reach, height).flat_map(|v| around(x, reach, width).map(move |u| v * width + u));
        DVec3::splat(f64::from(u8::from(near.any(|i| ends[i]))))
    };
    Image { width, height, pixels: places().map(weight).collect() }
}
