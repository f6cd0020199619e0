//! Axes: a frame with ticks and labels around series of data.
//!
//! Series are collected first and drawn at once, so that limits, margins and legend can follow from them.
//! Values that cannot be drawn (NaN, infinities, non-positive ones on log axes) are omitted.

use glam::DVec2;

use super::{
    canvas::{Canvas, Pen},
    color::Color,
    geometry::Rect,
    legend::{self, Legend},
    marks::{Mark, Placed, Style},
    scale::{Kind, Scale, Ticks},
    text::{Align, Height, TextStyle},
};

const TICK: f64 = 4.0;
const TICK_TEXT: f64 = 10.0;
const LABEL_TEXT: f64 = 11.0;
/// Room kept for tick labels at the left, so that frames one above the other mostly line up.
const LEFT_ROOM: f64 = 26.0;

/// One axis: label, scale, limits and ticks.
#[derive(Clone, Debug)]
pub(crate) struct Axis {
    label: String,
    kind: Kind,
    limits: Option<(f64, f64)>,
    ticks: Option<Vec<(f64, String)>>,
    grid: bool,
}

impl Axis {
    /// A linear axis whose limits follow its data.
    pub(crate) fn linear(label: impl Into<String>) -> Self {
        Self { label: label.into(), kind: Kind::Linear, limits: None, ticks: None, grid: true }
    }

    /// A logarithmic axis whose limits follow its positive data.
    pub(crate) fn log(label: impl Into<String>) -> Self {
        Self { kind: Kind::Log, ..Self::linear(label) }
    }

    /// An axis of named positions at 0, 1, 2…, for bars.
    pub(crate) fn categories(label: impl Into<String>, names: &[&str]) -> Self {
        let ticks = names.iter().enumerate().map(|(i, name)| (i as f64, (*name).to_owned())).collect();
        let limits = Some((-0.6, names.len() as f64 - 0.4));
        Self { limits, ticks: Some(ticks), grid: false, ..Self::linear(label) }
    }

    /// Fixes the limits to `low` and `high`, whatever the data.
    pub(crate) fn limits(self, low: f64, high: f64) -> Self {
        Self { limits: Some((low, high)), ..self }
    }

    /// Fixes the ticks to the given values.
    pub(crate) fn ticks<L: Into<String>>(self, ticks: impl IntoIterator<Item = (f64, L)>) -> Self {
        Self { ticks: Some(ticks.into_iter().map(|(value, label)| (value, label.into())).collect()), ..self }
    }

    fn scale(&self, values: impl IntoIterator<Item = f64>) -> Scale {
        match self.limits {
            Some((low, high)) => Scale::new(self.kind, low, high),
            None => Scale::covering(self.kind, values),
        }
    }

    fn ticks_on(&self, scale: Scale, target: f64) -> Ticks {
        let mut ticks = match &self.ticks {
            Some(ticks) => Ticks { major: ticks.clone(), ..Ticks::default() },
            None => scale.ticks((target as usize).clamp(2, 9)),
        };
        ticks.major.retain(|(value, _)| scale.holds(*value));
        ticks.minor.retain(|value| scale.holds(*value));
        ticks
    }
}

/// A plot before it is drawn.
#[derive(Clone, Debug)]
pub(crate) struct Axes {
    x: Axis,
    y: Axis,
    legend: Legend,
    marks: Vec<(Mark, Style)>,
    notes: Vec<([f64; 2], String, Color)>,
}

impl Axes {
    /// Empty axes, with the legend in the top right corner.
    pub(crate) fn new(x: Axis, y: Axis) -> Self {
        Self { x, y, legend: Legend::TopRight, marks: Vec::new(), notes: Vec::new() }
    }

    /// Moves the legend.
    pub(crate) fn legend(self, legend: Legend) -> Self {
        Self { legend, ..self }
    }

    /// A line through the points, with markers if the style has one.
    pub(crate) fn line(&mut self, points: impl IntoIterator<Item = [f64; 2]>, style: &Style) {
        self.push(Mark::Line(points.into_iter().collect()), style);
    }

    /// A staircase: a value holds from its x to the next.
    pub(crate) fn steps(&mut self, points: impl IntoIterator<Item = [f64; 2]>, style: &Style) {
        self.push(Mark::Steps(points.into_iter().collect()), style);
    }

    /// Markers without a line.
    pub(crate) fn scatter(&mut self, points: impl IntoIterator<Item = [f64; 2]>, style: &Style) {
        self.push(Mark::Scatter(points.into_iter().collect()), style);
    }

