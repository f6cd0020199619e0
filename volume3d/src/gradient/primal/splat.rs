//! Splatting of a cell's samples to the pixels around it.

use glam::DVec3;

use crate::gradient::film::film_accumulator::RowSums;
use crate::gradient::film::{FilmPlane, NEAR};
use crate::lanes::{Lanes, Task};

/// Samples whose weights are computed together.
const TOGETHER: usize = 8;

/// Samples of a class in a cell, for a filter that reaches at most one cell around a pixel.
pub(super) struct Splat<'a> {
    pub(super) film: &'a FilmPlane,
    pub(super) cell: (usize, usize),
    pub(super) class: usize,
    /// Positions in the cell.
    pub(super) places: &'a [[f64; 2]],
    /// Finite radiances.
    pub(super) radiances: &'a [DVec3],
    pub(super) row_sums: &'a mut RowSums<3>,
}

impl Task for Splat<'_> {
    type Output = ();

    /// Sums are kept in registers; samples are added to each in their original order.
    #[inline(always)]
    fn run<L: Lanes>(self, _: L) {
        let Self { film, cell: (i, j), class, places, radiances, row_sums } = self;
        let mut sums = [[[0.0; 4]; NEAR]; NEAR];
        for (b, sums) in sums.iter_mut().enumerate() {
            for (a, sum) in sums.iter_mut().enumerate() {
                if let Some(x) = film.pixel_column(i, a) {
                    sum[..3].copy_from_slice(row_sums.at(class, b, x));
                    sum[3] = row_sums.weight_at(class, b, x).map_or(0.0, |weight| *weight);
                }
            }
        }
        let mut light = [0.0; 4];
        for (places, radiances) in places.chunks(TOGETHER).zip(radiances.chunks(TOGETHER)) {
            let mut within = [[0.0; 2]; TOGETHER];
            within[..places.len()].copy_from_slice(places);
            let [columns, rows] = film.weights_near((i, j), &within);
            for (at, radiance) in radiances.iter().enumerate() {
                // The last one is the weight itself.
                let radiance = [radiance.x, radiance.y, radiance.z, 1.0];
                for c in 0..4 {
                    light[c] += radiance[c];
                }
                for b in 0..NEAR {
                    for a in 0..NEAR {
                        let weight = columns[a][at % TOGETHER] * rows[b][at % TOGETHER];
                        for c in 0..4 {
                            sums[b][a][c] += weight * radiance[c];
                        }
                    }
                }
            }
        }
        for (b, sums) in sums.iter().enumerate() {
            for (a, sum) in sums.iter().enumerate() {
                if let Some(x) = film.pixel_column(i, a) {
                    row_sums.at(class, b, x).copy_from_slice(&sum[..3]);
                    if let Some(weight) = row_sums.weight_at(class, b, x) {
                        *weight = sum[3];
                    }
                }
            }
        }
        row_sums.add_light(film, (i, j), class, DVec3::new(light[0], light[1], light[2]));
    }
}
