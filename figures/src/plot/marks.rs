//! Marks in axes: lines, markers, bands, bars and their style.

use glam::DVec2;

use super::{
    canvas::{Canvas, Pen},
    color::Color,
    geometry::Rect,
    scale::Scale,
};

/// A marker's shape.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Marker {
    Circle,
    Square,
    Diamond,
    TriangleUp,
    TriangleDown,
    Cross,
    Ring,
}

/// Appearance of one series and its name in the legend.
#[derive(Clone, Debug)]
pub(crate) struct Style {
    /// The line; its colour is also that of markers, bands and bars.
    pub(super) pen: Pen,
    /// Marker at every point, if any.
    pub(super) marker: Option<Marker>,
    /// Radius of markers, in logical pixels.
    pub(super) radius: f64,
    /// Name in the legend; a series without one is not listed.
    pub(super) label: String,
}

impl Style {
    /// A solid line of ordinary width, unnamed.
    pub(crate) fn new(color: Color) -> Self {
        Self { pen: Pen::new(color, 1.7), marker: None, radius: 3.0, label: String::new() }
    }

    /// Sets the name in the legend.
    pub(crate) fn labelled(self, label: impl Into<String>) -> Self {
        Self { label: label.into(), ..self }
    }

    /// Sets the line width in logical pixels.
    pub(crate) fn width(self, width: f64) -> Self {
        Self { pen: Pen { width, ..self.pen }, ..self }
    }

    /// Makes the line dashed.
    pub(crate) fn dashed(self) -> Self {
        Self { pen: self.pen.dashed(), ..self }
    }

    /// Makes the line dotted.
    pub(crate) fn dotted(self) -> Self {
        Self { pen: self.pen.dotted(), ..self }
    }

    /// Adds a marker at every point.
    pub(crate) fn marker(self, marker: Marker) -> Self {
        Self { marker: Some(marker), ..self }
    }

    /// Sets the radius of markers.
    pub(crate) fn radius(self, radius: f64) -> Self {
        Self { radius, ..self }
    }
}

/// One series' data. Points are [x, y] unless noted.
#[derive(Clone, Debug)]
pub(super) enum Mark {
    Line(Vec<[f64; 2]>),
    Steps(Vec<[f64; 2]>),
    Scatter(Vec<[f64; 2]>),
    /// [x, y, low, high]
    ErrorBars(Vec<[f64; 4]>),
    /// [x, low, high]
    Band(Vec<[f64; 3]>),
    /// [x, y] and the width in units of x
    Bars(Vec<[f64; 2]>, f64),
    Horizontal(f64),
    Vertical(f64),
}

impl Mark {
    /// The points that the axes have to show.
    pub(super) fn extent(&self) -> Vec<[f64; 2]> {
        match self {
            Self::Line(points) | Self::Steps(points) | Self::Scatter(points) => points.clone(),
            Self::ErrorBars(points) => {
                points.iter().flat_map(|[x, y, low, high]| [[*x, *y], [*x, *low], [*x, *high]]).collect()
            }
            Self::Band(points) => {
                points.iter().flat_map(|[x, low, high]| [[*x, *low], [*x, *high]]).collect()
            }
            Self::Bars(points, width) => {
                points.iter().flat_map(|[x, y]| [[x - 0.5 * width, 0.0], [x + 0.5 * width, *y]]).collect()
            }
            Self::Horizontal(y) => vec![[f64::NAN, *y]],
            Self::Vertical(x) => vec![[*x, f64::NAN]],
        }
    }
}

/// The map from data to the page inside the frame of drawn axes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Placed {
    pub(crate) frame: Rect,
    pub(crate) x: Scale,
    pub(crate) y: Scale,
}

impl Placed {
    /// The page point of (x, y), which may lie outside the frame; `None` where a scale has no position for
    /// it.
    pub(crate) fn at(&self, [x, y]: [f64; 2]) -> Option<DVec2> {
        // Clamped, since what lies far outside is clipped and single precision must hold it.
        let reach = |position: f64| position.clamp(-1e4, 1e4);
        let (u, v) = (reach(self.x.position(x)?), reach(self.y.position(y)?));
        Some(DVec2::new(self.frame.x + u * self.frame.width, self.frame.bottom() - v * self.frame.height))
    }

