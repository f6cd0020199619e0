//! Warped-area sampling (Bangaru, Li and Durand 2020), for several constructions of the field.

use glam::{DVec2, DVec3};

use super::Method;
use super::area_integral::{AreaIntegral, Form, PixelSide, pixel_mean};
use super::edge_points::PixelEdges;
use super::error::EstimatorError;
use super::plane::{self, Covectors, GradientImage, LinearMethod, VertexGradient, View};
use crate::plane::fields::{AuxiliaryField, JumpField, SceneJumps, scene_stencil};
use crate::plane::{Film, Filter, Hit, Image, MaterialPoint, Motion, Scene};
use crate::random::Stream;
use crate::warp::{JumpMean, Plane, Stencil, Warp};

/// dI/dθ = ∫ h ∂f/∂θ + ∇·(V h f) du, at sampled points u.
///
/// For the box filter, which is discontinuous on the static pixel edge, the flux ∮ f (V·n) dl through that
/// edge is subtracted, at one point of it per sample (Bangaru et al. 2022).
///
/// The mean shade of the pixel is subtracted from f as a control variate: ∫ ∇·(V h) du = 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WarpedArea {
    /// Samples per pixel.
    pub samples: usize,
    /// Construction of V.
    pub construction: Construction,
    /// Area or reparameterised form; reverse mode is the transpose of both.
    pub form: Form,
    /// Random seed.
    pub seed: u64,
}

/// A construction of V for an image, with lengths in pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Construction {
    /// A mean over hits at auxiliary points around u. Unbiased if the warp is debiased, consistent otherwise.
    /// It needs no list of edges, and supports any shapes, as long as the scene answers visibility queries.
    Auxiliary {
        /// Parameters of the estimate.
        warp: Warp,
        /// Kernel concentration κ, in 1/pixel²: its width is κ^−½ pixels.
        kappa: f64,
    },
    /// A [mean over the discontinuities](JumpMean) around u: unbiased and deterministic. It needs a list of
    /// all edges; with one it has far less variance than auxiliary points, at a lower cost.
    JumpMean {
        /// R in pixels: the variance is least at about 0.6, and hardly larger from 0.3 to 8; the cost of a
        /// sample grows with it.
        reach: f64,
    },
    /// A [softened](JumpMean#softened) mean over the discontinuities, and one sample of the edges per sample
    /// of the area for its residual: unbiased for every softness from 0, the exact mean, to ∞, edge sampling.
    /// Its samples are bounded at crossings of edges that move differently, and in gaps, where samples of the
    /// exact mean are not. Like edge sampling it does not support scenes whose visible edges coincide. Only
    /// the area form is used, whatever the value of [`form`](WarpedArea::form).
    Softened {
        /// R in pixels.
        reach: f64,
        /// ε in pixels: 0.3 to 0.5 of a reach of 1.2.
        softness: f64,
    },
}

impl Construction {
    /// Default κ, in 1/pixel²: a kernel 0.15 pixels wide.
    pub const KAPPA: f64 = 44.0;
}

impl From<Warp> for Construction {
    /// Auxiliary points with the default kernel width.
    fn from(warp: Warp) -> Self {
        Self::Auxiliary { warp, kappa: Self::KAPPA }
    }
}

impl Default for Construction {
    /// Auxiliary points, the published method.
    fn default() -> Self {
        Warp::default().into()
    }
}

impl Default for WarpedArea {
    fn default() -> Self {
        Self { samples: 64, construction: Construction::default(), form: Form::Area, seed: 0 }
    }
}

impl Method for WarpedArea {
    fn name(&self) -> &'static str {
        match self.construction {
            Construction::Auxiliary { .. } => "warped area",
            Construction::JumpMean { .. } => "mean over jumps",
            Construction::Softened { .. } => "softened mean over jumps",
        }
    }

    fn forward(&self, scene: &Scene, motion: &Motion, film: &Film) -> Result<GradientImage, EstimatorError> {
        match self.form {
            Form::Area => plane::forward(self, scene, motion, film),
            Form::Reparameterised => {
                let velocities = &motion.velocities(scene)?;
                let prepared = self.prepare(scene, film)?;
                let (samples, form, seed) = (self.samples, self.form, self.seed);
                let integral = AreaIntegral { samples, form, seed, control_variate: true };
                match prepared {
                    Prepared::Auxiliary { warp, kappa } => {
                        let field = AuxiliaryField { scene, velocities, warp, kappa };
                        integral.forward(scene, velocities, film, &field)
                    }
                    Prepared::Jumps { jumps, residual: false } => {
                        integral.forward(scene, velocities, film, &JumpField { scene, velocities, jumps })
                    }
                    // The residual has only one form.
                    Prepared::Jumps { residual: true, .. } => plane::forward(self, scene, motion, film),
                }
            }
        }
    }

    fn reverse(&self, scene: &Scene, film: &Film, adjoint: &Image) -> Result<VertexGradient, EstimatorError> {
        plane::reverse(self, scene, film, adjoint)
    }
}

/// A pixel's centre, its control variate (the mean shade), and its edges, if they are sampled.
pub(super) struct Pixel {
    centre: DVec2,
    control: DVec3,
    edges: Option<PixelEdges>,
}

/// A construction with lengths in the scene's own unit.
#[derive(Clone, Debug)]
pub(super) enum Prepared {
    Auxiliary {
        warp: Warp,
        kappa: f64,
    },
    Jumps {
        jumps: SceneJumps,
        /// Whether the field has a residual.
        residual: bool,
    },
}

