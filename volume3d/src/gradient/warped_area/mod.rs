//! Warped-area sampling: dI/dθ = ∫ ∂f/∂θ + ∇·(V f), with V from auxiliary rays at every bounce.

use flatland::random::stream;
use flatland::warp::{Debias, Warp};
use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::auxiliary::{Auxiliary, Construction, MovingBounds};
use super::change::{Change, Wanted, supported};
use super::driver::{CellSink, over_film, waves};
use super::error::GradientError;
use super::film::FilmPlane;
use super::forward::Forward;
use super::groups::numbers;
use super::motion::Motion;
use super::primal::primal;
use super::progress::{Progress, Stopped};
use super::result::{GradientImage, Image, finish, quantities};
use super::reverse::{Inputs, Recorded, Reverse, Sink};
use super::{AUXILIARY, BASELINE, EDGE, EDGE_AUXILIARY, PATH};
use crate::calculus::{Dual, Frame, Number, Rgb, Tape};
use crate::path::{Kernels, Paths, Plain, Sequence};
use crate::scene::Scene;

/// Warped-area sampling (Bangaru, Li and Durand 2020) along paths.
#[derive(Clone, Debug)]
pub struct WarpedArea {
    /// Samples a pixel.
    pub samples: usize,
    /// Samples a pixel of the image that is subtracted as a control variate: ∫ ∇·(h V) du = 0, so radiance may
    /// be counted from any level that does not depend on the samples. 0 subtracts nothing.
    pub baseline: usize,
    /// The warp, on the film and on directions alike.
    pub warp: Warp,
    /// Its concentrations.
    pub kernels: Kernels,
    /// Whether velocities on directions fade away from jumps, V_i (1 − B_i).
    pub fades: bool,
    /// False leaves out the warp, and with it primary and secondary term: the interior term alone.
    pub warps: bool,
    /// The seed of everything random.
    pub seed: u64,
}

impl Default for WarpedArea {
    fn default() -> Self {
        Self {
            samples: 16,
            baseline: 4,
            warp: Warp { debias: DEBIAS, ..Warp::default() },
            kernels: Kernels::default(),
            fades: true,
            warps: true,
            seed: 0,
        }
    }
}

/// Along paths the error of one sample is large beside that of its warp, and a level that is drawn rarely counts
/// for much when it is: blocks are larger, and levels rarer, than the plane's default.
const DEBIAS: Debias = Debias::Multilevel { rays: 16, first: 0.1, ratio: 0.35 };

/// What every sample of one gradient shares.
struct Job<'s> {
    method: &'s WarpedArea,
    paths: Paths<'s>,
    film: FilmPlane,
    baseline: Image,
    construction: Construction,
}

impl WarpedArea {
    /// The derivative of every pixel along a change.
    ///
    /// # Errors
    /// [`GradientError`], for what cannot be differentiated and bad parameters.
    pub fn forward(
        &self,
        scene: &Scene,
        change: &Change,
        progress: &Progress,
    ) -> Result<GradientImage, GradientError> {
        self.image::<1, 6>(scene, change, self.construction(), progress)
    }

    /// The same, with interior, primary and secondary term apart.
    ///
    /// # Errors
    /// [`GradientError`], for what cannot be differentiated and bad parameters.
    pub fn forward_terms(
        &self,
        scene: &Scene,
        change: &Change,
        progress: &Progress,
    ) -> Result<GradientImage, GradientError> {
        self.image::<3, 15>(scene, change, self.construction(), progress)
    }

    /// Σ over pixels and channels of adjoint · dI/dθ, for every wanted parameter θ at once: the transpose of
    /// [`forward`](Self::forward), with the same random numbers.
    ///
    /// # Errors
    /// [`GradientError`], for what cannot be differentiated and bad parameters.
    pub fn reverse(
        &self,
        scene: &Scene,
        adjoint: &[DVec3],
        wanted: &Wanted,
        progress: &Progress,
    ) -> Result<Change, GradientError> {
        self.pull(scene, adjoint, wanted, self.construction(), progress)
    }

    fn construction(&self) -> Construction {
        Construction::Weighted { fades: self.fades }
    }

