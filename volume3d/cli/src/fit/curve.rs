//! The losses of a fit as a plot.

use plotters::prelude::*;
use volume3d::optimize::Fit;

/// The smooth curve averages over 1/`SMOOTH` of all steps.
const SMOOTH: usize = 25;

/// An SVG with the loss of every step and its moving average, on a logarithmic axis.
pub(super) fn losses(fit: &Fit) -> String {
    let losses: Vec<f64> = fit.state().records.iter().map(|r| r.loss + r.penalty).collect();
    let mut svg = String::new();
    // A plot that fails is empty: the numbers are in the table.
    if draw(&losses, &mut svg).is_err() {
        svg.clear();
    }
    svg
}

fn draw(losses: &[f64], svg: &mut String) -> Result<(), Box<dyn std::error::Error>> {
    let root = SVGBackend::with_string(svg, (720, 360)).into_drawing_area();
    root.fill(&WHITE)?;
    let positive = || losses.iter().copied().filter(|l| *l > 0.0 && l.is_finite());
    let (low, high) = (positive().fold(f64::INFINITY, f64::min), positive().fold(0.0, f64::max));
    if high == 0.0 {
        root.present()?;
        return Ok(());
    }
    let mut chart = ChartBuilder::on(&root)
        .margin(12)
        .x_label_area_size(36)
        .y_label_area_size(64)
        .build_cartesian_2d(0.0..losses.len().max(2) as f64, (0.8 * low..1.25 * high).log_scale())?;
    let exponent = |v: &f64| format!("{v:.0e}");
    chart
        .configure_mesh()
        .x_desc("step")
        .y_desc("loss")
        .y_label_formatter(&exponent)
        .light_line_style(WHITE)
        .draw()?;
    let points = |values: &[f64]| -> Vec<(f64, f64)> {
        let points = values.iter().enumerate().map(|(i, l)| (i as f64 + 1.0, *l));
        points.filter(|(_, l)| *l > 0.0 && l.is_finite()).collect()
    };
    chart.draw_series(LineSeries::new(points(losses), RGBColor(160, 190, 220)))?;
    chart.draw_series(LineSeries::new(points(&smooth(losses)), RGBColor(20, 80, 150).stroke_width(2)))?;
    root.present()?;
    Ok(())
}

/// The moving average, centred at each value.
fn smooth(values: &[f64]) -> Vec<f64> {
    let reach = values.len() / SMOOTH / 2;
    let around = |i: usize| &values[i.saturating_sub(reach)..values.len().min(i + reach + 1)];
    (0..values.len()).map(|i| around(i).iter().sum::<f64>() / around(i).len() as f64).collect()
}
