//! Plots of named rows: numbers with their errors on a common axis, and columns of words beside them.

use glam::DVec2;

use super::{
    axes::{Axes, Axis},
    canvas::Canvas,
    color::Color,
    geometry::Rect,
    legend::Legend,
    marks::{Marker, Placed, Style},
    text::{Align, Height, TextStyle},
};

const TEXT: f64 = 9.8;

/// Rows from top to bottom, each with a name and a colour.
pub(crate) struct Rows {
    /// Axes for additional marks; initially without a legend.
    pub(crate) axes: Axes,
    names: Vec<(String, Color)>,
}

impl Rows {
    pub(crate) fn new(x: Axis, names: Vec<(String, Color)>) -> Self {
        let y = Axis::linear("").ticks::<String>([]).limits(-0.6, names.len() as f64 - 0.4);
        Self { axes: Axes::new(x, y).legend(Legend::None), names }
    }

    /// The position of a value in a row, in the units of the axes.
    pub(crate) fn point(&self, row: usize, value: f64) -> [f64; 2] {
        [value, (self.names.len() - 1 - row) as f64]
    }

    /// A marker in a row.
    pub(crate) fn mark(&mut self, row: usize, value: f64, marker: Marker) {
        let style = Style::new(self.names[row].1).marker(marker).radius(4.0);
        self.axes.scatter([self.point(row, value)], &style);
    }

    /// A line in a row.
    pub(crate) fn bar(&mut self, row: usize, ends: [f64; 2]) {
        let ends = ends.map(|end| self.point(row, end));
        self.axes.line(ends, &Style::new(self.names[row].1));
    }

    /// Draws the plot with room for the names on its left, and for `right` on its right.
    pub(crate) fn draw(&self, canvas: &mut Canvas, space: Rect, left: f64, right: f64) -> Placed {
        let placed = self.axes.draw(canvas, space.inset(left, 0.0, right, 0.0));
        let end = placed.frame.x - 8.0;
        self.words(canvas, &placed, end, Align::Right, |row| (self.names[row].0.clone(), self.names[row].1));
        placed
    }

    /// Writes a column of words with a heading, at an offset to the right of the plot.
    pub(crate) fn column(
        &self,
        canvas: &mut Canvas,
        placed: &Placed,
        (offset, heading): (f64, &str),
        words: impl Fn(usize) -> (String, Color),
    ) {
        let x = placed.frame.right() + offset;
        let style = TextStyle::new(10.0, Color::MUTED);
        canvas.text(heading, DVec2::new(x, placed.frame.y - 4.0), &style);
        self.words(canvas, placed, x, Align::Left, words);
    }

    fn words(
        &self,
        canvas: &mut Canvas,
        placed: &Placed,
        x: f64,
        align: Align,
        words: impl Fn(usize) -> (String, Color),
    ) {
        for row in 0..self.names.len() {
            let Some(at) = placed.at(self.point(row, placed.x.low())) else { continue };
            let (text, color) = words(row);
            let style = TextStyle::new(TEXT, color.mix(Color::INK, 0.25)).anchored(align, Height::Middle);
            canvas.text(&text, DVec2::new(x, at.y), &style);
        }
    }
}
