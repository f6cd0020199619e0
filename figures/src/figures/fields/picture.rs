//! The picture: the scene, every construction, and the two rules as bars.

use flatland::plane::exact::Arrangement;
use glam::DVec2;

use super::constructions::{Construction, Sampled};
use super::example::{EXTENT, Example, Site, WIDTH};
use super::rules::{Measured, Record};
use crate::plot::{
    Align, Axes, Axis, Canvas, Color, Figure, Filter, Height, Legend, PANEL_TITLE_ROOM, Palette, Pen, Raster,
    Rect, Style, TextStyle, Upward, View, number,
};

/// Room for two lines under a panel.
const FOOT: f64 = 35.0;
const GUTTER: f64 = 20.0;
const BODY: f64 = 960.0;
const KEY: f64 = 46.0;
/// Panels are three by three.
const COLUMNS: f64 = 3.0;
const ROWS: f64 = 3.0;
/// Mismatch, relative to the largest boundary speed, from which on a silhouette is fully coloured.
const LOUD: f64 = 0.5;
/// Length of an arrow for the largest boundary speed, in kernel widths.
const ARROW: f64 = 1.1;
/// How much longer arrows are in the scene.
const SCENE_ARROW: f64 = 1.6;
const SHAPES: [Color; 2] = [Color::hex(0xe1_e4_e8), Color::hex(0xf7_e3_b8)];

/// Everything the picture shows.
pub(super) struct Shown<'a> {
    pub(super) example: &'a Example,
    pub(super) arrangement: &'a Arrangement<'a>,
    pub(super) sites: &'a [Site],
    pub(super) speed: f64,
    pub(super) constructions: &'a [Construction<'a>],
    pub(super) sampled: &'a [Sampled],
    pub(super) records: &'a [Record],
}