    /// Vertical bars from low to high around markers: [x, y, low, high].
    pub(crate) fn error_bars(&mut self, points: impl IntoIterator<Item = [f64; 4]>, style: &Style) {
        self.push(Mark::ErrorBars(points.into_iter().collect()), style);
    }

    /// A pale band between two curves: [x, low, high].
    pub(crate) fn band(&mut self, points: impl IntoIterator<Item = [f64; 3]>, style: &Style) {
        self.push(Mark::Band(points.into_iter().collect()), style);
    }

    /// Bars from zero (on a log axis from its low end) to y, `width` in units of x.
    pub(crate) fn bars(&mut self, points: impl IntoIterator<Item = [f64; 2]>, width: f64, style: &Style) {
        self.push(Mark::Bars(points.into_iter().collect(), width), style);
    }

    /// A reference line at height y.
    pub(crate) fn horizontal(&mut self, y: f64, style: &Style) {
        self.push(Mark::Horizontal(y), style);
    }

    /// A reference line at x.
    pub(crate) fn vertical(&mut self, x: f64, style: &Style) {
        self.push(Mark::Vertical(x), style);
    }

    /// A text to the right of a point.
    pub(crate) fn note(&mut self, point: [f64; 2], text: impl Into<String>, color: Color) {
        self.notes.push((point, text.into(), color));
    }

    /// A line through points with bars for their errors: [x, y, low, high].
    pub(crate) fn measured(&mut self, points: impl IntoIterator<Item = [f64; 4]>, style: &Style) {
        let points: Vec<[f64; 4]> = points.into_iter().collect();
        let line = points.iter().map(|[x, y, ..]| [*x, *y]).collect();
        self.error_bars(points, &Style::new(style.pen.color));
        self.push(Mark::Line(line), style);
    }

    fn push(&mut self, mark: Mark, style: &Style) {
        self.marks.push((mark, style.clone()));
    }

    /// Draws everything into `space` and returns the map from data to the page, for additional drawing.
    pub(crate) fn draw(&self, canvas: &mut Canvas, space: Rect) -> Placed {
        let extent: Vec<[f64; 2]> = self.marks.iter().flat_map(|(mark, _)| mark.extent()).collect();
        let x = self.x.scale(extent.iter().map(|point| point[0]));
        let y = self.y.scale(extent.iter().map(|point| point[1]));
        let entries: Vec<&(Mark, Style)> =
            self.marks.iter().filter(|(_, style)| !style.label.is_empty()).collect();
        let legend_width = if self.legend == Legend::Outside { legend::width(&entries) } else { 0.0 };

        let rough = space.inset(50.0, 0.0, legend_width, 0.0);
        let x_room = if self.x.kind == Kind::Log { 44.0 } else { 62.0 };
        let x_ticks = self.x.ticks_on(x, rough.width / x_room);
        let y_ticks = self.y.ticks_on(y, space.height / 34.0);
        let tick_style = TextStyle::new(TICK_TEXT, Color::MUTED);
        let tick_width =
            y_ticks.major.iter().map(|(_, text)| tick_style.width(text)).fold(LEFT_ROOM, f64::max);

        // A fixed height, with a common factor or without, so that frames in a row line up.
        let top = 15.0;
        let labelled = |label: &str| if label.is_empty() { 0.0 } else { LABEL_TEXT + 8.0 };
        let left = labelled(&self.y.label) + tick_width + TICK + 4.0;
        let below = TICK + 4.0 + 0.8 * TICK_TEXT;
        let bottom = below + labelled(&self.x.label) + 2.0;
        let frame = space.inset(left, top, legend_width + 9.0, bottom);
        let placed = Placed { frame, x, y };

        self.draw_grid(canvas, &placed, &x_ticks, &y_ticks);
        for (mark, style) in &self.marks {
            placed.draw(canvas, mark, style);
        }
        draw_spines(canvas, &placed, &x_ticks, &y_ticks);

        for (value, text) in &x_ticks.major {
            let Some(at) = placed.at([*value, y.low()]) else { continue };
            let style = tick_style.anchored(Align::Centre, Height::Top);
            canvas.text(text, DVec2::new(at.x, frame.bottom() + TICK + 4.0), &style);
        }
        for (value, text) in &y_ticks.major {
            let Some(at) = placed.at([x.low(), *value]) else { continue };
            let style = tick_style.anchored(Align::Right, Height::Middle);
            canvas.text(text, DVec2::new(frame.x - TICK - 4.0, at.y), &style);
        }
        let above = DVec2::new(frame.x, frame.y - 6.0);
        canvas.text(&y_ticks.factor, above, &tick_style.anchored(Align::Left, Height::Baseline));
        let corner = DVec2::new(frame.right(), frame.bottom() + below + 6.0);
        canvas.text(&x_ticks.factor, corner, &tick_style.anchored(Align::Right, Height::Top));

        let style = TextStyle::new(LABEL_TEXT, Color::INK);
        let at = DVec2::new(frame.centre().x, frame.bottom() + below + 6.0);
        canvas.text(&self.x.label, at, &style.anchored(Align::Centre, Height::Top));
        let at = DVec2::new(space.x + 1.0, frame.centre().y);
        canvas.text(&self.y.label, at, &style.anchored(Align::Centre, Height::Top).upwards());

        legend::draw(canvas, self.legend, frame, &entries);
        for (point, text, color) in &self.notes {
            let Some(at) = placed.at(*point).filter(|at| frame.contains(*at)) else { continue };
            let style =
                TextStyle::new(TICK_TEXT, *color).anchored(Align::Left, Height::Middle).halo(Color::WHITE);
            canvas.text(text, at + DVec2::new(8.0, 0.0), &style);
        }
        placed
    }

