//! Error against time: points as measured, lines as predicted.

use anyhow::anyhow;
use plotters::prelude::*;

use super::law::{Law, Rung};
use super::settings::Setting;
use super::study::Outcome;

/// Columns and rows, and how many of the columns are for the plot; the others name the settings.
const SIZE: (u32, u32) = (1000, 600);
const PLOT: u32 = 660;

/// Colours that tell neighbours in the list apart; after the last they begin again.
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

/// How far lines go beyond what was measured, in times of the longest run.
const BEYOND: f64 = 30.0;

/// Places along a line.
const PLACES: usize = 80;

/// One setting in the picture, as pairs of seconds and error.
struct Series<'a> {
    setting: &'a Setting,
    colour: RGBColor,
    points: Vec<(f64, f64)>,
    line: Vec<(f64, f64)>,
}

/// The picture as SVG.
pub(super) fn svg(settings: &[Setting], outcomes: &[Outcome]) -> anyhow::Result<String> {
    let measured: Vec<(usize, &Setting, &[Rung])> = settings
        .iter()
        .zip(outcomes)
        .enumerate()
        .filter_map(|(i, (setting, outcome))| match outcome {
            Outcome::Measured(rungs) => Some((i, setting, &rungs[..])),
            _ => None,
        })
        .collect();
    let longest = measured.iter().flat_map(|m| m.2).map(|r| r.seconds).fold(0.0, f64::max);
    let series: Vec<Series<'_>> = measured
        .into_iter()
        .filter_map(|(i, setting, rungs)| {
            let law = Law::of(rungs, setting.unbiased)?;
            let colour = COLOURS[i % COLOURS.len()];
            let points = shown(rungs.iter().map(|r| (r.seconds, error(r))));
            Some(Series { setting, colour, points, line: line(&law, BEYOND * longest) })
        })
        .collect();
    let mut text = String::new();
    draw(&series, &mut text).map_err(|e| anyhow!("cannot draw the picture: {e}"))?;
    Ok(text)
}

/// What one run of a rung errs.
fn error(rung: &Rung) -> f64 {
    let s = &rung.statistics;
    (s.relative_bias2.value + s.relative_variance.value).max(0.0).sqrt()
}

/// Only what has a place on logarithmic axes.
fn shown(all: impl Iterator<Item = (f64, f64)>) -> Vec<(f64, f64)> {
    all.filter(|(t, e)| [t, e].iter().all(|x| **x > 0.0 && x.is_finite())).collect()
}

/// What is predicted from one sample a pixel to a time.
fn line(law: &Law, until: f64) -> Vec<(f64, f64)> {
    let most = law.within(until).map_or(1.0, |e| e.samples as f64);
    let samples = (0..=PLACES).map(|i| most.powf(i as f64 / PLACES as f64).round() as usize);
    shown(samples.map(|n| law.expected(n)).map(|e| (e.seconds, e.error.value)))
}

/// The axis around some numbers, a decade at least.
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
    for Series { setting, colour, points, line } in series {
        if setting.unbiased {
            chart.draw_series(LineSeries::new(line.iter().copied(), colour.stroke_width(2)))?;
        } else {
            chart.draw_series(DashedLineSeries::new(line.iter().copied(), 6, 4, colour.stroke_width(2)))?;
        }
        chart.draw_series(points.iter().map(|p| Circle::new(*p, 4, colour.filled())))?;
    }
    names(series, &right)?;
    root.present()
}

/// Which colour is which setting.
fn names<'t>(
    series: &[Series<'_>],
    area: &DrawingArea<SVGBackend<'t>, plotters::coord::Shift>,
) -> Result<(), DrawingAreaErrorKind<<SVGBackend<'t> as DrawingBackend>::ErrorType>> {
    let style = ("sans-serif", 14).into_font();
    let write = |words: &str, x: i32, y: i32| area.draw(&Text::new(words.to_owned(), (x, y), style.clone()));
    for (i, Series { setting, colour, .. }) in series.iter().enumerate() {
        let y = 24 + 24 * i as i32;
        area.draw(&Circle::new((14, y + 7), 5, colour.filled()))?;
        write(&setting.options, 28, y)?;
    }
    let below = 40 + 24 * series.len() as i32;
    let words = [
        "points: as measured",
        "lines: √(bias² + variance/samples)",
        "solid: unbiased; dashed: biased",
        "a bias that is not resolved counts as its bound",
    ];
    for (i, words) in words.iter().enumerate() {
        write(words, 8, below + 20 * i as i32)?;
    }
    Ok(())
}
