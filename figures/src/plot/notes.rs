//! Texts beside points and reference lines, each put where it covers the least.

use glam::DVec2;

use super::{
    canvas::Canvas,
    color::Color,
    geometry::Rect,
    marks::{Mark, Placed, Style},
    text::{Align, Height, TextStyle},
};

const TEXT: f64 = 10.0;

/// What a new text should not cover.
struct Occupied {
    frame: Rect,
    /// Curves and markers, sampled.
    points: Vec<DVec2>,
    /// Legend and earlier texts.
    texts: Vec<Rect>,
}

impl Occupied {
    /// The first of the candidates that covers the least.
    fn least(&self, candidates: &[Rect]) -> Option<Rect> {
        let cost = |candidate: &Rect| {
            let near = candidate.inset(-2.0, -1.0, -2.0, -1.0);
            let inside = near.corners().iter().all(|corner| self.frame.contains(*corner));
            let texts = self.texts.iter().filter(|other| other.overlaps(near)).count();
            let covered = self.points.iter().filter(|point| near.contains(**point)).count();
            1000 * texts + 500 * usize::from(!inside) + covered.min(400)
        };
        candidates.iter().min_by_key(|candidate| cost(candidate)).copied()
    }

    fn set(&mut self, canvas: &mut Canvas, text: &str, color: Color, candidates: &[Rect]) {
        let Some(best) = self.least(candidates) else { return };
        let style = TextStyle::new(TEXT, color).anchored(Align::Left, Height::Middle).halo(Color::WHITE);
        canvas.text(text, DVec2::new(best.x, best.centre().y), &style);
        self.texts.push(best);
    }
}

/// Names the reference lines among `marks`, then sets each note (point, text, colour) beside its point.
pub(super) fn draw(
    canvas: &mut Canvas,
    placed: &Placed,
    marks: &[(Mark, Style)],
    notes: &[([f64; 2], String, Color)],
    legend: Option<Rect>,
) {
    let frame = placed.frame;
    let points = marks.iter().flat_map(|(mark, _)| placed.trace(mark)).collect();
    let mut occupied = Occupied { frame, points, texts: legend.into_iter().collect() };
    for (mark, style) in marks {
        let (Mark::Horizontal(_, text) | Mark::Vertical(_, text)) = mark else { continue };
        let Some([from, to]) = placed.reference(mark).filter(|_| !text.is_empty()) else { continue };
        let size = size(text);
        let candidates: Vec<Rect> = if matches!(mark, Mark::Horizontal(..)) {
            let (left, right) = (from.x + 5.0, to.x - 3.0 - size.x);
            // From the right end to the left, above before below.
            [1.0, 0.75, 0.5, 0.25, 0.0]
                .iter()
                .flat_map(|t| [-size.y - 4.0, 4.0].map(|dy| DVec2::new(left + t * (right - left), to.y + dy)))
                .map(|corner| Rect::new(corner.x, corner.y, size.x, size.y))
                .collect()
        } else {
            let (top, bottom) = (to.y + 3.0, from.y - 6.0 - size.y);
            [0.0, 0.25, 0.5, 0.75, 1.0]
                .iter()
                .flat_map(|t| [5.0, -5.0 - size.x].map(|dx| DVec2::new(to.x + dx, top + t * (bottom - top))))
                .map(|corner| Rect::new(corner.x, corner.y, size.x, size.y))
                .collect()
        };
        occupied.set(canvas, text, style.pen.color, &candidates);
    }
    for (point, text, color) in notes {
        let Some(at) = placed.at(*point).filter(|at| frame.contains(*at)) else { continue };
        let size = size(text);
        let (beside, over) = (8.0, 12.0);
        // In the order of preference: right, left, above, below, then the diagonals.
        let candidates = [
            DVec2::new(beside, -0.5 * size.y),
            DVec2::new(-beside - size.x, -0.5 * size.y),
            DVec2::new(-0.5 * size.x, -over - 0.5 * size.y),
            DVec2::new(-0.5 * size.x, over - 0.5 * size.y),
            DVec2::new(0.6 * beside, -over - 0.3 * size.y),
            DVec2::new(0.6 * beside, over - 0.7 * size.y),
            DVec2::new(-0.6 * beside - size.x, -over - 0.3 * size.y),
            DVec2::new(-0.6 * beside - size.x, over - 0.7 * size.y),
        ]
        .map(|corner| Rect::new(at.x + corner.x, at.y + corner.y, size.x, size.y));
        occupied.set(canvas, text, *color, &candidates);
    }
}

fn size(text: &str) -> DVec2 {
    DVec2::new(TextStyle::new(TEXT, Color::INK).width(text), TEXT)
}
