//! Colour bars, and pictures with a colour bar beside them.

use glam::DVec2;

use super::{
    canvas::{Canvas, Pen},
    color::Color,
    colormap::Shading,
    geometry::Rect,
    raster::Raster,
    scale::{Kind, Ticks},
    text::{Align, Height, TextStyle},
};

const TICK: f64 = 3.0;
const TEXT: f64 = 10.0;
const LABEL: f64 = 11.0;
/// Width of a bar and its distance from the picture, in logical pixels.
const THICKNESS: f64 = 9.0;
const GAP: f64 = 7.0;
/// Room for tick labels and above the bar for their common factor, kept even if it is not needed, so
/// that pictures in a row come out alike.
const LABEL_ROOM: f64 = 24.0;
const ABOVE: f64 = TEXT + 5.0;

impl Canvas {
    /// The colours for t from 0 to 1 along the longer side of `bar`, from the left or from the bottom.
    pub(crate) fn color_strip(&mut self, bar: Rect, color: impl Fn(f64) -> Color) {
        self.strip(bar, color, |raster| raster);
    }

    fn strip(&mut self, bar: Rect, color: impl Fn(f64) -> Color, placed: impl Fn(Raster) -> Raster) {
        let upright = bar.height > bar.width;
        let steps = (2.0 * bar.width.max(bar.height)).round().clamp(2.0, 4096.0) as usize;
        let (columns, rows) = if upright { (1, steps) } else { (steps, 1) };
        let strip = Raster::from_fn(columns, rows, |x, y| {
            let t = (x.max(y) as f64 + 0.5) / steps as f64;
            color(if upright { 1.0 - t } else { t }).rgb
        });
        self.image(&placed(strip), bar);
        self.frame(bar, &Pen::new(Color::SPINE, 0.5));
    }

    /// A colour strip for a shading, with ticks and `label` to the right of an upright bar and below a level
    /// one.
    pub(crate) fn color_bar(&mut self, bar: Rect, shading: &Shading, label: &str) {
        let upright = bar.height > bar.width;
        self.strip(bar, |t| shading.color(shading.scale.value(t)), |raster| shading.placed(raster));
        let ticks = bar_ticks(shading, if upright { bar.height / 32.0 } else { bar.width / 44.0 });
        let muted = TextStyle::new(TEXT, Color::MUTED);
        let beside = muted.anchored(Align::Left, Height::Middle);
        let (out, style) =
            if upright { (DVec2::X, beside) } else { (DVec2::Y, muted.anchored(Align::Centre, Height::Top)) };
        let mut widest: f64 = 0.0;
        for (value, text) in &ticks.major {
            let Some(t) = shading.scale.position(*value) else { continue };
            let at = if upright {
                DVec2::new(bar.right(), bar.bottom() - t * bar.height)
            } else {
                DVec2::new(bar.x + t * bar.width, bar.bottom())
            };
            self.rule(at, at + TICK * out, &Pen::new(Color::SPINE, 0.5));
            widest = widest.max(self.text(text, at + (TICK + 3.0) * out, &style));
        }
        let style = TextStyle::new(LABEL, Color::INK).anchored(Align::Centre, Height::Top);
        if upright {
            self.text(&ticks.factor, DVec2::new(bar.x, bar.y - 5.0), &muted);
            let x = bar.right() + TICK + 3.0 + widest + 6.0;
            self.text(label, DVec2::new(x, bar.centre().y), &style.upwards());
        } else {
            self.text(&ticks.factor, DVec2::new(bar.right() + 5.0, bar.centre().y), &beside);
            let y = bar.bottom() + TICK + 3.0 + TEXT + 5.0;
            self.text(label, DVec2::new(bar.centre().x, y), &style);
        }
    }

    /// The field of `width` columns as a framed picture with its colour bar on the right, as large as `space`
    /// allows, in its top left corner. Returns the rectangle of the picture alone.
    pub(crate) fn field(&mut self, width: usize, values: &[f64], shading: &Shading, space: Rect) -> Rect {
        let ticks = bar_ticks(shading, 6.0);
        let style = TextStyle::new(TEXT, Color::MUTED);
        let widest = ticks.major.iter().map(|(_, text)| style.width(text)).fold(LABEL_ROOM, f64::max);
        let beside = GAP + THICKNESS + TICK + 3.0 + widest;
        let picture = self.picture(&shading.raster(width, values), space.inset(0.0, ABOVE, beside, 1.0));
        self.color_bar(Rect::new(picture.right() + GAP, picture.y, THICKNESS, picture.height), shading, "");
        picture
    }
}

/// About `target` ticks, at least two.
fn bar_ticks(shading: &Shading, target: f64) -> Ticks {
    let ticks = shading.scale.ticks((target as usize).clamp(2, 7));
    let too_few = shading.scale.kind() == Kind::Linear && ticks.major.len() < 2;
    if too_few { shading.scale.ticks(4) } else { ticks }
}
