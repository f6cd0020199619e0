//! Colour bars, and pictures with a colour bar beside them.

use glam::DVec2;

use super::{
    canvas::{Canvas, Pen},
    color::Color,
    colormap::Shading,
    geometry::Rect,
    raster::{Filter, Raster},
    scale::{Kind, Ticks},
    text::{Align, Direction, Height, TextStyle},
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
    /// A bar filling `bar`, low values at the bottom, with ticks and `label` to its right.
    pub(crate) fn vertical_color_bar(&mut self, bar: Rect, shading: &Shading, label: &str) {
        let strip = Raster::from_fn(1, device_steps(bar.height), |_, row| {
            let position = 1.0 - (row as f64 + 0.5) / device_steps(bar.height) as f64;
            shading.color(shading.scale.value(position)).rgb.map(f64::from)
        });
        self.image(&strip, bar, Filter::Nearest);
        self.frame(bar, &Pen::new(Color::SPINE, 0.5));
        let ticks = bar_ticks(shading, bar.height / 32.0);
        let style = TextStyle::new(TEXT, Color::MUTED).anchored(Align::Left, Height::Middle);
        let mut widest: f64 = 0.0;
        for (value, text) in &ticks.major {
            let Some(position) = shading.scale.position(*value) else { continue };
            let at = DVec2::new(bar.right(), bar.bottom() - position * bar.height);
            self.rule(at, at + DVec2::new(TICK, 0.0), &Pen::new(Color::SPINE, 0.5));
            widest = widest.max(self.text(text, at + DVec2::new(TICK + 3.0, 0.0), &style));
        }
        let above = DVec2::new(bar.x, bar.y - 5.0);
        self.text(&ticks.factor, above, &style.anchored(Align::Left, Height::Baseline));
        let style =
            TextStyle::new(LABEL, Color::INK).anchored(Align::Centre, Height::Top).running(Direction::Up);
        let x = bar.right() + TICK + 3.0 + widest + 6.0;
        self.text(label, DVec2::new(x, bar.centre().y), &style);
    }

    /// A bar filling `bar`, low values on the left, with ticks and `label` below.
    pub(crate) fn horizontal_color_bar(&mut self, bar: Rect, shading: &Shading, label: &str) {
        let steps = device_steps(bar.width);
        let strip = Raster::from_fn(steps, 1, |column, _| {
            let position = (column as f64 + 0.5) / steps as f64;
            shading.color(shading.scale.value(position)).rgb.map(f64::from)
        });
        self.image(&strip, bar, Filter::Nearest);
        self.frame(bar, &Pen::new(Color::SPINE, 0.5));
        let ticks = bar_ticks(shading, bar.width / 44.0);
        let style = TextStyle::new(TEXT, Color::MUTED).anchored(Align::Centre, Height::Top);
        for (value, text) in &ticks.major {
            let Some(position) = shading.scale.position(*value) else { continue };
            let at = DVec2::new(bar.x + position * bar.width, bar.bottom());
            self.rule(at, at + DVec2::new(0.0, TICK), &Pen::new(Color::SPINE, 0.5));
            self.text(text, at + DVec2::new(0.0, TICK + 3.0), &style);
        }
        let beside = DVec2::new(bar.right() + 5.0, bar.centre().y);
        self.text(&ticks.factor, beside, &style.anchored(Align::Left, Height::Middle));
        let below = DVec2::new(bar.centre().x, bar.bottom() + TICK + 3.0 + TEXT + 5.0);
        self.text(label, below, &TextStyle::new(LABEL, Color::INK).anchored(Align::Centre, Height::Top));
    }

    /// The field of `width`×`height` values as a framed picture with its colour bar on the right, as
    /// large as `space` allows, in its top left corner. Returns the rectangle of the picture alone.
    ///
    /// # Panics
    /// If there are not `width`·`height` values.
    pub(crate) fn field(
        &mut self,
        (width, height): (usize, usize),
        values: &[f64],
        shading: &Shading,
        label: &str,
        space: Rect,
    ) -> Rect {
        let ticks = bar_ticks(shading, 6.0);
        let style = TextStyle::new(TEXT, Color::MUTED);
        let widest = ticks.major.iter().map(|(_, text)| style.width(text)).fold(LABEL_ROOM, f64::max);
        let labelled = if label.is_empty() { 0.0 } else { 6.0 + LABEL };
        let beside = GAP + THICKNESS + TICK + 3.0 + widest + labelled;
        let raster = shading.raster(width, height, values);
        let picture = self.image_fit(&raster, space.inset(0.0, ABOVE, beside, 1.0), Filter::Nearest);
        self.frame(picture, &Pen::new(Color::SPINE, 0.5));
        let bar = Rect::new(picture.right() + GAP, picture.y, THICKNESS, picture.height);
        self.vertical_color_bar(bar, shading, label);
        picture
    }
}

fn device_steps(length: f64) -> usize {
    (2.0 * length).round().clamp(2.0, 4096.0) as usize
}

/// About `target` ticks, two at the least.
fn bar_ticks(shading: &Shading, target: f64) -> Ticks {
    let ticks = shading.scale.ticks((target as usize).clamp(2, 7));
    if shading.scale.kind() == Kind::Linear && ticks.major.len() < 2 {
        return shading.scale.ticks(4);
    }
    ticks
}
