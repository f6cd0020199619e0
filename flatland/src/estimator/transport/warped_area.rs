//! Warped-area sampling along paths (Bangaru, Li and Durand 2020), with any construction of the field.

use super::driver::{self, CONTROL, LinearMethod, Streams, View};
use super::fault::Fault;
use super::kernels::Kernels;
use super::sweep::{Sweep, first_ray};
use super::{Gradient, GradientImage, Method, PathError};
use crate::plane::Filter;
use crate::random::stream;
use crate::transport::fields::Construction;
use crate::transport::{Camera, CameraTangent, Covector, Origin, Paths, Tangent, Terms, World};
use crate::warp::{JumpMean, LinearField as _, WarpError, Weighting};

/// A warp at every bounce: on the film, and on the circle of directions at every surface, for
/// directions drawn by the scattering function as well as for those towards emitters.
///
/// The light of each emitting segment and the light that is scattered towards a surface are integrals
/// of their own, with kernels of their own. Both strategies of multiple importance sampling see the
/// same field for the same integral: their weights are not differentiated, and would have to be if it
/// were not the same.
///
/// Unbiased with [`Construction::JumpMean`] and [`Construction::Harmonic`], and with [`Construction::Local`] and
/// [`Construction::Auxiliary`] if their warp is debiased and boundary-aware with pγ ≥ 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WarpedArea {
    /// Paths a pixel.
    pub samples: usize,
    /// How paths end.
    pub paths: Paths,
    /// How the warp field is constructed.
    pub construction: Construction,
    /// The concentrations of the auxiliary kernels.
    pub kernels: Kernels,
    /// A mistake to make, for tests that must notice it.
    pub fault: Option<Fault>,
    /// Seed.
    pub seed: u64,
}

impl Default for WarpedArea {
    fn default() -> Self {
        Self {
            samples: 64,
            paths: Paths::default(),
            construction: Construction::default(),
            kernels: Kernels::default(),
            fault: None,
            seed: 0,
        }
    }
}

impl Method for WarpedArea {
    fn name(&self) -> &'static str {
        match self.construction {
            Construction::Auxiliary(w) | Construction::Local(w) if w.weighting == Weighting::Gaussian => {
                "Gaussian field"
            }
            Construction::Auxiliary(_) | Construction::Local(_) => "warped area",
            Construction::JumpMean { .. } => "mean over jumps",
            Construction::Harmonic => "harmonic field",
            Construction::Direct => "direct field",
            Construction::Followed { .. } => "rotation",
            Construction::Still => "interior only",
        }
    }

    fn forward(&self, world: &World, camera: &Camera, change: &Tangent) -> Result<GradientImage, PathError> {
        driver::forward(self, world, camera, change)
    }

    fn reverse(&self, world: &World, camera: &Camera, adjoint: &[f64]) -> Result<Gradient, PathError> {
        driver::reverse(self, world, camera, adjoint)
    }
}

/// A pixel, and the mean radiance over it as a control variate: ∫ ∇·(V h) du = 0.
pub(super) struct Pixel {
    index: usize,
    control: f64,
}

/// Fixed film points of the control variate.
const CONTROLS: usize = 8;

impl LinearMethod for WarpedArea {
    type Pixel = Pixel;

    fn samples(&self) -> usize {
        self.samples
    }

    fn seed(&self) -> u64 {
        self.seed
    }

    fn check(&self) -> Result<(), PathError> {
        let Kernels { film, surface, relative } = self.kernels;
        if !(relative > 0.0 && relative <= 1e6) {
            return Err(PathError::RelativeWidth { relative });
        }
        for kappa in [film, surface] {
            match &self.construction {
                Construction::Auxiliary(warp) | Construction::Local(warp) => warp.check(kappa)?,
                Construction::Followed { candidates: 0 } => return Err(PathError::NoCandidates),
                _ if !(kappa > 0.0 && kappa.is_finite()) => return Err(WarpError::Kappa { kappa }.into()),
                Construction::JumpMean { reach } => JumpMean { reach: reach / kappa.sqrt() }.check()?,
                _ => {}
            }
        }
        Ok(())
    }

