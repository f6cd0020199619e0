//! Dark-page versions of drawings.

use super::canvas::{Canvas, Kept};

/// The dark page and the light ink on it, sRGB-encoded, as in the gallery's style sheet.
const PAGE: [f64; 3] = [20.0, 23.0, 27.0];
const INK: [f64; 3] = [228.0, 231.0, 235.0];

/// The opaque 8-bit pixels of a drawing, which always has a white background.
pub(crate) fn light(canvas: &Canvas) -> Vec<u8> {
    canvas.pixmap().pixels().iter().flat_map(|pixel| [pixel.red(), pixel.green(), pixel.blue()]).collect()
}

/// The pixels for a dark page: everything drawn changes lightness and keeps its hue, so that white becomes
/// the page. Photographs, and colour maps without white, do not change.
pub(crate) fn dark(canvas: &Canvas) -> Vec<u8> {
    let mut pixels = light(canvas);
    darkened(&mut pixels, [0, 0, canvas.pixmap().width()], canvas.kept());
    pixels
}

/// Turns opaque 8-bit pixels into those for a dark page: of a rectangle of a drawing, given as its left and
/// top end and its width in device pixels.
pub(crate) fn darkened(pixels: &mut [u8], [left, top, width]: [u32; 3], kept: &Kept) {
    for (i, pixel) in (0..).zip(pixels.chunks_exact_mut(3)) {
        if !kept.holds(left + i % width, top + i / width) {
            let turned = turned([pixel[0], pixel[1], pixel[2]]);
            pixel.copy_from_slice(&turned);
        }
    }
}

/// The colour of the same hue whose lightness (the mean of its largest and least channel) is 1 less its own,
/// between page and ink.
fn turned(rgb: [u8; 3]) -> [u8; 3] {
    let (least, most) = rgb.iter().fold((255, 0), |(a, b), &c| (c.min(a), c.max(b)));
    let shift = 255.0 - f64::from(least) - f64::from(most);
    std::array::from_fn(|k| {
        let part = (f64::from(rgb[k]) + shift) / 255.0;
        (PAGE[k] + part * (INK[k] - PAGE[k])).round() as u8
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn white_and_black_change_places_and_hues_stay() {
        assert_eq!(turned([255; 3]), PAGE.map(|c| c as u8));
        assert_eq!(turned([0; 3]), INK.map(|c| c as u8));
        let [red, green, blue] = turned([120, 0, 0]);
        assert!(red > 200 && green.abs_diff(blue) < 8 && green < 150, "{red} {green} {blue}");
    }
}
