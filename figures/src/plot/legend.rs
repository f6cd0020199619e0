//! Legends: the names of series beside samples of them.

use glam::DVec2;

use super::{
    canvas::{Canvas, Pen},
    color::Color,
    geometry::Rect,
    marks::{Mark, Marker, Style},
    text::{Align, Height, TextStyle},
};

const TEXT: f64 = 10.0;
const ROW: f64 = 15.0;
const SAMPLE: f64 = 20.0;
const GAP: f64 = 6.0;
const PADDING: f64 = 6.0;

/// Position of the legend: in a corner of the frame, or none.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Legend {
    None,
    TopLeft,
    TopRight,
    BottomLeft,
    BottomRight,
    /// To the right of the frame, which shrinks by its width.
    Outside,
}

fn text_style() -> TextStyle {
    TextStyle::new(TEXT, Color::INK).anchored(Align::Left, Height::Middle)
}

/// Width of the legend with its padding; zero without entries.
pub(super) fn width(entries: &[&(Mark, Style)]) -> f64 {
    let longest = entries.iter().map(|(_, style)| text_style().width(&style.label)).fold(0.0, f64::max);
    if entries.is_empty() { 0.0 } else { longest + SAMPLE + GAP + 2.0 * PADDING }
}

/// Draws the legend.
pub(super) fn draw(canvas: &mut Canvas, legend: Legend, frame: Rect, entries: &[&(Mark, Style)]) {
    if entries.is_empty() || legend == Legend::None {
        return;
    }
    let (width, height) = (width(entries), ROW * entries.len() as f64 + PADDING);
    let air = 4.0;
    let (left, right) = (frame.x + air + 2.0, frame.right() - width - air);
    let (top, bottom) = (frame.y + air, frame.bottom() - height - air - 2.0);
    let (x, y) = match legend {
        Legend::TopLeft => (left, top),
        Legend::BottomLeft => (left, bottom),
        Legend::BottomRight => (right, bottom),
        Legend::Outside => (frame.right() + 9.0, frame.y - 3.0),
        Legend::TopRight | Legend::None => (right, top),
    };
    let covered = Rect::new(x, y, width, height);
    if legend != Legend::Outside {
        canvas.fill_rect(covered, Color::WHITE.alpha(0.85));
    }
    for (i, (mark, style)) in entries.iter().enumerate() {
        let middle = DVec2::new(x + PADDING, y + 0.5 * PADDING + ROW * (i as f64 + 0.5));
        sample(canvas, mark, style, middle);
        canvas.text(&style.label, middle + DVec2::new(SAMPLE + GAP, 0.0), &text_style());
    }
}

/// A short piece of the series, starting at `start`.
fn sample(canvas: &mut Canvas, mark: &Mark, style: &Style, start: DVec2) {
    let end = start + DVec2::new(SAMPLE, 0.0);
    let middle = 0.5 * (start + end);
    let swatch = Rect::new(start.x + 3.0, start.y - 4.5, SAMPLE - 6.0, 9.0);
    match mark {
        Mark::Band(_) => {
            return canvas.fill_rect(swatch, style.pen.color.alpha(0.2 * style.pen.color.alpha));
        }
        Mark::Bars(..) => return canvas.fill_rect(swatch, style.pen.color),
        Mark::Line(_) | Mark::Steps(_) | Mark::Horizontal(_) | Mark::Vertical(_) => {
            canvas.line(start, end, &style.pen);
        }
        Mark::ErrorBars(_) => {
            let reach = DVec2::new(0.0, 5.0);
            canvas.line(middle - reach, middle + reach, &Pen::new(style.pen.color, 1.2));
        }
        Mark::Scatter(_) => {}
    }
    let implied = matches!(mark, Mark::Scatter(_)).then_some(Marker::Circle);
    if let Some(marker) = style.marker.or(implied) {
        canvas.marker(marker, middle, style.radius, style.pen.color);
    }
}