    pub(super) fn pull(
        &self,
        scene: &Scene,
        adjoint: &[DVec3],
        wanted: &Wanted,
        construction: Construction,
        progress: &Progress,
    ) -> Result<Change, GradientError> {
        let (width, height) = scene.size();
        if adjoint.len() != width * height {
            return Err(GradientError::Adjoint { found: adjoint.len(), width, height });
        }
        self.check(scene, wanted.is_geometric(), 1)?;
        let job = self.job(scene, construction, progress)?;
        let inputs = Inputs::new(scene, wanted);
        let bounds = MovingBounds::new(scene, &wanted.shapes);
        let rows = job.rows();
        progress.start(rows);
        let mut gradient = Change::still(scene);
        for wave in waves(rows) {
            let parts: Vec<Change> = wave
                .into_par_iter()
                .map(|j| {
                    let part = job.reverse_row(j, adjoint, &inputs, &bounds, progress);
                    progress.advance();
                    part
                })
                .collect();
            if progress.stopped() {
                return Err(Stopped.into());
            }
            parts.iter().for_each(|part| gradient.add(part));
        }
        gradient.pull_normals(scene, wanted);
        Ok(gradient)
    }

    fn check(&self, scene: &Scene, geometric: bool, least: usize) -> Result<(), GradientError> {
        if geometric && self.warps {
            supported(scene)?;
        }
        for kappa in [self.kernels.film, self.kernels.surface, self.kernels.relative] {
            self.warp.check(kappa)?;
        }
        if self.samples < least {
            return Err(GradientError::Samples { samples: self.samples, least });
        }
        Ok(())
    }

    fn job<'s>(
        &'s self,
        scene: &'s Scene,
        construction: Construction,
        progress: &Progress,
    ) -> Result<Job<'s>, GradientError> {
        let paths = Paths::new(scene, self.kernels);
        let (width, height) = scene.size();
        let baseline = match self.baseline {
            0 => Image { width, height, pixels: vec![], standard_error: vec![], non_finite: vec![] },
            samples => primal(&paths, samples, self.seed ^ BASELINE, progress)?,
        };
        let film = FilmPlane::new(scene);
        Ok(Job { method: self, paths, film, baseline, construction })
    }

    pub(super) fn image<const N: usize, const K: usize>(
        &self,
        scene: &Scene,
        change: &Change,
        construction: Construction,
        progress: &Progress,
    ) -> Result<GradientImage, GradientError> {
        if !change.fits(scene) {
            return Err(GradientError::Change);
        }
        self.check(scene, change.is_geometric(), 1)?;
        let job = self.job(scene, construction, progress)?;
        let motion = Motion::new(scene, change);
        let begin = || {
            let auxiliary = job.auxiliary(&motion.bounds);
            Forward::<N> { scene, motion: &motion, auxiliary }
        };
        let cell = |forward: &mut Forward<'_, N>, place, sink: CellSink<'_, K>| {
            job.forward_cell(forward, place, sink);
        };
        let rays = |forward: &Forward<'_, N>| forward.auxiliary.as_ref().map_or(0, |a| a.rays);
        let sums = over_film(&job.film, self.samples, progress, begin, cell, rays)?;
        Ok(finish::<N, K>(&job.film, sums))
    }
}

