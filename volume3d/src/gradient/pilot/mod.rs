//! Which unbiased method, and how its samples are split: what a pilot of few samples says.
//!
//! A gradient is a sum of independent parts, an integral over the area and others over curves. Part i of nᵢ samples has the
//! variance σᵢ²/nᵢ and takes the time cᵢ nᵢ. Of all splits that take a time T the least variance has nᵢ ∝ σᵢ/√cᵢ
//! (Neyman 1934), and it is (Σ σᵢ √cᵢ)²/T. So two methods are compared by Σ σᵢ √cᵢ alone, each at its best split:
//!
//! - warped-area sampling with a [softened field](super::Field::Softened): area, silhouettes on the film, edges of shadows;
//! - [edge sampling](EdgeSampling): paths, edges on the film, edges that shading points see before lights
//!   and before all else;
//! - warped-area sampling with the exact [mean over jumps](super::Field::JumpMean), whose samples are all
//!   of the area, where the pilot has more than the fewest samples.
//!
//! The softened field, whose tails are the lightest, is taken unless another one is expected to err less by
//! more than the pilot may be wrong:
//!
//! - Edge sampling has to promise a quarter less if a pilot has the fewest samples, and with more of them
//!   less than that. Of a kind of curve of which its trial saw nothing 16 times as many samples are drawn.
//!   If these see nothing either, three in as many may (the rule of three), each like those of the noisiest
//!   kind; edge sampling is then chosen if it promises to err four times less, and its trial is not refuted
//!   by the other's.
//! - The exact mean has heavy tails where silhouettes meet in penumbrae. It has to promise less by two
//!   standard errors of its variance, known by the spread of that over the film, and its trial has to
//!   confirm that of the softened field.
//!
//! Where the trial of the softened field saw no shadow, its field towards lights is exact: sampled curves
//! miss shadows of which the film shows a small part.
//!
//! Edge sampling is no candidate beside implicit surfaces, whose silhouettes it does not know; where a
//! material is not diffuse, as few samples find what narrow lobes see; and where more shapes emit than
//! contacts are followed of. Nothing is chosen, and the exact mean is taken, where no mesh moves beside
//! implicit surfaces, and where a list of all edges, which it does not need, would take more than a quarter
//! of the time.
//!
//! Samples of the area of warped-area sampling are spread over the film by the same rule, more of them in squares of pixels where the pilot's
//! scatter more, if there are 16 or more, of one view, only geometry changes, and light is reflected only once: an [`Allocation`](super::Allocation).
//!
//! The σᵢ are the pilot's, whose samples have a seed of their own and are not used again: what is chosen does not depend on what
//! is then estimated, and is unbiased. The cᵢ are counts of rays and of means over jumps, which tell processor time within a quarter: the clock
//! would choose anew in every run, and the same seed has the same bits here, on any machine. A cost that is wrong by a factor of 2
//! makes a part's samples wrong by √2, and the variance larger by 3 % at most.

mod agreement;
mod method;
mod reason;
mod split;
mod survey;
mod trial;

use flatland::random::stream;
use glam::DVec3;
use rand::Rng as _;

use self::agreement::Agreement;
pub use self::method::Method;
pub use self::reason::Reason;
pub use self::survey::Survey;
use self::survey::{Seen, softened};
use self::trial::Trial;
use super::boundary::contacts_are_followed;
use super::{ActiveParameters, EdgeSampling, Field, GradientError, Progress, Tangent, WarpedArea};
use crate::Image;
use crate::scene::{Bsdf, Scene, Triangle};

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
    /// Samples a pixel of [`WarpedArea::default`] that take about as long as what is chosen. The pilot
    /// takes the time of about 8 to 32 more, or of an eighth of them if that is more.
    pub samples: usize,
    /// The seed of what is chosen; the pilot's own follows from it.
    pub seed: u64,
}

