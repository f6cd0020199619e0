//! Which unbiased method, and how its samples are split: what a pilot of few samples says.
//!
//! A gradient is a sum of independent parts, an integral over the area and others over curves. Part i of nᵢ samples has the
//! variance σᵢ²/nᵢ and takes the time cᵢ nᵢ. Of all splits that take a time T the least variance has nᵢ ∝ σᵢ/√cᵢ
//! (Neyman 1934), and it is (Σ σᵢ √cᵢ)²/T. So two methods are compared by Σ σᵢ √cᵢ alone, each at its best split:
//!
//! - warped-area sampling with a [softened field](super::Field::Softened): area, silhouettes on the film, edges of shadows;
//! - [edge sampling](EdgeSampling): paths, edges on the film, edges that shading points see before lights and before all else.
//!
//! The exact [mean over jumps](super::Field::JumpMean) is the first with ε = 0; at equal time it was never
//! better where both were measured. Beside implicit surfaces it is what is taken, and nothing is chosen: edge
//! sampling does not know their silhouettes.
//!
//! Samples of the area of warped-area sampling are spread over the film by the same rule, more of them in squares of pixels where the pilot's
//! scatter more, if there are 16 or more, of one view, only geometry changes, and light is reflected only once: an [`Allocation`](super::Allocation).
//!
//! The σᵢ are the pilot's, whose samples have a seed of their own and are not used again: what is chosen does not depend on what
//! is then estimated, and is unbiased. The cᵢ are counts of rays and of means over jumps, which tell processor time within a quarter: the clock
//! would choose anew in every run, and the same seed has the same bits here, on any machine. A cost that is wrong by a factor of 2
//! makes a part's samples wrong by √2, and the variance larger by 3 % at most.

mod method;
mod split;
mod survey;

use flatland::random::stream;
use glam::DVec3;
use rand::Rng as _;

pub use self::method::Method;
pub use self::survey::Survey;
use self::survey::{Seen, softened};
use super::boundary::contacts_are_followed;
use super::{ActiveParameters, EdgeSampling, GradientError, Progress, Tangent, WarpedArea};
use crate::Image;
use crate::scene::{Bsdf, Scene};

/// Chooses between unbiased methods, and splits their samples.
///
/// ```no_run
/// # use volume3d::{gradient::{Pilot, Progress, Tangent}, scene::Scene};
/// # fn f(scene: &Scene, change: &Tangent) -> Result<(), Box<dyn std::error::Error>> {
/// let choice = Pilot { samples: 64, seed: 1 }.for_change(scene, change, &Progress::none())?;
/// let image = choice.method.forward(scene, change, &Progress::none())?;
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Copy, Debug)]
pub struct Pilot {
    /// What is chosen takes about the time of [`WarpedArea::default`] with so many samples a pixel. The pilot itself takes that of
    /// about 8 of them, or of an eighth of them if that is more.
    pub samples: usize,
    /// The seed of what is chosen; the pilot's own follows from it.
    pub seed: u64,
}

/// What a pilot chose, and why.
#[derive(Clone, Debug)]
pub struct Choice {
    /// The better of the candidates; edge sampling if it is expected to have clearly less error, by a quarter in a pilot of the fewest samples, or
    /// less at all where light is reflected more than once.
    pub method: Method,
    /// All of them, the chosen first; none if there was nothing to be chosen, and no edge sampling where a surface is not diffuse.
    pub candidates: Vec<Candidate>,
}

/// A method with its best split.
#[derive(Clone, Debug)]
pub struct Candidate {
    /// The method.
    pub method: Method,
    /// The squared error that the pilot expects of it: the sum over pixels and channels, each as often as the adjoint's square says.
    pub expected_squared_error: f64,
    /// What part of it is the area's, that of curves on the film, that of curves before lights that shading points see, and that of
    /// curves before all else.
    pub shares: [f64; 4],
    /// Whether the pilot saw light jump at every kind of curve that it sampled. If not, the expected error
    /// lacks what was not seen, and the method is not chosen.
    pub is_complete: bool,
}

/// The purpose of random numbers.
const PILOT: u64 = 0x70_696c_6f74;
/// The pilot's part of all samples, and how many it has at least: a variance takes two, and that of curves is told by groups.
///
/// At 40 samples on figure 12's scenes twice as many of the least led to choices as good, and took another 7 to 15 % of the time.
const PART: usize = 64;
const PART_OF_AREA: usize = 32;
const FEWEST: usize = 2;
const FEWEST_CURVES: usize = 1;

/// Whether all surfaces reflect widely. Edges are drawn without regard to lobes: few of those that a narrow one reflects are found, and a pilot of few
/// samples may see none. (A sphere before a conductor of roughness 0.025 had 400 times the squared error that the pilot expected of edge
/// sampling, and 35 times that of warped-area sampling.)
fn reflects_widely(scene: &Scene) -> bool {
    scene.description.materials.iter().all(|material| matches!(material.bsdf, Bsdf::Diffuse { .. }))
}

