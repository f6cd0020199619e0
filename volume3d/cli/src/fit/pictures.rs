//! Pictures of a fit for viewing, from samples that the fit does not use.

use glam::DVec3;
use volume3d::Image;
use volume3d::gradient::render;
use volume3d::optimize::Fit;
use volume3d::scene::Scene;

use super::super::session::silent;

/// Samples per pixel of these pictures.
pub(super) const PICTURE: usize = 64;

/// Key of their random streams, distinct from those of the fit.
pub(super) const LOOKED_AT: u64 = 1 << 33;

/// Renders a view of the scene in its current state, with the random numbers of a purpose.
pub(super) fn looked_at(
    fit: &Fit,
    scene: &mut Scene,
    view: usize,
    samples: usize,
    purpose: u64,
) -> anyhow::Result<Image> {
    fit.objective().look(scene, view)?;
    Ok(render(scene, samples, purpose + view as u64, &silent())?.image)
}

/// Images in rows, side by side, separated by white.
pub(super) fn sheet(rows: &[Vec<Image>]) -> Image {
    const BETWEEN: usize = 4;
    let along = |row: &[Image]| row.iter().map(|image| image.width + BETWEEN).sum::<usize>();
    let tall = |row: &[Image]| row.iter().map(|image| image.height).max().unwrap_or(0) + BETWEEN;
    let width = rows.iter().map(|row| along(row)).max().unwrap_or(0).saturating_sub(BETWEEN).max(1);
    let height = rows.iter().map(|row| tall(row)).sum::<usize>().saturating_sub(BETWEEN).max(1);
    let mut sheet = Image::constant(width, height, DVec3::ONE);
    let mut top = 0;
    for row in rows {
        let mut left = 0;
        for image in row {
            for (y, pixels) in image.pixels.chunks_exact(image.width).enumerate() {
                let at = (top + y) * width + left;
                sheet.pixels[at..at + image.width].copy_from_slice(pixels);
            }
            left += image.width + BETWEEN;
        }
        top += tall(row);
    }
    sheet
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sheet_has_all_its_images() {
        let image = |width, height, value| Image::constant(width, height, DVec3::splat(value));
        let sheet = sheet(&[vec![image(3, 2, 0.1), image(5, 4, 0.2)], vec![image(2, 2, 0.3)]]);
        assert_eq!(sheet.size(), (12, 10));
        let at = |x: usize, y: usize| sheet.pixels[y * 12 + x].x;
        assert_eq!(
            [at(2, 1), at(2, 2), at(7, 3), at(11, 0), at(1, 9), at(3, 9)],
            [0.1, 1.0, 0.2, 0.2, 0.3, 1.0]
        );
    }
}
