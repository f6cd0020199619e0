//! Pilot: choice of the unbiased method and of its sample split, from a run of few samples.
//!
//! A gradient is a sum of independent parts, one integral over the area and others over curves. Part i with
//! nᵢ samples has the variance σᵢ²/nᵢ and the cost cᵢ nᵢ. At fixed total cost T the variance is least for
//! nᵢ ∝ σᵢ/√cᵢ (Neyman 1934), where it equals (Σ σᵢ √cᵢ)²/T. Methods, each at its best split, are therefore
//! compared by Σ σᵢ √cᵢ:
//!
//! - warped-area sampling with a [softened field](crate::gradient::Field::Softened): area, silhouettes on the
//!   film, edges of shadows;
//! - [edge sampling](EdgeSampling): paths, edges on the film, edges seen from shading points before lights
//!   and before everything else;
//! - warped-area sampling with the exact [mean over discontinuities](crate::gradient::Field::JumpMean), with
//!   area samples only, if the pilot has more than the minimum number of samples.
//!
//! The softened field, which has the lightest tails, is chosen unless another method's expected error is
//! lower by more than the pilot's uncertainty:
//!
//! - Edge sampling must promise an error lower by a quarter if the pilot has the minimum number of samples,
//!   and by less with more samples. If its trial saw nothing of a kind of curve, 16 times as many samples of
//!   that kind are drawn. If these see nothing either, three in as many may contribute (the rule of three),
//!   each like those of the noisiest kind; edge sampling is then chosen only if it promises a four times
//!   lower error and its trial is not refuted by the other's.
//! - The exact mean has heavy tails where silhouettes meet in penumbrae. It must be better by two standard
//!   errors of its variance, estimated from the variance's spread over the film, and its trial must confirm
//!   that of the softened field.
//!
//! If the trial of the softened field saw no shadow, its field towards lights is exact: sampled curves miss
//! shadows that are a small part of what the film shows.
//!
//! Where light comes through ideal mirrors, glass or masks, or from lights without extent, the exact mean is
//! used without a trial: only warped-area sampling follows discontinuities there.
//!
//! Edge sampling is not a candidate with implicit surfaces, whose silhouettes it does not support; with
//! materials that are not diffuse, as few samples find what narrow lobes see; or with more emitting shapes
//! than contacts are detected for. The exact mean is used without a trial if implicit surfaces are present
//! and no mesh moves, or if listing and weighing all edges would take more than a quarter of the time.
//!
//! Area samples of warped-area sampling are allocated over the film by the same rule, if there are at least
//! 16 of them in a single view, only geometry changes, and light is reflected only once: see
//! [`Allocation`](crate::gradient::Allocation).
//!
//! The σᵢ come from the pilot, whose samples have a seed of their own and are not reused: the choice does not
//! depend on the final estimate, which stays unbiased. The cᵢ are counts of rays and of means over
//! discontinuities, which predict processor time to about 25 %. They make results reproducible, which timings
//! would not. A cost wrong by a factor of 2 makes a sample count wrong by √2, and increases the variance by
//! at most 3 %.

mod agreement;
mod choice;
mod method;
mod reason;
mod split;
mod survey;
mod trial;

use flatland::random::stream;
use glam::DVec3;
use rand::Rng as _;

use self::agreement::Agreement;
use self::choice::FEWEST;
pub use self::choice::{Candidate, Choice, Pilot};
pub use self::method::Method;
pub use self::reason::Reason;
pub use self::survey::Survey;
use self::survey::{Seen, softened};
use self::trial::Trial;
use crate::Image;
use crate::gradient::curve::contacts_are_followed;
use crate::gradient::results::error::check_adjoint;
use crate::gradient::unsupported::moves_chains;
use crate::gradient::{ActiveParameters, EdgeSampling, Field, GradientError, Progress, Tangent, WarpedArea};
use crate::scene::{Bsdf, Scene, Triangle};

/// Purpose of the random numbers.
const PILOT: u64 = 0x70_696c_6f74;
/// The pilot's fraction of all samples, and its least number of curve samples: the variance of curves is
/// estimated from groups. Twice the least numbers gave no better choices.
const PART: usize = 64;
const PART_OF_AREA: usize = 32;
const FEWEST_CURVES: usize = 1;
/// Costs in rays: to list an edge; to weigh it if its shape does not emit; to put it into the hierarchy of
/// the exact mean, with its triangles and their crossings; and the assumed cost of a sample of the exact mean
/// while that is unknown.
const LISTED: f64 = 2.0;
const WEIGHED: f64 = 9.0;
const MADE: f64 = 24.0;
const SAMPLE: f64 = 16.0;
/// Number of edges per triangle.
const EDGES: f64 = 1.5;
/// Largest fraction of the time of the method that listing edges may take.
const QUARTER: f64 = 0.25;