    fn draw_grid(&self, canvas: &mut Canvas, placed: &Placed, x_ticks: &Ticks, y_ticks: &Ticks) {
        let (frame, pen) = (placed.frame, Pen::new(Color::GRID, 0.5));
        let at = |point: [f64; 2]| placed.at(point);
        for (value, _) in x_ticks.major.iter().filter(|_| self.x.grid) {
            let Some(foot) = at([*value, placed.y.low()]) else { continue };
            canvas.rule(foot, DVec2::new(foot.x, frame.y), &pen);
        }
        for (value, _) in y_ticks.major.iter().filter(|_| self.y.grid) {
            let Some(start) = at([placed.x.low(), *value]) else { continue };
            canvas.rule(start, DVec2::new(frame.right(), start.y), &pen);
        }
    }
}

/// The left and bottom edges of the frame with their ticks.
fn draw_spines(canvas: &mut Canvas, placed: &Placed, x_ticks: &Ticks, y_ticks: &Ticks) {
    let frame = placed.frame;
    let pen = Pen::new(Color::SPINE, 1.0);
    let thin = Pen::new(Color::SPINE, 0.5);
    let [_, _, _, corner] = frame.corners();
    canvas.rule(DVec2::new(frame.x, frame.y), corner, &pen);
    canvas.rule(corner, DVec2::new(frame.right(), frame.bottom()), &pen);
    let lengths = |ticks: &Ticks| -> Vec<(f64, f64)> {
        let major = ticks.major.iter().map(|(value, _)| (*value, TICK));
        major.chain(ticks.minor.iter().map(|value| (*value, 0.55 * TICK))).collect()
    };
    for (value, length) in lengths(x_ticks) {
        let Some(at) = placed.at([value, placed.y.low()]) else { continue };
        canvas.rule(at, at + DVec2::new(0.0, length), &thin);
    }
    for (value, length) in lengths(y_ticks) {
        let Some(at) = placed.at([placed.x.low(), value]) else { continue };
        canvas.rule(at, at - DVec2::new(length, 0.0), &thin);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plot::marks::Marker;

    #[test]
    fn odd_data_never_panics() {
        let odd = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 0.0, -1.0, 5e-324, 1e308, 1.0];
        for (x, y) in [
            (Axis::linear("x"), Axis::linear("y")),
            (Axis::log("x"), Axis::log("y")),
            (Axis::log("x").limits(-1.0, 0.0), Axis::linear("y").limits(f64::NAN, 1.0)),
            (Axis::categories("x", &[]), Axis::linear("y").ticks([(f64::NAN, "a")])),
        ] {
            let mut axes = Axes::new(x, y).legend(Legend::Outside);
            let style = Style::new(Color::INK).labelled("s").marker(Marker::Cross);
            let pairs: Vec<[f64; 2]> = odd.iter().flat_map(|a| odd.iter().map(|b| [*a, *b])).collect();
            axes.line([], &style);
            axes.steps(pairs.clone(), &style.clone().dashed());
            axes.measured(pairs.iter().map(|[a, b]| [*a, *b, *b, *a]), &style);
            axes.band(pairs.iter().map(|[a, b]| [*a, *b, *a]), &style);
            axes.bars(pairs, 0.5, &style);
            for value in odd {
                axes.horizontal(value, &style);
                axes.vertical(value, &style);
            }
            for space in [Rect::new(0.0, 0.0, 200.0, 100.0), Rect::new(5.0, 5.0, 1.0, 0.0)] {
                let mut canvas = Canvas::new(200.0, 100.0);
                axes.draw(&mut canvas, space);
                canvas.arrow(DVec2::ZERO, DVec2::splat(odd[0]), &Pen::new(Color::INK, 1.0));
            }
        }
    }
}