/// What a pilot chose, and why.
#[derive(Clone, Debug)]
pub struct Choice {
    /// The best of the candidates: the softened field, unless another one is expected to err less, by as
    /// much as the pilot may be wrong.
    pub method: Method,
    /// All of them, the chosen first; none if there was nothing to be chosen, and no edge sampling where a surface is not diffuse.
    pub candidates: Vec<Candidate>,
    /// Whether listing all edges would have taken more than a quarter of the time of what is chosen: then
    /// nothing was tried, and the exact mean is taken, which needs no lists.
    pub in_haste: bool,
    /// Whether what is chosen is expected to err by as much as all that any trial found: then the choice is
    /// a guess, and so is what it leads to.
    pub is_lost: bool,
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
    /// Why it was not chosen where it is expected to err less than one that was preferred to it.
    pub reason: Option<Reason>,
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
/// What it takes to list an edge, to weigh it if its shape does not emit, and to put it into the hierarchy
/// of the exact mean with its triangles and their crossings, in rays: on a bumpy sphere of 122,888 edges.
/// And what a sample of the exact mean takes, as long as that is unknown.
const LISTED: f64 = 2.0;
const WEIGHED: f64 = 9.0;
const MADE: f64 = 24.0;
const SAMPLE: f64 = 16.0;
/// Edges for each triangle.
const EDGES: f64 = 1.5;
/// The part of the time of what is asked for that listing edges takes at most.
const QUARTER: f64 = 0.25;

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
        let smooth = active.lights
            || active.environment_rotation
            || active.moves_lights()
            || active.materials.contains(&true);
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
        let implicit = !scene.description.implicits.is_empty();
        let meshes = change.positions.iter().any(|rate| *rate != DVec3::ZERO);
        if !change.is_geometric() || (implicit && !meshes) {
            return Ok(Survey::nothing());
        }
        if self.is_in_haste(scene) {
            return Ok(Survey { in_haste: true, ..Survey::nothing() });
        }
        let (seed, (few, curves)) = (self.own_seed(), self.few());
        // Trials that are compared need independent seeds.
        let [seed_of_edges, seed_of_exact, seed_again] = [1, 2, 3].map(|n| stream(seed, &[n]).next_u64());
        let trial = |method: &Method| -> Result<Trial<'_>, GradientError> {
            Ok(Trial { scene, image: method.forward(scene, change, progress)?, weights })
        };
        let area = |field, seed| {
            Method::WarpedArea(WarpedArea {
                samples: few,
                sign_changes: curves,
                field,
                seed,
                ..WarpedArea::default()
            })
        };
        let method = area(softened(curves, curves), seed);
        let softened = trial(&method)?;
        let found = Agreement::alone(&softened);
        let mut survey = Survey { smooth, found, seed, ..Survey::nothing() };
        survey.softened = Some(Seen::of(&softened, method, (few, curves)));
        if !implicit && reflects_widely(scene) && contacts_are_followed(scene) {
            let method = Method::EdgeSampling(EdgeSampling {
                samples: few,
                primary: curves,
                secondary: curves,
                bounces: curves,
                seed: seed_of_edges,
                ..EdgeSampling::default()
            });
            let edges = trial(&method)?;
            survey.agreements[0] = Agreement::of(&softened, &edges);
            let seen = Seen::of(&edges, method, (few, curves));
            survey.edges = Some(match seen.again(seed_again) {
                Some(again) => seen.with_again(&trial(&Method::EdgeSampling(again))?),
                None => seen,
            });
        }
        // The fewest do not tell whether its tails are heavy.
        if few > FEWEST {
            let method = area(Field::default(), seed_of_exact);
            let exact = trial(&method)?;
            survey.agreements[1] = Agreement::of(&softened, &exact);
            survey.exact = Some(Seen::of(&exact, method, (few, curves)));
        }
        Ok(survey)
    }

    /// Whether there is no time to list edges.
    fn is_in_haste(&self, scene: &Scene) -> bool {
        let (width, height) = scene.size();
        let edges = |count: usize| EDGES * count as f64;
        let emits = |t: &&Triangle| scene.description.shapes[t.shape as usize].radiance.is_some();
        let (all, emitting) = (scene.triangles.len(), scene.triangles.iter().filter(emits).count());
        let asked = MADE * edges(all) + SAMPLE * (self.samples * width * height) as f64;
        LISTED * edges(all) + WEIGHED * edges(all - emitting) > QUARTER * asked
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
