//! Camera rays of a cell's samples, traced in packets.

use std::ops::Range;

use glam::{DVec2, DVec3};

use crate::gradient::film::FilmPlane;
use crate::gradient::run::groups::CellNumbers;
use crate::scene::{Hit, Scene};

/// Rays of a cell traced together, with one origin and a narrow cone: the size of a packet.
pub(in crate::gradient) const TOGETHER: usize = 16;

/// Rays through film points, and what they hit: bit for bit that of rays traced alone.
#[derive(Default)]
pub(in crate::gradient) struct CameraRays {
    directions: Vec<DVec3>,
    hits: Vec<Option<Hit>>,
    packet: Vec<Option<Hit>>,
}

impl CameraRays {
    pub(in crate::gradient) fn clear(&mut self) {
        self.directions.clear();
        self.hits.clear();
    }

    /// Traces a packet of rays of a pinhole camera, at most [`TOGETHER`] of one cell.
    pub(in crate::gradient) fn trace(
        &mut self,
        scene: &Scene,
        film: &FilmPlane,
        points: impl IntoIterator<Item = DVec2>,
    ) {
        let first = self.directions.len();
        self.directions.extend(points.into_iter().map(|u| film.ray(u)));
        let origin = film.still.origin.value();
        scene.closest_bundle(origin, &self.directions[first..], None, &mut self.packet);
        self.hits.extend_from_slice(&self.packet);
    }

    /// Traces one ray from a point of a lens.
    pub(in crate::gradient) fn trace_from(&mut self, scene: &Scene, origin: DVec3, direction: DVec3) {
        self.directions.push(direction);
        self.hits.push(scene.closest(origin, direction, None));
    }

    /// Direction and hit of a ray, in the order in which they were traced.
    pub(in crate::gradient) fn get(&self, index: usize) -> (DVec3, Option<Hit>) {
        (self.directions[index], self.hits[index])
    }
}

/// The rays of some samples of a cell, traced when one of them is asked for.
#[derive(Default)]
pub(in crate::gradient) struct CellRays {
    cell: (usize, usize),
    samples: Range<usize>,
    rays: CameraRays,
}

impl CellRays {
    /// Ray and hit of one sample of a cell, given the random numbers of its paths.
    pub(in crate::gradient) fn of(
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
            self.rays.clear();
            self.rays.trace(scene, film, self.samples.clone().map(point));
        }
        self.rays.get(sample - self.samples.start)
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
        let mut rays = CellRays::default();
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
