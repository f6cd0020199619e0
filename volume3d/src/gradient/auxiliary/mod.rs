//! Warps at a point, from auxiliary rays or from nearby discontinuities.

mod ahead;
mod follow;
mod mean;
mod weighted;

use std::cell::Cell;

use flatland::random::Stream;
use flatland::sdf::{End, Trace};
use flatland::warp::{Bundle, Domain, Plane, Warp};
use glam::{DVec2, DVec3};

use self::ahead::Ahead;
use self::mean::{Near, ON_FILM};
use super::film::FilmPlane;
use crate::Sphere;
use crate::gradient::warp::implicit_field::ImplicitField;
use crate::gradient::warp::jump_mean::{AngularSupport, SceneEdges};
use crate::gradient::warp::motion::MovingBounds;
use crate::gradient::warp::warps::{DirectionWarp, FilmField, FilmWarp};
use crate::path::{Kernel, Paths};
use crate::scene::{Hit, Surface, traced_by_this_thread};

/// Cost, in rays, of a mean over discontinuities, and of each piece of an edge in it. With 2, costs of
/// softened fields relative to edge sampling are predicted to a factor of 0.8 to 1.25.
const MEAN: f64 = 2.0;

/// Work of this thread so far, in rays: traced rays, and means over discontinuities.
pub(crate) fn work(auxiliary: Option<&Auxiliary<'_>>) -> f64 {
    traced_by_this_thread() as f64 + MEAN * auxiliary.map_or(0.0, |auxiliary| auxiliary.work() as f64)
}

/// Source of the velocities of a field.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Construction {
    /// Mean over discontinuities near a direction. `film` and `lobe` are the reach, in pixels on the film and
    /// in kernel widths elsewhere; the softness is in the same units. If shadows are sampled as curves, only
    /// implicit surfaces contribute towards lights, as given by their own field.
    JumpMean {
        film: f64,
        lobe: f64,
        softness: f64,
        lobe_softness: f64,
        sampled_shadows: bool,
        implicit: ImplicitField,
    },
    /// Mean over auxiliary rays, weighted by boundary functions. On directions, velocities fade near
    /// discontinuities, V_i (1 − B_i).
    Weighted,
    /// One rigid motion per kernel, that of the nearest of `candidates` points.
    Followed { candidates: usize },
}

/// Constructor of warps, which traces their auxiliary rays.
#[derive(Debug)]
pub(crate) struct Auxiliary<'s> {
    pub(crate) paths: &'s Paths<'s>,
    pub(crate) warp: &'s Warp,
    pub(crate) moving: &'s MovingBounds,
    pub(crate) construction: Construction,
    /// Edges of the scene, for fields that use them.
    pub(crate) edges: Option<&'s SceneEdges>,
    pub(crate) rng: Stream,
    /// Whether chains of ideal boundaries, and lights without extent, have warps of their own.
    pub(crate) follows_chains: bool,
    /// Whether film points come in random order, so that silhouettes near one are not reusable for the next.
    pub(crate) scattered: bool,
    rays: u64,
    work: u64,
    directions: Vec<DVec3>,
    hits: Vec<Option<Hit>>,
    near: Near,
    /// Cached caps, within lobes, towards lights and on the film: those of one shading point are alike.
    supports: [Cell<AngularSupport>; 3],
    /// Scratch memory for rays at implicit surfaces.
    trace: Trace<DVec3>,
    ahead: Ahead,
}

impl<'s> Auxiliary<'s> {
    pub(crate) fn new(
        paths: &'s Paths<'s>,
        warp: &'s Warp,
        moving: &'s MovingBounds,
        construction: Construction,
        edges: Option<&'s SceneEdges>,
        rng: Stream,
    ) -> Self {
        Self {
            paths,
            warp,
            moving,
            construction,
            edges,
            rng,
            follows_chains: false,
            scattered: false,
            rays: 0,
            work: 0,
            directions: vec![],
            hits: vec![],
            near: Near::default(),
            supports: [const { Cell::new(AngularSupport::NONE) }; 3],
            trace: Trace { direction: DVec3::ZERO, points: vec![], end: End::Miss },
            ahead: Ahead::nothing(),
        }
    }

    /// Number of rays traced.
    pub(crate) fn rays(&self) -> u64 {
        self.rays
    }

    /// Counts rays that were traced elsewhere.
    pub(crate) fn count(&mut self, rays: u64) {
        self.rays += rays;
    }

    /// Auxiliary points of a field of chains around one point.
    pub(crate) fn chain_bundle<D: Domain>(&mut self, at: D::Vector, kappa: f64) -> Bundle<D> {
        self.warp.bundle(at, kappa, &mut self.rng)
    }

    /// Work of means over discontinuities: their number plus the number of their edge pieces.
    pub(crate) fn work(&self) -> u64 {
        self.work
    }