impl Job<'_> {
    fn rows(&self) -> usize {
        self.film.rows + 2 * self.film.reach
    }

    fn columns(&self) -> usize {
        self.film.columns + 2 * self.film.reach
    }

    fn baseline(&self, x: usize, y: usize) -> DVec3 {
        if self.method.baseline == 0 { DVec3::ZERO } else { self.baseline.pixels[y * self.film.columns + x] }
    }

    fn auxiliary<'a>(&'a self, bounds: &'a MovingBounds) -> Option<Auxiliary<'a>> {
        let method = self.method;
        method.warps.then(|| {
            let rng = stream(method.seed, &[AUXILIARY]);
            Auxiliary::new(&self.paths, &method.warp, bounds, self.construction, rng)
        })
    }

    fn forward_cell<const N: usize, const K: usize>(
        &self,
        forward: &mut Forward<'_, N>,
        (i, j): (usize, usize),
        mut sink: CellSink<'_, K>,
    ) {
        let frame = forward.frame(&self.film);
        for sample in 0..self.method.samples {
            if let Some(auxiliary) = &mut forward.auxiliary {
                auxiliary.rng = self.stream(i, j, sample, AUXILIARY);
            }
            self.forward_sample::<N, K>(forward, &frame, (i, j, sample), &mut sink);
            if self.film.is_box() && self.method.warps {
                self.forward_edge::<N, K>(forward, &frame, (i, j, sample), &mut sink);
            }
        }
    }

    fn numbers(&self, cell: (usize, usize), sample: usize, purpose: u64) -> Sequence {
        numbers(self.method.seed, cell, sample, self.method.samples, purpose)
    }

    fn stream(&self, i: usize, j: usize, sample: usize, purpose: u64) -> flatland::random::Stream {
        stream(self.method.seed, &[i as u64, j as u64, sample as u64, purpose])
    }

    /// h(u) J (L − L₀) of one sample for every pixel it reaches.
    fn forward_sample<const N: usize, const K: usize>(
        &self,
        forward: &mut Forward<'_, N>,
        frame: &Frame<Dual<N>>,
        (i, j, sample): (usize, usize, usize),
        sink: &mut CellSink<'_, K>,
    ) {
        let film = &self.film;
        if !film.cell_counts(i, j) {
            return;
        }
        let mut numbers = self.numbers((i, j), sample, PATH);
        let u = film.point(i, j, numbers.pair());
        let (point, jacobian) = forward.film_warp(film, u, self.method.kernels.film);
        let direction = film.direction(frame, point);
        let hit = self.paths.closest(frame.origin.value(), direction.value(), None);
        let Rgb(radiance) = self.paths.radiance(forward, frame.origin, direction, hit, &mut numbers);
        let mut finite = true;
        film.for_each_pixel(i, j, |_, _, x, y| {
            let weight = film.weight(point, x, y) * jacobian;
            let sum: f64 = radiance.iter().map(|l| (*l * weight).tangent.iter().sum::<f64>() + l.value).sum();
            finite &= sum.is_finite();
        });
        if !finite {
            sink.non_finite.push(film.located(i, j, sample));
            return;
        }
        film.for_each_pixel(i, j, |_, b, x, y| {
            let weight = film.weight(point, x, y);
            let level = self.baseline(x, y);
            let value = DVec3::from_array(radiance.map(|l| l.value)) * weight.value;
            let weighted = weight * jacobian;
            let channels: [[f64; N]; 3] =
                std::array::from_fn(|c| ((radiance[c] - Dual::constant(level[c])) * weighted).tangent);
            sink.strip.add(sample, b, x, &quantities::<N, K>(value, channels));
        });
    }

    /// −∮ (L − L₀) V·ν over the edges of box pixels: the filter's own jump does not move (Bangaru et al. 2022).
    fn forward_edge<const N: usize, const K: usize>(
        &self,
        forward: &mut Forward<'_, N>,
        frame: &Frame<Dual<N>>,
        (i, j, sample): (usize, usize, usize),
        sink: &mut CellSink<'_, K>,
    ) {
        let film = &self.film;
        if let Some(auxiliary) = &mut forward.auxiliary {
            auxiliary.rng = self.stream(i, j, sample, EDGE_AUXILIARY);
        }
        let mut numbers = self.numbers((i, j), sample, EDGE);
        let (u, vertical) = self.edge_point(i, j, numbers.pair());
        let (point, _) = forward.film_warp(film, u, self.method.kernels.film);
        let across = if vertical { point[0] } else { point[1] };
        if across.tangent == [0.0; N] {
            return;
        }
        let radiance = self.still_radiance(frame.origin.value(), u, &mut numbers);
        if !(radiance * across.tangent.iter().sum::<f64>()).is_finite() {
            sink.non_finite.push(film.located(i, j, sample));
            return;
        }
        self.for_each_side(i, j, vertical, |_, b, x, y, sign| {
            let light = (radiance - self.baseline(x, y)) * sign;
            let channels: [[f64; N]; 3] = std::array::from_fn(|c| across.tangent.map(|v| light[c] * v));
            sink.strip.add(sample, b, x, &quantities::<N, K>(DVec3::ZERO, channels));
        });
    }

    /// A point on the left or the upper edge of a cell, one or the other.
    fn edge_point(&self, i: usize, j: usize, [choice, along]: [f64; 2]) -> (DVec2, bool) {
        let vertical = choice < 0.5;
        let within = if vertical { [0.0, along] } else { [along, 0.0] };
        (self.film.point(i, j, within), vertical)
    }

    /// The radiance seen through a film point.
    fn still_radiance(&self, origin: DVec3, u: DVec2, numbers: &mut Sequence) -> DVec3 {
        let frame = self.film.frame(&self.paths.scene.description.camera);
        let direction = self.film.direction(&frame, [u.x, u.y]);
        let hit = self.paths.closest(origin, direction.value(), None);
        let mut plain = Plain { scene: self.paths.scene };
        self.paths.radiance(&mut plain, frame.origin, direction, hit, numbers).value()
    }

    /// The pixels on both sides of a cell's left or upper edge, each with the weight of the sample: twice, as
    /// only one of two edges is chosen, and −ν out of the pixel.
    fn for_each_side(
        &self,
        i: usize,
        j: usize,
        vertical: bool,
        mut f: impl FnMut(usize, usize, usize, usize, f64),
    ) {
        let film = &self.film;
        let before = if vertical { (0, 1) } else { (1, 0) };
        for ((a, b), sign) in [((1, 1), 2.0), (before, -2.0)] {
            if let (Some(x), Some(y)) = (film.pixel_column(i, a), film.pixel_row(j, b)) {
                f(a, b, x, y, sign);
            }
        }
    }

    fn reverse_row(
        &self,
        j: usize,
        adjoint: &[DVec3],
        inputs: &Inputs,
        bounds: &MovingBounds,
        progress: &Progress,
    ) -> Change {
        let scene = self.paths.scene;
        let mut part = Change::still(scene);
        let mut tape = Tape::new();
        let mut adjoints = vec![];
        for i in 0..self.columns() {
            if progress.stopped() {
                break;
            }
            for sample in 0..self.method.samples {
                let mut auxiliary = self.auxiliary(bounds);
                if let Some(auxiliary) = &mut auxiliary {
                    auxiliary.rng = self.stream(i, j, sample, AUXILIARY);
                }
                tape.clear();
                let mut reverse = Reverse::new(scene, inputs, &tape, auxiliary, self.film);
                let frame = reverse.frame();
                self.reverse_sample(&mut reverse, &frame, (i, j, sample), adjoint, &mut adjoints, &mut part);
                if self.film.is_box() && self.method.warps {
                    self.reverse_edge(&mut reverse, (i, j, sample), adjoint, &mut adjoints, &mut part);
                }
            }
        }
        part
    }

    fn reverse_sample<'t>(
        &self,
        reverse: &mut Reverse<'_, 't>,
        frame: &Frame<Recorded<'t>>,
        (i, j, sample): (usize, usize, usize),
        adjoint: &[DVec3],
        adjoints: &mut Vec<f64>,
        sink: &mut impl Sink,
    ) {
        let film = &self.film;
        if !film.cell_counts(i, j) {
            return;
        }
        let mut numbers = self.numbers((i, j), sample, PATH);
        let u = film.point(i, j, numbers.pair());
        let (point, jacobian) = reverse.film_warp(u, self.method.kernels.film);
        let direction = film.direction(frame, point);
        let hit = self.paths.closest(frame.origin.value(), direction.value(), None);
        let Rgb(radiance) = self.paths.radiance(reverse, frame.origin, direction, hit, &mut numbers);
        let mut sum = Recorded::constant(0.0);
        film.for_each_pixel(i, j, |_, _, x, y| {
            let weight = film.weight(point, x, y);
            let (delta, level) = (adjoint[y * film.columns + x], self.baseline(x, y));
            for c in 0..3 {
                sum = sum + weight * (radiance[c] - Recorded::constant(level[c])) * delta[c];
            }
        });
        let outputs = [(sum * jacobian, 1.0 / self.method.samples as f64)];
        if outputs[0].0.value().is_finite() {
            reverse.sweep(&outputs, adjoints, sink);
        }
    }

    fn reverse_edge(
        &self,
        reverse: &mut Reverse<'_, '_>,
        (i, j, sample): (usize, usize, usize),
        adjoint: &[DVec3],
        adjoints: &mut Vec<f64>,
        sink: &mut impl Sink,
    ) {
        if let Some(auxiliary) = &mut reverse.auxiliary {
            auxiliary.rng = self.stream(i, j, sample, EDGE_AUXILIARY);
        }
        let mut numbers = self.numbers((i, j), sample, EDGE);
        let (u, vertical) = self.edge_point(i, j, numbers.pair());
        let (point, _) = reverse.film_warp(u, self.method.kernels.film);
        let across = if vertical { point[0] } else { point[1] };
        if !across.is_recorded() {
            return;
        }
        let radiance = self.still_radiance(self.paths.scene.description.camera.origin, u, &mut numbers);
        let mut sum = 0.0;
        self.for_each_side(i, j, vertical, |_, _, x, y, sign| {
            let light = (radiance - self.baseline(x, y)) * sign;
            sum += adjoint[y * self.film.columns + x].dot(light);
        });
        if sum.is_finite() {
            reverse.sweep(&[(across, sum / self.method.samples as f64)], adjoints, sink);
        }
    }
}

impl Sink for Change {
    fn position(&mut self, index: u32, covector: DVec3) {
        self.positions[index as usize] += covector;
    }

    fn normal(&mut self, index: u32, covector: DVec3) {
        self.normals[index as usize] += covector;
    }

    fn rest(&mut self) -> &mut Change {
        self
    }
}
