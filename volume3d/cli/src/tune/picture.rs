//! A plot of error against time: points are measured, lines predicted.

use anyhow::anyhow;
use plotters::prelude::*;
use volume3d::tune::{Law, Rung, Tuned};

use super::settings::options;

/// Size in pixels, and the columns of the plot; the others are the legend.
const SIZE: (u32, u32) = (1000, 600);
const PLOT: u32 = 660;

/// Colours that distinguish neighbours in the legend; repeated after the last.
const COLOURS: [RGBColor; 12] = [
    RGBColor(31, 119, 180),
    RGBColor(44, 160, 44),
    RGBColor(23, 190, 207),
    RGBColor(0, 90, 90),
    RGBColor(255, 187, 60),
    RGBColor(255, 127, 14),
    RGBColor(214, 39, 40),
    RGBColor(148, 103, 189),
    RGBColor(127, 127, 127),
    RGBColor(227, 119, 194),
    RGBColor(188, 189, 34),
    RGBColor(140, 86, 75),
];

/// Lines extend to this multiple of the longest run's time.
const BEYOND: f64 = 30.0;

/// Points along a line.
const PLACES: usize = 80;

/// One setting in the plot, as pairs of seconds and error.
struct Series<'a> {
    tuned: &'a Tuned,
    colour: RGBColor,
    points: Vec<(f64, f64)>,
    line: Vec<(f64, f64)>,
}

/// The plot as SVG.
pub(super) fn svg(settings: &[Tuned]) -> anyhow::Result<String> {
    let longest = settings.iter().flat_map(Tuned::rungs).map(|r| r.seconds).fold(0.0, f64::max);
    let series = settings.iter().enumerate().filter_map(|(i, tuned)| {
        let (law, colour) = (tuned.law()?, COLOURS[i % COLOURS.len()]);
        let points = shown(tuned.rungs().iter().map(|r| (r.seconds, error(r))));
        Some(Series { tuned, colour, points, line: line(&law, BEYOND * longest) })
    });
    let series: Vec<Series<'_>> = series.collect();
    let mut text = String::new();
    draw(&series, &mut text).map_err(|e| anyhow!("cannot draw the picture: {e}"))?;
    Ok(text)
}

/// The error of one run of a rung.
fn error(rung: &Rung) -> f64 {
    let s = &rung.statistics;
    (s.relative_bias2.value + s.relative_variance.value).max(0.0).sqrt()
}

/// The points that logarithmic axes can show.
fn shown(all: impl Iterator<Item = (f64, f64)>) -> Vec<(f64, f64)> {
    all.filter(|(t, e)| [t, e].iter().all(|x| **x > 0.0 && x.is_finite())).collect()
}

/// The prediction from one sample per pixel up to a time.
fn line(law: &Law, until: f64) -> Vec<(f64, f64)> {
    let most = law.within(until).map_or(1.0, |e| e.samples as f64);
    let samples = (0..=PLACES).map(|i| most.powf(i as f64 / PLACES as f64).round() as usize);
    shown(samples.map(|n| law.expected(n)).map(|e| (e.seconds, e.error.value)))
}

/// The range of an axis for some values, at least a decade.
fn limits(values: impl Iterator<Item = f64> + Clone) -> std::ops::Range<f64> {
    let (low, high) = (values.clone().fold(f64::INFINITY, f64::min), values.fold(0.0, f64::max));
    if low.is_finite() && high > 0.0 { 0.7 * low..(1.4 * high).max(10.0 * low) } else { 0.1..10.0 }
}

fn draw<'t>(
    series: &[Series<'_>],
    text: &'t mut String,
) -> Result<(), DrawingAreaErrorKind<<SVGBackend<'t> as DrawingBackend>::ErrorType>> {
    let root = SVGBackend::with_string(text, SIZE).into_drawing_area();
    root.fill(&WHITE)?;
    let (left, right) = root.split_horizontally(PLOT);
    let places = || series.iter().flat_map(|s| s.points.iter().chain(&s.line));
    let (times, errors) = (limits(places().map(|p| p.0)), limits(places().map(|p| p.1)));
    let mut chart = ChartBuilder::on(&left)
        .margin(16)
        .x_label_area_size(44)
        .y_label_area_size(64)
        .build_cartesian_2d(times.log_scale(), errors.log_scale())?;
    chart
        .configure_mesh()
        .x_desc("seconds of one run")
        .y_desc("error, relative to the gradient")
        .x_label_formatter(&|t| format!("{t}"))
        .y_label_formatter(&|e| format!("{}%", (100.0 * e * 1e6).round() / 1e6))
        .light_line_style(WHITE)
        .label_style(("sans-serif", 14))
        .draw()?;
    for Series { tuned, colour, points, line } in series {
        if tuned.unbiased {
            chart.draw_series(LineSeries::new(line.iter().copied(), colour.stroke_width(2)))?;
        } else {
            chart.draw_series(DashedLineSeries::new(line.iter().copied(), 6, 4, colour.stroke_width(2)))?;
        }
        chart.draw_series(points.iter().map(|p| Circle::new(*p, 4, colour.filled())))?;
    }
    names(series, &right)?;
    root.present()
}

/// Draws the legend.
fn names<'t>(
    series: &[Series<'_>],
    area: &DrawingArea<SVGBackend<'t>, plotters::coord::Shift>,
) -> Result<(), DrawingAreaErrorKind<<SVGBackend<'t> as DrawingBackend>::ErrorType>> {
    let style = ("sans-serif", 14).into_font();
    let write = |words: &str, x: i32, y: i32| area.draw(&Text::new(words.to_owned(), (x, y), style.clone()));
    for (i, Series { tuned, colour, .. }) in series.iter().enumerate() {
        let y = 24 + 24 * i as i32;
        area.draw(&Circle::new((14, y + 7), 5, colour.filled()))?;
        write(&options(tuned.setting), 28, y)?;
    }
    let below = 40 + 24 * series.len() as i32;
    let words = [
        "points: measured",
        "lines: √(bias² + variance/samples)",
        "solid: unbiased; dashed: biased",
        "an unresolved bias counts as its bound",
    ];
    for (i, words) in words.iter().enumerate() {
        write(words, 8, below + 20 * i as i32)?;
    }
    Ok(())
}
