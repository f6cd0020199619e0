//! The drawing surface: shapes in logical pixels on a tiny-skia pixmap of twice the resolution.
//!
//! Shapes that are degenerate or not finite draw nothing.

use glam::DVec2;
use tiny_skia::{
    FillRule, LineCap, LineJoin, Mask, Paint, Path, PathBuilder, Pixmap, PixmapPaint, Stroke, StrokeDash,
    Transform,
};

use super::{color::Color, geometry::Rect};

/// Device pixels per logical pixel, so that figures stay crisp on dense screens and in print.
const SCALE: f64 = 2.0;
/// The longest side of a canvas in device pixels.
const LARGEST: f64 = 16384.0;

/// How a line is drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Pen {
    /// Colour.
    pub(crate) color: Color,
    /// Width in logical pixels.
    pub(crate) width: f64,
    /// Lengths of dash and gap in logical pixels, if not solid.
    pub(crate) dash: Option<[f64; 2]>,
}

impl Pen {
    /// A solid line.
    #[must_use]
    pub(crate) const fn new(color: Color, width: f64) -> Self {
        Self { color, width, dash: None }
    }

    /// The same line in dashes.
    #[must_use]
    pub(crate) fn dashed(self) -> Self {
        Self { dash: Some([3.0 * self.width + 1.5, 2.0 * self.width + 1.0]), ..self }
    }

    /// The same line in dots.
    #[must_use]
    pub(crate) fn dotted(self) -> Self {
        Self { dash: Some([1e-3, 2.0 * self.width + 0.5]), ..self }
    }
}

/// A page of logical pixels, white at first.
#[derive(Clone)]
pub(crate) struct Canvas {
    pixmap: Pixmap,
    clip: Option<Mask>,
}

impl Canvas {
    /// A white page of the given logical size, which is clamped to 1–8192 pixels a side.
    #[must_use]
    pub(crate) fn new(width: f64, height: f64) -> Self {
        let device = |length: f64| ((length * SCALE).round().min(LARGEST) as u32).max(1);
        let mut pixmap = Pixmap::new(device(width), device(height)).expect("sides lie in 1–16384");
        pixmap.fill(tiny_skia::Color::WHITE);
        Self { pixmap, clip: None }
    }

    /// Device pixels per logical pixel.
    #[must_use]
    pub(crate) fn scale(&self) -> f64 {
        SCALE
    }

    /// What has been drawn, in device pixels.
    #[must_use]
    pub(crate) fn pixmap(&self) -> &Pixmap {
        &self.pixmap
    }

    /// Runs `draw` with everything outside `rect` protected, besides what is protected already.
    pub(crate) fn clipped<T>(&mut self, rect: Rect, draw: impl FnOnce(&mut Self) -> T) -> T {
        let outer = self.clip.clone();
        let mut mask = outer.clone().or_else(|| Mask::new(self.pixmap.width(), self.pixmap.height()));
        if let (Some(mask), Some(path)) = (&mut mask, rings(&[rect.corners()], true)) {
            if outer.is_some() {
                mask.intersect_path(&path, FillRule::Winding, true, page_transform());
            } else {
                mask.fill_path(&path, FillRule::Winding, true, page_transform());
            }
        }
        self.clip = mask;
        let result = draw(self);
        self.clip = outer;
        result
    }

    /// Fills a path given in logical pixels.
    pub(crate) fn fill(&mut self, path: &Path, color: Color, rule: FillRule) {
        self.fill_transformed(path, color, rule, Transform::identity());
    }

    /// Strokes a path given in logical pixels, with round ends (square ones on dashes).
    pub(crate) fn stroke(&mut self, path: &Path, pen: &Pen) {
        self.stroke_transformed(path, pen, Transform::identity());
    }

    pub(super) fn fill_transformed(&mut self, path: &Path, color: Color, rule: FillRule, place: Transform) {
        let transform = place.post_concat(page_transform());
        self.pixmap.fill_path(path, &paint(color), rule, transform, self.clip.as_ref());
    }

