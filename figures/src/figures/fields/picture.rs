//! Picture of the scene, every construction, and the two rules as bars.

use flatland::plane::exact::Arrangement;
use glam::DVec2;

use super::constructions::{Construction, Sampled};
use super::example::{EXTENT, Example, Site, WIDTH, cells};
use super::rules::Record;
use crate::plot::*;
use crate::ratio::Ratio;

/// Room for two lines under a panel.
const FOOT: f64 = 35.0;
const GUTTER: f64 = 20.0;
const BODY: f64 = 960.0;
const KEY: f64 = 46.0;
/// A panel's width: the layout is three by three.
const PANEL: f64 = (BODY - 2.0 * GUTTER) / 3.0;
/// Mismatch, relative to the largest boundary speed, at which a silhouette is fully coloured.
const LOUD: f64 = 0.5;
/// Length of an arrow for the largest boundary speed, in kernel widths.
const ARROW: f64 = 1.1;
/// Scale factor of the arrows in the scene.
const SCENE_ARROW: f64 = 1.6;
const SHAPES: [Color; 2] = [Color::hex(0xe1_e4_e8), Color::hex(0xf7_e3_b8)];

/// Contents of the picture.
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
        let row = PANEL_TITLE_ROOM + PANEL * EXTENT.y / EXTENT.x + FOOT;
        let height = 3.0 * row + 2.0 * 12.0;
        let mut figure = Figure::new(BODY, height + KEY, "One boundary velocity, seven warp fields");
        let (body, key) = figure.body.split_top(height);
        let panels = body.grid([3, 3], [GUTTER, 12.0]);
        let space = figure.panel(panels[0], "scene and boundary velocity v");
        self.scene(&mut figure.canvas, space);
        for (i, construction) in self.constructions.iter().enumerate() {
            let title = format!("{}: {}", construction.name, construction.summary);
            let space = figure.panel(panels[i + 1], &title);
            self.field(&mut figure.canvas, space, i);
        }
        let space = figure.panel(panels[8], "both rules, measured");
        self.bars(&mut figure.canvas, space);
        self.key(&mut figure.canvas, key.inset(0.0, 14.0, 0.0, 0.0));
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
        let text = "v is known only on the silhouettes. V extends it to every point.";
        canvas.paragraph(text, at, frame.width, &style);
    }

    fn field(&self, canvas: &mut Canvas, space: Rect, index: usize) {
        let (frame, view) = framed(space);
        let (sampled, record) = (&self.sampled[index], &self.records[index]);
        let raster = Raster::from_fn(sampled.width, sampled.height, |x, y| {
            let value = sampled.fields[y * sampled.width + x].value;
            strength(value.length() / self.speed).rgb
        });
        canvas.image(&raster, frame);
        canvas.clipped(frame, |canvas| {
            if self.constructions[index].name == "oracle" {
                let pen = Pen::new(Color::SPINE.alpha(0.5), 0.6);
                for (corners, _) in self.arrangement.faces() {
                    canvas.stroke_polygon(&[corners.map(|p| view.at(p))], &pen);
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
        let (first, second) = (record.largest_jump, record.largest_mismatch);
        let foot = DVec2::new(frame.x, frame.bottom());
        verdict(canvas, foot + DVec2::new(0.0, 12.0), "Rule 1", record.continuous, ("jump", first));
        verdict(canvas, foot + DVec2::new(0.0, 27.0), "Rule 2", record.consistent, ("mismatch", second));
    }

    /// One arrow a kernel width, from the middle of each cell.
    fn arrows(&self, canvas: &mut Canvas, view: &View, sampled: &Sampled) {
        for (_, at) in cells() {
            let half = 0.5 * self.arrow(view, sampled.near(at));
            if half.length() > 0.6 {
                canvas.arrow(view.at(at) - half, view.at(at) + half, &Pen::new(Color::INK, 0.9));
            }
        }
    }

    fn arrow(&self, view: &View, velocity: DVec2) -> DVec2 {
        view.vector(velocity) * (ARROW * WIDTH / self.speed)
    }

    fn silhouettes(&self, canvas: &mut Canvas, view: &View, color: impl Fn(usize) -> Color) {
        let ends = |site: &Site| [site.at - site.half, site.at + site.half].map(|p| view.at(p));
        for (rim, width) in [(true, 3.6), (false, 2.0)] {
            for (i, site) in self.sites.iter().enumerate() {
                let [p, q] = ends(site);
                canvas.line(p, q, &Pen::new(if rim { Color::WHITE } else { color(i) }, width));
            }
        }
    }

    fn bars(&self, canvas: &mut Canvas, space: Rect) {
        let letters: Vec<String> =
            (0..self.records.len()).map(|i| format!("({})", char::from(b'b' + i as u8))).collect();
        let letters: Vec<&str> = letters.iter().map(String::as_str).collect();
        let text = TextStyle::new(10.5, Color::INK).anchored(Align::Left, Height::Middle);
        type Series<'a> = (Color, &'a str, f64, fn(&Record) -> Ratio);
        let series: [Series<'_>; 2] = [
            (Palette::GREY, "largest jump of V", -0.19, |record| record.largest_jump),
            (Palette::VERMILION, "largest mismatch |V·n − v·n|", 0.19, |record| record.largest_mismatch),
        ];
        let all = self.records.iter().flat_map(|record| [record.largest_jump, record.largest_mismatch]);
        let highest = all.map(|m| m.value.abs()).fold(0.0, f64::max);
        let y = Axis::linear("relative to the largest |v|").limits(0.0, 1.05 * highest);
        let mut axes = Axes::new(Axis::categories("", &letters), y).legend(Legend::None);
        for (i, (color, label, shift, value)) in series.into_iter().enumerate() {
            let bars = self.records.iter().enumerate();
            let bars = bars.map(|(i, record)| [i as f64 + shift, value(record).value.abs()]);
            axes.bars(bars, 0.34, &Style::new(color));
            let at = DVec2::new(space.x + 30.0, space.bottom() - FOOT + 12.0 + 15.0 * i as f64);
            canvas.fill_rect(Rect::new(at.x, at.y - 4.0, 12.0, 8.0), color);
            canvas.text(label, at + DVec2::new(18.0, 0.0), &text);
        }
        axes.draw(canvas, space.inset(0.0, 0.0, 0.0, FOOT - 2.0));
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
        canvas.text("|V·n − v·n| / largest |v|", beside(bar(places[1])), &text);
        let page = PANEL / EXTENT.x;
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

/// The frame of a panel and the map of the scene into it.
fn framed(space: Rect) -> (Rect, View) {
    let frame = space.split_top(space.width * EXTENT.y / EXTENT.x).0;
    (frame, View::downward(DVec2::ZERO, EXTENT, frame))
}

/// "Rule 1 kept · jump 0.01 ± 0.02" with a coloured point.
fn verdict(canvas: &mut Canvas, at: DVec2, rule: &str, kept: bool, (what, measured): (&str, Ratio)) {
    let (color, word) = if kept { (Palette::GREEN, "kept") } else { (Palette::VERMILION, "broken") };
    canvas.disc(at + DVec2::new(4.0, 0.0), 3.6, color);
    let style = TextStyle::new(10.5, color).bold().anchored(Align::Left, Height::Middle);
    let start = at + DVec2::new(12.0, 0.0);
    let width = canvas.text(&format!("{rule} {word}"), start, &style);
    let style = TextStyle::new(10.5, Color::MUTED).anchored(Align::Left, Height::Middle);
    canvas.text(&format!("· {what} {}", brief(measured)), start + DVec2::new(width + 4.0, 0.0), &style);
}

/// A value with its standard error, to the decimals a reader needs.
pub(super) fn brief(measured: Ratio) -> String {
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
    canvas.color_strip(bar, color);
    let style = TextStyle::new(10.0, Color::MUTED).anchored(Align::Centre, Height::Top);
    for (i, tick) in ticks.into_iter().enumerate() {
        let at = DVec2::new(bar.x + 0.5 * i as f64 * bar.width, bar.bottom() + 5.0);
        canvas.text(tick, at, &style);
    }
}
