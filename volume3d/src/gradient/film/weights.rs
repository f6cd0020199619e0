//! Filter weights of a cell's samples for the pixels around it.

use flatland::calculus::Number;
use glam::DVec2;

use super::filter::{weight, weights};
use super::plane::FilmPlane;
use crate::scene::Filter;

/// Pixels along an axis that a cell's samples reach, for filters at most two pixels wide.
pub(crate) const NEAR: usize = 3;

/// Pixels along an axis up to which weights are computed at once; wider filters are rare.
const WIDEST_AT_ONCE: usize = 9;

impl FilmPlane {
    /// Calls back with every pixel that a sample of the cell (i, j) reaches: its position (a, b) in the
    /// neighbourhood and (x, y) in the image.
    pub(crate) fn for_each_pixel(&self, i: usize, j: usize, mut f: impl FnMut(usize, usize, usize, usize)) {
        let around = if self.is_box() { 1..=1 } else { 0..=2 * self.reach };
        for b in around.clone() {
            for a in around.clone() {
                if let (Some(x), Some(y)) = (self.pixel_column(i, a), self.pixel_row(j, b)) {
                    f(a, b, x, y);
                }
            }
        }
    }

    /// Calls back with every pixel in which a point of the cell (i, j) has a weight, or gets one as it moves:
    /// row in the neighbourhood, position (x, y) in the image, and weight.
    #[inline]
    pub(crate) fn for_each_weight<T: Number>(
        &self,
        (i, j): (usize, usize),
        u: [T; 2],
        mut f: impl FnMut([usize; 3], T),
    ) {
        let width = 2 * self.reach + 1;
        if self.is_box() || width > WIDEST_AT_ONCE {
            self.for_each_pixel(i, j, |_, b, x, y| f([b, x, y], self.weight(u, x, y)));
            return;
        }
        let along = |axis: usize, pixel: usize| {
            let weight = weight(self.filter, u[axis] - T::constant(self.corner[axis] + (pixel as f64 + 0.5)));
            if self.is_cut() { weight * self.cut_scale(axis, pixel) } else { weight }
        };
        let counts = |weight: T| weight.value() != 0.0 || !weight.is_still();
        let mut columns = [T::constant(0.0); WIDEST_AT_ONCE];
        for (a, column) in columns[..width].iter_mut().enumerate() {
            if let Some(x) = self.pixel_column(i, a) {
                *column = along(0, x);
            }
        }
        for b in 0..width {
            let Some(y) = self.pixel_row(j, b) else { continue };
            let row = along(1, y);
            if counts(row) {
                for (a, &column) in columns[..width].iter().enumerate() {
                    if counts(column) {
                        f([b, i + a - 2 * self.reach, y], column * row);
                    }
                }
            }
        }
    }

    /// Whether [`weights_near`](Self::weights_near) covers all weights.
    pub(crate) fn is_near(&self) -> bool {
        !self.is_box() && 2 * self.reach + 1 == NEAR
    }

    /// Weights of N points of the cell (i, j) along columns and rows of the neighbourhood. Their products are
    /// the pixel weights of [`for_each_weight`](Self::for_each_weight), with additional zeros.
    #[inline(always)]
    pub(crate) fn weights_near<const N: usize>(
        &self,
        (i, j): (usize, usize),
        within: &[[f64; 2]; N],
    ) -> [[[f64; N]; NEAR]; 2] {
        let points = within.map(|within| self.point(i, j, within));
        let (mut columns, mut rows) = ([[0.0; N]; NEAR], [[0.0; N]; NEAR]);
        for a in 0..NEAR {
            if let Some(x) = self.pixel_column(i, a) {
                let weights = weights(self.filter, &points.map(|u| u.x - (self.corner.x + (x as f64 + 0.5))));
                let scale = self.cut_scale(0, x);
                columns[a] = weights.map(|weight| weight * scale);
            }
            if let Some(y) = self.pixel_row(j, a) {
                let weights = weights(self.filter, &points.map(|u| u.y - (self.corner.y + (y as f64 + 0.5))));
                let scale = self.cut_scale(1, y);
                rows[a] = weights.map(|weight| weight * scale);
            }
        }
        [columns, rows]
    }

    /// Whether a cell's samples reach one of these pixels or a neighbour of one.
    pub(crate) fn reaches(&self, i: usize, j: usize, pixel: impl Fn(usize) -> bool) -> bool {
        let around = || 0..=2 * self.reach;
        let rows = around().filter_map(|b| self.pixel_row(j, b));
        rows.flat_map(|y| around().filter_map(move |a| Some(y * self.columns + self.pixel_column(i, a)?)))
            .any(pixel)
    }

    /// Filter weight h of a point for the pixel (i, j) of the image.
    pub(crate) fn weight<T: Number>(&self, [x, y]: [T; 2], i: usize, j: usize) -> T {
        let centre = self.corner + DVec2::new(i as f64 + 0.5, j as f64 + 0.5);
        let at = |x: T, c: f64| weight(self.filter, x - T::constant(c));
        match self.filter {
            // Samples of a pixel are those of its cell; its edge is a separate integral.
            Filter::Box => T::constant(1.0),
            _ if self.is_cut() => {
                at(x, centre.x) * self.cut_scale(0, i) * (at(y, centre.y) * self.cut_scale(1, j))
            }
            _ => at(x, centre.x) * at(y, centre.y),
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::gradient::tests::film;
    use crate::scene::{Camera, Description, Scene};

    /// All cells of a small film, at its border and inside, bit for bit.
    #[test]
    fn weights_side_by_side_are_those_one_by_one() {
        let places = [[0.0, 0.0], [0.1, 0.9], [0.5, 0.5], [0.7, 0.2]];
        for filter in
            [Filter::Tent { radius: 1.0 }, Filter::Tent { radius: 0.7 }, Filter::Gaussian { deviation: 0.3 }]
        {
            let camera = Camera::look_at(DVec3::Z, DVec3::ZERO, DVec3::Y, 0.8);
            let scene = Scene::new(Description::new(camera, film(5, filter))).unwrap();
            let film = FilmPlane::new(&scene);
            assert!(film.is_near());
            let (columns, rows) = film.cells();
            let mut count = 0;
            for (i, j) in (0..rows).flat_map(|j| (0..columns).map(move |i| (i, j))) {
                let [by_column, by_row] = film.weights_near((i, j), &places);
                for (at, &within) in places.iter().enumerate() {
                    let mut near = [[0.0; NEAR]; NEAR];
                    film.for_each_weight((i, j), film.point(i, j, within).to_array(), |[b, x, _], weight| {
                        near[b][x + 2 * film.reach - i] = weight;
                        count += usize::from(weight > 0.0);
                    });
                    for (b, row) in near.iter().enumerate() {
                        let all = by_column.map(|column| column[at] * by_row[b][at]);
                        assert_eq!(all, *row, "{filter:?} {i} {j} {at}");
                    }
                }
            }
            assert!(count > 4 * 25, "{count}");
        }
    }
}