impl Shown<'_> {
    pub(super) fn draw(&self) -> Canvas {
        let panel = panel_width();
        let row = PANEL_TITLE_ROOM + panel * EXTENT.y / EXTENT.x + FOOT;
        let height = ROWS * row + (ROWS - 1.0) * 12.0 + KEY;
        let mut figure = Figure::new(BODY, height, "One boundary velocity, seven warp fields", "");
        let rows = figure.body.split_top(ROWS * row + (ROWS - 1.0) * 12.0);
        let panels: Vec<Rect> =
            rows.0.rows(&[1.0; ROWS as usize], 12.0).into_iter().flat_map(columns).collect();
        let space = figure.panel(panels[0], 0, "scene and boundary velocity v");
        self.scene(&mut figure.canvas, space);
        for (i, construction) in self.constructions.iter().enumerate() {
            let title = format!("{}: {}", construction.name, construction.summary);
            let space = figure.panel(panels[i + 1], i + 1, &title);
            self.field(&mut figure.canvas, space, i);
        }
        let space = figure.panel(panels[8], 8, "both rules, measured");
        self.bars(&mut figure.canvas, space);
        self.key(&mut figure.canvas, rows.1.inset(0.0, 14.0, 0.0, 0.0));
        figure.canvas
    }

    fn scene(&self, canvas: &mut Canvas, space: Rect) {
        let (frame, view) = framed(space);
        canvas.clipped(frame, |canvas| {
            for (shape, color) in self.example.scene.shapes().iter().zip(SHAPES) {
                let outline: Vec<DVec2> = shape.polygon().vertices().iter().map(|&p| view.at(p)).collect();
                canvas.fill_polygon(&[outline], color);
            }
            self.silhouettes(canvas, &view, |_| Color::INK);
            // One arrow in four sites is enough to see the motion.
            for site in self.sites.iter().skip(2).step_by(4) {
                let from = view.at(site.at);
                let tip = from + SCENE_ARROW * self.arrow(&view, site.velocity);
                canvas.arrow(from, tip, &Pen::new(Palette::BLUE, 1.7));
            }
            let style = TextStyle::new(10.5, Color::INK).anchored(Align::Centre, Height::Middle);
            canvas.text("turns", view.at(DVec2::new(1.3, 1.6)), &style);
            canvas.text("slides", view.at(DVec2::new(2.85, 1.72)), &style);
            let style = style.anchored(Align::Right, Height::Middle);
            canvas.text("at rest", view.at(DVec2::new(3.88, 0.2)), &style);
        });
        canvas.frame(frame, &Pen::new(Color::SPINE, 0.5));
        let style = TextStyle::new(10.5, Color::MUTED).anchored(Align::Left, Height::Top);
        let at = DVec2::new(frame.x, frame.bottom() + 6.0);
        canvas.paragraph(
            "v is known only on the silhouettes. V extends it to every point.",
            at,
            frame.width,
            &style,
        );
    }

    fn field(&self, canvas: &mut Canvas, space: Rect, index: usize) {
        let (frame, view) = framed(space);
        let (sampled, record) = (&self.sampled[index], &self.records[index]);
        let raster = Raster::from_fn(sampled.width, sampled.height, |x, y| {
            let value = sampled.fields[y * sampled.width + x].value;
            strength(value.length() / self.speed).rgb.map(f64::from)
        });
        canvas.image(&raster, frame, Filter::Nearest);
        canvas.clipped(frame, |canvas| {
            if self.constructions[index].name == "oracle" {
                for (corners, _) in self.arrangement.faces() {
                    canvas.stroke_polygon(
                        &[corners.map(|p| view.at(p))],
                        &Pen::new(Color::SPINE.alpha(0.5), 0.6),
                    );
                }
            }
            let scale = LOUD.recip() as f32;
            self.silhouettes(canvas, &view, |i| {
                let miss = record.silhouettes[i].mismatch[0].value.abs() as f32;
                Color::INK.mix(Palette::VERMILION, (miss * scale).min(1.0))
            });
            self.arrows(canvas, &view, sampled);
        });
        canvas.frame(frame, &Pen::new(Color::SPINE, 0.5));
        verdict(
            canvas,
            DVec2::new(frame.x, frame.bottom() + 12.0),
            "1",
            record.continuous,
            "jump",
            record.largest_jump,
        );
        let mismatch = record.largest_mismatch;
        verdict(
            canvas,
            DVec2::new(frame.x, frame.bottom() + 27.0),
            "2",
            record.consistent,
            "mismatch",
            mismatch,
        );
    }

    /// One arrow a kernel width, from the middle of each cell.
    fn arrows(&self, canvas: &mut Canvas, view: &View, sampled: &Sampled) {
        let cells = (EXTENT / WIDTH).round();
        for y in 0..cells.y as u32 {
            for x in 0..cells.x as u32 {
                let at = (DVec2::new(f64::from(x), f64::from(y)) + 0.5) * WIDTH;
                let half = 0.5 * self.arrow(view, sampled.near(at));
                if half.length() > 0.6 {
                    canvas.arrow(view.at(at) - half, view.at(at) + half, &Pen::new(Color::INK, 0.9));
                }
            }
        }
    }

    fn arrow(&self, view: &View, velocity: DVec2) -> DVec2 {
        view.vector(velocity) * (ARROW * WIDTH / self.speed)
    }

    fn silhouettes(&self, canvas: &mut Canvas, view: &View, color: impl Fn(usize) -> Color) {
        let ends = |site: &Site| [site.at - site.half, site.at + site.half].map(|p| view.at(p));
        for site in self.sites {
            let [p, q] = ends(site);
            canvas.line(p, q, &Pen::new(Color::WHITE, 3.6));
        }
        for (i, site) in self.sites.iter().enumerate() {
            let [p, q] = ends(site);
            canvas.line(p, q, &Pen::new(color(i), 2.0));
        }
    }

    fn bars(&self, canvas: &mut Canvas, space: Rect) {
        let letters: Vec<String> =
            (0..self.records.len()).map(|i| format!("({})", char::from(b'b' + i as u8))).collect();
        let letters: Vec<&str> = letters.iter().map(String::as_str).collect();
        let y = Axis::linear("relative to the largest |v|");
        let mut axes = Axes::new(Axis::categories("", &letters), y).legend(Legend::None);
        let jump = Style::new(Palette::GREY);
        let miss = Style::new(Palette::VERMILION);
        let series = |shift: f64, value: fn(&Record) -> Measured| {
            let places = self.records.iter().map(value).enumerate();
            places.map(move |(i, m)| (i as f64 + shift, m)).collect::<Vec<_>>()
        };
        for (style, points) in [
            (&jump, series(-0.19, |record| record.largest_jump)),
            (&miss, series(0.19, |record| record.largest_mismatch)),
        ] {
            axes.bars(points.iter().map(|(x, m)| [*x, m.value.abs()]), 0.34, style);
        }
        axes.draw(canvas, space.inset(0.0, 0.0, 0.0, FOOT - 2.0));
        let text = TextStyle::new(10.5, Color::INK).anchored(Align::Left, Height::Middle);
        let lines =
            [(Palette::GREY, "largest jump of V"), (Palette::VERMILION, "largest mismatch |V·ν − v·ν|")];
        for (i, (color, label)) in lines.into_iter().enumerate() {
            let at = DVec2::new(space.x + 30.0, space.bottom() - FOOT + 12.0 + 15.0 * i as f64);
            canvas.fill_rect(Rect::new(at.x, at.y - 4.0, 12.0, 8.0), color);
            canvas.text(label, at + DVec2::new(18.0, 0.0), &text);
        }
    }

    fn key(&self, canvas: &mut Canvas, space: Rect) {
        let places = space.columns(&[1.0, 1.25, 0.95, 1.2], 12.0);
        let text = TextStyle::new(10.5, Color::INK).anchored(Align::Left, Height::Middle);
        let bar = |place: Rect| Rect::new(place.x, place.y, 0.55 * place.width, 10.0);
        gradient(canvas, bar(places[0]), ["0", "0.5", "1"], strength);
        canvas.text("|V| / largest |v|", beside(bar(places[0])), &text);
        let ticks = [0.0, 0.5, 1.0].map(|t| number(t * LOUD));
        let shade = |t: f64| Color::INK.mix(Palette::VERMILION, t as f32);
        gradient(canvas, bar(places[1]), [&ticks[0], &ticks[1], &ticks[2]], shade);
        canvas.text("|V·ν − v·ν| / largest |v|", beside(bar(places[1])), &text);
        let page = panel_width() / EXTENT.x;
        let length = ARROW * WIDTH * page;
        let at = DVec2::new(places[2].x + 12.0, places[2].y + 5.0);
        canvas.arrow(at, at + DVec2::new(2.0 * length, 0.0), &Pen::new(Palette::BLUE, 1.7));
        canvas.text("largest |v|, in (a)", at + DVec2::new(2.0 * length + 8.0, 0.0), &text);
        let below = at + DVec2::new(length, 17.0);
        canvas.arrow(below, below + DVec2::new(length, 0.0), &Pen::new(Color::INK, 0.9));
        canvas.text("the same, elsewhere", below + DVec2::new(length + 8.0, 0.0), &text);
        let radius = WIDTH * page;
        let centre = DVec2::new(places[3].x + radius + 4.0, places[3].y + 10.0);
        canvas.circle(centre, radius, &Pen::new(Color::INK, 1.2));
        canvas.disc(centre, 1.4, Color::INK);
        let label = "auxiliary kernel (κ^{−1/2})";
        canvas.text(label, centre + DVec2::new(radius + 7.0, 0.0), &text);
    }
}

