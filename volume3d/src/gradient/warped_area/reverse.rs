//! Reverse mode of warped-area sampling: adjoints by parameter.

use flatland::calculus::{Number, Tape};
use glam::DVec3;

use super::job::{Job, PathNumbers, Place};
use crate::gradient::modes::accumulator::{Accumulator, Sums};
use crate::gradient::modes::reverse::{Inputs, Recorded, Reverse};
use crate::gradient::results::contribution::Source;
use crate::gradient::warp::motion::MovingBounds;
use crate::gradient::{ActiveParameters, Progress, Stopped};

/// Data shared by the rows.
struct Pull<'p> {
    adjoint: &'p [DVec3],
    inputs: Inputs,
    bounds: MovingBounds,
}

impl Job<'_> {
    /// Adds the derivative by every active parameter, without the boundary terms of the warp.
    pub(super) fn reverse(
        &self,
        adjoint: &[DVec3],
        active: &ActiveParameters,
        progress: &Progress,
        sums: &mut Sums,
    ) -> Result<(), Stopped> {
        let scene = self.paths.scene;
        let bounds = MovingBounds::new(scene, &active.shapes, active.implicits.contains(&true));
        let pull = Pull { adjoint, inputs: Inputs::new(scene, active), bounds };
        let (_, rows) = self.film.cells();
        sums.gather(rows, progress, |j, part| self.reverse_row(j, &pull, progress, part))
    }

    fn reverse_row(&self, j: usize, pull: &Pull<'_>, progress: &Progress, part: &mut Accumulator) {
        let (mut tape, mut adjoints) = (Tape::new(), vec![]);
        let (mut auxiliary, mut numbers) = (self.auxiliary(&pull.bounds), self.path_numbers());
        let (columns, _) = self.film.cells();
        // Cells without a pixel of nonzero adjoint contribute nothing.
        let counts = |i: &usize| self.film.reaches(*i, j, |pixel| pull.adjoint[pixel] != DVec3::ZERO);
        let cells =
            (0..columns).filter(|&i| self.film.cell_counts(i, j) || self.has_edges((i, j))).filter(counts);
        for (i, sample) in cells.flat_map(|i| (0..self.samples((i, j))).map(move |s| (i, s))) {
            if progress.stopped() {
                return;
            }
            let place = (i, j, sample);
            numbers.prepare((i, j), self.samples((i, j)));
            let mut finite = true;
            let mut record = |edge: bool| {
                tape.clear();
                let mut reverse = Reverse::new(self.paths.scene, &pull.inputs, &tape, auxiliary.as_mut());
                let outputs = if edge {
                    self.edge_outputs(&mut reverse, place, pull.adjoint)
                } else {
                    vec![self.output(&mut reverse, place, &mut numbers, pull.adjoint)]
                };
                let outputs = outputs.as_slice();
                finite &= outputs.is_empty() || reverse.sweep_if_finite(outputs, &mut adjoints, part);
            };
            if self.film.cell_counts(i, j) {
                record(false);
            }
            if self.has_edges((i, j)) {
                record(true);
            }
            let at = self.film.located(i, j, sample);
            part.end_sample(at, Source::Path);
            if !finite {
                part.leave_out(at);
            }
        }
    }

    /// Σ over pixels and channels of adjoint times integrand, and its weight in the mean over samples.
    fn output<'t>(
        &self,
        reverse: &mut Reverse<'_, 't>,
        place: Place,
        numbers: &mut PathNumbers,
        adjoint: &[DVec3],
    ) -> (Recorded<'t>, f64) {
        let frame = self.film.moving_frame(reverse);
        let sample = self.sample(reverse, &frame, place, numbers);
        // Results of these numbers appear on the tape only through their derivatives.
        let partials = sample.parts().flat_map(|part| self.partials(place, part, adjoint));
        let sum = partials.fold(Recorded::constant(0.0), |sum, (x, d)| sum + x.chain(x.value() * d, d));
        (sum, 1.0 / self.samples((place.0, place.1)) as f64)
    }

    /// The same of an edge of box pixels, or of a border that cuts filters, for every part of its light.
    fn edge_outputs<'t>(
        &self,
        reverse: &mut Reverse<'_, 't>,
        place: Place,
        adjoint: &[DVec3],
    ) -> Vec<(Recorded<'t>, f64)> {
        let mut outputs = vec![];
        self.edge_samples(reverse, place, |sample| {
            let mut sum = 0.0;
            self.for_each_side(place, &sample, |[_, x, y], light| {
                sum += adjoint[y * self.film.columns + x].dot(light);
            });
            outputs.push((sample.across, sum / self.samples((place.0, place.1)) as f64));
        });
        outputs
    }
}