/// Whether all surfaces have wide lobes. Edges are sampled independently of lobes: few of those that a narrow
/// lobe reflects are found, and the pilot may see none. (A sphere in front of a conductor of roughness 0.025
/// had 400 times the squared error that the pilot expected of edge sampling, and 35 times that of warped-area
/// sampling.)
fn reflects_widely(scene: &Scene) -> bool {
    scene.description.materials.iter().all(|material| matches!(material.bsdf, Bsdf::Diffuse { .. }))
}

impl Pilot {
    /// The better method for the derivative along a tangent.
    ///
    /// # Errors
    /// As for [`WarpedArea::forward`].
    pub fn for_change(
        &self,
        scene: &Scene,
        change: &Tangent,
        progress: &Progress,
    ) -> Result<Choice, GradientError> {
        Ok(self.choice(&self.survey_along(scene, change, progress)?))
    }

    /// Survey of the derivative along a tangent, for [`choice`](Self::choice).
    ///
    /// # Errors
    /// As for [`WarpedArea::forward`].
    pub fn survey_along(
        &self,
        scene: &Scene,
        change: &Tangent,
        progress: &Progress,
    ) -> Result<Survey, GradientError> {
        self.look(scene, change, None, change.is_more_than_geometric(), progress)
    }

    /// The better method for reverse mode. In place of all parameters the pilot moves every active shape and
    /// the camera in random directions, and weights the noise of pixels by the square of the adjoint, if
    /// there is one.
    ///
    /// # Errors
    /// As for [`WarpedArea::reverse`].
    pub fn for_active(
        &self,
        scene: &Scene,
        adjoint: Option<&Image>,
        active: &ActiveParameters,
        progress: &Progress,
    ) -> Result<Choice, GradientError> {
        Ok(self.choice(&self.survey(scene, adjoint, active, progress)?))
    }

    /// Survey of one view of several, for [`choice`](Self::choice).
    ///
    /// # Errors
    /// As for [`WarpedArea::reverse`].
    pub fn survey(
        &self,
        scene: &Scene,
        adjoint: Option<&Image>,
        active: &ActiveParameters,
        progress: &Progress,
    ) -> Result<Survey, GradientError> {
        adjoint.map_or(Ok(()), |adjoint| check_adjoint(scene, adjoint))?;
        let change = self.stand_in(scene, active);
        let smooth = active.lights
            || active.environment_rotation
            || active.moves_lights()
            || active.materials.contains(&true);
        self.look(scene, &change, adjoint, smooth, progress)
    }

    pub(in crate::gradient) fn look(
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
        // Light through chains has one method only.
        if !change.is_geometric() || (implicit && !meshes) || moves_chains(scene, change) {
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
        // The minimum number of samples does not show whether its tails are heavy.
        if few > FEWEST {
            let method = area(Field::default(), seed_of_exact);
            let exact = trial(&method)?;
            survey.agreements[1] = Agreement::of(&softened, &exact);
            survey.exact = Some(Seen::of(&exact, method, (few, curves)));
        }
        Ok(survey)
    }

    /// Whether listing edges would take too long.
    fn is_in_haste(&self, scene: &Scene) -> bool {
        let (width, height) = scene.size();
        let edges = |count: usize| EDGES * count as f64;
        let emits = |t: &&Triangle| scene.description.shapes[t.shape as usize].radiance.is_some();
        let (all, emitting) = (scene.triangles.len(), scene.triangles.iter().filter(emits).count());
        let asked = MADE * edges(all) + SAMPLE * (self.samples * width * height) as f64;
        LISTED * edges(all) + WEIGHED * edges(all - emitting) > QUARTER * asked
    }

    /// The pilot's own numbers of area samples and of curve samples.
    fn few(&self) -> (usize, usize) {
        ((self.samples / PART_OF_AREA).max(FEWEST), (self.samples / PART).max(FEWEST_CURVES))
    }

    /// Seed of the pilot's samples: equal for all budgets with equally large pilots.
    fn own_seed(&self) -> u64 {
        stream(self.seed, &[PILOT, self.few().0 as u64]).next_u64()
    }

    /// A motion of everything active: shapes and camera translate and rotate in random directions, at speeds
    /// proportional to their size or distance.
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
