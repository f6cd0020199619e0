//! Boundary terms of meshes: ∮ Δf v·ν along curves of discontinuity, by sampling points of them.
//!
//! The curves are edges and crossings on the film and as seen from shading points, borders of emitters, and
//! the curves of smooth shading: where a surface turns its other side to the camera or to an earlier path
//! vertex, and the horizon of a rotating face (Theory 9). Edge sampling takes all of them with V = 0;
//! warped-area sampling takes only the sign changes, with v − V in place of v (Theory 7): its field follows
//! the others except borders of flat emitters, which are added during next-event estimation.

mod along_warp;
mod curve;
mod directions;
mod driver;
mod emitters;
mod horizon;
mod inner_sign_changes;
mod list;
mod primary;
mod reflected_outlines;
mod residual;
mod secondary;
mod sensor;
mod sides;
mod sign_changes;
mod sums;
mod table;
#[cfg(test)]
mod tests;
mod walk;
mod warped;
mod warped_ray;
mod wedge;

use glam::DVec3;

pub(super) use self::along_warp::AlongWarp;
use self::driver::Boundary;
use self::emitters::{Emitters, Of};
use self::horizon::{Beyond, Horizon};
use self::inner_sign_changes::InnerSignChanges;
use self::list::EdgeList;
use self::primary::{Lines, Primary};
use self::reflected_outlines::ReflectedOutlines;
pub(super) use self::secondary::contacts_are_followed;
use self::secondary::{Light, Secondary};
use self::sign_changes::FilmSignChanges;
pub(super) use self::sums::{Effort, Gradients, Images};
use super::motion::Motion;
use super::{ActiveParameters, Stopped};
use crate::path::{Kernels, Paths};
use crate::scene::Scene;

/// Random streams, distinct from those of the interior term.
const PRIMARY_EDGE: u64 = 16;
const LIT_EDGE: u64 = 17;
const REST_EDGE: u64 = 18;
const EMITTER_EDGE: u64 = 19;
const BACKWARDS: u64 = 20;
const HORIZON: u64 = 21;
const BEYOND_HORIZON: u64 = 22;
const SIGN_CHANGE: u64 = 23;
const INNER_SIGN_CHANGE: u64 = 24;
const BEFORE_SIGN_CHANGE: u64 = 25;
const SIGN_CHANGE_AUXILIARY: u64 = 26;
const OUTLINE: u64 = 27;

/// Cap on the weight of static edges relative to that of moving ones, if any geometry moves. Static edges
/// contribute only if the shading point moves; with a smaller fraction their samples would be rare and large.
const STILL: f64 = 0.5;

/// Moving or active shapes and camera.
#[derive(Clone, Debug)]
pub(super) struct Moving {
    pub(super) shapes: Vec<bool>,
    pub(super) camera: bool,
}

impl Moving {
    /// Everything moves.
    fn everything(scene: &Scene) -> Self {
        let description = &scene.description;
        Self { shapes: vec![true; description.shapes.len() + description.implicits.len()], camera: true }
    }

    /// Shapes that move or whose normals change.
    pub(super) fn of(scene: &Scene, motion: &Motion<'_>) -> Self {
        let turns = |s: usize| motion.normals[scene.normal_range(s)].iter().any(|n| *n != DVec3::ZERO);
        let meshes = motion.moves.iter().enumerate().map(|(s, moves)| *moves || turns(s));
        let shapes = meshes.chain(motion.change.implicits.iter().map(|rates| !rates.is_still())).collect();
        Self { shapes, camera: motion.camera_moves }
    }

    /// Active shapes and camera.
    pub(super) fn active(active: &ActiveParameters) -> Self {
        let shapes = active.shapes.iter().chain(&active.implicits).copied().collect();
        Self { shapes, camera: active.camera }
    }

    fn anything(&self) -> bool {
        self.camera || self.shapes.iter().any(|&s| s)
    }

    /// Whether any of the given shapes moves.
    fn has_any(&self, shapes: [u32; 2]) -> bool {
        shapes.iter().any(|&s| self.shapes[s as usize])
    }

    /// Scales the weights of static entries down to a fraction of those of moving ones, if there are any.
    fn limit_still(&self, weights: &mut [f64], part: f64, moves: impl Fn(usize) -> bool) {
        let sum = |moving: bool| -> f64 {
            weights.iter().enumerate().filter(|&(i, _)| moves(i) == moving).map(|(_, w)| w).sum()
        };
        let (moving, still) = (sum(true), sum(false));
        if moving > 0.0 && still > part * moving && !self.camera {
            let factor = part * moving / still;
            weights.iter_mut().enumerate().filter(|&(i, _)| !moves(i)).for_each(|(_, w)| *w *= factor);
        }
    }
}

/// The term to which a boundary belongs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Term {
    Primary,
    Secondary,
    /// The part of the secondary term with a sample count of its own: light reflected by surfaces, a constant
    /// environment, and outlines of emitters after a bounce.
    Bounce,
}

/// Consumer of boundaries.
pub(super) trait Take {
    fn take(&mut self, term: Term, boundary: &impl Boundary) -> Result<(), Stopped>;
}

/// Passes all boundaries of a scene to a consumer.
pub(super) fn each_boundary(scene: &Scene, moving: &Moving, taker: &mut impl Take) -> Result<(), Stopped> {
    if !moving.anything() {
        return Ok(());
    }
    let paths = Paths::new(scene, Kernels::default());
    let list = &*scene.derived(EdgeList::new);
    taker.take(Term::Primary, &Primary::new(&paths, list, moving, Lines::Jumps))?;
    taker.take(Term::Primary, &FilmSignChanges::new(&paths, moving))?;
    for (term, light) in [(Term::Secondary, Light::Emitted), (Term::Bounce, Light::Rest)] {
        taker.take(term, &Secondary::new(&paths, list, moving, light))?;
    }
    taker.take(Term::Secondary, &Emitters::new(&paths, list, moving, Of::All, 1))?;
    taker.take(Term::Bounce, &ReflectedOutlines::new(&paths, list, moving))?;
    taker.take(Term::Secondary, &Horizon::new(&paths, moving, Beyond::All))?;
    taker.take(Term::Secondary, &InnerSignChanges::new(&paths, moving))
}