fn columns(row: Rect) -> Vec<Rect> {
    row.columns(&[1.0; COLUMNS as usize], GUTTER)
}

fn panel_width() -> f64 {
    (BODY - (COLUMNS - 1.0) * GUTTER) / COLUMNS
}

/// The frame of a panel and the map of the scene into it.
fn framed(space: Rect) -> (Rect, View) {
    let frame = space.split_top(space.width * EXTENT.y / EXTENT.x).0;
    (frame, View::fit(DVec2::ZERO, EXTENT, frame, Upward::No))
}

/// "Rule 1 kept · jump 0.01 ± 0.02" with a coloured point.
fn verdict(canvas: &mut Canvas, at: DVec2, rule: &str, kept: bool, what: &str, measured: Measured) {
    let color = if kept { Palette::GREEN } else { Palette::VERMILION };
    canvas.disc(at + DVec2::new(4.0, 0.0), 3.6, color);
    let style = TextStyle::new(10.5, color).bold().anchored(Align::Left, Height::Middle);
    let word = if kept { "kept" } else { "broken" };
    let start = at + DVec2::new(12.0, 0.0);
    let width = canvas.text(&format!("Rule {rule} {word}"), start, &style);
    let style = TextStyle::new(10.5, Color::MUTED).anchored(Align::Left, Height::Middle);
    let text = format!("· {what} {}", brief(measured));
    canvas.text(&text, start + DVec2::new(width + 4.0, 0.0), &style);
}

/// A value with its standard error, to the decimals a reader needs.
pub(super) fn brief(measured: Measured) -> String {
    let value = format!("{:.3}", measured.value.abs());
    if measured.error > 0.0 { format!("{value} ± {:.3}", measured.error) } else { value }
}

/// White for 0 to blue for 1.
fn strength(t: f64) -> Color {
    Color::WHITE.mix(Palette::BLUE, (0.85 * t.clamp(0.0, 1.0)) as f32)
}

fn beside(bar: Rect) -> DVec2 {
    DVec2::new(bar.right() + 9.0, bar.centre().y)
}

fn gradient(canvas: &mut Canvas, bar: Rect, ticks: [&str; 3], color: impl Fn(f64) -> Color) {
    let strip = Raster::from_fn(256, 1, |x, _| color((x as f64 + 0.5) / 256.0).rgb.map(f64::from));
    canvas.image(&strip, bar, Filter::Bilinear);
    canvas.frame(bar, &Pen::new(Color::SPINE, 0.5));
    let style = TextStyle::new(10.0, Color::MUTED).anchored(Align::Centre, Height::Top);
    for (i, tick) in ticks.into_iter().enumerate() {
        let at = DVec2::new(bar.x + 0.5 * i as f64 * bar.width, bar.bottom() + 5.0);
        canvas.text(tick, at, &style);
    }
}