    pub(super) fn stroke_transformed(&mut self, path: &Path, pen: &Pen, place: Transform) {
        let dotted = pen.dash.is_some_and(|[on, _]| on < 0.1);
        let stroke = Stroke {
            width: pen.width as f32,
            line_cap: if pen.dash.is_none() || dotted { LineCap::Round } else { LineCap::Butt },
            line_join: LineJoin::Round,
            dash: pen.dash.and_then(|[on, off]| StrokeDash::new(vec![on as f32, off as f32], 0.0)),
            ..Stroke::default()
        };
        let transform = place.post_concat(page_transform());
        self.pixmap.stroke_path(path, &paint(pen.color), &stroke, transform, self.clip.as_ref());
    }

    /// Copies opaque device pixels to the device position (left, top).
    pub(super) fn stamp(&mut self, picture: &Pixmap, left: i32, top: i32) {
        let (paint, clip) = (PixmapPaint::default(), self.clip.as_ref());
        self.pixmap.draw_pixmap(left, top, picture.as_ref(), &paint, Transform::identity(), clip);
    }

    /// A straight line.
    pub(crate) fn line(&mut self, from: DVec2, to: DVec2, pen: &Pen) {
        self.polyline(&[from, to], pen);
    }

    /// A horizontal or vertical line moved to whole device pixels, for axes and grids.
    pub(crate) fn rule(&mut self, from: DVec2, to: DVec2, pen: &Pen) {
        let thickness = (pen.width * SCALE).round().max(1.0);
        // An odd number of device pixels is centred on the middle of one, an even number between two.
        let middle = if thickness % 2.0 == 1.0 { 0.5 } else { 0.0 };
        let snap = |v: f64| ((v * SCALE - middle).round() + middle) / SCALE;
        let pen = Pen { width: thickness / SCALE, ..*pen };
        let [from, to] = [from, to].map(|point| DVec2::new(snap(point.x), snap(point.y)));
        if pen.dash.is_some() {
            return self.line(from, to, &pen);
        }
        let half = 0.5 * pen.width;
        let (low, high) = (from.min(to), from.max(to));
        let grow =
            if high.x - low.x > high.y - low.y { DVec2::new(0.0, half) } else { DVec2::new(half, 0.0) };
        let (low, size) = (low - grow, high - low + 2.0 * grow);
        self.fill_rect(Rect::new(low.x, low.y, size.x, size.y), pen.color);
    }

    /// An open chain of segments.
    pub(crate) fn polyline(&mut self, points: &[DVec2], pen: &Pen) {
        if let Some(path) = rings(&[points], false) {
            self.stroke(&path, pen);
        }
    }

    /// The interior of closed rings by the even-odd rule, so that inner rings are holes.
    pub(crate) fn fill_polygon<R: AsRef<[DVec2]>>(&mut self, outline: &[R], color: Color) {
        if let Some(path) = rings(outline, true) {
            self.fill(&path, color, FillRule::EvenOdd);
        }
    }

    /// The closed rings themselves.
    pub(crate) fn stroke_polygon<R: AsRef<[DVec2]>>(&mut self, outline: &[R], pen: &Pen) {
        if let Some(path) = rings(outline, true) {
            self.stroke(&path, pen);
        }
    }

    /// A filled rectangle.
    pub(crate) fn fill_rect(&mut self, rect: Rect, color: Color) {
        self.fill_polygon(&[rect.corners()], color);
    }

    /// A frame whose inner edge runs along the rectangle, on whole device pixels; pictures keep all of
    /// their pixels.
    pub(crate) fn frame(&mut self, rect: Rect, pen: &Pen) {
        let width = (pen.width * SCALE).round().max(1.0) / SCALE;
        let outer = rect.inset(-width, -width, -width, -width);
        self.fill_polygon(&[rect.corners(), outer.corners()], pen.color);
    }

    /// A filled disc.
    pub(crate) fn disc(&mut self, centre: DVec2, radius: f64, color: Color) {
        if let Some(path) = circle_path(centre, radius) {
            self.fill(&path, color, FillRule::Winding);
        }
    }

    /// A circle line.
    pub(crate) fn circle(&mut self, centre: DVec2, radius: f64, pen: &Pen) {
        if let Some(path) = circle_path(centre, radius) {
            self.stroke(&path, pen);
        }
    }