    fn pixel(&self, view: &View<'_>, pixel: usize) -> Pixel {
        let film = view.camera.film;
        let mut sum = 0.0;
        if view.active.geometry {
            for i in 0..CONTROLS {
                // Any constant would do that does not depend on the samples.
                let mut rng = stream(self.seed, &[pixel as u64, i as u64, CONTROL]);
                let offset = (i as f64 + 0.5) / CONTROLS as f64 - 0.5;
                let u = film.centre(pixel) + film.filter.radius() * offset;
                let direction = view.camera.direction(u);
                let origin = Origin::free(view.camera.position);
                sum += self.paths.radiance(view.world, origin, direction, &mut rng).0;
            }
        }
        Pixel { index: pixel, control: sum / CONTROLS as f64 }
    }

    fn sample(
        &self,
        view: &View<'_>,
        pixel: &Pixel,
        streams: &mut Streams,
        covectors: &mut Vec<Covector>,
    ) -> u64 {
        let View { world, camera, active } = *view;
        let sample = camera.film.sample(pixel.index, &mut streams.path);
        let origin = Origin::free(camera.position);
        let path = self.paths.trace(world, origin, camera.direction(sample.u), active, &mut streams.path);
        let mut sweep = Sweep {
            world,
            construction: &self.construction,
            kernels: &self.kernels,
            edges: None,
            fault: self.fault,
            geometry: active.geometry,
            rng: &mut streams.auxiliary,
            covectors,
            rays: path.rays,
        };
        let arrival = sweep.path(&path, sample.value);
        if active.geometry {
            let per_u =
                path.vertices.first().map_or(0.0, |v| first_ray(&mut sweep, camera, sample.u, v, arrival));
            let excess = path.radiance(world) - pixel.control;
            let (a, b) = (per_u + sample.slope * excess, sample.value * excess);
            self.film_field(&mut sweep, camera, sample.u, a, b);
            if camera.film.filter == Filter::Box {
                self.pixel_end(&mut sweep, view, pixel, &mut streams.pixel_end);
            }
        }
        sweep.rays
    }
}

impl WarpedArea {
    /// Emits the covectors of a V + b ∇·V on the film, the primary term.
    fn film_field(&self, sweep: &mut Sweep<'_, '_>, camera: &Camera, u: f64, a: f64, b: f64) {
        let field = self.construction.over_film(sweep.world, camera, u, self.kernels.film, sweep.rng);
        sweep.rays += field.rays;
        let mut primary = CameraTangent::default();
        field.scatter(a, b, |point, covector| {
            // A velocity relative to that of the camera.
            primary.position -= covector;
            let terms = Terms { primary: covector, ..Terms::default() };
            sweep.covectors.push(Covector::Point(*point, terms));
        });
        primary.add(a, &field.camera[0]);
        primary.add(b, &field.camera[1]);
        sweep.covectors.push(Covector::Camera(Terms { primary, ..Terms::default() }));
    }

    /// The box filter jumps at the fixed ends of its pixel: the flux f V through one of them, chosen at
    /// random, is subtracted (Bangaru et al. 2022).
    fn pixel_end(
        &self,
        sweep: &mut Sweep<'_, '_>,
        view: &View<'_>,
        pixel: &Pixel,
        rng: &mut crate::random::Stream,
    ) {
        let outward = if crate::random::open01(rng) < 0.5 { -1.0 } else { 1.0 };
        let u = view.camera.film.centre(pixel.index) + 0.5 * outward;
        let origin = Origin::free(view.camera.position);
        let (value, rays) = self.paths.radiance(view.world, origin, view.camera.direction(u), rng);
        sweep.rays += rays;
        self.film_field(sweep, view.camera, u, -2.0 * outward * (value - pixel.control), 0.0);
    }
}
