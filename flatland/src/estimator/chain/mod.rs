//! Derivatives of images of worlds with mirrors, glass and openings: warped-area sampling of
//! [chains](crate::chain).
//!
//! No list of edges is needed. [`WarpedArea`] is unbiased with a debiased [`Warp`].
//! Forward mode takes a rate for each of the world's [`numbers`](crate::chain::World::numbers) and then for
//! the camera's position (2), angle and field of view; reverse mode returns the derivative by each of them.

mod sample;
#[cfg(test)]
mod tests;

pub use sample::{AuxiliaryRay, Fault};

use self::sample::Job;
use super::driver::{self, Covectors};
use super::error::{EstimatorError, check_adjoint, check_direction};
use super::estimate::Estimate;
use crate::chain::World;
use crate::random::stream;
use crate::transport::Camera;
use crate::warp::{BoundaryFunction, Warp, Weighting};

/// Warped-area sampling of chains.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WarpedArea {
    /// Samples per pixel.
    pub samples: usize,
    /// The estimate of the warp field.
    pub warp: Warp,
    /// Concentration κ of the auxiliary kernel on the film, in 1/pixel².
    pub kappa: f64,
    /// Most points of a chain; longer ones carry no light.
    pub longest: usize,
    /// A deliberate mistake, as a negative control.
    pub fault: Option<Fault>,
    /// Random seed.
    pub seed: u64,
}

impl Default for WarpedArea {
    /// γ = 3/2 with B ~ s², debiased, and the κ of the least variance × rays over mirrors, lenses, openings
    /// and shadows.
    fn default() -> Self {
        let boundary = BoundaryFunction::default();
        let warp =
            Warp { weighting: Weighting::BoundaryAware { gamma: 1.5, boundary }, ..Warp::one_dimensional() };
        Self { samples: 64, warp, kappa: 20.0, longest: 8, fault: None, seed: 0 }
    }
}

impl WarpedArea {
    /// Auxiliary rays of the field at the film coordinate u, with their weights: for drawings.
    ///
    /// # Errors
    /// An [`EstimatorError`] that names the parameter.
    pub fn auxiliary_rays(
        &self,
        world: &World,
        camera: &Camera,
        u: f64,
    ) -> Result<Vec<AuxiliaryRay>, EstimatorError> {
        camera.check()?;
        self.warp.check(self.kappa)?;
        Ok(Job::new(self, world, camera).auxiliary_rays(u, &mut stream(self.seed, &[u.to_bits()])))
    }

    /// dI/dθ of every pixel.
    ///
    /// # Errors
    /// An [`EstimatorError`] that names the parameter.
    pub fn forward(
        &self,
        world: &World,
        camera: &Camera,
        rates: &[f64],
    ) -> Result<Estimate<Vec<f64>>, EstimatorError> {
        camera.check()?;
        self.warp.check(self.kappa)?;
        check_direction(world.count() + 4, rates)?;
        let job = &Job::new(self, world, camera);
        driver::forward(camera.film.pixels, self.samples, |pixel| {
            let mut covectors = vec![];
            move |sample| {
                covectors.clear();
                let rays = job.sample(pixel, sample, 1.0, &mut covectors);
                (covectors.iter().map(|&(i, c): &(usize, f64)| c * rates[i]).sum::<f64>(), rays.into())
            }
        })
    }

    /// dL/dp of every number p, for the loss whose adjoint image is ∂L/∂I.
    ///
    /// # Errors
    /// An [`EstimatorError`] that names the parameter.
    pub fn reverse(
        &self,
        world: &World,
        camera: &Camera,
        adjoint: &[f64],
    ) -> Result<Estimate<Vec<f64>>, EstimatorError> {
        camera.check()?;
        self.warp.check(self.kappa)?;
        check_adjoint((camera.film.pixels, 1), (adjoint.len(), 1))?;
        let job = &Job::new(self, world, camera);
        driver::reverse(adjoint.len(), self.samples, world.count() + 4, |pixel| {
            let delta = adjoint[pixel];
            (delta != 0.0).then_some(move |sample, out: &mut Covectors<f64>| {
                job.sample(pixel, sample, delta, out).into()
            })
        })
    }
}
