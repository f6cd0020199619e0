//! The picture.

use super::Measured;
use crate::plot::*;

const PICTURE: f64 = 150.0;
const GAP: f64 = 12.0;

pub(super) fn page(measured: &Measured) -> Canvas {
    let width = 5.0 * PICTURE + 4.0 * GAP + 60.0;
    let title = "Implicit surfaces in space: fields, their bias and their jumps";
    let heights = [PICTURE + PANEL_TITLE_ROOM, 200.0, 250.0];
    let mut figure = Figure::new(width, heights.iter().sum::<f64>() + 2.0 * GUTTER, title);
    let rows = figure.body.rows(&heights, GUTTER);
    maps(&mut figure, measured, rows[0]);
    figure.plot(rows[1], "V along a line through both balls", &scans(measured));
    let plots = rows[2].columns(&[1.0; 3], GUTTER);
    let axes = misses(measured, 0, Axis::log("tolerance (radians)"), Legend::BottomRight);
    figure.plot(plots[0], "Bias by the tolerance, ball", &axes);
    let axes = misses(measured, 1, Axis::log("most steps of a ray"), Legend::BottomLeft);
    figure.plot(plots[1], "Bias by the steps allowed, ball", &axes);
    figure.plot(plots[2], "A ball on grids", &grids(measured));
    figure.canvas
}

fn maps(figure: &mut Figure, measured: &Measured, row: Rect) {
    let maps = &measured.maps;
    let place = |i: usize| Rect::new(row.x + i as f64 * (PICTURE + GAP), row.y, PICTURE, row.height);
    let space = figure.panel(place(0), "Two balls that move");
    let grey = Raster::new(maps.side, maps.picture.iter().map(|&v| [v as f32; 3]).collect());
    figure.canvas.picture(&grey.encoded(), space);
    let space = figure.panel(place(1), "Difference of pictures");
    let shading = Shading::signed_covering(&maps.difference, 0.99);
    figure.canvas.picture(&shading.raster(maps.side, &maps.difference), space);
    let shading = Shading::signed_covering(&maps.fields[0].1, 1.0);
    for (i, (name, values)) in maps.fields.iter().enumerate() {
        let space = figure.panel(place(2 + i), &format!("V, {name}"));
        let drawn = figure.canvas.picture(&shading.raster(maps.side, values), space);
        if i + 1 == maps.fields.len() {
            let bar = Rect::new(drawn.right() + 8.0, drawn.y, 8.0, drawn.height);
            figure.canvas.color_bar(bar, &shading, "");
        }
    }
}

fn scans(measured: &Measured) -> Axes {
    let mut axes = Axes::new(Axis::linear("angle (degrees)"), Axis::linear("V (radians per unit of time)"))
        .legend(Legend::Outside);
    let looks = [
        Style::new(Palette::BLUE),
        Style::new(Palette::VERMILION),
        Style::new(Palette::SKY).dotted(),
        Style::new(Palette::ORANGE).dotted(),
        Style::new(Palette::GREEN).dashed(),
        Style::new(Palette::PURPLE).dashed(),
    ];
    for (scan, style) in measured.scans.iter().zip(looks) {
        axes.line(
            scan.values.iter().copied(),
            &style.labelled(format!("{}: {} jumps", scan.name, scan.jumps.len())),
        );
    }
    axes
}

/// |slope − 1| without noise.
fn misses(measured: &Measured, study: usize, x: Axis, legend: Legend) -> Axes {
    let mut axes = Axes::new(x, Axis::log("|slope − 1|")).legend(legend);
    let looks = [
        Style::new(Palette::BLUE).marker(Marker::Circle),
        Style::new(Palette::SKY).marker(Marker::Square),
        Style::new(Palette::VERMILION).marker(Marker::Diamond),
    ];
    for (curve, style) in measured.curves[study].iter().zip(looks) {
        let points = curve.points.iter().map(|&[x, slope]| [x, (slope - 1.0).abs()]);
        axes.line(points, &style.labelled(curve.name.clone()));
    }
    axes
}

fn grids(measured: &Measured) -> Axes {
    let cells = measured.grids.iter().flat_map(|series| &series.points).map(|(cells, _)| *cells);
    let ticks = cells.map(|cells| (cells as f64, cells.to_string()));
    let ends = measured.grids.iter().flat_map(|series| &series.points).flat_map(|(_, slope)| slope.ends());
    let (low, high) = ends.fold((1.0_f64, 1.0_f64), |(low, high), end| (low.min(end), high.max(end)));
    // Room for the legend below all curves.
    let slopes = Axis::linear("slope").limits(low - 0.75 * (high - low), high + 0.05 * (high - low));
    let mut axes =
        Axes::new(Axis::log("cells along a side").ticks(ticks), slopes).legend(Legend::BottomRight);
    axes.horizontal(1.0, &Style::new(Color::MUTED).dotted());
    let looks = [
        Style::new(Palette::BLUE).marker(Marker::Circle),
        Style::new(Palette::VERMILION).marker(Marker::Diamond),
        Style::new(Palette::SKY).marker(Marker::Circle).dashed(),
        Style::new(Palette::ORANGE).marker(Marker::Diamond).dashed(),
    ];
    for (series, style) in measured.grids.iter().zip(looks) {
        let points = series.points.iter().map(|(cells, slope)| {
            let [low, high] = slope.ends();
            [*cells as f64, slope.value, low, high]
        });
        axes.measured(points, &style.labelled(series.name.clone()));
    }
    axes
}
