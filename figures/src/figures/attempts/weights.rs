//! D, B and the weight around a point near and a point far from the silhouette.

use flatland::random::stream;
use flatland::warp::{Debias, Plane, Warp};
use glam::DVec2;

use super::check;
use super::edge::{Edge, KAPPA, Weight};
use crate::plot::{Align, Canvas, Color, Figure, Height, Palette, Pen, Rect, Shading, TextStyle, View};

/// Half the side of the window around u, in kernel widths.
const WINDOW: f64 = 3.0;
/// Auxiliary points shown.
const RAYS: usize = 96;

/// An auxiliary point with its share of the estimate.
#[derive(Clone, Copy, Debug)]
pub(super) struct Auxiliary {
    pub(super) at: DVec2,
    /// w̃ / Σ w̃.
    pub(super) share: f64,
    pub(super) boundary: f64,
    /// V·x of the surface seen there.
    pub(super) velocity: f64,
}

/// Maps and shares around one point u.
pub(super) struct Around {
    pub(super) u: DVec2,
    side: usize,
    /// D, B of the default weight, and both normalised weights, on the window's pixels.
    maps: [Vec<f64>; 4],
    /// The moving side's share of the integral of either weight: V·x at u.
    pub(super) shares: [f64; 2],
    /// The moving side's share of the kernel.
    pub(super) kernel: f64,
    pub(super) points: Vec<Auxiliary>,
}

impl Around {
    pub(super) fn new(edge: &Edge, x: f64, side: usize, seed: u64) -> Self {
        let (scene, u) = (&edge.scene, DVec2::new(x, 0.0));
        let weights = Weight::both();
        let integrals = weights.map(|weight| check::share(u, |p| weight.value(scene, u, p)));
        let kernel = check::share(u, |p| check::kernel(u, p)).0;
        let map = |f: &dyn Fn(DVec2) -> f64| -> Vec<f64> {
            let pixel = 2.0 * WINDOW / side as f64;
            let place =
                |i: usize| DVec2::new((i % side) as f64 + 0.5, (i / side) as f64 + 0.5) * pixel - WINDOW + u;
            (0..side * side).map(|i| f(place(i))).collect()
        };
        let maps = [
            map(&|p| Weight::distance(u, p)),
            map(&|p| weights[0].boundary(scene, p)),
            map(&|p| weights[0].value(scene, u, p) / integrals[0].1),
            map(&|p| weights[1].value(scene, u, p) / integrals[1].1),
        ];
        let shares = integrals.map(|(share, _)| share);
        Self { u, side, maps, shares, kernel, points: auxiliary_points(edge, u, seed) }
    }
}

/// The points of one estimate with the default settings.
fn auxiliary_points(edge: &Edge, u: DVec2, seed: u64) -> Vec<Auxiliary> {
    let warp = Warp { debias: Debias::Consistent { rays: RAYS }, ..Warp::default() };
    let (scene, weight) = (&edge.scene, Weight::both()[0]);
    let stencil = warp.stencil::<Plane, _>(u, KAPPA, &mut stream(seed, &[5]), |p| {
        let hit = scene.hit(p);
        let velocity = hit.map_or(0.0, |hit| hit.velocity(&edge.velocities).x);
        let distance = scene.boundary_distance(hit.as_ref(), p, warp.reach(KAPPA));
        ((p, velocity), if hit.is_some() { distance } else { f64::INFINITY })
    });
    let point = |term: &flatland::warp::Term<DVec2, (DVec2, f64)>| Auxiliary {
        at: term.hit.0,
        share: term.weight,
        boundary: weight.boundary(scene, term.hit.0),
        velocity: term.hit.1,
    };
    stencil.terms().iter().map(point).collect()
}

const BODY: f64 = 960.0;
const LEFT: f64 = 22.0;
const GUTTER: f64 = 16.0;
const BARS: f64 = 52.0;