    /// Whether the warp may be nonzero at direction ω seen from a static point x on a surface.
    pub(crate) fn may_warp(&self, x: DVec3, direction: DVec3, kernel: &Kernel) -> bool {
        match self.construction {
            Construction::JumpMean { .. } => {
                self.reach(kernel).is_some_and(|reach| self.moving.may_be_near(x, direction, reach))
            }
            Construction::Weighted | Construction::Followed { .. } => true,
        }
    }

    /// Whether the warp towards a sampled light may be nonzero.
    pub(crate) fn warps_light(&self) -> bool {
        !self.samples_shadows() || !self.paths.scene.description.implicits.is_empty()
    }

    /// Whether shadows of meshes are sampled as curves, so that the field towards lights has no mesh edges.
    pub(super) fn samples_shadows(&self) -> bool {
        matches!(self.construction, Construction::JumpMean { sampled_shadows: true, .. })
    }

    /// Whether the field within lobes is continuous everywhere: true for the mean over discontinuities,
    /// unless it is softened, which leaves residuals.
    pub(crate) fn levels_bounces(&self) -> bool {
        matches!(self.construction, Construction::JumpMean { lobe_softness: 0.0, .. })
    }

    /// The warp at direction ω seen from x on a surface; `None` if nothing seen can move.
    pub(crate) fn on_sphere(
        &mut self,
        x: DVec3,
        from: Surface,
        direction: DVec3,
        kernel: Kernel,
        x_moves: bool,
    ) -> Option<DirectionWarp> {
        let kappa = kernel.kappa;
        if let Construction::JumpMean { .. } = self.construction {
            let reach = self.reach(&kernel)?;
            let mean = self.jump_mean_on_sphere(x, from, direction, kernel, reach, x_moves)?;
            self.work += mean.work();
            return Some(DirectionWarp::JumpMean(mean));
        }
        if let Construction::Followed { candidates } = self.construction {
            // As for weights: objects below the horizon are inside a solid and arbitrarily near.
            let keep =
                |d: DVec3, distance| kernel.normal.dot(d) > 0.0 && kernel.domain.counts(x, d, distance);
            let motion =
                self.follow::<Sphere>(x, Some(from), direction, kappa, candidates, x_moves, |d| d, keep);
            return motion.map(DirectionWarp::Rigid);
        }
        self.weighted_on_sphere(x, from, direction, kernel, x_moves)
    }

    /// The warp at a film point where a surface or nothing is seen; `None` if nothing seen can move.
    pub(crate) fn on_film(
        &mut self,
        film: &FilmPlane,
        u: DVec2,
        seen: Option<Surface>,
        camera_moves: bool,
    ) -> Option<FilmWarp> {
        let kappa = self.paths.kernels.film;
        let ray = |p: DVec2| film.ray(p);
        let origin = film.still.origin.value();
        let field = match self.construction {
            Construction::JumpMean { film: radius, softness, .. } => {
                let [radius, softness] = [radius, softness].map(|pixels| pixels * film.pixel_angle());
                let reach = self.support(ON_FILM, radius).softened(softness);
                let direction = ray(u);
                let from_one_place = !film.has_lens() && !self.scattered;
                let mean = self.jump_mean_on_film(
                    origin,
                    direction,
                    (reach, softness),
                    seen,
                    camera_moves,
                    from_one_place,
                )?;
                self.work += mean.work();
                FilmField::JumpMean(mean, direction)
            }
            Construction::Followed { candidates } => {
                let everything = |_, _| true;
                let motion =
                    self.follow::<Plane>(origin, None, u, kappa, candidates, camera_moves, ray, everything);
                FilmField::Rigid(motion?)
            }
            Construction::Weighted => {
                FilmField::Rays(self.weighted_on_film(film, u, kappa, ray, camera_moves)?)
            }
        };
        Some(FilmWarp { field, film: *film })
    }

    /// Field of implicit surfaces within the mean over discontinuities.
    fn implicit_field(&self) -> ImplicitField {
        self.field_of_implicits().unwrap_or_default()
    }

    /// The field of implicit surfaces, if there are any and it consists of their tracer's points.
    fn field_of_implicits(&self) -> Option<ImplicitField> {
        match self.construction {
            Construction::JumpMean { implicit, .. } if !self.paths.scene.description.implicits.is_empty() => {
                Some(implicit)
            }
            Construction::JumpMean { .. } | Construction::Weighted | Construction::Followed { .. } => None,
        }
    }

    /// Unit normal of a surface at a point, on the side of the vector `side`.
    fn upward(&self, surface: Surface, at: DVec3, side: DVec3) -> DVec3 {
        let normal = self.paths.scene.normal_of(surface, at);
        if normal.dot(side) < 0.0 { -normal } else { normal }
    }
}
