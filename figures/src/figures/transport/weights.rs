//! The weight of every auxiliary ray, over the shapes seen.

use glam::DVec2;

use super::fans::{Fan, REACH};
use super::setting::looks;
use super::world::pen;
use crate::plot::{Align, Axes, Axis, Canvas, Color, Height, Legend, Pen, Rect, TextStyle};

/// The part of the height below zero, for the strip of what is seen.
const STRIP: f64 = 0.2;

/// Draws one panel a fan, side by side.
pub(super) fn draw(canvas: &mut Canvas, space: Rect, fans: &[Fan]) {
    for (index, (fan, cell)) in fans.iter().zip(space.columns(&[1.0; 4], 14.0)).enumerate() {
        let frame = stems(canvas, cell, fan, index == 0);
        let style = TextStyle::new(11.0, Color::INK).anchored(Align::Centre, Height::Baseline);
        canvas.text(&fan.title, DVec2::new(frame.centre().x, frame.y - 6.0), &style);
    }
}

fn stems(canvas: &mut Canvas, space: Rect, fan: &Fan, first: bool) -> Rect {
    let top = 1.12 * fan.rays.iter().map(|r| r.share).fold(0.0, f64::max);
    let tick = [0.5, 0.2, 0.1, 0.05, 0.02].into_iter().find(|t| *t < top).unwrap_or(0.01);
    let ticks = [(0.0, "0".to_owned()), (tick, format!("{}%", 100.0 * tick))];
    let x = Axis::linear("kernel widths away").limits(-REACH, REACH);
    let y =
        Axis::linear(if first { "share of the weight" } else { "" }).limits(-STRIP * top, top).ticks(ticks);
    let placed = Axes::new(x, y).legend(Legend::None).draw(canvas, space);
    let at = |x: f64, y: f64| placed.at([x, y]).unwrap_or(DVec2::ZERO);
    let style = TextStyle::new(9.5, Color::INK).anchored(Align::Centre, Height::Middle);
    for ([from, to], shape) in &fan.seen {
        let (low, high) = (at(*from, -STRIP * top), at(*to, -0.01 * top));
        let rect = Rect::new(low.x, high.y, high.x - low.x, low.y - high.y);
        let (text, color) = looks(*shape);
        canvas.fill_rect(rect, color.tint(0.45));
        if style.width(text) + 4.0 < rect.width {
            canvas.text(text, rect.centre(), &style);
        }
        if *from > -REACH {
            canvas.line(at(*from, -STRIP * top), at(*from, top), &Pen::new(Color::SPINE, 1.0).dashed());
        }
    }
    let zero = at(0.0, 0.0);
    canvas.line(zero, at(0.0, top), &Pen::new(Color::INK.alpha(0.5), 1.0));
    for ray in fan.lightest_first().into_iter().filter(|r| r.offset.abs() < REACH) {
        let pen = pen(ray.share);
        let tip = at(ray.offset, ray.share);
        canvas.line(at(ray.offset, 0.0), tip, &Pen::new(pen.color, pen.width.max(1.0)));
        canvas.disc(tip, 1.2 + 0.5 * pen.width, pen.color);
    }
    canvas.frame(placed.frame, &Pen::new(Color::SPINE, 0.7));
    placed.frame
}
