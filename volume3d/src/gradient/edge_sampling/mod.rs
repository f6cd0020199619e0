//! Monte Carlo edge sampling (Li, Aittala, Durand and Lehtinen 2018): the interior term by path tracing, the
//! boundary terms by sampling edges.

mod carried;
mod curve;
mod driver;
mod emitters;
mod flips;
mod horizon;
mod inner_flips;
mod list;
mod primary;
mod secondary;
mod sensor;
mod sides;
mod table;
#[cfg(test)]
mod tests;
mod walk;
mod warped;
mod wedge;

use glam::DVec3;

use self::driver::{Boundary, Driver, Estimate};
use self::emitters::Emitters;
use self::flips::Flips;
use self::horizon::Horizon;
use self::inner_flips::InnerFlips;
use self::list::EdgeList;
use self::primary::Primary;
use self::secondary::{Light, Secondary};
pub(super) use self::warped::Flipped;
use super::change::{supports_change, supports_wanted};
use super::contribution::Contribution;
use super::motion::Motion;
use super::{Change, Gradient, GradientError, GradientImage, Progress, Stopped, Terms, Wanted, WarpedArea};
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
const INNER_FLIP: u64 = 24;
const BEFORE_FLIP: u64 = 25;
const FLIP_AUXILIARY: u64 = 26;

/// What stands still is at most this part of all samples of jumps seen from shading points, where other things move:
/// it counts only where the shading point moves.
const STILL: f64 = 0.2;

/// Derivatives by sampling edges.
///
/// Besides edges it samples the curves that smooth shading brings: where a surface turns its other side to the camera
/// or to an earlier point of the path, and the horizon of a face that turns.
///
/// Jumps seen from shading points are drawn where they arise: a point of an edge, and a line through it. Where the film
/// shows a small part of a large world few lines pass what it shows, and the secondary term is noisy; a receiver of
/// a thousandth of its world's size is hardly ever found.
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
        Self { samples: 16, primary: 16, secondary: 16, seed: 0 }
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
    /// [`GradientError`]: `Unsupported` where geometry moves before ideal mirrors or under lights without extent,
    /// `Change` if the change is of another scene, `Samples` and `Warp` for parameters out of their range, and `Stopped`.
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
    /// [`GradientError`]: `Unsupported` where geometry moves before ideal mirrors or under lights without extent,
    /// `Change` if the change is of another scene, `Samples` and `Warp` for parameters out of their range, and `Stopped`.
    pub fn forward_terms(
        &self,
        scene: &Scene,
        change: &Change,
        progress: &Progress,
    ) -> Result<GradientImage, GradientError> {
        supports_change(scene, change)?;
        self.check(change.is_geometric())?;
        let image = self.interior().forward(scene, change, progress)?;
        let motion = Motion::new(scene, change);
        let moving = Moving::of(scene, &motion);
        let zero = vec![DVec3::ZERO; image.gradient.len()];
        let terms = Terms { interior: image.gradient.clone(), primary: zero.clone(), secondary: zero };
        let mut sums = Images { method: self, scene, motion: &motion, progress, image, terms };
        each_boundary(scene, &moving, &mut sums)?;
        let Images { mut image, terms, .. } = sums;
        image.terms = Some(terms);
        Ok(image)
    }

    /// Σ over pixels and channels of adjoint · dI/dθ, for every wanted parameter θ at once: the transpose of
    /// [`forward`](Self::forward), with the same random numbers if the wanted shapes are those that move.
    ///
    /// # Errors
    /// [`GradientError`]: `Unsupported` where geometry is wanted before ideal mirrors or under lights without extent,
    /// `Adjoint` if the adjoint has not the film's size, `Samples` and `Warp` for parameters out of their range, and
    /// `Stopped`.
    pub fn reverse(
        &self,
        scene: &Scene,
        adjoint: &[DVec3],
        wanted: &Wanted,
        progress: &Progress,
    ) -> Result<Gradient, GradientError> {
        supports_wanted(scene, wanted)?;
        self.check(wanted.is_geometric())?;
        let mut gradient = self.interior().reverse(scene, adjoint, wanted, progress)?;
        let moving = Moving { shapes: wanted.shapes.clone(), camera: wanted.camera };
        let boundary = Change::still(scene).into();
        let mut sums = Sums { method: self, scene, adjoint, wanted, progress, gradient: boundary };
        each_boundary(scene, &moving, &mut sums)?;
        let mut boundary = sums.gradient;
        boundary.change.pull_normals(scene, wanted);
        gradient.absorb(boundary);
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

    fn driver<'s>(&self, scene: &'s Scene, term: Term) -> Driver<'s> {
        let (width, height) = scene.size();
        let samples = if term == Term::Primary { self.primary } else { self.secondary };
        Driver::new(scene, self.seed, samples * width * height)
    }

    fn check(&self, geometric: bool) -> Result<(), GradientError> {
        match [self.samples, self.primary, self.secondary].into_iter().find(|&s| s < 1 && geometric) {
            Some(samples) => Err(GradientError::Samples { samples, least: 1 }),
            None => Ok(()),
        }
    }
}

