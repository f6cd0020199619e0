//! Rectangles of the page and the map from a scene onto them.
//!
//! Page coordinates are logical pixels, x to the right and y down.

use glam::DVec2;
use serde::{Deserialize, Serialize};

/// An axis-aligned rectangle in logical pixels, from its top left corner.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize)]
pub(crate) struct Rect {
    pub(crate) x: f64,
    pub(crate) y: f64,
    pub(crate) width: f64,
    pub(crate) height: f64,
}

impl Rect {
    /// A rectangle; negative extents become zero.
    pub(crate) fn new(x: f64, y: f64, width: f64, height: f64) -> Self {
        Self { x, y, width: width.max(0.0), height: height.max(0.0) }
    }

    pub(crate) fn right(self) -> f64 {
        self.x + self.width
    }

    pub(crate) fn bottom(self) -> f64 {
        self.y + self.height
    }

    pub(crate) fn centre(self) -> DVec2 {
        DVec2::new(self.x + 0.5 * self.width, self.y + 0.5 * self.height)
    }

    /// The corners, clockwise on the page from the top left.
    pub(crate) fn corners(self) -> [DVec2; 4] {
        [
            DVec2::new(self.x, self.y),
            DVec2::new(self.right(), self.y),
            DVec2::new(self.right(), self.bottom()),
            DVec2::new(self.x, self.bottom()),
        ]
    }

    /// Whether the closed rectangle contains `point`.
    pub(crate) fn contains(self, point: DVec2) -> bool {
        point.x >= self.x && point.x <= self.right() && point.y >= self.y && point.y <= self.bottom()
    }

    /// Shrinks every side by the given amount (grows where it is negative).
    pub(crate) fn inset(self, left: f64, top: f64, right: f64, bottom: f64) -> Self {
        Self::new(self.x + left, self.y + top, self.width - left - right, self.height - top - bottom)
    }

    /// Cuts a strip of height `height` off the top: (strip, rest).
    pub(crate) fn split_top(self, height: f64) -> (Self, Self) {
        let height = height.clamp(0.0, self.height);
        (Self { height, ..self }, self.inset(0.0, height, 0.0, 0.0))
    }

    /// Columns with widths in the ratio of `weights`, `gutter` apart.
    pub(crate) fn columns(self, weights: &[f64], gutter: f64) -> Vec<Self> {
        shares(weights, self.width, gutter)
            .map(|(start, width)| Self::new(self.x + start, self.y, width, self.height))
            .collect()
    }

    /// Rows with heights in the ratio of `weights`, `gutter` apart.
    pub(crate) fn rows(self, weights: &[f64], gutter: f64) -> Vec<Self> {
        shares(weights, self.height, gutter)
            .map(|(start, height)| Self::new(self.x, self.y + start, self.width, height))
            .collect()
    }

    /// Cells of a grid of `rows` × `columns`, row by row, separated by gaps between columns and between rows.
    pub(crate) fn grid(self, [rows, columns]: [usize; 2], [across, down]: [f64; 2]) -> Vec<Self> {
        let rows = self.rows(&vec![1.0; rows], down);
        rows.into_iter().flat_map(|row| row.columns(&vec![1.0; columns], across)).collect()
    }
}

/// (start, length) of each share of `total`, less the gutters between them.
fn shares(weights: &[f64], total: f64, gutter: f64) -> impl Iterator<Item = (f64, f64)> {
    let free = (total - gutter * weights.len().saturating_sub(1) as f64).max(0.0);
    let sum: f64 = weights.iter().sum();
    weights.iter().scan(0.0, move |start, weight| {
        let length = if sum > 0.0 { free * weight / sum } else { 0.0 };
        let share = (*start, length);
        *start += length + gutter;
        Some(share)
    })
}

/// The similarity from scene coordinates to the page: uniform scale, centred in its rectangle.
#[derive(Clone, Copy, Debug)]
pub(crate) struct View {
    scene_centre: DVec2,
    page_centre: DVec2,
    scale: DVec2,
}

impl View {
    /// Shows the scene box from `low` to `high` as large as `page` allows, y growing down the page as image
    /// rows do.
    pub(crate) fn downward(low: DVec2, high: DVec2, page: Rect) -> Self {
        let size = (high - low).max(DVec2::splat(f64::MIN_POSITIVE));
        let scale = DVec2::splat((page.width / size.x).min(page.height / size.y));
        Self { scene_centre: 0.5 * (low + high), page_centre: page.centre(), scale }
    }

    /// The similarity with y growing up the page, as in mathematics.
    pub(crate) fn upward(low: DVec2, high: DVec2, page: Rect) -> Self {
        let view = Self::downward(low, high, page);
        Self { scale: view.scale * DVec2::new(1.0, -1.0), ..view }
    }

    /// The page point of a scene point.
    pub(crate) fn at(&self, point: DVec2) -> DVec2 {
        self.page_centre + (point - self.scene_centre) * self.scale
    }

    /// The page vector of a scene vector.
    pub(crate) fn vector(&self, vector: DVec2) -> DVec2 {
        vector * self.scale
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn grids_tile_and_views_are_centred() {
        let cells = Rect::new(10.0, 20.0, 110.0, 50.0).grid([2, 3], [10.0; 2]);
        assert_eq!(
            (cells.len(), cells[0].width, cells[5].right(), cells[5].bottom()),
            (6, 30.0, 120.0, 70.0)
        );
        let view = View::upward(DVec2::ZERO, DVec2::new(2.0, 1.0), Rect::new(0.0, 0.0, 100.0, 100.0));
        assert_eq!(view.at(DVec2::ZERO), DVec2::new(0.0, 75.0));
        assert_eq!(view.at(DVec2::new(2.0, 1.0)), DVec2::new(100.0, 25.0));
    }
}
