//! Camera rays of a cell's samples, traced in groups.

use std::ops::Range;

use glam::DVec3;

use crate::gradient::film::FilmPlane;
use crate::gradient::groups::CellNumbers;
use crate::scene::{Hit, Scene};

/// Rays traced together through the hierarchy.
const TOGETHER: usize = 16;

/// Rays of some samples of a cell.
#[derive(Default)]
pub(super) struct CameraRays {
    cell: (usize, usize),
    samples: Range<usize>,
    directions: Vec<DVec3>,
    hits: Vec<Option<Hit>>,
}

impl CameraRays {
    /// Ray and hit of one sample of a cell, given the random numbers of its paths: bit for bit those of a ray
    /// traced alone.
    pub(super) fn of(
        &mut self,
        scene: &Scene,
        film: &FilmPlane,
        (i, j, sample): (usize, usize, usize),
        samples: usize,
        numbers: &CellNumbers,
    ) -> (DVec3, Option<Hit>) {
        if self.cell != (i, j) || !self.samples.contains(&sample) {
            self.cell = (i, j);
            self.samples = sample..samples.min(sample + TOGETHER);
            let point = |sample| film.point(i, j, numbers.of(sample, 0).1.pair());
            self.directions.clear();
            self.directions.extend(self.samples.clone().map(|sample| film.ray(point(sample))));
            scene.closest_bundle(film.still.origin.value(), &self.directions, None, &mut self.hits);
        }
        let place = sample - self.samples.start;
        (self.directions[place], self.hits[place])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gradient::tests::scenes::square;
    use crate::scene::Filter;

    /// More samples than are traced together, cell after cell, and a previous cell again.
    #[test]
    fn rays_of_a_cell_are_those_one_by_one() {
        let scene = square(Filter::Tent { radius: 1.0 });
        let (film, samples) = (FilmPlane::new(&scene), TOGETHER + 5);
        let mut numbers = CellNumbers::new(3, 1, 1, 2);
        let mut rays = CameraRays::default();
        let (mut met, mut missed) = (0, 0);
        let (columns, rows) = film.cells();
        let cells = (0..rows).flat_map(|j| (0..columns).map(move |i| (i, j)));
        for (i, j) in cells.chain([(0, 0), (1, 1)]) {
            numbers.prepare((i, j), samples);
            for sample in 0..samples {
                let u = film.point(i, j, numbers.of(sample, 0).1.pair());
                let direction = film.ray(u);
                let alone = scene.closest(film.still.origin.value(), direction, None);
                let (ray, hit) = rays.of(&scene, &film, (i, j, sample), samples, &numbers);
                assert_eq!(ray, direction);
                let distance = |hit: Option<Hit>| hit.map(|h| (h.surface, h.distance.to_bits()));
                assert_eq!(distance(hit), distance(alone));
                met += usize::from(hit.is_some());
                missed += usize::from(hit.is_none());
            }
        }
        assert!(met > 100 && missed > 100, "{met} {missed}");
    }
}
