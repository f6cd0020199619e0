//! Pictures made of pixels and their magnification on the page.

use super::{canvas::Canvas, color::Color, geometry::Rect};

/// An RGB picture, row by row from the top, sRGB-encoded in [0, 1] (values beyond are clamped when drawn).
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Raster {
    width: usize,
    height: usize,
    pixels: Vec<[f32; 3]>,
}

/// How a magnified picture is read between its pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Filter {
    /// Every pixel a square of one colour.
    Nearest,
    /// Straight interpolation between pixel centres.
    Bilinear,
}

impl Raster {
    /// A picture of encoded pixels.
    ///
    /// # Panics
    /// If there are not `width`·`height` pixels.
    #[must_use]
    pub(crate) fn new(width: usize, height: usize, pixels: Vec<[f32; 3]>) -> Self {
        assert_eq!(pixels.len(), width * height, "a {width}×{height} picture");
        Self { width, height, pixels }
    }

    /// The picture whose pixel in column x and row y is `color(x, y)`, encoded.
    #[must_use]
    pub(crate) fn from_fn(
        width: usize,
        height: usize,
        mut color: impl FnMut(usize, usize) -> [f64; 3],
    ) -> Self {
        let pixels = (0..width * height).map(|i| color(i % width, i / width).map(|c| c as f32)).collect();
        Self { width, height, pixels }
    }

    /// Encodes linear values by the sRGB transfer function.
    #[must_use]
    pub(crate) fn encoded(mut self) -> Self {
        for channel in self.pixels.iter_mut().flatten() {
            let linear = channel.clamp(0.0, 1.0);
            *channel =
                if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 };
        }
        self
    }

    /// The pixels, row by row from the top.
    #[must_use]
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

    /// The bilinear reading at pixel-space (x, y), pixel centres at half-integers, borders extended.
    fn between(&self, x: f64, y: f64) -> [f32; 3] {
        let axis = |t: f64, end: usize| {
            let t = (t - 0.5).clamp(0.0, (end - 1) as f64);
            let low = t as usize;
            (low, (low + 1).min(end - 1), (t - low as f64) as f32)
        };
        let ((x0, x1, tx), (y0, y1, ty)) = (axis(x, self.width), axis(y, self.height));
        let at = |x: usize, y: usize| Color::from_rgb(self.pixels[y * self.width + x]);
        at(x0, y0).mix(at(x1, y0), tx).mix(at(x0, y1).mix(at(x1, y1), tx), ty).rgb
    }
}

impl Canvas {
    /// Stretches a picture over `target`, whose edges move to device pixels; where it shrinks, device
    /// pixels take means. Returns the rectangle covered.
    pub(crate) fn image(&mut self, raster: &Raster, target: Rect, filter: Filter) -> Rect {
        let scale = self.scale();
        let (left, top) = ((target.x * scale).round(), (target.y * scale).round());
        let columns = (target.right() * scale).round() - left;
        let rows = (target.bottom() * scale).round() - top;
        let covered = Rect::new(left / scale, top / scale, columns / scale, rows / scale);
        let Some(mut picture) = tiny_skia::Pixmap::new(columns as u32, rows as u32) else { return covered };
        if raster.width == 0 || raster.height == 0 {
            return covered;
        }
        let (step_x, step_y) = (raster.width as f64 / columns, raster.height as f64 / rows);
        let shrinks = step_x > 1.0 || step_y > 1.0;
        for (i, pixel) in picture.pixels_mut().iter_mut().enumerate() {
            let (x, y) = ((i % columns as usize) as f64, (i / columns as usize) as f64);
            let rgb = if shrinks {
                raster.mean([x * step_x, (x + 1.0) * step_x], [y * step_y, (y + 1.0) * step_y])
            } else {
                let (u, v) = ((x + 0.5) * step_x, (y + 0.5) * step_y);
                match filter {
                    Filter::Nearest => raster.pixels[v as usize * raster.width + u as usize],
                    Filter::Bilinear => raster.between(u, v),
                }
            };
            *pixel = Color::from_rgb(rgb).to_skia().premultiply().to_color_u8();
        }
        self.stamp(&picture, left as i32, top as i32);
        covered
    }

    /// Places a picture as large as `space` allows at its own aspect ratio, in its top left corner. Magnified with
    /// [`Filter::Nearest`], every pixel is a square of the same whole number of device pixels. Returns
    /// the rectangle covered, for frames and overlays.
    pub(crate) fn image_fit(&mut self, raster: &Raster, space: Rect, filter: Filter) -> Rect {
        let rect = self.fitted(raster.width, raster.height, space, filter);
        self.image(raster, rect, filter)
    }

    /// Where [`Canvas::image_fit`] places a picture of `width`×`height` pixels.
    #[must_use]
    pub(crate) fn fitted(&self, width: usize, height: usize, space: Rect, filter: Filter) -> Rect {
        let size = (width.max(1) as f64, height.max(1) as f64);
        let device = self.scale();
        let mut magnification = (space.width * device / size.0).min(space.height * device / size.1);
        if filter == Filter::Nearest && magnification > 1.0 {
            magnification = magnification.floor();
        }
        let (w, h) = (size.0 * magnification / device, size.1 * magnification / device);
        let snap = |v: f64| (v * device).round() / device;
        Rect::new(snap(space.x), snap(space.y), w, h)
    }
}

#[cfg(test)]
mod tests {
    use tiny_skia::PremultipliedColorU8;

    use super::*;

    fn checker() -> Raster {
        Raster::from_fn(3, 2, |x, y| [((x + y) % 2) as f64; 3])
    }

    #[test]
    fn nearest_squares_are_exact() {
        let mut canvas = Canvas::new(50.0, 40.0);
        let rect = canvas.image_fit(&checker(), Rect::new(1.0, 1.0, 47.3, 37.1), Filter::Nearest);
        let square = (rect.width * canvas.scale()) as u32 / 3;
        assert_eq!(f64::from(square) * 3.0, rect.width * canvas.scale());
        let (left, top) = ((rect.x * canvas.scale()) as u32, (rect.y * canvas.scale()) as u32);
        for (column, row) in (0..3).flat_map(|column| (0..2).map(move |row| (column, row))) {
            for corner in [0, square - 1] {
                let pixel =
                    canvas.pixmap().pixel(left + column * square + corner, top + row * square + corner);
                let red = pixel.map(PremultipliedColorU8::red);
                assert_eq!(red, Some(if (column + row) % 2 == 1 { 255 } else { 0 }));
            }
        }
    }

    #[test]
    fn shrinking_takes_means() {
        let mean = checker().mean([0.0, 3.0], [0.0, 2.0]);
        assert!((mean[0] - 0.5).abs() < 1e-6);
        assert_eq!(checker().between(1.0, 0.5), [0.5; 3]);
    }
}
