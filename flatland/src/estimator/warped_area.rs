//! Warped-area sampling (Bangaru, Li and Durand 2020).

use glam::{DVec2, DVec3};

use super::linear::{self, Covectors, LinearMethod, View, sample_stream};
use super::{EstimatorError, GradientImage, Method, VertexGradient};
use crate::dual::Dual;
use crate::plane::{Attachment, Film, Filter, Hit, Image, MaterialPoint, Motion, PixelSample, Scene};
use crate::random::{Stream, open01};
use crate::warp::{Field, Plane, Stencil, Warp};

/// Which of the two equal forms of the area integral is evaluated.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Form {
    /// ∂f/∂θ + ∇f·V + f ∇·V, term by term.
    #[default]
    Area,
    /// d/dθ of f(T(u'); θ) |det DT| with T = u' + (θ − θ₀) V(u'), by dual numbers.
    Reparameterised,
}

/// dI/dθ = ∫ h ∂f/∂θ + ∇·(V h f) du, with V estimated from auxiliary rays around each sample.
///
/// For the box filter, which jumps on the fixed pixel edge, the flux ∮ f (V·n) dl through that edge
/// is subtracted, at one point of it per sample (Bangaru et al. 2022).
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
            Form::Reparameterised => self.forward_reparameterised(scene, motion, film),
        }
    }

    fn reverse(&self, scene: &Scene, film: &Film, adjoint: &Image) -> Result<VertexGradient, EstimatorError> {
        linear::reverse(self, scene, film, adjoint)
    }
}

/// A warp stencil over scene hits; a miss is `None` and stands still.
type SceneStencil = Stencil<Plane, Option<Hit>>;

impl WarpedArea {
    fn stencil(&self, view: &View<'_, f64>, u: DVec2, rng: &mut Stream) -> SceneStencil {
        let reach = self.warp.reach(view.prepared);
        self.warp.stencil(u, view.prepared, rng, |point| {
            let hit = view.scene.hit(point);
            let distance =
                hit.as_ref().map_or(f64::INFINITY, |h| view.scene.boundary_distance(Some(h), point, reach));
            (hit, distance)
        })
    }

    fn forward_reparameterised(
        &self,
        scene: &Scene,
        motion: &Motion,
        film: &Film,
    ) -> Result<GradientImage, EstimatorError> {
        let velocities = motion.velocities(scene)?;
        let view = View { scene, film, prepared: self.prepare(scene, film)? };
        linear::check_samples(self.samples)?;
        let velocity = |hit: &Option<Hit>| hit.map_or(DVec2::ZERO, |h| h.velocity(&velocities));
        Ok(linear::gradient_image(film, self.samples, |x, y| {
            let (centre, index) = (film.centre(x, y), y * film.width() + x);
            let (view, velocity) = (&view, &velocity);
            move |sample| {
                let mut rng = sample_stream(self.seed, index, sample);
                let s = film.sample(centre, &mut rng);
                let hit = scene.hit(s.u);
                let stencil = self.stencil(view, s.u, &mut rng);
                let mut rays = 1 + stencil.terms().len() as u64;
                let field = stencil.field(velocity);
                let mut value =
                    reparameterised(view.scene, film, centre, &s, hit.as_ref(), velocity(&hit), field);
                if film.filter() == Filter::Box {
                    let side = PixelSide::draw(film, centre, &mut rng);
                    let f = scene.value(scene.hit(side.u).as_ref(), side.u);
                    let stencil = self.stencil(view, side.u, &mut rng);
                    rays += 1 + stencil.terms().len() as u64;
                    value -= side.weight * stencil.field(velocity).value.dot(side.outward) * f;
                }
                (value, rays)
            }
        }))
    }
}

/// d/dθ of h(T) f(T; θ) |det DT| / p at θ₀, along T = u + (θ − θ₀) V.
fn reparameterised(
    scene: &Scene,
    film: &Film,
    centre: DVec2,
    sample: &PixelSample,
    hit: Option<&Hit>,
    material_velocity: DVec2,
    field: Field<DVec2>,
) -> DVec3 {
    let point = Dual::path(sample.u, field.value);
    let filter = film.filter_value_dual(centre, point) * (1.0 / sample.density);
    let jacobian = Dual { value: 1.0, slope: field.divergence };
    // A shade that goes along with the material sees T move relative to it.
    let shade_point = match hit.map(|h| scene.shapes()[h.shape()].shade().attachment()) {
        Some(Attachment::Material) => Dual::path(sample.u, field.value - material_velocity),
        Some(Attachment::Image) | None => point,
    };
    let shade = scene.value_dual(hit, sample.u, shade_point);
    DVec3::from(shade.map(|f| (f * filter * jacobian).slope))
}

/// A point of a pixel's edge.
pub(super) struct PixelSide {
    pub(super) u: DVec2,
    pub(super) outward: DVec2,
    /// h over the density.
    pub(super) weight: f64,
}

impl PixelSide {
    pub(super) fn draw(film: &Film, centre: DVec2, rng: &mut Stream) -> Self {
        let along = 4.0 * open01(rng);
        let outward = [DVec2::X, DVec2::Y, DVec2::NEG_X, DVec2::NEG_Y][along as usize];
        let u = centre + film.pixel() * (0.5 * outward + (along.fract() - 0.5) * outward.perp());
        Self { u, outward, weight: 4.0 / film.pixel() }
    }
}

impl LinearMethod for WarpedArea {
    /// κ in the scene's own unit.
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
        self.warp.check(self.kappa)?;
        self.warp.check(kappa)?;
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
        let (scene, film) = (view.scene, view.film);
        let s = film.sample(centre, rng);
        let hit = scene.hit(s.u);
        let f = scene.value(hit.as_ref(), s.u);
        let gradient = scene.gradient(hit.as_ref(), s.u);
        if let (Some(hit), Some(g)) = (&hit, scene.material_gradient(hit.as_ref(), s.u)) {
            emit(hit.point(), &g.map(|g| -s.value * g));
        }
        // ∇·(V h f)/p = (f ∇h + h ∇f)·V/p + h f ∇·V/p
        let stencil = self.stencil(view, s.u, rng);
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
            let f = scene.value(scene.hit(side.u).as_ref(), side.u);
            let stencil = self.stencil(view, side.u, rng);
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
