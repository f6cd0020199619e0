//! Forward and reverse mode of all methods in the plane whose samples are linear in the velocities.

use glam::{DVec2, DVec3};

use super::driver;
use super::error::{EstimatorError, check_adjoint};
use super::estimate::Estimate;
use crate::plane::{Film, Image, MaterialPoint, Motion, Scene};
use crate::random::Stream;

/// dI/dθ of every pixel, per channel.
pub type GradientImage = Estimate<Image>;

/// dL/dp of every vertex p of the scene, shape by shape.
pub type VertexGradient = Estimate<Vec<DVec2>>;

/// One covector per channel: the derivative of a sample of dI/dθ by the velocity of a material point.
pub(super) type Covectors = [DVec2; 3];

/// A method whose sample is Σ covector · velocity over material points. Forward mode multiplies, reverse mode
/// scatters the same covectors, so each is the transpose of the other by construction.
pub(super) trait LinearMethod: Sync {
    /// Data prepared once per scene.
    type Prepared: Sync;
    /// Data prepared once per pixel.
    type Pixel;

    /// Samples per pixel.
    fn samples(&self) -> usize;

    /// Seed of all streams.
    fn seed(&self) -> u64;

    fn prepare(&self, scene: &Scene, film: &Film) -> Result<Self::Prepared, EstimatorError>;

    fn pixel(&self, view: &View<'_, Self::Prepared>, x: usize, y: usize) -> Self::Pixel;

    /// One sample: emits covectors, and returns the number of rays.
    fn sample(
        &self,
        view: &View<'_, Self::Prepared>,
        pixel: &Self::Pixel,
        rng: &mut Stream,
        emit: impl FnMut(&MaterialPoint, &Covectors),
    ) -> u64;
}

/// A scene and its film, with the prepared data of a method.
#[derive(Debug)]
pub(super) struct View<'a, P> {
    pub(super) scene: &'a Scene,
    pub(super) film: &'a Film,
    pub(super) prepared: P,
}

pub(super) fn forward<M: LinearMethod>(
    method: &M,
    scene: &Scene,
    motion: &Motion,
    film: &Film,
) -> Result<GradientImage, EstimatorError> {
    let velocities = &motion.velocities(scene)?;
    let view = &View { scene, film, prepared: method.prepare(scene, film)? };
    gradient_image(film, method.samples(), method.seed(), |x, y| {
        let pixel = method.pixel(view, x, y);
        move |rng| {
            let mut value = DVec3::ZERO;
            let rays = method.sample(view, &pixel, rng, |point, covectors| {
                let v = point.velocity(velocities);
                value += DVec3::from(covectors.map(|c| c.dot(v)));
            });
            (value, rays)
        }
    })
}

/// Mean and standard error of every pixel; `pixel(x, y)` returns the function from a sample's stream to its
/// value and rays.
pub(super) fn gradient_image<F: FnMut(&mut Stream) -> (DVec3, u64)>(
    film: &Film,
    samples: usize,
    seed: u64,
    pixel: impl Fn(usize, usize) -> F + Sync,
) -> Result<GradientImage, EstimatorError> {
    let width = film.width();
    let estimate = driver::forward(width * film.height(), samples, |p| {
        let mut sample = pixel(p % width, p / width);
        move |s| {
            let (value, rays) = sample(&mut driver::sample_stream(seed, p, s));
            (value, rays.into())
        }
    })?;
    Ok(estimate.map(|mean, error| (Image::from_pixels(film, mean), Image::from_pixels(film, error))))
}

pub(super) fn reverse<M: LinearMethod>(
    method: &M,
    scene: &Scene,
    film: &Film,
    adjoint: &Image,
) -> Result<VertexGradient, EstimatorError> {
    check_size(film, adjoint)?;
    let view = &View { scene, film, prepared: method.prepare(scene, film)? };
    let width = film.width();
    driver::reverse(width * film.height(), method.samples(), scene.vertices().len(), |p| {
        let (x, y) = (p % width, p / width);
        let delta = adjoint.pixel(x, y);
        (delta != DVec3::ZERO).then(|| {
            let pixel = method.pixel(view, x, y);
            move |s, out: &mut driver::Covectors<DVec2>| {
                let rng = &mut driver::sample_stream(method.seed(), p, s);
                let rays = method.sample(view, &pixel, rng, |point, covectors| {
                    let c = delta.x * covectors[0] + delta.y * covectors[1] + delta.z * covectors[2];
                    point.scatter(c, |vertex, part| out.push((vertex, part)));
                });
                rays.into()
            }
        })
    })
}

/// Whether an adjoint image is of the film's size.
pub(super) fn check_size(film: &Film, adjoint: &Image) -> Result<(), EstimatorError> {
    check_adjoint((film.width(), film.height()), (adjoint.width(), adjoint.height()))
}
