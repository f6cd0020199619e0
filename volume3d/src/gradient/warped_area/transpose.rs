//! The same samples in reverse.

use glam::DVec3;
use rayon::prelude::*;

use super::job::{Job, Partner};
use crate::calculus::{Number, Rgb, Tape};
use crate::gradient::accumulator::Accumulator;
use crate::gradient::auxiliary::MovingBounds;
use crate::gradient::contribution::Source;
use crate::gradient::driver::row_blocks;
use crate::gradient::result::Gradient;
use crate::gradient::reverse::{Inputs, Recorded, Reverse, Sink};
use crate::gradient::{
    AUXILIARY, ActiveParameters, EDGE, EDGE_AUXILIARY, GRADIENT_PATH, Progress, Stopped, Tangent,
};

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
        let inputs = Inputs::new(scene, active);
        let bounds = MovingBounds::new(scene, &active.shapes);
        let rows = self.rows();
        progress.start(rows);
        let mut gradient = Gradient::from(Tangent::still(scene));
        for block in row_blocks(rows) {
            let parts: Vec<Gradient> = block
                .into_par_iter()
                .map(|j| {
                    let part = self.reverse_row(j, adjoint, &inputs, &bounds, progress);
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

    fn reverse_row(
        &self,
        j: usize,
        adjoint: &[DVec3],
        inputs: &Inputs,
        bounds: &MovingBounds,
        progress: &Progress,
    ) -> Gradient {
        let scene = self.paths.scene;
        let mut part = Accumulator::new(scene);
        let (mut tape, mut adjoints) = (Tape::new(), vec![]);
        let mut auxiliary = self.auxiliary(bounds);
        for i in 0..self.columns() {
            for sample in 0..self.method.samples {
                if progress.stopped() {
                    return part.gradient;
                }
                let place = (i, j, sample);
                let mut finite = true;
                for &partner in self.partners() {
                    if let Some(auxiliary) = &mut auxiliary {
                        auxiliary.rng = self.stream(i, j, sample, AUXILIARY);
                    }
                    tape.clear();
                    let mut reverse = Reverse::new(scene, inputs, &tape, auxiliary.take(), self.film);
                    finite &=
                        self.reverse_sample(&mut reverse, place, partner, adjoint, &mut adjoints, &mut part);
                    auxiliary = reverse.auxiliary.take();
                }
                if self.film.is_box() && self.method.warps {
                    if let Some(auxiliary) = &mut auxiliary {
                        auxiliary.rng = self.stream(i, j, sample, EDGE_AUXILIARY);
                    }
                    tape.clear();
                    let mut reverse = Reverse::new(scene, inputs, &tape, auxiliary.take(), self.film);
                    finite &= self.reverse_edge(&mut reverse, place, adjoint, &mut adjoints, &mut part);
                    auxiliary = reverse.auxiliary.take();
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

    /// Whether the sample was finite; if not, it is left out.
    fn reverse_sample<'t>(
        &self,
        reverse: &mut Reverse<'_, 't>,
        (i, j, sample): (usize, usize, usize),
        partner: Partner,
        adjoint: &[DVec3],
        adjoints: &mut Vec<f64>,
        sink: &mut impl Sink,
    ) -> bool {
        let film = &self.film;
        if !film.cell_counts(i, j) {
            return true;
        }
        let frame = &reverse.frame();
        let mut numbers = self.numbers((i, j), sample, GRADIENT_PATH);
        let u = film.point(i, j, partner.within(numbers.pair()));
        let hit = self.camera_hit(u);
        let (point, jacobian) = reverse.film_warp(u, self.method.kernels.film, hit.map(|h| h.triangle));
        let direction = film.direction(frame, point);
        let Rgb(radiance) = self.paths.radiance(reverse, frame.origin, direction, hit, &mut numbers);
        let value = DVec3::from_array(radiance.map(Number::value));
        let warped = [point[0], point[1], jacobian].iter().any(|x| !x.is_still());
        let carried = if warped { self.carried(value, u, hit, (i, j, sample)) } else { value };
        let mut sum = Recorded::constant(0.0);
        film.for_each_pixel(i, j, |_, _, x, y| {
            let weight = film.weight(point, x, y);
            let (delta, level) = (adjoint[y * film.columns + x], self.control_variate(x, y));
            for c in 0..3 {
                let more = Recorded::constant(carried[c] - value[c] - level[c]);
                sum = sum + weight * (radiance[c] + more) * delta[c];
            }
        });
        let outputs = [(sum * jacobian, self.share() / self.method.samples as f64)];
        reverse.sweep_if_finite(&outputs, adjoints, sink)
    }

    /// The same on the edges of box pixels.
    fn reverse_edge(
        &self,
        reverse: &mut Reverse<'_, '_>,
        (i, j, sample): (usize, usize, usize),
        adjoint: &[DVec3],
        adjoints: &mut Vec<f64>,
        sink: &mut impl Sink,
    ) -> bool {
        let mut numbers = self.numbers((i, j), sample, EDGE);
        let (u, vertical) = self.edge_point(i, j, numbers.pair());
        let hit = self.camera_hit(u);
        let (point, _) = reverse.film_warp(u, self.method.kernels.film, hit.map(|h| h.triangle));
        let across = if vertical { point[0] } else { point[1] };
        if !across.is_recorded() {
            return true;
        }
        let radiance = self.still_radiance(u, hit, &mut numbers);
        let mut sum = 0.0;
        self.for_each_side(i, j, vertical, |_, _, x, y, sign| {
            let light = (radiance - self.control_variate(x, y)) * sign;
            sum += adjoint[y * self.film.columns + x].dot(light);
        });
        reverse.sweep_if_finite(&[(across, sum / self.method.samples as f64)], adjoints, sink)
    }
}
