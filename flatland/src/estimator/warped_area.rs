//! Warped-area sampling (Bangaru, Li and Durand 2020).

use glam::{DVec2, DVec3};

use super::area_integral::{AreaIntegral, Form, PixelSide, pixel_mean};
use super::linear::{self, Covectors, LinearMethod, View, check_samples};
use super::{EstimatorError, GradientImage, Method, VertexGradient};
use crate::plane::fields::{AuxiliaryField, scene_stencil};
use crate::plane::{Film, Filter, Image, MaterialPoint, Motion, Scene};
use crate::random::Stream;
use crate::warp::Warp;

/// dI/dθ = ∫ h ∂f/∂θ + ∇·(V h f) du, with V estimated from auxiliary rays around each sample.
///
/// For the box filter, which jumps on the fixed pixel edge, the flux ∮ f (V·n) dl through that edge
/// is subtracted, at one point of it per sample (Bangaru et al. 2022).
///
/// The mean shade of the pixel is subtracted from f as a control variate: ∫ ∇·(V h) du = 0.
///
/// Unbiased if `warp.debias` is, consistent otherwise. It needs no list of edges, and works
/// whatever the shapes, as long as the scene can say what is seen at a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WarpedArea {
    /// Samples a pixel.
    pub samples: usize,
    /// The auxiliary kernel's concentration κ, in 1/pixel²: its width is κ^−½ pixels.
    pub kappa: f64,
    /// How the warp field is estimated.
    pub warp: Warp,
    /// Area or reparameterised form; reverse mode is the transpose of both.
    pub form: Form,
    /// Seed.
    pub seed: u64,
}

impl Default for WarpedArea {
    fn default() -> Self {
        Self { samples: 64, kappa: 44.0, warp: Warp::default(), form: Form::Area, seed: 0 }
    }
}

impl Method for WarpedArea {
    fn name(&self) -> &'static str {
        "warped area"
    }

    fn forward(&self, scene: &Scene, motion: &Motion, film: &Film) -> Result<GradientImage, EstimatorError> {
        match self.form {
            Form::Area => linear::forward(self, scene, motion, film),
            Form::Reparameterised => {
                let velocities = &motion.velocities(scene)?;
                let kappa = self.prepare(scene, film)?;
                check_samples(self.samples)?;
                let field = AuxiliaryField { scene, velocities, warp: self.warp, kappa };
                let (samples, form, seed) = (self.samples, self.form, self.seed);
                let integral = AreaIntegral { samples, form, seed, control_variate: true };
                Ok(integral.forward(scene, velocities, film, &field))
            }
        }
    }

    fn reverse(&self, scene: &Scene, film: &Film, adjoint: &Image) -> Result<VertexGradient, EstimatorError> {
        linear::reverse(self, scene, film, adjoint)
    }
}

impl LinearMethod for WarpedArea {
    /// κ in the scene's own unit.
    type Prepared = f64;
    /// The centre, and the control variate: the mean shade, which is subtracted from f.
    type Pixel = (DVec2, DVec3);

    fn samples(&self) -> usize {
        self.samples
    }

    fn seed(&self) -> u64 {
        self.seed
    }

    fn prepare(&self, _: &Scene, film: &Film) -> Result<f64, EstimatorError> {
        let kappa = self.kappa / (film.pixel() * film.pixel());
        self.warp.check(self.kappa)?;
        self.warp.check(kappa)?;
        Ok(kappa)
    }

    fn pixel(&self, view: &View<'_, f64>, x: usize, y: usize) -> (DVec2, DVec3) {
        let centre = view.film.centre(x, y);
        (centre, pixel_mean(view.scene, view.film, centre))
    }

    fn sample(
        &self,
        view: &View<'_, f64>,
        &(centre, control): &(DVec2, DVec3),
        rng: &mut Stream,
        mut emit: impl FnMut(&MaterialPoint, &Covectors),
    ) -> u64 {
        let (scene, film) = (view.scene, view.film);
        let s = film.sample(centre, rng);
        let hit = scene.hit(s.u);
        let f = scene.value(hit.as_ref(), s.u) - control;
        let gradient = scene.gradient(hit.as_ref(), s.u);
        if let (Some(hit), Some(g)) = (&hit, scene.material_gradient(hit.as_ref(), s.u)) {
            emit(hit.point(), &g.map(|g| -s.value * g));
        }
        // ∇·(V h f)/p = (f ∇h + h ∇f)·V/p + h f ∇·V/p
        let stencil = scene_stencil(scene, &self.warp, view.prepared, s.u, rng);
        let mut rays = 1 + stencil.terms().len() as u64;
        for term in stencil.terms() {
            let Some(hit) = &term.hit else { continue };
            let covectors = [0, 1, 2].map(|c| {
                let a = f[c] * s.gradient + s.value * gradient[c];
                term.weight * a + s.value * f[c] * term.divergence
            });
            emit(hit.point(), &covectors);
        }
        if film.filter() == Filter::Box {
            let side = PixelSide::draw(film, centre, rng);
            let f = scene.value(scene.hit(side.u).as_ref(), side.u) - control;
            let stencil = scene_stencil(scene, &self.warp, view.prepared, side.u, rng);
            rays += 1 + stencil.terms().len() as u64;
            for term in stencil.terms() {
                let Some(hit) = &term.hit else { continue };
                let flux = -side.weight * term.weight * side.outward;
                emit(hit.point(), &f.to_array().map(|f| f * flux));
            }
        }
        rays
    }
}
