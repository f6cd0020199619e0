//! Warps at a point: from what auxiliary rays hit, or from the jumps near by.

mod ahead;
mod follow;
mod mean;
mod weighted;

use std::cell::Cell;

use flatland::random::Stream;
use flatland::sdf::{End, Trace};
use flatland::warp::{Plane, Warp};
use glam::{DVec2, DVec3};

use self::ahead::Ahead;
use self::mean::{Near, ON_FILM};
use super::film::FilmPlane;
use super::implicit_field::ImplicitField;
use super::jump_mean::{AngularSupport, SceneEdges};
use super::motion::MovingBounds;
use super::warps::{DirectionWarp, FilmField, FilmWarp};
use crate::Sphere;
use crate::path::{Kernel, Paths};
use crate::scene::{Hit, Surface, traced_by_this_thread};

/// What a mean over jumps takes, and each piece of an edge in it, relative to a ray: with 1 softened fields took 1.0 to 1.6 times as long
/// as a pilot thought in comparison with edge sampling, on figure 12's scenes, and with 2 it is 0.8 to 1.25 times.
const MEAN: f64 = 2.0;

/// What this thread has done so far, in rays: those it has traced, and means over jumps.
pub(crate) fn work(auxiliary: Option<&Auxiliary<'_>>) -> f64 {
    traced_by_this_thread() as f64 + MEAN * auxiliary.map_or(0.0, |auxiliary| auxiliary.work() as f64)
}

/// Where the velocities that make a field come from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Construction {
    /// The mean over jumps near a direction: within so many pixels on the film, so many widths of the kernel
    /// elsewhere; softened by so many pixels on the film, and so many widths within lobes. Towards lights, if
    /// shadows are sampled as curves, there is what implicit surfaces give to it alone. They give what their
    /// field says.
    JumpMean {
        film: f64,
        lobe: f64,
        softness: f64,
        lobe_softness: f64,
        sampled_shadows: bool,
        implicit: ImplicitField,
    },
    /// Weighted with regard to boundaries. On directions velocities fade away from jumps, V_i (1 − B_i).
    Weighted,
    /// One rigid motion per kernel, that of the nearest of so many points.
    Followed { candidates: usize },
}

/// Who makes warps, and traces auxiliary rays for them.
#[derive(Debug)]
pub(crate) struct Auxiliary<'s> {
    pub(crate) paths: &'s Paths<'s>,
    pub(crate) warp: &'s Warp,
    pub(crate) moving: &'s MovingBounds,
    pub(crate) construction: Construction,
    /// The edges of the scene, for fields that are made of them.
    pub(crate) edges: Option<&'s SceneEdges>,
    pub(crate) rng: Stream,
    /// Whether film points come in no order, so that silhouettes near one are of no use for the next.
    pub(crate) scattered: bool,
    rays: u64,
    work: u64,
    directions: Vec<DVec3>,
    hits: Vec<Option<Hit>>,
    near: Near,
    /// Caps that were made last, within lobes, towards lights and on the film: those of one shading point are alike.
    supports: [Cell<AngularSupport>; 3],
    /// Memory for rays at implicit surfaces.
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

    /// How many rays have been traced.
    pub(crate) fn rays(&self) -> u64 {
        self.rays
    }

    /// What means over jumps took: how many have been made, and pieces of edges in them.
    pub(crate) fn work(&self) -> u64 {
        self.work
    }

    /// Whether there may be a warp at direction ω as seen from x on a surface, if x stands still.
    pub(crate) fn may_warp(&self, x: DVec3, direction: DVec3, kernel: &Kernel) -> bool {
        match self.construction {
            Construction::JumpMean { .. } => {
                self.reach(kernel).is_some_and(|reach| self.moving.may_be_near(x, direction, reach))
            }
            Construction::Weighted | Construction::Followed { .. } => true,
        }
    }

    /// Whether there may be a warp towards a light that is chosen.
    pub(crate) fn warps_light(&self) -> bool {
        !self.samples_shadows() || !self.paths.scene.description.implicits.is_empty()
    }

    /// Whether shadows of meshes are sampled, and no edge of theirs is in the field towards lights.
    pub(super) fn samples_shadows(&self) -> bool {
        matches!(self.construction, Construction::JumpMean { sampled_shadows: true, .. })
    }

    /// Whether the field within lobes is continuous everywhere: the mean over jumps, unless it is softened, which leaves residuals.
    pub(crate) fn levels_bounces(&self) -> bool {
        matches!(self.construction, Construction::JumpMean { lobe_softness: 0.0, .. })
    }

    /// The warp at direction ω as seen from x on a surface; nothing where nothing seen can move.
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
            // As for weights: what is below the horizon is inside a solid, and arbitrarily near.
            let keep =
                |d: DVec3, distance| kernel.normal.dot(d) > 0.0 && kernel.domain.counts(x, d, distance);
            let motion =
                self.follow::<Sphere>(x, Some(from), direction, kappa, candidates, x_moves, |d| d, keep);
            return motion.map(DirectionWarp::Rigid);
        }
        self.weighted_on_sphere(x, from, direction, kernel, x_moves)
    }

    /// The warp at a point of the film, at which a surface or nothing is seen; nothing where nothing seen can move.
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

    /// The field of implicit surfaces within the mean over jumps.
    fn implicit_field(&self) -> ImplicitField {
        self.field_of_implicits().unwrap_or_default()
    }

    /// The same, if there are any and it is made of their tracer's points.
    fn field_of_implicits(&self) -> Option<ImplicitField> {
        match self.construction {
            Construction::JumpMean { implicit, .. } if !self.paths.scene.description.implicits.is_empty() => {
                Some(implicit)
            }
            Construction::JumpMean { .. } | Construction::Weighted | Construction::Followed { .. } => None,
        }
    }

    /// The unit normal of a surface at a point of it, on the side of another vector.
    fn upward(&self, surface: Surface, at: DVec3, side: DVec3) -> DVec3 {
        let normal = self.paths.scene.normal_of(surface, at);
        if normal.dot(side) < 0.0 { -normal } else { normal }
    }
}