    /// The page height of the value y, or of the bottom of the frame where a log scale has no position for
    /// it.
    fn level(&self, y: f64) -> f64 {
        self.at([self.x.low(), y]).map_or(self.frame.bottom(), |point| point.y)
    }

    /// Draws one series, clipped to the frame (markers may reach over it).
    pub(super) fn draw(&self, canvas: &mut Canvas, mark: &Mark, style: &Style) {
        // A margin of half a line width, so that a curve along the frame keeps its full width.
        let clip = self.frame.inset(-1.0, -1.0, -1.0, -1.0);
        let pen = &style.pen;
        match mark {
            Mark::Line(points) => {
                canvas.clipped(clip, |canvas| self.chain(canvas, points, pen));
                self.markers(canvas, points.iter().copied(), style);
            }
            Mark::Steps(points) => {
                let corners = staircase(points);
                canvas.clipped(clip, |canvas| self.chain(canvas, &corners, pen));
                self.markers(canvas, points.iter().copied(), style);
            }
            Mark::Scatter(points) => {
                let style = Style { marker: style.marker.or(Some(Marker::Circle)), ..style.clone() };
                self.markers(canvas, points.iter().copied(), &style);
            }
            Mark::ErrorBars(points) => {
                canvas.clipped(clip, |canvas| self.error_bars(canvas, points, style));
                self.markers(canvas, points.iter().map(|[x, y, ..]| [*x, *y]), style);
            }
            Mark::Band(points) => canvas.clipped(self.frame, |canvas| self.band(canvas, points, pen.color)),
            Mark::Bars(points, width) => canvas.clipped(self.frame, |canvas| {
                for [x, y] in points {
                    let ends = [x - 0.5 * width, x + 0.5 * width].map(|x| self.at([x, *y]));
                    let [Some(left), Some(right)] = ends else { continue };
                    let base = self.level(0.0);
                    let (top, bottom) = (left.y.min(base), left.y.max(base));
                    canvas.fill_rect(Rect::new(left.x, top, right.x - left.x, bottom - top), pen.color);
                }
            }),
            Mark::Horizontal(y) => {
                self.reference(canvas, [self.x.low(), self.x.high()].map(|x| [x, *y]), pen);
            }
            Mark::Vertical(x) => {
                self.reference(canvas, [self.y.low(), self.y.high()].map(|y| [*x, y]), pen);
            }
        }
    }

    /// A line across the frame, if it lies in it.
    fn reference(&self, canvas: &mut Canvas, ends: [[f64; 2]; 2], pen: &Pen) {
        let [Some(from), Some(to)] = ends.map(|end| self.at(end)) else { return };
        if self.frame.inset(-0.5, -0.5, -0.5, -0.5).contains(0.5 * (from + to)) {
            canvas.rule(from, to, pen);
        }
    }

    /// Runs of finite points, each cut to the neighbourhood of the frame.
    fn chain(&self, canvas: &mut Canvas, points: &[[f64; 2]], pen: &Pen) {
        for run in points.split(|point| self.at(*point).is_none()) {
            let pixels: Vec<DVec2> = run.iter().filter_map(|point| self.at(*point)).collect();
            let near = self.frame.inset(-50.0, -50.0, -50.0, -50.0);
            let (low, high) = (DVec2::new(near.x, near.y), DVec2::new(near.right(), near.bottom()));
            let mut visible: Vec<DVec2> = Vec::with_capacity(pixels.len());
            for pair in pixels.windows(2) {
                let Some((enter, leave)) = cut([pair[0], pair[1]], low, high) else { continue };
                let from = if enter > 0.0 { pair[0].lerp(pair[1], enter) } else { pair[0] };
                let to = if leave < 1.0 { pair[0].lerp(pair[1], leave) } else { pair[1] };
                if visible.last() != Some(&from) {
                    canvas.polyline(&visible, pen);
                    visible.clear();
                    visible.push(from);
                }
                visible.push(to);
            }
            canvas.polyline(&visible, pen);
        }
    }

    fn markers(&self, canvas: &mut Canvas, points: impl Iterator<Item = [f64; 2]>, style: &Style) {
        let Some(marker) = style.marker else { return };
        let reach = self.frame.inset(-0.5, -0.5, -0.5, -0.5);
        for at in points.filter_map(|point| self.at(point)).filter(|at| reach.contains(*at)) {
            canvas.marker(marker, at, style.radius, style.pen.color);
        }
    }

