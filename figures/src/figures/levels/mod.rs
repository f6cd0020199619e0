//! Implicit surfaces in space: every field against known derivatives.

mod maps;
mod outputs;
mod page;
mod scan;
mod shapes;
mod study;

use flatland::sdf::Tracer;
use flatland::sdf::fields::{BangaruField, ViciniField};
use volume3d::sdf::Interpolation;

use self::maps::Maps;
use self::outputs::Outputs;
use self::scan::Scan;
use self::shapes::{CELLS, Subject};
use self::study::{BAND, Found, Method, RAYS, Target, tracer, vicini};
use crate::context::Context;
use crate::figures::common::{listed, percent};
use crate::gallery::Section;
use crate::output::Table;
use crate::plot::number;
use crate::prose::Prose;
use crate::ratio::Ratio;
use crate::seeds::seed_of;

/// A line of the table.
struct Row {
    shape: String,
    is_smooth: bool,
    outputs: Outputs,
    method: Method,
    found: Found,
}

/// A field's slope along something, without noise.
struct Curve {
    name: String,
    points: Vec<[f64; 2]>,
}

/// A field's slope on grids of several resolutions.
struct Series {
    name: String,
    points: Vec<(usize, Ratio)>,
}

/// Measurements of the figure.
struct Measured {
    maps: Maps,
    scans: Vec<Scan>,
    /// Curves by tolerance, and by steps.
    curves: [Vec<Curve>; 2],
    grids: Vec<Series>,
    rows: Vec<Row>,
}

/// Measures, draws and explains.
pub(crate) fn draw(context: &Context) -> anyhow::Result<Section> {
    let [smooth, plain] = [Subject::union(0.5)?, Subject::union(0.0)?];
    context.step("fields over a film");
    let maps = Maps::new(&smooth, context.spend(40, 192))?;
    context.step("jumps");
    let scans = scan::scans(&smooth, &plain, context.spend(200, 4000));
    context.step("bias by tolerance and steps");
    let curves = curves(context)?;
    context.step("grids");
    let grids = grids(context)?;
    context.step("every field on every shape");
    let measured = Measured { maps, scans, curves, grids, rows: rows(context)? };
    context.png("levels.png", &page::page(&measured))?;
    let table = table(&measured.rows);
    let data = vec![
        context.csv("levels_fields.csv", &table)?,
        context.csv("levels_bias.csv", &bias(&measured.curves))?,
        context.csv("levels_grids.csv", &resolutions(&measured.grids))?,
    ];
    prose(&measured)?.section("levels", data, table)
}

/// Arcs of an outline.
fn arcs(context: &Context) -> u32 {
    context.spend(16, 400)
}

fn curves(context: &Context) -> anyhow::Result<[Vec<Curve>; 2]> {
    let ball = Subject::ball()?;
    let target = Target::new(&ball, Outputs::Film, &ball.outline(arcs(context))?);
    let coarse = ViciniField { epsilon: 1e-4, ..vicini() };
    let methods = [
        ("Vicini et al., ε = 10⁻⁶", Method::Vicini(vicini())),
        ("Vicini et al., ε = 10⁻⁴", Method::Vicini(coarse)),
        ("Bangaru et al.", Method::Bangaru(BangaruField::default())),
    ];
    let count = arcs(context);
    let along = |places: &[f64], with: &dyn Fn(f64) -> Tracer| {
        let curve = |&(name, method): &(&str, Method)| {
            let points = places.iter().map(|&x| [x, target.at_last_hits(method, with(x), count)]).collect();
            Curve { name: name.to_owned(), points }
        };
        methods.iter().map(curve).collect()
    };
    let tolerances = [1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8];
    let steps = [10.0, 20.0, 40.0, 80.0, 160.0, 320.0, 640.0, 1280.0, 2560.0];
    let by_tolerance = |tolerance| Tracer { tolerance, max_steps: 20_000, ..tracer() };
    let by_steps = |steps| Tracer { max_steps: steps as usize, ..tracer() };
    Ok([along(&tolerances, &by_tolerance), along(&steps, &by_steps)])
}

fn grids(context: &Context) -> anyhow::Result<Vec<Series>> {
    let mut all = vec![];
    let (cells, samples) = context.spend((&[8, 16][..], 4000), (&[8, 16, 32, 64][..], 1_000_000));
    let methods = [Method::Vicini(vicini()), Method::Bangaru(BangaruField::default())];
    for interpolation in [Interpolation::Cubic, Interpolation::Trilinear] {
        for (which, method) in (0..).zip(methods) {
            let mut points = vec![];
            for &cells in cells {
                let grid = Subject::grid(interpolation, cells)?;
                let target = Target::new(&grid, Outputs::Film, &grid.outline(arcs(context))?);
                let seed = seed_of(context.seed(), &[18, 2, which, cells as u64]);
                points.push((cells, target.measure(method, tracer(), samples, seed).slope));
            }
            let kind = if interpolation == Interpolation::Cubic { "spline" } else { "trilinear" };
            all.push(Series { name: format!("{kind}, {}", method.name()), points });
        }
    }
    Ok(all)
}