impl Pilot {
    /// The better method for the derivative along a change.
    ///
    /// # Errors
    /// Those of [`WarpedArea::forward`].
    pub fn for_change(
        &self,
        scene: &Scene,
        change: &Tangent,
        progress: &Progress,
    ) -> Result<Choice, GradientError> {
        Ok(self.choice(&self.survey_along(scene, change, progress)?))
    }

    /// What it sees of a derivative along a change, for [`choice`](Self::choice).
    ///
    /// # Errors
    /// Those of [`WarpedArea::forward`].
    pub fn survey_along(
        &self,
        scene: &Scene,
        change: &Tangent,
        progress: &Progress,
    ) -> Result<Survey, GradientError> {
        self.look(scene, change, None, change.is_more_than_geometric(), progress)
    }

    /// The better method for the transpose. As a stand-in for all parameters the pilot moves every active shape and the
    /// camera along a direction of its own, and counts the noise of pixels by the square of the adjoint, if there is one.
    ///
    /// # Errors
    /// Those of [`WarpedArea::reverse`].
    pub fn for_active(
        &self,
        scene: &Scene,
        adjoint: Option<&Image>,
        active: &ActiveParameters,
        progress: &Progress,
    ) -> Result<Choice, GradientError> {
        Ok(self.choice(&self.survey(scene, adjoint, active, progress)?))
    }

    /// What it sees of one view of several, for [`choice`](Self::choice).
    ///
    /// # Errors
    /// Those of [`WarpedArea::reverse`].
    pub fn survey(
        &self,
        scene: &Scene,
        adjoint: Option<&Image>,
        active: &ActiveParameters,
        progress: &Progress,
    ) -> Result<Survey, GradientError> {
        if let Some(adjoint) = adjoint
            && (adjoint.size() != scene.size() || adjoint.pixels.len() != adjoint.width * adjoint.height)
        {
            return Err(GradientError::Adjoint { found: adjoint.size(), film: scene.size() });
        }
        let change = self.stand_in(scene, active);
        let smooth = active.lights || active.poses || active.materials.contains(&true);
        self.look(scene, &change, adjoint, smooth, progress)
    }

    pub(super) fn look(
        &self,
        scene: &Scene,
        change: &Tangent,
        weights: Option<&Image>,
        smooth: bool,
        progress: &Progress,
    ) -> Result<Survey, GradientError> {
        if !change.fits(scene) {
            return Err(GradientError::Tangent);
        }
        if self.samples < 1 {
            return Err(GradientError::Samples { samples: self.samples, least: 1 });
        }
        if !change.is_geometric() || !scene.description.implicits.is_empty() {
            return Ok(Survey::nothing());
        }
        let (seed, (few, curves)) = (self.own_seed(), self.few());
        let trial = |method: Method| -> Result<Seen, GradientError> {
            let noise = method.forward(scene, change, progress)?.noise;
            Ok(Seen::of(scene, method, &noise, (few, curves), weights))
        };
        let softened = Method::WarpedArea(WarpedArea {
            samples: few,
            sign_changes: curves,
            field: softened(curves, curves),
            seed,
            ..WarpedArea::default()
        });
        let edges = Method::EdgeSampling(EdgeSampling {
            samples: few,
            primary: curves,
            secondary: curves,
            bounces: curves,
            seed,
            ..EdgeSampling::default()
        });
        let softened = Some(trial(softened)?);
        let tried = reflects_widely(scene) && contacts_are_followed(scene);
        let edges = if tried { Some(trial(edges)?) } else { None };
        Ok(Survey { smooth, softened, edges, views: 1, seed })
    }

    /// How many samples of the area and of curves it takes itself.
    fn few(&self) -> (usize, usize) {
        ((self.samples / PART_OF_AREA).max(FEWEST), (self.samples / PART).max(FEWEST_CURVES))
    }

    /// Of its samples: the same for all numbers of samples of which it sees as much.
    fn own_seed(&self) -> u64 {
        stream(self.seed, &[PILOT, self.few().0 as u64]).next_u64()
    }

    /// A motion of all that is active: shapes and camera move and turn, each in a direction of its own, at a speed of its size or distance.
    fn stand_in(&self, scene: &Scene, active: &ActiveParameters) -> Tangent {
        let mut rng = stream(self.seed, &[PILOT]);
        let mut direction = move || {
            let mut number = || (rng.next_u64() >> 11) as f64 / (1u64 << 53) as f64 - 0.5;
            DVec3::new(number(), number(), number()).try_normalize().unwrap_or(DVec3::X)
        };
        let mut change = Tangent::still(scene);
        for shape in (0..active.shapes.len()).filter(|&s| active.shapes[s]) {
            let corners = &scene.positions[scene.position_range(shape)];
            let centre = corners.iter().sum::<DVec3>() / corners.len().max(1) as f64;
            let size = corners.iter().map(|p| p.distance(centre)).fold(0.0, f64::max);
            change.translate(scene, shape, direction() * size);
            change.rotate(scene, shape, centre, direction());
        }
        for (rates, _) in change.implicits.iter_mut().zip(&active.implicits).filter(|(_, active)| **active) {
            rates.translation = direction();
        }
        if active.camera {
            change.camera.rotation = direction();
        }
        change
    }
}
