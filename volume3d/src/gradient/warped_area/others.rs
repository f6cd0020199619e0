//! Additional paths of split samples, without derivatives, traced in waves over neighbouring cells.
//!
//! Cells of a square share their random numbers, so that such paths are coherent.

use glam::DVec3;

use super::job::{Place, SPLITTING};
use crate::gradient::run::groups::CellNumbers;
use crate::path::{Paths, Wave, WaveTables};
use crate::scene::{Hit, traced_by_this_thread};

/// Number of samples below which additional paths are traced individually.
const FEWEST: usize = 8;

/// Split samples of some cells of one square.
pub(super) struct Others<'p> {
    paths: &'p Paths<'p>,
    origin: DVec3,
    wave: Wave<'p>,
    waiting: Vec<Waiting>,
}

/// A sample whose additional paths have not been traced yet.
struct Waiting {
    /// Index of the sample in the result.
    index: usize,
    place: Place,
    /// Number of samples of its cell.
    samples: usize,
    direction: DVec3,
    hit: Option<Hit>,
}

impl Waiting {
    /// Key shared by paths that draw the same numbers.
    fn key(&self) -> (usize, usize) {
        (self.samples, self.place.2)
    }
}

impl<'p> Others<'p> {
    pub(super) fn new(paths: &'p Paths<'p>, tables: &'p WaveTables) -> Self {
        let origin = paths.scene.camera().origin;
        Self { paths, origin, wave: Wave::new(paths, tables), waiting: vec![] }
    }

    /// Adds a sample of a cell, with its ray's direction and hit, to be traced later.
    pub(super) fn wait(
        &mut self,
        index: usize,
        place: Place,
        samples: usize,
        (direction, hit): (DVec3, Option<Hit>),
    ) {
        self.waiting.push(Waiting { index, place, samples, direction, hit });
    }

    /// Traces all waiting paths. Calls back with the sample's index, the sum of their radiance, the column of
    /// the cell and the number of rays traced.
    pub(super) fn follow(
        &mut self,
        numbers: &mut CellNumbers,
        mut found: impl FnMut(usize, DVec3, usize, u64),
    ) {
        let Self { paths, origin, wave, waiting } = self;
        waiting.sort_by_key(Waiting::key);
        let alike = waiting.chunk_by(|a, b| a.key() == b.key());
        for together in alike.flat_map(|alike| alike.chunks(Wave::MOST)) {
            let &Waiting { place: (i, j, sample), samples, .. } = &together[0];
            numbers.prepare((i, j), samples);
            if together.len() < FEWEST {
                for one in together {
                    let before = traced_by_this_thread();
                    let draws = (0..SPLITTING - 1).map(|other| numbers.of(sample, other).1);
                    let light = paths.still_radiances(*origin, one.direction, one.hit, draws);
                    found(one.index, light, one.place.0, traced_by_this_thread() - before);
                }
                continue;
            }
            let (mut light, mut traced) = ([DVec3::ZERO; Wave::MOST], [0; Wave::MOST]);
            for other in 0..SPLITTING - 1 {
                let mut radiances = [DVec3::ZERO; Wave::MOST];
                let rays = together.iter().map(|one| (one.direction, one.hit));
                let (_, draws) = numbers.of(sample, other);
                wave.radiances_alike(*origin, rays, draws, &mut radiances[..together.len()]);
                light.iter_mut().zip(radiances).for_each(|(light, radiance)| *light += radiance);
                traced.iter_mut().zip(wave.traced()).for_each(|(traced, more)| *traced += more);
            }
            for (at, one) in together.iter().enumerate() {
                found(one.index, light[at], one.place.0, traced[at]);
            }
        }
        waiting.clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gradient::film::FilmPlane;
    use crate::gradient::tests::scenes::room;
    use crate::path::Kernels;
    use crate::scene::{Filter, Scene};

    /// Bit for bit, and with equally many rays: for few samples and for many, in cells with different numbers
    /// of them.
    #[test]
    fn paths_side_by_side_find_what_they_find_alone() {
        let mut description = room(Filter::Tent { radius: 1.0 }).description;
        description.film.width = 12;
        let scene = Scene::new(description).unwrap();
        let (paths, film) = (Paths::new(&scene, Kernels::default()), FilmPlane::new(&scene));
        let tables = WaveTables::new(&paths).expect("the scene is plain");
        let mut numbers = CellNumbers::new(3, 1, SPLITTING - 1, paths.pairs());
        let mut others = Others::new(&paths, &tables);
        let origin = film.still.origin.value();
        let (mut expected, mut lit) = (vec![], 0);
        let (columns, rows) = film.cells();
        let alike = columns - columns.div_ceil(7);
        assert!((FEWEST..=Wave::MOST).contains(&alike), "{alike} go together");
        for (i, j) in (0..rows / 2).flat_map(|j| (0..columns).map(move |i| (i, j))) {
            let samples = if i % 7 == 0 { 3 } else { 4 };
            numbers.prepare((i, j), samples);
            for sample in 0..samples {
                let direction = film.ray(film.point(i, j, [0.3, 0.6]));
                let hit = scene.closest(origin, direction, None);
                let before = traced_by_this_thread();
                let draws = (0..SPLITTING - 1).map(|other| numbers.of(sample, other).1);
                let light = paths.still_radiances(origin, direction, hit, draws);
                others.wait(expected.len(), (i, j, sample), samples, (direction, hit));
                expected.push((light, i, traced_by_this_thread() - before));
                lit += usize::from(hit.is_some() && light != DVec3::ZERO);
            }
            // A row is within one square.
            if i + 1 == columns {
                let mut found = vec![None; expected.len()];
                others.follow(&mut numbers, |index, light, column, traced| {
                    found[index] = Some((light, column, traced));
                });
                assert_eq!(found, expected.drain(..).map(Some).collect::<Vec<_>>());
            }
        }
        assert!(lit > 30, "{lit}");
    }
}
