//! Figures: a title above a body of lettered panels.

use glam::DVec2;

use super::{
    axes::Axes,
    canvas::Canvas,
    color::Color,
    geometry::Rect,
    marks::Placed,
    text::{Align, Height, TextStyle},
};

/// White margin around everything.
const MARGIN: f64 = 14.0;
const TITLE: f64 = 15.0;
const PANEL_TITLE: f64 = 11.5;
/// Height of a panel's title.
pub(crate) const PANEL_TITLE_ROOM: f64 = 21.0;
/// Distance between panels that keeps their labels apart.
pub(crate) const GUTTER: f64 = 22.0;

/// A page with a title and a free body for panels below it.
pub(crate) struct Figure {
    pub(crate) canvas: Canvas,
    pub(crate) body: Rect,
    /// Number of lettered panels.
    panels: u8,
}

impl Figure {
    /// A figure whose body has the given size in logical pixels (720–960 wide suits the gallery); the title
    /// adds its own height, and takes none if empty.
    pub(crate) fn new(body_width: f64, body_height: f64, title: &str) -> Self {
        let above = if title.is_empty() { 0.0 } else { TITLE + 13.0 };
        let mut canvas = Canvas::new(body_width + 2.0 * MARGIN, body_height + above + 2.0 * MARGIN);
        let body = Rect::new(MARGIN, MARGIN + above, body_width, body_height);
        let style = TextStyle::new(TITLE, Color::INK).bold().anchored(Align::Left, Height::Top);
        canvas.text(title, DVec2::new(MARGIN, MARGIN), &style);
        Self { canvas, body, panels: 0 }
    }

    /// Titles the next panel "(a) Title" and returns the space below the title.
    pub(crate) fn panel(&mut self, space: Rect, title: &str) -> Rect {
        let letter = char::from(b'a' + self.panels);
        self.panels += 1;
        self.canvas.part(space);
        let (strip, rest) = space.split_top(PANEL_TITLE_ROOM);
        let at = DVec2::new(strip.x, strip.y + 1.0);
        let style = TextStyle::new(PANEL_TITLE, Color::INK).anchored(Align::Left, Height::Top);
        let width = self.canvas.text(&format!("({letter})"), at, &style.bold());
        self.canvas.text(title, at + DVec2::new(width + 6.0, 0.0), &style);
        rest
    }

    /// A panel with a plot; returns its frame and scales.
    pub(crate) fn plot(&mut self, space: Rect, title: &str, axes: &Axes) -> Placed {
        let space = self.panel(space, title);
        axes.draw(&mut self.canvas, space)
    }
}
