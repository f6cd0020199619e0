//! Pixel pictures and their magnification on the page.

use super::{
    canvas::{Canvas, Pen, SCALE},
    color::Color,
    geometry::Rect,
};

/// An RGB picture, row by row from the top, sRGB-encoded in [0, 1] (values beyond are clamped when drawn).
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Raster {
    width: usize,
    height: usize,
    pixels: Vec<[f32; 3]>,
    /// Whether it does not change on dark pages.
    is_kept: bool,
}

impl Raster {
    /// A picture of `width` columns of encoded pixels.
    pub(crate) fn new(width: usize, pixels: Vec<[f32; 3]>) -> Self {
        let height = pixels.len() / width;
        assert_eq!(pixels.len(), width * height, "a {width}×{height} picture");
        Self { width, height, pixels, is_kept: false }
    }

    /// The picture whose pixel in column x and row y is `color(x, y)`, encoded.
    pub(crate) fn from_fn(width: usize, height: usize, color: impl Fn(usize, usize) -> [f32; 3]) -> Self {
        Self::new(width, (0..width * height).map(|i| color(i % width, i / width)).collect())
    }

    /// Marks the picture as unchanged on dark pages: photographs, or colours without white.
    pub(crate) fn kept(self) -> Self {
        Self { is_kept: true, ..self }
    }

    /// Encodes linear values by the sRGB transfer function: a photograph, which does not change on dark
    /// pages.
    pub(crate) fn encoded(mut self) -> Self {
        for channel in self.pixels.iter_mut().flatten() {
            let linear = channel.clamp(0.0, 1.0);
            *channel =
                if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 };
        }
        self.kept()
    }

    /// The pixels, row by row from the top.
    pub(crate) fn pixels(&self) -> &[[f32; 3]] {
        &self.pixels
    }

    /// The mean colour over the pixel-space box [x0, x1]×[y0, y1], which has positive area.
    fn mean(&self, [x0, x1]: [f64; 2], [y0, y1]: [f64; 2]) -> [f32; 3] {
        let span = |low: f64, high: f64, end: usize| {
            let first = (low.max(0.0) as usize).min(end - 1);
            let last = (high.ceil().max(0.0) as usize).clamp(first + 1, end);
            (first..last).map(move |i| (i, (high.min(i as f64 + 1.0) - low.max(i as f64)).max(1e-9)))
        };
        let (mut sum, mut weight) = ([0.0; 3], 0.0);
        for (row, row_weight) in span(y0, y1, self.height) {
            for (column, column_weight) in span(x0, x1, self.width) {
                let pixel = Color::from_rgb(self.pixels[row * self.width + column]).rgb;
                let share = row_weight * column_weight;
                sum = std::array::from_fn(|i| sum[i] + share * f64::from(pixel[i]));
                weight += share;
            }
        }
        sum.map(|channel| (channel / weight) as f32)
    }
}

impl Canvas {
    /// Stretches a picture over `target`, whose edges are snapped to device pixels: every pixel becomes a
    /// rectangle of one colour, or, where the picture shrinks, device pixels take means. Returns the
    /// rectangle covered.
    pub(crate) fn image(&mut self, raster: &Raster, target: Rect) -> Rect {
        let (left, top) = ((target.x * SCALE).round(), (target.y * SCALE).round());
        let columns = (target.right() * SCALE).round() - left;
        let rows = (target.bottom() * SCALE).round() - top;
        let covered = Rect::new(left / SCALE, top / SCALE, columns / SCALE, rows / SCALE);
        let Some(mut picture) = tiny_skia::Pixmap::new(columns as u32, rows as u32) else { return covered };
        let (step_x, step_y) = (raster.width as f64 / columns, raster.height as f64 / rows);
        let shrinks = step_x > 1.0 || step_y > 1.0;
        for (i, pixel) in picture.pixels_mut().iter_mut().enumerate() {
            let (x, y) = ((i % columns as usize) as f64, (i / columns as usize) as f64);
            let rgb = if shrinks {
                raster.mean([x * step_x, (x + 1.0) * step_x], [y * step_y, (y + 1.0) * step_y])
            } else {
                let (u, v) = ((x + 0.5) * step_x, (y + 0.5) * step_y);
                raster.pixels[v as usize * raster.width + u as usize]
            };
            *pixel = Color::from_rgb(rgb).to_skia().premultiply().to_color_u8();
        }
        self.stamp(&picture, left as i32, top as i32);
        if raster.is_kept {
            self.keep([left, top, left + columns, top + rows].map(|side| side as u32));
        }
        covered
    }

    /// Draws a picture in a thin frame, as large as `space` allows at its own aspect ratio, in the top left
    /// corner. Magnified, every pixel is a square of the same whole number of device pixels. Returns the
    /// rectangle covered.
    pub(crate) fn picture(&mut self, raster: &Raster, space: Rect) -> Rect {
        let size = (raster.width as f64, raster.height as f64);
        let mut magnification = (space.width * SCALE / size.0).min(space.height * SCALE / size.1);
        if magnification > 1.0 {
            magnification = magnification.floor();
        }
        let (w, h) = (size.0 * magnification / SCALE, size.1 * magnification / SCALE);
        let snap = |v: f64| (v * SCALE).round() / SCALE;
        let place = self.image(raster, Rect::new(snap(space.x), snap(space.y), w, h));
        self.frame(place, &Pen::new(Color::SPINE, 0.5));
        place
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn magnified_pixels_are_squares_and_shrunk_ones_means() {
        let checker = Raster::from_fn(3, 2, |x, y| [((x + y) % 2) as f32; 3]);
        let mut canvas = Canvas::new(50.0, 40.0);
        let rect = canvas.picture(&checker, Rect::new(1.0, 1.0, 47.3, 37.1));
        let [left, top, side] = [rect.x, rect.y, rect.width / 3.0].map(|v| (v * SCALE) as u32);
        for (column, row) in (0..3).flat_map(|column| (0..2).map(move |row| (column, row))) {
            for corner in [0, side - 1] {
                let (x, y) = (left + column * side + corner, top + row * side + corner);
                let red = canvas.pixmap().pixel(x, y).map(tiny_skia::PremultipliedColorU8::red);
                assert_eq!(red, Some(if (column + row) % 2 == 1 { 255 } else { 0 }));
            }
        }
        assert!((checker.mean([0.0, 3.0], [0.0, 2.0])[0] - 0.5).abs() < 1e-6);
    }
}