impl Prepared {
    /// Coefficients of (V, ∇·V) at u, and the number of rays.
    fn stencil(
        &self,
        scene: &Scene,
        u: DVec2,
        seen: Option<&Hit>,
        rng: &mut Stream,
    ) -> (Stencil<Plane, Option<MaterialPoint>>, u64) {
        match self {
            Self::Auxiliary { warp, kappa } => {
                let stencil = scene_stencil(scene, warp, *kappa, u, rng);
                let rays = stencil.terms().len() as u64;
                (stencil, rays)
            }
            Self::Jumps { jumps, .. } => (jumps.stencil(scene, u, seen), 0),
        }
    }
}

impl LinearMethod for WarpedArea {
    type Prepared = Prepared;
    type Pixel = Pixel;

    fn samples(&self) -> usize {
        self.samples
    }

    fn seed(&self) -> u64 {
        self.seed
    }

    fn prepare(&self, scene: &Scene, film: &Film) -> Result<Prepared, EstimatorError> {
        Ok(match self.construction {
            Construction::Auxiliary { warp, kappa: per_pixel } => {
                let kappa = per_pixel / (film.pixel() * film.pixel());
                warp.check(per_pixel)?;
                warp.check(kappa)?;
                Prepared::Auxiliary { warp, kappa }
            }
            Construction::JumpMean { reach } => {
                JumpMean { reach }.check()?;
                let mean = JumpMean { reach: reach * film.pixel() };
                mean.check()?;
                Prepared::Jumps { jumps: SceneJumps::new(scene, mean), residual: false }
            }
            Construction::Softened { reach, softness } => {
                JumpMean { reach }.check()?;
                if softness.is_nan() || softness < 0.0 {
                    return Err(EstimatorError::Softness { softness });
                }
                let mean = JumpMean { reach: reach * film.pixel() };
                mean.check()?;
                Prepared::Jumps {
                    jumps: SceneJumps::softened(scene, mean, softness * film.pixel()),
                    residual: softness > 0.0,
                }
            }
        })
    }

    fn pixel(&self, view: &View<'_, Prepared>, x: usize, y: usize) -> Pixel {
        let (scene, film) = (view.scene, view.film);
        let centre = film.centre(x, y);
        let edges = match &view.prepared {
            Prepared::Jumps { jumps, residual: true } => {
                Some(PixelEdges::new(jumps.edges(), scene, film, centre))
            }
            _ => None,
        };
        Pixel { centre, control: pixel_mean(scene, film, centre), edges }
    }

    fn sample(
        &self,
        view: &View<'_, Prepared>,
        pixel: &Pixel,
        rng: &mut Stream,
        mut emit: impl FnMut(&MaterialPoint, &Covectors),
    ) -> u64 {
        let (scene, film) = (view.scene, view.film);
        let Pixel { centre, control, .. } = *pixel;
        let s = film.sample(centre, rng);
        let hit = scene.hit(s.u);
        let f = scene.value(hit.as_ref(), s.u) - control;
        let gradient = scene.gradient(hit.as_ref(), s.u);
        if let (Some(hit), Some(g)) = (&hit, scene.material_gradient(hit.as_ref(), s.u)) {
            emit(hit.point(), &g.map(|g| -s.value * g));
        }
        // ∇·(V h f)/p = (f ∇h + h ∇f)·V/p + h f ∇·V/p
        let (stencil, field_rays) = view.prepared.stencil(scene, s.u, hit.as_ref(), rng);
        let mut rays = 1 + field_rays;
        for term in stencil.terms() {
            let Some(point) = &term.hit else { continue };
            let covectors = [0, 1, 2].map(|c| {
                let a = f[c] * s.gradient + s.value * gradient[c];
                term.weight * a + s.value * f[c] * term.divergence
            });
            emit(point, &covectors);
        }
        if film.filter() == Filter::Box {
            let side = PixelSide::draw(film, centre, rng);
            let hit = scene.hit(side.u);
            let f = scene.value(hit.as_ref(), side.u) - control;
            let (stencil, field_rays) = view.prepared.stencil(scene, side.u, hit.as_ref(), rng);
            rays += 1 + field_rays;
            for term in stencil.terms() {
                let Some(point) = &term.hit else { continue };
                let flux = -side.weight * term.weight * side.outward;
                emit(point, &f.to_array().map(|f| f * flux));
            }
        }
        if let Some(edges) = &pixel.edges {
            rays += residual(view, edges, control, rng, emit);
        }
        rays
    }
}

/// −∮ h f⁺ (v − V⁺)·ν dl at one point of the edges: the residual of a softened field, on the side on which a
/// shape ends. On the shape's own side V = v.
fn residual(
    view: &View<'_, Prepared>,
    edges: &PixelEdges,
    control: DVec3,
    rng: &mut Stream,
    mut emit: impl FnMut(&MaterialPoint, &Covectors),
) -> u64 {
    let (point, rays) = edges.draw(view.scene, view.film, rng);
    let Some(point) = point else { return rays };
    let [_, beside] = point.values;
    let f = (beside - control) * point.weight;
    let (stencil, field_rays) = view.prepared.stencil(view.scene, point.u, point.beside.as_ref(), rng);
    emit(&point.material, &f.to_array().map(|f| -f * point.outward));
    for term in stencil.terms() {
        let Some(moved_by) = &term.hit else { continue };
        emit(moved_by, &f.to_array().map(|f| f * term.weight * point.outward));
    }
    rays + field_rays
}