pub(super) fn draw(around: &[Around]) -> Canvas {
    let [quadratic, linear] = Weight::both();
    let panel = (BODY - LEFT - 4.0 * GUTTER) / 5.0;
    let height = 21.0 + 2.0 * panel + GUTTER + BARS;
    let mut figure = Figure::new(BODY, height, "The boundary-aware weight w = (D + B)^{−γ} around a point u");
    let named = |weight: &Weight| format!("w, {}, γ = {}", weight.name, weight.gamma);
    let boundary = format!("B, {}", quadratic.name.trim_end_matches(" B"));
    let panels = [
        ("D, distance from u".to_owned(), Shading::log(1e-2, 1e2), "D"),
        (boundary, Shading::sequential(0.0, 1.0), "B"),
        (named(&quadratic), Shading::log(1e-5, 10.0), "w / ∫ w"),
        (named(&linear), Shading::log(1e-5, 10.0), "w / ∫ w"),
        ("auxiliary points".to_owned(), Shading::log(1e-2, 10.0), "weight / mean weight"),
    ];
    let columns = figure.body.inset(LEFT, 0.0, 0.0, 0.0).columns(&[1.0; 5], GUTTER);
    for (c, ((title, shading, label), column)) in panels.iter().zip(columns).enumerate() {
        let space = figure.panel(column, title);
        for (r, one) in around.iter().enumerate() {
            let frame = Rect::new(space.x, space.y + r as f64 * (panel + GUTTER), panel, panel);
            let canvas = &mut figure.canvas;
            if c < 4 {
                map(canvas, frame, one, c, shading);
            } else {
                scatter(canvas, frame, one, shading);
            }
            if c == 0 {
                let style = TextStyle::new(11.0, Color::INK).anchored(Align::Centre, Height::Middle);
                let at = DVec2::new(figure.body.x + 7.0, frame.centre().y);
                let label = format!("u is {} kernel widths away", one.u.x);
                canvas.text(&label, at, &style.upwards());
            }
        }
        let bar = Rect::new(space.x + 14.0, space.bottom() - BARS + 14.0, panel - 28.0, 9.0);
        figure.canvas.color_bar(bar, shading, label);
    }
    figure.canvas
}

fn view(frame: Rect, one: &Around) -> View {
    let half = DVec2::splat(WINDOW);
    View::downward(one.u - half, one.u + half, frame)
}

fn map(canvas: &mut Canvas, frame: Rect, one: &Around, which: usize, shading: &Shading) {
    let raster = shading.raster(one.side, &one.maps[which]);
    canvas.image(&raster, frame);
    marks(canvas, frame, one, Color::WHITE);
    if which >= 2 {
        let text = format!("V·n = {:.3}", one.shares[which - 2]);
        note(canvas, frame, &text);
    }
}

fn scatter(canvas: &mut Canvas, frame: Rect, one: &Around, shading: &Shading) {
    let view = view(frame, one);
    let mean = 1.0 / one.points.len() as f64;
    let left = view.at(DVec2::ZERO).x.max(frame.x) - frame.x;
    canvas.fill_rect(Rect { width: left, ..frame }, Color::hex(0xe9_ec_ef));
    let mut points: Vec<_> = one.points.iter().collect();
    points.sort_by(|a, b| a.share.total_cmp(&b.share));
    canvas.clipped(frame, |canvas| {
        for p in points {
            let radius = 2.0 + 1.2 * (p.share / mean).sqrt().min(4.0);
            canvas.disc(view.at(p.at), radius + 0.7, Color::WHITE);
            canvas.disc(view.at(p.at), radius, shading.color(p.share / mean));
        }
    });
    marks(canvas, frame, one, Color::INK);
    let value: f64 = one.points.iter().map(|p| p.share * p.velocity).sum();
    note(canvas, frame, &format!("V·n ≈ {value:.3}"));
}

/// The silhouette, u itself and the frame.
fn marks(canvas: &mut Canvas, frame: Rect, one: &Around, color: Color) {
    let view = view(frame, one);
    let x = view.at(DVec2::ZERO).x;
    canvas.rule(DVec2::new(x, frame.y), DVec2::new(x, frame.bottom()), &Pen::new(color, 1.0).dashed());
    let u = view.at(one.u);
    canvas.circle(u, 4.0, &Pen::new(Color::WHITE, 3.4));
    canvas.circle(u, 4.0, &Pen::new(Palette::VERMILION, 1.9));
    canvas.frame(frame, &Pen::new(Color::SPINE, 0.5));
}

/// A text on a white plate in the lower right corner.
fn note(canvas: &mut Canvas, frame: Rect, text: &str) {
    let style = TextStyle::new(10.5, Color::INK).anchored(Align::Centre, Height::Middle);
    let (width, height) = (style.width(text) + 12.0, 18.0);
    let plate = Rect::new(frame.right() - width - 6.0, frame.bottom() - height - 6.0, width, height);
    canvas.fill_rect(plate, Color::WHITE.alpha(0.88));
    canvas.text(text, plate.centre(), &style);
}
