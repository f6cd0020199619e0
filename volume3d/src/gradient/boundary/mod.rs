//! Boundary terms of meshes: ∮ Δf v·ν along the curves at which light jumps, by sampling points of them.
//!
//! Edges and crossings on the film and as shading points see them, borders of emitters, and the curves that
//! smooth shading brings: where a surface turns its other side to the camera or to an earlier point of the
//! path, and the horizon of a face that turns (Theory 9). Edge sampling takes all of them with V = 0; warped
//! area the sign changes alone, with v − V in place of v (Theory 7): its field follows the rest, but for the
//! borders of flat emitters, which are added where next-event estimation meets them.

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

/// Streams of random numbers, beside those of the interior term.
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

/// For a sample of a jump that moves there is at most this of what stands still, where something moves: that counts only where the
/// shading point moves. Fewer would be rare and large.
const STILL: f64 = 0.5;

/// What moves, or is active: the shapes, and the camera.
#[derive(Clone, Debug)]
pub(super) struct Moving {
    pub(super) shapes: Vec<bool>,
    pub(super) camera: bool,
}

impl Moving {
    /// As if everything did.
    fn everything(scene: &Scene) -> Self {
        let description = &scene.description;
        Self { shapes: vec![true; description.shapes.len() + description.implicits.len()], camera: true }
    }

    /// What moves or turns its normals.
    pub(super) fn of(scene: &Scene, motion: &Motion<'_>) -> Self {
        let turns = |s: usize| motion.normals[scene.normal_range(s)].iter().any(|n| *n != DVec3::ZERO);
        let meshes = motion.moves.iter().enumerate().map(|(s, moves)| *moves || turns(s));
        let shapes = meshes.chain(motion.change.implicits.iter().map(|rates| !rates.is_still())).collect();
        Self { shapes, camera: motion.camera_moves }
    }

    /// What is active.
    pub(super) fn active(active: &ActiveParameters) -> Self {
        let shapes = active.shapes.iter().chain(&active.implicits).copied().collect();
        Self { shapes, camera: active.camera }
    }

    fn anything(&self) -> bool {
        self.camera || self.shapes.iter().any(|&s| s)
    }

    /// Whether any of some shapes moves.
    fn has_any(&self, shapes: [u32; 2]) -> bool {
        shapes.iter().any(|&s| self.shapes[s as usize])
    }

    /// Scales the weights of what stands still down to a part of what moves, if something does.
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

/// Which term a boundary belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Term {
    Primary,
    Secondary,
    /// Of the secondary term, what surfaces reflect, a constant environment, and outlines of emitters after a bounce: it has samples of
    /// its own.
    Bounce,
}

/// What is done with every boundary there is.
pub(super) trait Take {
    fn take(&mut self, term: Term, boundary: &impl Boundary) -> Result<(), Stopped>;
}

/// Hands over all boundaries of a scene, one after the other.
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
