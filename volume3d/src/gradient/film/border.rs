//! Edges and curves on the borders of box-filtered pixels.
//!
//! A box filter is discontinuous at the border of its pixel. If an edge lies exactly on a border, its motion
//! to one side takes from one pixel and its motion to the other side from the other: both pixels have only
//! one-sided derivatives, and rounding decides to which of them a point of the edge belongs. The mean of the
//! one-sided derivatives is that of a pixel whose border is displaced randomly by less than any relevant
//! rounding: it is well defined, linear in motions, and equal for all methods, provided that samples of edges
//! and of borders are treated alike. Nothing changes farther from a border.

use glam::DVec2;

use super::plane::FilmPlane;

impl FilmPlane {
    /// Displacement of a pixel's border, from a number in (0, 1).
    pub(crate) fn beside_border(&self, number: f64) -> f64 {
        self.border * (2.0 * number - 1.0)
    }

    /// Moves a point on the image border into the image; leaves others unchanged.
    pub(super) fn within_borders(&self, u: DVec2) -> DVec2 {
        let (low, high) = self.image();
        let near = u.clamp(low, high - self.border);
        DVec2::select((u - near).abs().cmple(DVec2::splat(2.0 * self.border)), near, u)
    }

    /// Whether a point at this distance from a border lies on it, up to rounding.
    pub(crate) fn is_on_border(&self, distance: f64) -> bool {
        distance <= self.border
    }

    /// Least and largest coordinates of the image.
    pub(crate) fn image(&self) -> (DVec2, DVec2) {
        (self.corner, self.corner + DVec2::new(self.columns as f64, self.rows as f64))
    }

    /// Calls with every pixel (x, y) of the image that a point of an edge reaches, and its weight there,
    /// which is not 0. On the border of box pixels it is a part of each of them, and on a border that cuts
    /// filters a part of all that it would be.
    pub(crate) fn for_each_share(&self, at: DVec2, mut f: impl FnMut(usize, usize, f64)) {
        let Some((i, j)) = self.cell(at) else { return };
        if !self.is_box() {
            let part = if self.is_cut() { self.part_within(at) } else { 1.0 };
            self.for_each_pixel(i, j, |_, _, x, y| {
                let weight = self.weight(at.to_array(), x, y) * part;
                if weight != 0.0 {
                    f(x, y, weight);
                }
            });
            return;
        }
        let size = [self.columns, self.rows];
        // Fraction of border displacements that leave the point within a pixel.
        let part = |axis: usize, pixel: usize| {
            let beside = (at[axis] - self.corner[axis] - (pixel as f64 + 0.5)).abs();
            ((0.5 - beside) / self.border).mul_add(0.5, 0.5).clamp(0.0, 1.0)
        };
        let around = |axis: usize, cell: usize| {
            let pixel = cell - self.reach;
            pixel.saturating_sub(1)..(pixel + 2).min(size[axis])
        };
        for y in around(1, j) {
            let along = part(1, y);
            for x in around(0, i).filter(|_| along > 0.0) {
                let share = part(0, x) * along;
                if share > 0.0 {
                    f(x, y, share);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::gradient::tests::film;
    use crate::scene::{Camera, Description, Filter, Scene};

    /// Points within a pixel, on a side, on a corner, and on the image border, with and without rounding.
    #[test]
    fn points_on_borders_belong_to_all_pixels_there() {
        let camera = Camera::look_at(DVec3::Z, DVec3::ZERO, DVec3::Y, 0.8);
        let film = FilmPlane::new(&Scene::new(Description::new(camera, film(5, Filter::Box))).unwrap());
        let shares = |x: f64, y: f64| {
            let mut found = vec![];
            film.for_each_share(DVec2::new(x, y), |i, j, share| found.push(((i, j), share)));
            found
        };
        assert_eq!(shares(2.3, 4.999), [((2, 4), 1.0)]);
        assert_eq!(shares(2.0, 0.5), [((1, 0), 0.5), ((2, 0), 0.5)]);
        assert_eq!(shares(3.0, 2.0).len(), 4);
        for off in [-1e-15, 0.0, 1e-15] {
            for (x, pixels) in [(off, 1), (5.0 + off, 1), (2.0 + 4.0 * off, 2)] {
                let found = shares(x, 1.5);
                assert_eq!(found.len(), pixels, "{x:e}");
                assert!(found.iter().all(|(_, share)| (share - 0.5).abs() < 1e-2), "{found:?}");
            }
        }
        assert_eq!(shares(5.0 + 1e-9, 1.5), []);
        assert_eq!(shares(-1e-9, 1.5), []);
        assert_eq!(shares(2.0 + 1e-9, 1.5), [((2, 1), 1.0)]);
    }
}
