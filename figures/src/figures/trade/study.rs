//! The scene of the study, and what is measured of a method on it.

use std::time::Instant;

use anyhow::Context as _;
use flatland::estimator::{Exact, Method};
use flatland::plane::fields::AuxiliaryField;
use flatland::plane::{Film, Filter, Motion, Polygon, Scene, Shade, Shape};
use flatland::random::{open01, stream};
use flatland::warp::{Warp, WarpField};
use glam::{DVec2, DVec3};
use rayon::prelude::*;

/// Pixels a side.
pub(super) const SIDE: usize = 4;
/// The auxiliary kernel's κ wherever it is not what varies, in 1/pixel²: a width of 0.15 pixels.
pub(super) const KAPPA: f64 = 44.0;

/// A white quadrilateral that moves over black, and its exact gradient image.
pub(super) struct Study {
    pub(super) scene: Scene,
    pub(super) film: Film,
    pub(super) motion: Motion,
    /// dI/dθ of every pixel.
    pub(super) exact: Vec<f64>,
    pub(super) velocities: Vec<DVec2>,
    norm: f64,
}

/// What a method computes in the mean, against the exact gradient image.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bias {
    /// 1 − slope of the mean gradient on the exact one: the part of the gradient that is missing.
    pub(super) missing: f64,
    /// Its standard error.
    pub(super) error: f64,
    /// ‖mean − exact‖²/‖exact‖², with the noise's own contribution taken off.
    pub(super) squared: f64,
}

/// How much a method varies and costs, per sample of one pixel.
#[derive(Clone, Copy, Debug)]
pub(super) struct Spread {
    /// Σ variance/Σ exact², over pixels.
    pub(super) variance: f64,
    /// Times the scene was asked what is seen.
    pub(super) rays: f64,
}

impl Study {
    /// The scene of the figure.
    pub(super) fn new() -> anyhow::Result<Self> {
        let corners = [(1.1, 1.4), (2.9, 1.0), (3.2, 2.6), (1.5, 3.1)];
        let quadrilateral = Polygon::simple(corners.map(|(x, y)| DVec2::new(x, y)))?;
        let shape = Shape::new(quadrilateral, Shade::constant(DVec3::ONE));
        let scene = Scene::new(DVec3::ZERO, vec![shape])?;
        let film = Film::new(SIDE, SIDE, Filter::Tent)?;
        let turn = Motion::rotate([0], DVec2::new(2.2, 2.0));
        let motion = Motion::translate([0], DVec2::new(1.0, 0.3)).and(turn);
        let velocities = motion.velocities(&scene)?;
        let exact: Vec<f64> =
            Exact.forward(&scene, &motion, &film)?.mean.pixels().iter().map(|pixel| pixel.x).collect();
        let norm = exact.iter().map(|e| e * e).sum();
        Ok(Self { scene, film, motion, exact, velocities, norm })
    }

    /// The bias of the area integral with a warp of auxiliary rays, from `batches` independent means
    /// of one sample in every cell of a `grid` × `grid` partition of the plane that the film sees.
    ///
    /// Stratified samples that serve all pixels at once have the same mean as the method's own, and
    /// far less variance: the bias of hundreds of rays would drown in noise otherwise.
    pub(super) fn bias(&self, warp: Warp, kappa: f64, batches: usize, grid: usize, seed: u64) -> Bias {
        let field = AuxiliaryField { scene: &self.scene, velocities: &self.velocities, warp, kappa };
        let rows: Vec<Vec<f64>> = (0..batches * grid)
            .into_par_iter()
            .map(|i| self.stratified_row(&field, grid, i % grid, (seed, i as u64)))
            .collect();
        let images: Vec<Vec<f64>> = rows.chunks(grid).map(sum).collect();
        self.regress(&images)
    }

