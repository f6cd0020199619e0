//! Flat transport: one path with its auxiliary rays, the image of a shadow, and its derivative
//! by every method.

mod curves;
mod fans;
mod setting;
mod study;
mod weights;
mod world;

use flatland::transport::Terms;

use self::fans::{DrawnPath, RAYS, REACH};
use self::setting::Setting;
use self::study::{CONSISTENT, EDGES, Entry, FIXED, JUMPS, REACH as JUMP_REACH, STEP, Study, WARPED};
use crate::context::Context;
use crate::figures::common::{largest, percent};
use crate::gallery::Section;
use crate::output::Table;
use crate::plot::{Align, Canvas, Color, Figure, GUTTER, Height, PANEL_TITLE_ROOM, Rect, TextStyle, number};
use crate::prose::Prose;

const BODY: f64 = 960.0;
/// Width of the world's panel.
const WIDE: f64 = 610.0;
const WEIGHTS: f64 = 190.0;
const ROW: f64 = 185.0;

/// Measures, draws and explains.
pub(crate) fn draw(context: &Context) -> anyhow::Result<Section> {
    let setting = Setting::new()?;
    let path = DrawnPath::new(&setting, context.seed())?;
    let study = Study::new(context, &setting)?;
    context.step("drawing");
    context.png("transport.png", &world_page(&setting, &path, &study))?;
    context.png("transport_methods.png", &methods_page(&study))?;
    let results = Results { study: &study, path: &path, vertices: setting.world.vertex_count() };
    let data = results.write(context)?;
    results.prose()?.section("transport", data, results.table())
}

/// The world with the path, the image and its terms, and the weights.
fn world_page(setting: &Setting, path: &DrawnPath, study: &Study) -> Canvas {
    let size = world::HIGH - world::LOW;
    let upper = WIDE * size.y / size.x + PANEL_TITLE_ROOM;
    let height = upper + GUTTER + PANEL_TITLE_ROOM + WEIGHTS;
    let mut figure = Figure::new(BODY, height, "A path, and the auxiliary rays that warp it at every bounce");
    let (above, below) = figure.body.split_top(upper);
    let columns = above.columns(&[WIDE, BODY - WIDE], 0.0);
    let (left, right) = (columns[0], columns[1]);
    let title = "One path through the camera, the floor and the wall; auxiliary rays by weight";
    let space = figure.panel(left, title);
    let image: Vec<f64> = study.images[1].iter().map(|p| p[0]).collect();
    world::draw(&mut figure.canvas, space, setting, path, &image);
    let rows = right.inset(GUTTER, 0.0, 0.0, 0.0).rows(&[0.92, 1.0], 12.0);
    let space = figure.panel(rows[0], "The image: a line of pixels (lines: exact)");
    curves::image(&mut figure.canvas, space, study);
    let space = figure.panel(rows[1], "Its derivative, term by term (thin: exact)");
    curves::terms(&mut figure.canvas, space, study);
    let title = "Weights of the auxiliary rays against what they see (dashed: jumps)";
    let space = figure.panel(below.inset(0.0, GUTTER, 0.0, 0.0), title);
    weights::draw(&mut figure.canvas, space, &path.fans);
    figure.canvas
}

/// Small multiples: every method beside the exact derivative.
fn methods_page(study: &Study) -> Canvas {
    let title = "The derivative of a shadow by every method, at the same number of rays";
    let count = study.entries.len() + 1;
    let rows = count.div_ceil(3);
    let mut figure = Figure::new(BODY, rows as f64 * ROW + 20.0, title);
    let cells = figure.body.grid([rows, 3], [14.0, 10.0]);
    for (i, entry) in study.entries.iter().enumerate() {
        let space = figure.panel(cells[i], entry.looks.name);
        let width = TextStyle::new(11.5, Color::INK).width(entry.looks.name) + 30.0;
        let style = TextStyle::new(10.0, Color::MUTED).anchored(Align::Left, Height::Top);
        let at = glam::DVec2::new(cells[i].x + width, cells[i].y + 2.5);
        figure.canvas.text(entry.looks.verdict, at, &style);
        curves::method(&mut figure.canvas, space, study, entry, [i % 3 == 0, i / 3 + 1 == rows]);
    }
    let last = study.entries.len();
    // The rest of its row.
    let rest = Rect { width: figure.body.right() - cells[last].x, ..cells[last] };
    let space = figure.panel(rest, "two bounces (exact: radiosity)");
    curves::twice(&mut figure.canvas, space, study, [last.is_multiple_of(3), true]);
    figure.canvas
}

