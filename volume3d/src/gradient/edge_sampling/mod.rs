//! Monte Carlo edge sampling (Li, Aittala, Durand and Lehtinen 2018): the interior term by path tracing, the
//! boundary terms by sampling edges.

mod driver;
mod emitters;
mod flips;
mod horizon;
mod list;
mod primary;
mod secondary;
mod sensor;
mod sides;
mod table;
#[cfg(test)]
mod tests;
mod walk;

use glam::DVec3;

use self::driver::{Driver, Estimate};
use self::emitters::Emitters;
use self::flips::Flips;
use self::horizon::Horizon;
use self::list::EdgeList;
use self::primary::Primary;
use self::secondary::{Light, Secondary};
use super::change::supported;
use super::motion::Motion;
use super::{Change, GradientError, GradientImage, Progress, Terms, Wanted, WarpedArea};
use crate::path::{Kernels, Paths};
use crate::scene::Scene;

/// Streams of random numbers, beside those of the interior term.
const PRIMARY_EDGE: u64 = 16;
const LIT_EDGE: u64 = 17;
const REST_EDGE: u64 = 18;
const EMITTER_EDGE: u64 = 19;
const BACKWARDS: u64 = 20;
const HORIZON: u64 = 21;
const BEYOND_HORIZON: u64 = 22;
const FLIP: u64 = 23;

/// Derivatives by sampling edges.
///
/// Besides edges it samples two curves that smooth shading brings: where a surface turns its other side to the
/// camera, and the horizon of a face that turns. Surfaces that turn their other side to an earlier point of a path
/// instead of the camera are *not* sampled: with smooth normals and three segments or more a jump there is left
/// out.
#[derive(Clone, Debug)]
pub struct EdgeSampling {
    /// Paths a pixel for the interior term.
    pub samples: usize,
    /// Samples of edges on the film, a pixel on average.
    pub primary: usize,
    /// Samples of edges seen from shading points, a pixel on average.
    pub secondary: usize,
    /// The seed of everything random.
    pub seed: u64,
}

impl Default for EdgeSampling {
    fn default() -> Self {
        Self { samples: 16, primary: 4, secondary: 16, seed: 0 }
    }
}

/// What moves, or is wanted: the shapes, and the camera.
#[derive(Clone, Debug)]
struct Moving {
    shapes: Vec<bool>,
    camera: bool,
}

impl EdgeSampling {
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
        let mut image = self.forward_terms(scene, change, progress)?;
        image.terms = None;
        Ok(image)
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
        self.check(scene, change.is_geometric())?;
        let mut image = self.interior().forward(scene, change, progress)?;
        let motion = Motion::new(scene, change);
        let moving = Moving { shapes: motion.moves.clone(), camera: motion.camera_moves };
        let zero = vec![DVec3::ZERO; image.gradient.len()];
        let mut terms = Terms { interior: image.gradient.clone(), primary: zero.clone(), secondary: zero };
        if moving.anything() {
            let paths = Paths::new(scene, Kernels::default());
            let list = EdgeList::new(scene);
            let primary = Primary::new(&paths, &list, &moving);
            if !primary.is_empty() {
                let estimate = self.driver(scene, self.primary).forward(&primary, &motion, progress)?;
                add(&mut image, &mut terms.primary, estimate);
            }
            let flips = Flips::new(&paths, &moving);
            if !flips.is_empty() {
                let estimate = self.driver(scene, self.primary).forward(&flips, &motion, progress)?;
                add(&mut image, &mut terms.primary, estimate);
            }
            let driver = self.driver(scene, self.secondary);
            for light in [Light::Emitted, Light::Rest] {
                let part = Secondary::new(&paths, &list, &moving, light);
                if !part.is_empty() {
                    add(&mut image, &mut terms.secondary, driver.forward(&part, &motion, progress)?);
                }
            }
            let part = Emitters::new(&paths, &list, &moving);
            if !part.is_empty() {
                add(&mut image, &mut terms.secondary, driver.forward(&part, &motion, progress)?);
            }
            let part = Horizon::new(&paths, &moving);
            if !part.is_empty() {
                add(&mut image, &mut terms.secondary, driver.forward(&part, &motion, progress)?);
            }
        }
        image.terms = Some(terms);
        Ok(image)
    }

    /// Σ over pixels and channels of adjoint · dI/dθ, for every wanted parameter θ at once: the transpose of
    /// [`forward`](Self::forward), with the same random numbers if the wanted shapes are those that move.
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
        self.check(scene, wanted.is_geometric())?;
        let mut gradient = self.interior().reverse(scene, adjoint, wanted, progress)?;
        let moving = Moving { shapes: wanted.shapes.clone(), camera: wanted.camera };
        if moving.anything() {
            let mut boundary = Change::still(scene);
            let paths = Paths::new(scene, Kernels::default());
            let list = EdgeList::new(scene);
            let primary = Primary::new(&paths, &list, &moving);
            if !primary.is_empty() {
                let driver = self.driver(scene, self.primary);
                driver.reverse(&primary, adjoint, wanted, progress, &mut boundary)?;
            }
            let flips = Flips::new(&paths, &moving);
            if !flips.is_empty() {
                let driver = self.driver(scene, self.primary);
                driver.reverse(&flips, adjoint, wanted, progress, &mut boundary)?;
            }
            let driver = self.driver(scene, self.secondary);
            for light in [Light::Emitted, Light::Rest] {
                let part = Secondary::new(&paths, &list, &moving, light);
                if !part.is_empty() {
                    driver.reverse(&part, adjoint, wanted, progress, &mut boundary)?;
                }
            }
            let part = Emitters::new(&paths, &list, &moving);
            if !part.is_empty() {
                driver.reverse(&part, adjoint, wanted, progress, &mut boundary)?;
            }
            let part = Horizon::new(&paths, &moving);
            if !part.is_empty() {
                driver.reverse(&part, adjoint, wanted, progress, &mut boundary)?;
            }
            boundary.pull_normals(scene, wanted);
            gradient.add(&boundary);
        }
        Ok(gradient)
    }

    fn interior(&self) -> WarpedArea {
        WarpedArea {
            samples: self.samples,
            baseline: 0,
            warps: false,
            seed: self.seed,
            ..WarpedArea::default()
        }
    }

    fn driver<'s>(&self, scene: &'s Scene, samples: usize) -> Driver<'s> {
        let (width, height) = scene.size();
        Driver::new(scene, self.seed, samples * width * height)
    }

    fn check(&self, scene: &Scene, geometric: bool) -> Result<(), GradientError> {
        if geometric {
            supported(scene)?;
        }
        match [self.samples, self.primary, self.secondary].into_iter().find(|&s| s < 1 && geometric) {
            Some(samples) => Err(GradientError::Samples { samples, least: 1 }),
            None => Ok(()),
        }
    }
}

impl Moving {
    fn anything(&self) -> bool {
        self.camera || self.shapes.iter().any(|&s| s)
    }
}

/// Adds an estimate to the whole and to a term.
fn add(image: &mut GradientImage, term: &mut [DVec3], estimate: Estimate) {
    for (i, (mean, variance)) in estimate.mean.iter().zip(&estimate.variance).enumerate() {
        term[i] += *mean;
        image.gradient[i] += *mean;
        let error = image.standard_error[i];
        image.standard_error[i] = (error * error + *variance).map(f64::sqrt);
    }
    image.non_finite.extend(estimate.non_finite);
}