    /// The contribution of one row of cells to every pixel.
    fn stratified_row(
        &self,
        field: &AuxiliaryField<'_>,
        grid: usize,
        row: usize,
        (seed, address): (u64, u64),
    ) -> Vec<f64> {
        let (low, high) = self.film.extent();
        let cell = (high - low) / grid as f64;
        let mut rng = stream(seed, &[address]);
        let mut image = vec![0.0; self.exact.len()];
        for column in 0..grid {
            let jitter = DVec2::new(column as f64 + open01(&mut rng), row as f64 + open01(&mut rng));
            let u = low + cell * jitter;
            let (v, _) = field.at(u, &mut rng);
            // ∇·(V h f) with f constant but for its jump; less ½ everywhere, since ∫ ∇·(V h) du = 0.
            let f = self.scene.value(self.scene.hit(u).as_ref(), u).x - 0.5;
            for (i, value) in image.iter_mut().enumerate() {
                let centre = self.film.centre(i % SIDE, i / SIDE);
                let (h, gradient) =
                    (self.film.filter_value(centre, u), self.film.filter_gradient(centre, u));
                *value += cell.x * cell.y * f * (gradient.dot(v.value) + h * v.divergence);
            }
        }
        image
    }

    /// The regression on the exact gradient of the mean of independent images.
    fn regress(&self, images: &[Vec<f64>]) -> Bias {
        let count = images.len() as f64;
        let mean: Vec<f64> = sum(images).iter().map(|s| s / count).collect();
        let slope = |image: &[f64]| {
            image.iter().zip(&self.exact).map(|(a, e)| a * e).sum::<f64>() / self.norm
        };
        let noise = |of: &dyn Fn(&[f64]) -> f64| {
            images.iter().map(|image| of(image)).sum::<f64>() / (count * (count - 1.0))
        };
        let middle = slope(&mean);
        let distance =
            |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum::<f64>() / self.norm;
        Bias {
            missing: 1.0 - middle,
            error: noise(&|image| (slope(image) - middle).powi(2)).sqrt(),
            squared: distance(&mean, &self.exact) - noise(&|image| distance(image, &mean)),
        }
    }

    /// The variance and cost of a method that takes `samples` a pixel.
    pub(super) fn spread(&self, method: &dyn Method, samples: usize) -> anyhow::Result<Spread> {
        let image = method.forward(&self.scene, &self.motion, &self.film)?;
        let squares: f64 = image.standard_error.pixels().iter().map(|e| e.x * e.x).sum();
        let count = (samples * self.exact.len()) as f64;
        Ok(Spread { variance: squares * samples as f64 / self.norm, rays: image.rays as f64 / count })
    }

    /// The bias of any method, from `batches` runs of it.
    pub(super) fn bias_of<M: Method>(
        &self,
        batches: usize,
        mut method: impl FnMut(usize) -> M,
    ) -> anyhow::Result<Bias> {
        let images = (0..batches)
            .map(|batch| {
                let image = method(batch).forward(&self.scene, &self.motion, &self.film)?.mean;
                Ok(image.pixels().iter().map(|pixel| pixel.x).collect())
            })
            .collect::<anyhow::Result<Vec<Vec<f64>>>>()?;
        Ok(self.regress(&images))
    }

    /// The bias of an image known without noise.
    pub(super) fn bias_exactly(&self, image: &[f64]) -> Bias {
        let mut bias = self.regress(&[image.to_vec(), image.to_vec()]);
        bias.error = 0.0;
        bias
    }

    /// Seconds that one thread takes for a sample of one pixel: the least of three runs, so that what
    /// else the machine does counts little.
    pub(super) fn seconds(&self, method: &dyn Method, samples: usize) -> anyhow::Result<f64> {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().context("starting one thread")?;
        let mut least = f64::INFINITY;
        for _ in 0..3 {
            let start = Instant::now();
            pool.install(|| method.forward(&self.scene, &self.motion, &self.film))?;
            least = least.min(start.elapsed().as_secs_f64());
        }
        Ok(least / (samples * self.exact.len()) as f64)
    }
}

/// The sum of images.
fn sum(images: &[Vec<f64>]) -> Vec<f64> {
    let mut total = vec![0.0; images.first().map_or(0, Vec::len)];
    for image in images {
        total.iter_mut().zip(image).for_each(|(t, v)| *t += v);
    }
    total
}

/// A seed for the part of the study that the words name: 52 bits of their stream.
pub(super) fn seed_of(seed: u64, words: &[u64]) -> u64 {
    (open01(&mut stream(seed, words)) * 2f64.powi(52)) as u64
}