fn rows(context: &Context) -> anyhow::Result<Vec<Row>> {
    let samples = context.spend(4000, 10_000_000);
    let mut rows = vec![];
    for (index, subject) in (0..).zip(Subject::all()?) {
        let outline = subject.outline(arcs(context))?;
        for outputs in Outputs::ALL {
            let target = Target::new(&subject, outputs, &outline);
            for (which, method) in (0..).zip(Method::all()) {
                let seed = seed_of(context.seed(), &[18, 1, index, which]);
                let is_judged = subject.is_smooth && matches!(method, Method::Vicini(_));
                let samples =
                    if is_judged { samples.max(needed(context, &target, method, index)) } else { samples };
                let found = target.measure(method, tracer(), samples, seed);
                let (shape, is_smooth) = (subject.name.clone(), subject.is_smooth);
                rows.push(Row { shape, is_smooth, outputs, method, found });
            }
        }
    }
    Ok(rows)
}

/// Number of samples that resolves a bias of 1 % at four standard errors, from separate pilot samples.
fn needed(context: &Context, target: &Target<'_>, method: Method, index: u64) -> usize {
    let (pilot, error) = context.spend((400, f64::INFINITY), (4_000_000, 0.0020));
    let seed = seed_of(context.seed(), &[18, 3, index]);
    (target.measure(method, tracer(), pilot, seed).deviation / error).powi(2) as usize
}

fn prose(measured: &Measured) -> anyhow::Result<Prose> {
    let default = |row: &&Row| matches!(row.method, Method::Vicini(_));
    let slopes = |is_smooth: bool| {
        let rows = measured.rows.iter().filter(default).filter(|row| row.is_smooth == is_smooth);
        listed(rows.map(|row| format!("{}, {}: {}", row.shape, row.outputs.name(), row.found.slope.shown())))
    };
    let ball = |method: Method| {
        let of = |row: &&Row| row.shape == "ball" && row.outputs == Outputs::Film && row.method == method;
        measured.rows.iter().find(of).map_or_else(String::new, |row| number(row.found.nanoseconds))
    };
    let prices = listed(Method::all().map(|method| format!("{}: {}", method.name(), ball(method))));
    let at = |study: usize, x: f64| {
        let point = measured.curves[study][0].points.iter().find(|point| point[0] == x);
        point.map_or_else(String::new, |point| percent((point[1] - 1.0).abs()))
    };
    let jumps = listed(measured.scans.iter().map(|scan| format!("{}: {}", scan.name, scan.jumps.len())));
    let default_scan = measured.scans.iter().find(|scan| scan.name == scan::DEFAULT);
    let largest_jump = default_scan.map_or(0.0, |scan| scan.jumps.iter().copied().fold(0.0, f64::max));
    let is_ball = |row: &&Row| row.shape == "ball" && row.outputs == Outputs::Film;
    let ball_slope = measured.rows.iter().filter(default).find(is_ball).map(|row| row.found.slope.shown());
    let trilinear = measured.grids.iter().filter(|series| series.name.starts_with("trilinear"));
    let finest = trilinear.filter_map(|series| {
        let (cells, slope) = series.points.last()?;
        Some(format!("{}, {cells} cells: {}", series.name, slope.shown()))
    });
    let lost = measured.rows.iter().filter(default).map(|row| row.found.lost).fold(0.0, f64::max);
    Prose::new(
        include_str!("levels.md"),
        &[
            ("smooth", &slopes(true)),
            ("rough", &slopes(false)),
            ("prices", &prices),
            ("jumps", &jumps),
            ("finest", &listed(finest)),
            ("cells", &CELLS),
            ("rays", &RAYS),
            ("band", &number(BAND)),
            ("at_thousandth", &at(0, 1e-3)),
            ("at_default", &at(0, 1e-7)),
            ("few_steps", &at(1, 20.0)),
            ("many_steps", &at(1, 640.0)),
            ("lost", &percent(lost)),
            ("ball_slope", &ball_slope.unwrap_or_default()),
            ("largest_jump", &number(largest_jump)),
        ],
    )
}

fn table(rows: &[Row]) -> Table {
    Table::of(
        rows,
        &[
            ("shape", &|row| row.shape.as_str().into()),
            ("integrals", &|row| row.outputs.name().into()),
            ("field", &|row| row.method.name().into()),
            ("slope", &|row| row.found.slope.shown().into()),
            ("deviation of a sample", &|row| row.found.deviation.into()),
            ("ns a sample", &|row| row.found.nanoseconds.into()),
            ("rays out of steps (%)", &|row| (100.0 * row.found.lost).into()),
        ],
    )
}

fn bias(curves: &[Vec<Curve>; 2]) -> Table {
    let named = ["tolerance", "steps"].into_iter().zip(curves);
    let rows = named.flat_map(|(what, curves)| {
        curves.iter().flat_map(move |curve| curve.points.iter().map(move |point| (what, curve, *point)))
    });
    Table::of(
        rows,
        &[
            ("varied", &|(what, ..)| (*what).into()),
            ("field", &|(_, curve, _)| curve.name.as_str().into()),
            ("value", &|(.., [x, _])| (*x).into()),
            ("slope", &|(.., [_, slope])| (*slope).into()),
        ],
    )
}

fn resolutions(grids: &[Series]) -> Table {
    let rows = grids.iter().flat_map(|series| series.points.iter().map(move |point| (series, *point)));
    Table::of(
        rows,
        &[
            ("grid and field", &|(series, _)| series.name.as_str().into()),
            ("cells", &|(_, (cells, _))| (*cells).into()),
            ("slope", &|(_, (_, slope))| slope.value.into()),
            ("standard error", &|(_, (_, slope))| slope.error.into()),
        ],
    )
}