impl Moving {
    /// As if everything did.
    fn everything(scene: &Scene) -> Self {
        Self { shapes: vec![true; scene.description.shapes.len()], camera: true }
    }

    /// What moves or turns its normals.
    fn of(scene: &Scene, motion: &Motion<'_>) -> Self {
        let turns = |s: usize| motion.normals[scene.normal_range(s)].iter().any(|n| *n != DVec3::ZERO);
        let shapes = motion.moves.iter().enumerate().map(|(s, moves)| *moves || turns(s)).collect();
        Self { shapes, camera: motion.camera_moves }
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
enum Term {
    Primary,
    Secondary,
}

/// What is done with every boundary there is.
trait Take {
    fn take(&mut self, term: Term, boundary: &impl Boundary) -> Result<(), Stopped>;
}

/// Hands over all boundaries of a scene, one after the other.
fn each_boundary(scene: &Scene, moving: &Moving, taker: &mut impl Take) -> Result<(), Stopped> {
    if !moving.anything() {
        return Ok(());
    }
    let paths = Paths::new(scene, Kernels::default());
    let list = EdgeList::new(scene);
    taker.take(Term::Primary, &Primary::new(&paths, &list, moving))?;
    taker.take(Term::Primary, &Flips::new(&paths, moving))?;
    for light in [Light::Emitted, Light::Rest] {
        taker.take(Term::Secondary, &Secondary::new(&paths, &list, moving, light))?;
    }
    taker.take(Term::Secondary, &Emitters::new(&paths, &list, moving))?;
    taker.take(Term::Secondary, &Horizon::new(&paths, moving))?;
    taker.take(Term::Secondary, &InnerFlips::new(&paths, moving))
}

/// Forward mode: the image so far.
struct Images<'a> {
    method: &'a EdgeSampling,
    scene: &'a Scene,
    motion: &'a Motion<'a>,
    progress: &'a Progress,
    image: GradientImage,
    terms: Terms,
}

impl Take for Images<'_> {
    fn take(&mut self, term: Term, boundary: &impl Boundary) -> Result<(), Stopped> {
        if !boundary.is_empty() {
            let estimate =
                self.method.driver(self.scene, term).forward(boundary, self.motion, self.progress)?;
            let Terms { primary, secondary, .. } = &mut self.terms;
            let part = if term == Term::Primary { primary } else { secondary };
            add(&mut self.image, Some(part), estimate);
        }
        Ok(())
    }
}

/// Reverse mode: the boundary terms so far.
struct Sums<'a> {
    method: &'a EdgeSampling,
    scene: &'a Scene,
    adjoint: &'a [DVec3],
    wanted: &'a Wanted,
    progress: &'a Progress,
    gradient: Gradient,
}

impl Take for Sums<'_> {
    fn take(&mut self, term: Term, boundary: &impl Boundary) -> Result<(), Stopped> {
        if boundary.is_empty() {
            return Ok(());
        }
        let driver = self.method.driver(self.scene, term);
        driver.reverse(boundary, self.adjoint, self.wanted, self.progress, &mut self.gradient)
    }
}

/// Adds an estimate to the whole and to a term, if terms are kept apart.
fn add(image: &mut GradientImage, mut term: Option<&mut Vec<DVec3>>, estimate: Estimate) {
    for (i, (mean, variance)) in estimate.mean.iter().zip(&estimate.variance).enumerate() {
        if let Some(term) = &mut term {
            term[i] += *mean;
        }
        image.gradient[i] += *mean;
        let error = image.standard_error[i];
        image.standard_error[i] = (error * error + *variance).map(f64::sqrt);
    }
    image.regions.add(&estimate.regions);
    image.auxiliary_rays += estimate.rays;
    image.non_finite.extend(estimate.non_finite);
    Contribution::keep_larger(&mut image.largest, estimate.largest);
}
