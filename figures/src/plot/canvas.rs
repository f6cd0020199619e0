//! The drawing surface: shapes in logical pixels on a tiny-skia pixmap of twice the resolution.
//!
//! Degenerate shapes and shapes with coordinates that are not finite draw nothing.

use glam::DVec2;
use serde::{Deserialize, Serialize};
use tiny_skia::{
    FillRule, LineCap, LineJoin, Mask, Paint, Path, PathBuilder, Pixmap, PixmapPaint, Stroke, StrokeDash,
    Transform,
};

use super::{color::Color, geometry::Rect};

/// Device pixels per logical pixel, so that figures stay crisp on dense screens and in print.
pub(super) const SCALE: f64 = 2.0;
/// The longest side of a canvas in device pixels.
const LARGEST: f64 = 16384.0;

/// Style of a line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Pen {
    pub(crate) color: Color,
    /// Width in logical pixels.
    pub(crate) width: f64,
    /// Lengths of dash and gap in logical pixels, if not solid.
    pub(crate) dash: Option<[f64; 2]>,
}

impl Pen {
    /// A solid line.
    pub(crate) const fn new(color: Color, width: f64) -> Self {
        Self { color, width, dash: None }
    }

    /// The line with dashes.
    pub(crate) fn dashed(self) -> Self {
        Self { dash: Some([3.0 * self.width + 1.5, 2.0 * self.width + 1.0]), ..self }
    }

    /// The line with dots.
    pub(crate) fn dotted(self) -> Self {
        Self { dash: Some([1e-3, 2.0 * self.width + 0.5]), ..self }
    }
}

/// Rectangles in device pixels, as [left, top, right, bottom], that do not change on dark pages.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, Serialize)]
pub(crate) struct Kept(Vec<[u32; 4]>);

impl Kept {
    pub(super) fn holds(&self, x: u32, y: u32) -> bool {
        let within =
            |&[left, top, right, bottom]: &[u32; 4]| (left..right).contains(&x) && (top..bottom).contains(&y);
        self.0.iter().any(within)
    }
}

/// A page measured in logical pixels, initially white.
#[derive(Clone)]
pub(crate) struct Canvas {
    pixmap: Pixmap,
    clip: Option<Mask>,
    /// Parts of the page that can be read on their own, in logical pixels.
    parts: Vec<Rect>,
    /// Colours unchanged on dark pages.
    kept: Kept,
}

impl Canvas {
    /// A white page of the given logical size, which is clamped to 1–8192 pixels a side.
    pub(crate) fn new(width: f64, height: f64) -> Self {
        let device = |length: f64| ((length * SCALE).round().min(LARGEST) as u32).max(1);
        let mut pixmap = Pixmap::new(device(width), device(height)).expect("sides lie in 1–16384");
        pixmap.fill(tiny_skia::Color::WHITE);
        Self { pixmap, clip: None, parts: vec![], kept: Kept::default() }
    }

    /// The pixels drawn so far, in device pixels.
    pub(crate) fn pixmap(&self) -> &Pixmap {
        &self.pixmap
    }

    /// Its size in logical pixels.
    pub(crate) fn size(&self) -> DVec2 {
        DVec2::new(f64::from(self.pixmap.width()), f64::from(self.pixmap.height())) / SCALE
    }

    /// Marks a rectangle as readable on its own, for pages too narrow for the whole drawing.
    pub(crate) fn part(&mut self, space: Rect) {
        self.parts.push(space);
    }

    /// All parts that can be read on their own.
    pub(crate) fn parts(&self) -> &[Rect] {
        &self.parts
    }

    pub(super) fn keep(&mut self, place: [u32; 4]) {
        self.kept.0.push(place);
    }

    /// Colours unchanged on dark pages.
    pub(crate) fn kept(&self) -> &Kept {
        &self.kept
    }

    /// Runs `draw` with drawing restricted to `rect`, in addition to earlier restrictions.
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
    pub(super) fn fill(&mut self, path: &Path, color: Color, rule: FillRule, place: Transform) {
        let transform = place.post_concat(page_transform());
        self.pixmap.fill_path(path, &paint(color), rule, transform, self.clip.as_ref());
    }

    /// Strokes a path given in logical pixels, with round ends (square ones on dashes).
    pub(super) fn stroke(&mut self, path: &Path, pen: &Pen, place: Transform) {
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

    /// A horizontal or vertical line snapped to whole device pixels, for axes and grids.
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
            self.stroke(&path, pen, Transform::identity());
        }
    }

    /// The interior of closed rings by the even-odd rule, so that inner rings are holes.
    pub(crate) fn fill_polygon<R: AsRef<[DVec2]>>(&mut self, outline: &[R], color: Color) {
        if let Some(path) = rings(outline, true) {
            self.fill(&path, color, FillRule::EvenOdd, Transform::identity());
        }
    }

    /// The closed rings themselves.
    pub(crate) fn stroke_polygon<R: AsRef<[DVec2]>>(&mut self, outline: &[R], pen: &Pen) {
        if let Some(path) = rings(outline, true) {
            self.stroke(&path, pen, Transform::identity());
        }
    }

    /// The interior of one ring, with a line around it.
    pub(crate) fn outlined(&mut self, ring: &[DVec2], color: Color, pen: &Pen) {
        self.fill_polygon(&[ring], color);
        self.stroke_polygon(&[ring], pen);
    }

    /// A filled rectangle.
    pub(crate) fn fill_rect(&mut self, rect: Rect, color: Color) {
        self.fill_polygon(&[rect.corners()], color);
    }

    /// A frame whose inner edge runs along the rectangle, on whole device pixels; pictures keep all of their
    /// pixels.
    pub(crate) fn frame(&mut self, rect: Rect, pen: &Pen) {
        let width = (pen.width * SCALE).round().max(1.0) / SCALE;
        let outer = rect.inset(-width, -width, -width, -width);
        self.fill_polygon(&[rect.corners(), outer.corners()], pen.color);
    }

    /// A filled disc.
    pub(crate) fn disc(&mut self, centre: DVec2, radius: f64, color: Color) {
        if let Some(path) = circle(centre, radius) {
            self.fill(&path, color, FillRule::Winding, Transform::identity());
        }
    }

    /// A circle line.
    pub(crate) fn circle(&mut self, centre: DVec2, radius: f64, pen: &Pen) {
        if let Some(path) = circle(centre, radius) {
            self.stroke(&path, pen, Transform::identity());
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
        self.line(from, neck, &shaft);
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

fn circle(centre: DVec2, radius: f64) -> Option<Path> {
    PathBuilder::from_circle(centre.x as f32, centre.y as f32, radius as f32)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn holes_and_clips() {
        let mut canvas = Canvas::new(20.0, 20.0);
        let outline = [Rect::new(2.0, 2.0, 16.0, 16.0).corners(), Rect::new(6.0, 6.0, 8.0, 8.0).corners()];
        canvas.clipped(Rect::new(0.0, 0.0, 10.0, 20.0), |canvas| {
            canvas.clipped(Rect::new(0.0, 0.0, 20.0, 10.0), |canvas| {
                canvas.fill_polygon(&outline, Color::hex(0));
            });
        });
        // Inside, in the hole, clipped on the right and below.
        for (x, y, expected) in [(8, 8, 0), (16, 16, 255), (30, 8, 255), (8, 30, 255)] {
            assert_eq!(
                canvas.pixmap().pixel(x, y).map(tiny_skia::PremultipliedColorU8::red),
                Some(expected),
                "{x} {y}"
            );
        }
    }
}
