//! The same samples in reverse: the adjoints of their numbers, by parameter.

use glam::DVec3;
use rayon::prelude::*;

use super::job::{Job, Place};
use crate::calculus::{Number, Tape};
use crate::gradient::accumulator::Accumulator;
use crate::gradient::auxiliary::MovingBounds;
use crate::gradient::contribution::Source;
use crate::gradient::driver::row_blocks;
use crate::gradient::result::Gradient;
use crate::gradient::reverse::{Inputs, Recorded, Reverse};
use crate::gradient::{ActiveParameters, Progress, Stopped, Tangent};

/// What the rows share.
struct Pull<'p> {
    adjoint: &'p [DVec3],
    inputs: Inputs,
    bounds: MovingBounds,
}

impl Job<'_> {
    /// The derivative by every active parameter, but for the boundary terms that go with the warp; normals that are
    /// computed from positions are yet to be pulled back.
    pub(super) fn reverse(
        &self,
        adjoint: &[DVec3],
        active: &ActiveParameters,
        progress: &Progress,
    ) -> Result<Gradient, Stopped> {
        let scene = self.paths.scene;
        let bounds = MovingBounds::new(scene, &active.shapes);
        let pull = Pull { adjoint, inputs: Inputs::new(scene, active), bounds };
        let rows = self.film.rows + 2 * self.film.reach;
        progress.start(rows);
        let mut gradient = Gradient::from(Tangent::still(scene));
        for block in row_blocks(rows) {
            let parts: Vec<Gradient> = block
                .into_par_iter()
                .map(|j| {
                    let part = self.reverse_row(j, &pull, progress);
                    progress.advance();
                    part
                })
                .collect();
            if progress.stopped() {
                return Err(Stopped);
            }
            parts.into_iter().for_each(|part| gradient.absorb(part));
        }
        Ok(gradient)
    }

    fn reverse_row(&self, j: usize, pull: &Pull<'_>, progress: &Progress) -> Gradient {
        let mut part = Accumulator::new(self.paths.scene);
        let (mut tape, mut adjoints) = (Tape::new(), vec![]);
        let mut auxiliary = self.auxiliary(&pull.bounds);
        for i in 0..self.film.columns + 2 * self.film.reach {
            for sample in 0..self.method.samples {
                if progress.stopped() {
                    return part.gradient;
                }
                let place = (i, j, sample);
                let mut finite = true;
                let mut record = |edge: bool| {
                    tape.clear();
                    let scene = self.paths.scene;
                    let mut reverse = Reverse::new(scene, &pull.inputs, &tape, auxiliary.as_mut(), self.film);
                    let output = if edge {
                        self.edge_output(&mut reverse, place, pull.adjoint)
                    } else {
                        Some(self.output(&mut reverse, place, pull.adjoint))
                    };
                    finite &= output.is_none_or(|o| reverse.sweep_if_finite(&[o], &mut adjoints, &mut part));
                };
                if self.film.cell_counts(i, j) {
                    record(false);
                }
                if self.has_edges() {
                    record(true);
                }
                let at = self.film.located(i, j, sample);
                part.end_sample(at, Source::Path);
                if !finite {
                    part.gradient.non_finite.push(at);
                }
            }
        }
        part.gradient
    }

    /// Σ over pixels and channels of adjoint times integrand, and what it counts in the mean of all samples.
    fn output<'t>(
        &self,
        reverse: &mut Reverse<'_, 't>,
        place: Place,
        adjoint: &[DVec3],
    ) -> (Recorded<'t>, f64) {
        let frame = self.film.moving_frame(&self.paths.scene.description.camera, reverse);
        let sample = self.sample(reverse, &frame, place);
        let mut sum = Recorded::constant(0.0);
        self.for_each_pixel(place, &sample, |[_, x, y], _, integrand| {
            let delta = adjoint[y * self.film.columns + x];
            for c in 0..3 {
                sum = sum + integrand[c] * delta[c];
            }
        });
        (sum, 1.0 / self.method.samples as f64)
    }

    /// The same of an edge of box pixels.
    fn edge_output<'t>(
        &self,
        reverse: &mut Reverse<'_, 't>,
        place: Place,
        adjoint: &[DVec3],
    ) -> Option<(Recorded<'t>, f64)> {
        let sample = self.edge_sample(reverse, place)?;
        let mut sum = 0.0;
        self.for_each_side(place, &sample, |[_, x, y], light| {
            sum += adjoint[y * self.film.columns + x].dot(light);
        });
        Some((sample.across, sum / self.method.samples as f64))
    }
}
