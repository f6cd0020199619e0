//! Rotation heuristic: one rigid motion per kernel (Loubet, Holzschuch and Jakob 2019), in the image plane.

use glam::DVec2;

use super::Method;
use super::area_integral::PixelSide;
use super::error::EstimatorError;
use super::plane::{self, Covectors, GradientImage, LinearMethod, VertexGradient, View};
use crate::plane::fields::{followed, kernel_offset};
use crate::plane::{Film, Filter, Image, MaterialPoint, Motion, Scene};
use crate::random::Stream;
use crate::warp::WarpError;

/// The integral over the image is spread over small kernels, ∫ f du = ∫∫ f(u) k(μ, u) du dμ, and each kernel
/// is moved rigidly so as to follow one of the points seen in it.
///
/// With V the velocity of that point, constant on the kernel,
///
/// ```text
/// dI/dθ ≈ ∫∫ k h ∂f/∂θ + ∇(k h f)·V du dμ
/// ```
///
/// On the sphere the rigid motion is a rotation; in the plane, a translation. The point is chosen
/// heuristically: the one on the topmost shape among several drawn from the kernel. **Biased** wherever no
/// single rigid motion moves every edge in the kernel (Theory 11).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rotation {
    /// Samples per pixel.
    pub samples: usize,
    /// The kernel's concentration κ, in 1/pixel².
    pub kappa: f64,
    /// Number of points from which the followed one is chosen.
    pub candidates: usize,
    /// Random seed.
    pub seed: u64,
}

impl Default for Rotation {
    fn default() -> Self {
        Self { samples: 64, kappa: 44.0, candidates: 4, seed: 0 }
    }
}

impl Method for Rotation {
    fn name(&self) -> &'static str {
        "rotation"
    }

    fn forward(&self, scene: &Scene, motion: &Motion, film: &Film) -> Result<GradientImage, EstimatorError> {
        plane::forward(self, scene, motion, film)
    }

    fn reverse(&self, scene: &Scene, film: &Film, adjoint: &Image) -> Result<VertexGradient, EstimatorError> {
        plane::reverse(self, scene, film, adjoint)
    }
}

impl LinearMethod for Rotation {
    type Prepared = f64;
    type Pixel = DVec2;

    fn samples(&self) -> usize {
        self.samples
    }

    fn seed(&self) -> u64 {
        self.seed
    }

    fn prepare(&self, _: &Scene, film: &Film) -> Result<f64, EstimatorError> {
        let kappa = self.kappa / (film.pixel() * film.pixel());
        if !(kappa > 0.0 && kappa.is_finite()) {
            return Err(WarpError::Kappa { kappa: self.kappa }.into());
        }
        if self.candidates == 0 {
            return Err(EstimatorError::NoCandidates);
        }
        Ok(kappa)
    }

    fn pixel(&self, view: &View<'_, f64>, x: usize, y: usize) -> DVec2 {
        view.film.centre(x, y)
    }

    fn sample(
        &self,
        view: &View<'_, f64>,
        &centre: &DVec2,
        rng: &mut Stream,
        mut emit: impl FnMut(&MaterialPoint, &Covectors),
    ) -> u64 {
        let (scene, film, kappa) = (view.scene, view.film, view.prepared);
        // u from the pixel and μ from the kernel around u: the same joint density as μ first.
        let s = film.sample(centre, rng);
        let offset = kernel_offset(kappa, rng);
        let mu = s.u + offset;
        let hit = scene.hit(s.u);
        if let (Some(hit), Some(g)) = (&hit, scene.material_gradient(hit.as_ref(), s.u)) {
            emit(hit.point(), &g.map(|g| -s.value * g));
        }
        let mut rays = 1 + self.candidates as u64;
        let Some(point) = followed(scene, mu, kappa, self.candidates, rng) else { return rays };
        let f = scene.value(hit.as_ref(), s.u);
        let gradient = scene.gradient(hit.as_ref(), s.u);
        // ∇_u k(μ, u)/k = κ (μ − u)
        let covectors =
            [0, 1, 2].map(|c| f[c] * s.gradient + s.value * gradient[c] + s.value * f[c] * kappa * offset);
        emit(point.point(), &covectors);
        if film.filter() == Filter::Box {
            // The filter's own discontinuity, on the pixel's static edge.
            let side = PixelSide::draw(film, centre, rng);
            let mu = side.u + kernel_offset(kappa, rng);
            rays += 1 + self.candidates as u64;
            if let Some(point) = followed(scene, mu, kappa, self.candidates, rng) {
                let f = scene.value(scene.hit(side.u).as_ref(), side.u);
                let flux = -side.weight * side.outward;
                emit(point.point(), &f.to_array().map(|f| f * flux));
            }
        }
        rays
    }
}