    fn error_bars(&self, canvas: &mut Canvas, points: &[[f64; 4]], style: &Style) {
        let pen = Pen::new(style.pen.color, (0.7 * style.pen.width).max(1.0));
        for [x, y, low, high] in points {
            let (Some(at), true) = (self.at([*x, *y]), low.is_finite() && high.is_finite()) else { continue };
            for level in [self.level(*low), self.level(*high)] {
                let end = DVec2::new(at.x, level);
                canvas.line(at, end, &pen);
                canvas.line(end - DVec2::new(2.5, 0.0), end + DVec2::new(2.5, 0.0), &pen);
            }
        }
    }

    fn band(&self, canvas: &mut Canvas, points: &[[f64; 3]], color: Color) {
        let usable =
            |[x, low, high]: &[f64; 3]| self.x.position(*x).is_some() && low.is_finite() && high.is_finite();
        for run in points.split(|point| !usable(point)) {
            let edge = |value: fn(&[f64; 3]) -> f64| {
                run.iter().filter_map(move |point| {
                    let x = self.at([point[0], self.y.high()])?.x;
                    Some(DVec2::new(x, self.level(value(point))))
                })
            };
            let mut outline: Vec<DVec2> = edge(|point| point[1]).collect();
            let mut upper: Vec<DVec2> = edge(|point| point[2]).collect();
            upper.reverse();
            outline.append(&mut upper);
            canvas.fill_polygon(&[outline], color.alpha(0.2 * color.alpha));
        }
    }
}

impl Canvas {
    /// A marker with a thin white rim that keeps it apart from lines and neighbours.
    pub(crate) fn marker(&mut self, marker: Marker, at: DVec2, radius: f64, color: Color) {
        // Scaled so that all shapes look equally large.
        let corners = |corners: &[[f64; 2]], scale: f64| -> Vec<DVec2> {
            corners.iter().map(|corner| at + radius * scale * DVec2::from(*corner)).collect()
        };
        let outline = match marker {
            Marker::Circle => {
                self.disc(at, radius + 0.7, Color::WHITE);
                return self.disc(at, radius, color);
            }
            Marker::Ring => {
                self.disc(at, radius, Color::WHITE);
                return self.circle(at, radius - 0.2, &Pen::new(color, 0.5 * radius));
            }
            Marker::Cross => {
                for pen in [Pen::new(Color::WHITE, 0.55 * radius + 1.4), Pen::new(color, 0.55 * radius)] {
                    for arm in [DVec2::new(0.9, 0.9), DVec2::new(0.9, -0.9)] {
                        self.line(at - radius * arm, at + radius * arm, &pen);
                    }
                }
                return;
            }
            Marker::Square => corners(&[[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]], 0.88),
            Marker::Diamond => corners(&[[0.0, -1.0], [1.0, 0.0], [0.0, 1.0], [-1.0, 0.0]], 1.25),
            Marker::TriangleUp => corners(&[[0.0, -1.1], [1.05, 0.75], [-1.05, 0.75]], 1.1),
            Marker::TriangleDown => corners(&[[0.0, 1.1], [-1.05, -0.75], [1.05, -0.75]], 1.1),
        };
        self.stroke_polygon(&[&outline], &Pen::new(Color::WHITE, 1.4));
        self.fill_polygon(&[&outline], color);
    }
}

/// The corners of a staircase: a value holds from its x to the next.
fn staircase(points: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let treads = points.windows(2).flat_map(|pair| [pair[0], [pair[1][0], pair[0][1]]]);
    treads.chain(points.last().copied()).collect()
}

/// The part of a segment in a box, as parameters along it (Liang and Barsky 1984), if any.
pub(crate) fn cut([p, q]: [DVec2; 2], low: DVec2, high: DVec2) -> Option<(f64, f64)> {
    let d = q - p;
    let (mut start, mut end) = (0.0_f64, 1.0_f64);
    for axis in 0..2 {
        let [a, b] = [(low[axis] - p[axis]) / d[axis], (high[axis] - p[axis]) / d[axis]];
        if d[axis] == 0.0 {
            if p[axis] < low[axis] || p[axis] > high[axis] {
                return None;
            }
            continue;
        }
        (start, end) = (start.max(a.min(b)), end.min(a.max(b)));
    }
    (start < end).then_some((start, end))
}
