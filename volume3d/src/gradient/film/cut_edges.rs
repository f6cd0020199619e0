//! The border of the film, where it [cuts](super::cut) the filters of pixels.

use glam::DVec2;

use super::plane::FilmPlane;

/// Edges of a cell on the border of the film.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CutEdges {
    /// On the left or the upper edge of the cell: −1 where the film is before it, 1 where it is behind it,
    /// and 0 where the border is not there.
    pub(crate) inwards: [f64; 2],
}

impl FilmPlane {
    /// Whether the border of the film cuts filters.
    pub(crate) fn is_cut(&self) -> bool {
        self.cut.is_some()
    }

    /// Whether no sample counts beyond the border.
    pub(crate) fn ends_at_border(&self) -> bool {
        self.is_box() || self.is_cut()
    }

    /// Whether a cell is one of the image.
    pub(super) fn is_within(&self, cell: [usize; 2]) -> bool {
        (0..2).all(|axis| (self.reach..self.reach + self.size()[axis]).contains(&cell[axis]))
    }

    /// Columns and rows.
    pub(crate) fn size(&self) -> [usize; 2] {
        [self.columns, self.rows]
    }

    /// Factor of a pixel's weights along an axis, as the border cuts its filter.
    #[inline]
    pub(super) fn cut_scale(&self, axis: usize, x: usize) -> f64 {
        self.cut.as_ref().map_or(1.0, |cut| cut.scale(x, self.size()[axis]))
    }

    /// Which of the left and the upper edge of a cell are on the border that cuts filters, if one is.
    pub(crate) fn cut_edges(&self, cell: (usize, usize)) -> Option<CutEdges> {
        if !self.is_cut() {
            return None;
        }
        let (cell, size) = ([cell.0, cell.1], self.size());
        let inwards = [0, 1].map(|axis| {
            let (at, across) = (cell[axis], 1 - axis);
            let along = self.reach..self.reach + size[across];
            match at {
                _ if !along.contains(&cell[across]) => 0.0,
                at if at == self.reach => 1.0,
                at if at == self.reach + size[axis] => -1.0,
                _ => 0.0,
            }
        });
        (inwards != [0.0; 2]).then_some(CutEdges { inwards })
    }

    /// The part of a point that is within the film, whose border may be anywhere within its rounding.
    pub(super) fn part_within(&self, at: DVec2) -> f64 {
        let (low, high) = self.image();
        let inside = (at - low).min(high - at) / self.border;
        let part = (0.5 * inside + 0.5).clamp(DVec2::ZERO, DVec2::ONE);
        part.x * part.y
    }
}
