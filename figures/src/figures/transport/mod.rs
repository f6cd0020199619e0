//! Figure 7: flat transport: one path with its auxiliary rays, the image of a shadow, and its derivative
//! by every method.

mod curves;
mod fans;
mod setting;
mod study;
mod text;
mod weights;
mod world;

use self::fans::DrawnPath;
use self::setting::Setting;
use self::study::Study;
use crate::context::Context;
use crate::gallery::Section;
use crate::plot::{Align, Canvas, Color, Figure, GUTTER, Height, PANEL_TITLE_ROOM, Rect, TextStyle};

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
    context.step("7 flat transport: drawing");
    context.png("figure7_transport.png", &world_page(&setting, &path, &study))?;
    context.png("figure7_methods.png", &methods_page(&study))?;
    let results = text::Results { study: &study, path: &path, vertices: setting.world.vertex_count() };
    let data = results.write(context)?;
    results.prose()?.section("transport", data, results.table())
}

/// The world with the path, the image and its terms, and the weights.
fn world_page(setting: &Setting, path: &DrawnPath, study: &Study) -> Canvas {
    let size = world::HIGH - world::LOW;
    let upper = WIDE * size.y / size.x + PANEL_TITLE_ROOM;
    let height = upper + GUTTER + PANEL_TITLE_ROOM + WEIGHTS;
    let mut figure =
        Figure::new(BODY, height, "A path, and the auxiliary rays that warp it at every bounce", "");
    let (above, below) = figure.body.split_top(upper);
    let columns = above.columns(&[WIDE, BODY - WIDE], 0.0);
    let (left, right) = (columns[0], columns[1]);
    let space = figure.panel(
        left,
        0,
        "One path through the camera, the floor and the wall; auxiliary rays by weight",
    );
    let image: Vec<f64> = study.images[1].iter().map(|p| p[0]).collect();
    world::draw(&mut figure.canvas, space, setting, path, &image);
    let rows = right.inset(GUTTER, 0.0, 0.0, 0.0).rows(&[0.92, 1.0], 12.0);
    let space = figure.panel(rows[0], 1, "The image: a line of pixels (lines: exact)");
    curves::image(&mut figure.canvas, space, study);
    let space = figure.panel(rows[1], 2, "Its derivative, term by term (thin: exact)");
    curves::terms(&mut figure.canvas, space, study);
    let title = "Weights of the auxiliary rays against what they see (dashed: jumps)";
    let space = figure.panel(below.inset(0.0, GUTTER, 0.0, 0.0), 3, title);
    weights::draw(&mut figure.canvas, space, &path.fans);
    figure.canvas
}

/// Small multiples: every method beside the exact derivative.
fn methods_page(study: &Study) -> Canvas {
    let title = "The derivative of a shadow by every method, at the same number of rays";
    let count = study.entries.len() + 1;
    let rows = count.div_ceil(3);
    let mut figure = Figure::new(BODY, rows as f64 * ROW + 20.0, title, "");
    let cells: Vec<_> = figure
        .body
        .rows(&vec![1.0; rows], 10.0)
        .into_iter()
        .flat_map(|r| r.columns(&[1.0; 3], 14.0))
        .collect();
    for (i, entry) in study.entries.iter().enumerate() {
        let space = figure.panel(cells[i], i, entry.looks.name);
        let width = TextStyle::new(11.5, Color::INK).width(entry.looks.name) + 30.0;
        let style = TextStyle::new(10.0, Color::MUTED).anchored(Align::Left, Height::Top);
        figure.canvas.text(
            entry.looks.verdict,
            glam::DVec2::new(cells[i].x + width, cells[i].y + 2.5),
            &style,
        );
        curves::method(&mut figure.canvas, space, study, entry, [i % 3 == 0, i / 3 + 1 == rows]);
    }
    let last = study.entries.len();
    // All that is left of its row.
    let rest = Rect { width: figure.body.right() - cells[last].x, ..cells[last] };
    let space = figure.panel(rest, last, "two bounces (exact: radiosity)");
    curves::twice(&mut figure.canvas, space, study, [last.is_multiple_of(3), true]);
    figure.canvas
}