    /// An arrow whose head grows with the pen and never outgrows the arrow.
    pub(crate) fn arrow(&mut self, from: DVec2, to: DVec2, pen: &Pen) {
        let span = to - from;
        let length = span.length();
        if !(length > 1e-3 && length.is_finite()) {
            return;
        }
        let along = span / length;
        let across = along.perp();
        let head = (3.4 * pen.width + 3.2).min(0.7 * length);
        let neck = to - 0.78 * head * along;
        let tail = to - head * along;
        // A short arrow keeps its proportions: the shaft thins with its head.
        let shaft = Pen { width: pen.width.min(0.45 * head), ..*pen };
        let shaft_path = [from, neck];
        if let Some(path) = rings(&[shaft_path], false) {
            self.stroke(&path, &shaft);
        }
        let half = 0.42 * head;
        self.fill_polygon(&[[to, tail + half * across, neck, tail - half * across]], pen.color);
    }
}

fn page_transform() -> Transform {
    Transform::from_scale(SCALE as f32, SCALE as f32)
}

fn paint(color: Color) -> Paint<'static> {
    let mut paint = Paint::default();
    paint.set_color(color.to_skia());
    paint
}

fn rings<R: AsRef<[DVec2]>>(rings: &[R], closed: bool) -> Option<Path> {
    let mut builder = PathBuilder::new();
    for ring in rings {
        for (i, point) in ring.as_ref().iter().enumerate() {
            let (x, y) = (point.x as f32, point.y as f32);
            if i == 0 { builder.move_to(x, y) } else { builder.line_to(x, y) }
        }
        if closed {
            builder.close();
        }
    }
    builder.finish()
}

fn circle_path(centre: DVec2, radius: f64) -> Option<Path> {
    PathBuilder::from_circle(centre.x as f32, centre.y as f32, radius as f32)
}

#[cfg(test)]
mod tests {
    use tiny_skia::PremultipliedColorU8;

    use super::*;

    fn red(canvas: &Canvas, x: u32, y: u32) -> Option<u8> {
        canvas.pixmap().pixel(x, y).map(PremultipliedColorU8::red)
    }

    #[test]
    fn holes_and_clips() {
        let mut canvas = Canvas::new(20.0, 20.0);
        let black = Color::hex(0);
        let outline = [Rect::new(2.0, 2.0, 16.0, 16.0).corners(), Rect::new(6.0, 6.0, 8.0, 8.0).corners()];
        canvas.clipped(Rect::new(0.0, 0.0, 10.0, 20.0), |canvas| {
            canvas.clipped(Rect::new(0.0, 0.0, 20.0, 10.0), |canvas| canvas.fill_polygon(&outline, black));
        });
        assert_eq!(red(&canvas, 8, 8), Some(0));
        assert_eq!(red(&canvas, 16, 16), Some(255), "the hole");
        assert_eq!(red(&canvas, 30, 8), Some(255), "clipped on the right");
        assert_eq!(red(&canvas, 8, 30), Some(255), "clipped below");
    }

    #[test]
    fn odd_shapes_draw_nothing_or_something_but_never_panic() {
        let mut canvas = Canvas::new(f64::NAN, 1e9);
        let pen = Pen::new(Color::INK, 1.0);
        for value in [f64::NAN, f64::INFINITY, 1e300, -1e300, 0.0] {
            let point = DVec2::splat(value);
            canvas.line(point, DVec2::ZERO, &pen.dashed());
            canvas.rule(point, DVec2::ZERO, &pen);
            canvas.arrow(DVec2::ZERO, point, &pen);
            canvas.disc(point, value, Color::INK);
            canvas.fill_polygon(&[[point; 3]], Color::INK);
            canvas.fill_polygon::<[DVec2; 0]>(&[[]], Color::INK);
        }
    }

    #[test]
    fn rules_are_crisp() {
        let mut canvas = Canvas::new(10.0, 10.0);
        canvas.rule(DVec2::new(0.0, 4.9), DVec2::new(10.0, 4.9), &Pen::new(Color::hex(0), 1.0));
        let column: Vec<_> = (8..12).map(|y| red(&canvas, 10, y)).collect();
        assert_eq!(column, [Some(255), Some(0), Some(0), Some(255)]);
    }
}