/// Half width of a band in standard errors.
const BAND: f64 = 2.0;

/// The part of the largest derivative below which one is negligible.
const NEGLIGIBLE: f64 = 0.05;
/// Number of rays of a direction that count as its heaviest.
const HEAVIEST: usize = RAYS / 4;

/// Data of the text.
struct Results<'a> {
    study: &'a Study,
    path: &'a DrawnPath,
    /// Number of vertices of the world.
    vertices: usize,
}

impl Results<'_> {
    /// The pixel of the largest error in its own standard errors, and that ratio, where the derivative is not
    /// negligible.
    fn worst(&self, name: &str) -> (usize, f64) {
        let exact = self.study.total();
        let least = NEGLIGIBLE * largest(&exact);
        let Some(entry) = self.study.entry(name) else { return (0, f64::NAN) };
        let ratio = |(i, e): (usize, &f64)| {
            (entry.image.mean[i].total() - e).abs() / entry.image.standard_error.total[i]
        };
        let ratios = exact.iter().enumerate().filter(|(_, e)| e.abs() > least).map(|x| (x.0, ratio(x)));
        ratios.fold((0, 0.0), |worst, one| if one.1 > worst.1 { one } else { worst })
    }

    /// The text on the path, the terms and the methods.
    fn prose(&self) -> anyhow::Result<Prose> {
        let Study { exact, images, twice, .. } = self.study;
        let squares = |k: usize| exact.iter().map(|t| t.to_array()[k].powi(2)).sum::<f64>();
        let size = |k: usize| percent(squares(k) / (0..3).map(squares).sum::<f64>());
        let shown = |e: &Entry| {
            format!("{} with a noise of {}", e.agreement.slope.shown(), percent(e.agreement.noise))
        };
        let slope = |name: &str| self.study.entry(name).map_or_else(String::new, shown);
        let [emitter, scattered] = [1, 2].map(|i| self.path.fans[i].heaviest(HEAVIEST));
        let (worst_pixel, worst_ratio) = self.worst(WARPED);
        let image_error = images.iter().flatten().map(|p| p[1]).fold(0.0, f64::max);
        Prose::new(
            include_str!("transport.md"),
            &[
                ("rays", &RAYS),
                ("heaviest", &HEAVIEST),
                ("emitter_share", &percent(emitter.0)),
                ("emitter_reach", &number(emitter.1)),
                ("scattered_share", &percent(scattered.0)),
                ("scattered_reach", &number(scattered.1)),
                ("interior", &size(0)),
                ("primary", &size(1)),
                ("secondary", &size(2)),
                ("million_rays", &format!("{:.1}", self.study.rays as f64 * 1e-6)),
                ("warped", &slope(WARPED)),
                ("fixed", &FIXED),
                ("consistent", &slope(CONSISTENT)),
                ("jumps", &slope(JUMPS)),
                ("jump_reach", &number(JUMP_REACH)),
                ("harmonic", &slope("harmonic field")),
                ("edges", &slope(EDGES)),
                ("vertices", &self.vertices),
                ("step", &STEP),
                ("differences", &slope("finite differences")),
                ("exact_difference", &format!("{:.4}", self.study.exact_difference)),
                ("rotation", &slope("rotation")),
                ("direct", &slope("direct field")),
                ("interior_only", &slope("interior only")),
                ("worst_pixel", &worst_pixel),
                ("worst_ratio", &format!("{worst_ratio:.1}")),
                ("radiosity_error", &number(self.study.radiosity_error)),
                ("twice_warped", &shown(&twice[0])),
                ("twice_jumps", &shown(&twice[1])),
                ("twice_edges", &shown(&twice[2])),
                ("image_error", &number(image_error)),
                ("band", &BAND),
                ("reach", &REACH),
                ("twice_names", &twice.each_ref().map(|e| e.looks.name).join(", ")),
            ],
        )
    }

    /// A row per method.
    fn table(&self) -> Table {
        let pixels = self.study.exact.len();
        let once = self.study.entries.iter().map(|entry| (1_usize, entry));
        Table::of(
            once.chain(self.study.twice.iter().map(|entry| (2, entry))),
            &[
                ("bounces", &|(bounces, _)| (*bounces).into()),
                ("method", &|(_, e)| e.looks.name.into()),
                ("slope on the exact derivative", &|(_, e)| e.agreement.slope.value.into()),
                ("± standard error", &|(_, e)| e.agreement.slope.error.into()),
                ("noise, relative", &|(_, e)| e.agreement.noise.into()),
                ("error, relative", &|(_, e)| e.agreement.error.into()),
                ("rays a sample", &|(_, e)| (e.image.rays as f64 / (e.samples * pixels) as f64).into()),
                ("samples a pixel", &|(_, e)| e.samples.into()),
                ("seconds", &|(_, e)| e.seconds.into()),
            ],
        )
    }

    /// Writes all data and returns the names of the files.
    fn write(&self, context: &Context) -> anyhow::Result<Vec<String>> {
        Ok(vec![
            context.csv("transport_derivative.csv", &self.derivatives())?,
            context.csv("transport_image.csv", &self.images())?,
            context.csv("transport_two_bounces.csv", &self.twice())?,
            context.csv("transport_auxiliary_rays.csv", &self.rays())?,
            context.csv("transport_methods.csv", &self.table())?,
        ])
    }

    fn derivatives(&self) -> Table {
        let pixels = 0..self.study.exact.len();
        let exact = pixels.clone().map(|i| ("exact", i, self.study.exact[i], Terms::default(), 0.0));
        let estimates = self.study.entries.iter().flat_map(|entry| {
            let image = &entry.image;
            let row = move |i| {
                (
                    entry.looks.name,
                    i,
                    image.mean[i],
                    image.standard_error.by_term[i],
                    image.standard_error.total[i],
                )
            };
            pixels.clone().map(row)
        });
        Table::of(
            exact.chain(estimates),
            &[
                ("method", &|(name, ..)| (*name).into()),
                ("pixel", &|(_, i, ..)| (*i).into()),
                ("interior", &|(_, _, mean, ..)| mean.interior.into()),
                ("primary", &|(_, _, mean, ..)| mean.primary.into()),
                ("secondary", &|(_, _, mean, ..)| mean.secondary.into()),
                ("interior_error", &|(.., error, _)| error.interior.into()),
                ("primary_error", &|(.., error, _)| error.primary.into()),
                ("secondary_error", &|(.., error, _)| error.secondary.into()),
                ("total", &|(_, _, mean, ..)| mean.total().into()),
                ("total_error", &|(.., error)| (*error).into()),
            ],
        )
    }

    fn twice(&self) -> Table {
        let [a, b, c] = &self.study.twice;
        let errors = [a, b, c].map(|e| format!("{}_error", e.looks.name));
        Table::of(
            0..self.study.exact_twice.len(),
            &[
                ("pixel", &|i| (*i).into()),
                ("exact", &|i| self.study.exact_twice[*i].into()),
                (a.looks.name, &|i| a.image.mean[*i].total().into()),
                (&errors[0], &|i| a.image.standard_error.total[*i].into()),
                (b.looks.name, &|i| b.image.mean[*i].total().into()),
                (&errors[1], &|i| b.image.standard_error.total[*i].into()),
                (c.looks.name, &|i| c.image.mean[*i].total().into()),
                (&errors[2], &|i| c.image.standard_error.total[*i].into()),
            ],
        )
    }

    fn images(&self) -> Table {
        let [one, two] = &self.study.images;
        Table::of(
            0..self.study.exact_image.len(),
            &[
                ("pixel", &|i| (*i).into()),
                ("one_bounce_exact", &|i| self.study.exact_image[*i].into()),
                ("one_bounce", &|i| one[*i][0].into()),
                ("one_bounce_error", &|i| one[*i][1].into()),
                ("two_bounces_exact", &|i| self.study.exact_image_twice[*i].into()),
                ("two_bounces", &|i| two[*i][0].into()),
                ("two_bounces_error", &|i| two[*i][1].into()),
            ],
        )
    }

    fn rays(&self) -> Table {
        let fans = self.path.fans.iter().enumerate();
        Table::of(
            fans.flat_map(|(i, fan)| fan.rays.iter().map(move |ray| (i, fan, ray))),
            &[
                ("direction", &|(i, ..)| (*i).into()),
                ("from_x", &|(_, fan, _)| fan.from.x.into()),
                ("from_y", &|(_, fan, _)| fan.from.y.into()),
                ("to_x", &|(.., ray)| ray.end.x.into()),
                ("to_y", &|(.., ray)| ray.end.y.into()),
                ("offset_in_kernel_widths", &|(.., ray)| ray.offset.into()),
                ("share", &|(.., ray)| ray.share.into()),
            ],
        )
    }
}
