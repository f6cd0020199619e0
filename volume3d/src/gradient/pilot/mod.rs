//! Which unbiased method, and how its samples are split: what a pilot of few samples says.
//!
//! A gradient is a sum of independent parts, an integral over the area and others over curves. Part i of nᵢ samples has the
//! variance σᵢ²/nᵢ and takes the time cᵢ nᵢ. Of all splits that take a time T the least variance has nᵢ ∝ σᵢ/√cᵢ
//! (Neyman 1934), and it is (Σ σᵢ √cᵢ)²/T. So two methods are compared by Σ σᵢ √cᵢ alone, each at its best split:
//!
//! - warped-area sampling with a [softened field](Field::Softened): area, silhouettes on the film, edges of shadows, silhouettes that
//!   bounces see;
//! - [edge sampling](EdgeSampling): paths, edges on the film, edges that shading points see before lights and before all else.
//!
//! The exact [mean over jumps](Field::JumpMean) is the first with ε = 0; at equal time it was never better where both were
//! measured. It is what is left where a field cannot be softened, beside implicit surfaces, and there nothing is to be chosen.
//!
//! Samples of the area are spread over the film by the same rule, more of them in squares of 16 × 16 pixels where the pilot's scatter
//! more: an [`Allocation`].
//!
//! The σᵢ are the pilot's, whose samples have a seed of their own and are not used again: what is chosen does not depend on what
//! is then estimated, and is unbiased. The cᵢ are constants that were measured: the clock would choose anew in every run,
//! and the same seed has the same bits here, on any machine. A cost that is wrong by a factor of 2 makes a part's samples wrong by √2,
//! and the variance larger by 3 % at most.

mod method;
mod split;

use std::sync::Arc;

use flatland::random::stream;
use glam::DVec3;
use rand::Rng as _;

pub use self::method::Method;
use self::split::{PARTS, Split, split};
use super::film::FilmPlane;
use super::groups::GROUPS;
use super::warped_area::shadows_are_curves;
use super::{
    ActiveParameters, Allocation, EdgeSampling, Field, GradientError, Progress, Tangent, WarpedArea,
};
use crate::Image;
use crate::scene::Scene;

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
    /// about 5 of them, or of an eighth of them if that is more.
    pub samples: usize,
    /// The seed of what is chosen; the pilot's own follows from it.
    pub seed: u64,
}

/// What a pilot chose, and why.
#[derive(Clone, Debug)]
pub struct Choice {
    /// The better of the candidates; edge sampling if they are much alike.
    pub method: Method,
    /// All of them, the chosen first; none if there was nothing to be chosen.
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
}

/// The purpose of random numbers.
const PILOT: u64 = 0x70_696c_6f74;
/// The pilot's part of all samples, and how many it has at least: a variance takes two, and that of curves is told by groups.
const PART: usize = 32;
const PART_OF_AREA: usize = 16;
const FEWEST: usize = 4;
/// The part of all samples that is the area's at least, and that where materials or lights change as well, of which curves know
/// nothing; and at least one of each group that tells a standard error, if there are as many. The image that comes with a gradient
/// has no other.
const OF_AREA: usize = 8;
const OF_AREA_IF_SMOOTH: usize = 2;

/// Costs of samples relative to that of a path of edge sampling: of the area, of a curve of every kind on the film, and of one that
/// shading points see before lights, and before all else. Processor time on figure 12's five scenes of 128² pixels: means, of which single ones are 0.5 to 2.3 times as much.
const SOFTENED_COSTS: [f64; PARTS - 1] = [4.3, 2.2, 2.5];
const EDGE_COSTS: [f64; PARTS - 1] = [2.0, 1.3, 1.3];
/// Many samples of the area are stratified, of which few show little: what they scatter is about this part of what few say (0.4 to 1.2).
const STRATIFIED: f64 = 0.7;
/// Samples of the area are spread unevenly if there are so many: twice as many as the least.
const SPREAD: usize = 2 * GROUPS;
/// Enough to tell what spreading them is worth.
const MANY: usize = 1 << 16;
/// The cost of a sample of [`WarpedArea::default`].
const EXACT_COST: f64 = 3.0;

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
        self.choose(scene, change, None, change.is_more_than_geometric(), progress)
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
        if let Some(adjoint) = adjoint
            && (adjoint.size() != scene.size() || adjoint.pixels.len() != adjoint.width * adjoint.height)
        {
            return Err(GradientError::Adjoint { found: adjoint.size(), film: scene.size() });
        }
        let change = self.stand_in(scene, active);
        let smooth = active.lights || active.poses || active.materials.contains(&true);
        self.choose(scene, &change, adjoint, smooth, progress)
    }

    fn choose(
        &self,
        scene: &Scene,
        change: &Tangent,
        weights: Option<&Image>,
        smooth: bool,
        progress: &Progress,
    ) -> Result<Choice, GradientError> {
        if !change.fits(scene) {
            return Err(GradientError::Tangent);
        }
        if self.samples < 1 {
            return Err(GradientError::Samples { samples: self.samples, least: 1 });
        }
        let exact = WarpedArea { samples: self.samples, seed: self.seed, ..WarpedArea::default() };
        if !change.is_geometric() || !scene.description.implicits.is_empty() {
            return Ok(Choice { method: Method::WarpedArea(exact), candidates: vec![] });
        }
        let seed = stream(self.seed, &[PILOT, self.samples as u64]).next_u64();
        let (few, curves) = ((self.samples / PART_OF_AREA).max(FEWEST), (self.samples / PART).max(1));
        let film = FilmPlane::new(scene);
        let part = if smooth { OF_AREA_IF_SMOOTH } else { OF_AREA };
        let of_area = (self.samples / part).max(self.samples.min(GROUPS)).max(FEWEST);
        // The candidate, and whether the pilot saw some of every part.
        let trial = |method: Method, costs: [f64; PARTS - 1]| -> Result<_, GradientError> {
            let noise = method.forward(scene, change, progress)?.noise;
            let by_pixel = weighted(&noise.area, weights);
            let curve = |image| curves as f64 * weighted(image, weights).iter().sum::<f64>();
            let [on_film, before_lights, before_all_else] =
                [&noise.film_curves, &noise.shading_curves, &noise.bounce_curves].map(curve);
            // Of one sample, spread as they will be.
            let by_cell: Vec<f64> = noise.work.iter().map(|work| 1.0 + work / few as f64).collect();
            let spread = |samples: usize| Arc::new(Allocation::new(&film, samples, &by_pixel, &by_cell));
            let area = STRATIFIED * few as f64 * spread(MANY).variance(&film, MANY, &by_pixel);
            let [film_cost, light_cost, other_cost] = costs;
            let costs = [
                by_cell.iter().sum::<f64>() / by_cell.len() as f64,
                film_cost * noise.kinds.on_film as f64,
                light_cost * noise.kinds.before_lights as f64,
                other_cost * noise.kinds.before_all_else as f64,
            ];
            let variances = [area, on_film, before_lights, before_all_else];
            let mut split = split(variances, costs, EXACT_COST * self.samples as f64, of_area);
            let seen = (1..PARTS).all(|i| costs[i] == 0.0 || variances[i] > 0.0);
            let area = split.samples[0];
            let allocation = (area >= SPREAD && !smooth).then(|| spread(area));
            if let Some(allocation) = &allocation {
                split.samples[0] = allocation.mean(&film).round() as usize;
            }
            if std::env::var("DBG").is_ok() {
                eprintln!("costs {costs:?} variances {variances:?} split {split:?}");
            }
            Ok((candidate(&method, self.seed, split, allocation), seen))
        };
        let softened = WarpedArea {
            samples: few,
            sign_changes: curves,
            field: softened(curves, curves, curves),
            seed,
            ..WarpedArea::default()
        };
        let (warped, _) = trial(Method::WarpedArea(softened), SOFTENED_COSTS)?;
        if !shadows_are_curves(scene) {
            return Ok(Choice { method: warped.method.clone(), candidates: vec![warped] });
        }
        let edges = EdgeSampling {
            samples: few,
            primary: curves,
            secondary: curves,
            bounces: curves,
            seed,
            allow_missing: vec![],
        };
        let (edges, seen) = trial(Method::EdgeSampling(edges), EDGE_COSTS)?;
        // In a large world, of which the film shows a small part, few edges are found by chance.
        let better = seen && edges.expected_squared_error < warped.expected_squared_error;
        let candidates = if better { vec![edges, warped] } else { vec![warped, edges] };
        Ok(Choice { method: candidates[0].method.clone(), candidates })
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

/// With the default's reach and softness.
fn softened(silhouettes: usize, shadows: usize, bounces: usize) -> Field {
    match Field::softened(1) {
        Field::Softened { film, lobe, softness, .. } => {
            Field::Softened { film, lobe, softness, silhouettes, shadows, bounces }
        }
        other => other,
    }
}

/// A method of the pilot's kind with the samples of a split.
fn candidate(method: &Method, seed: u64, split: Split, allocation: Option<Arc<Allocation>>) -> Candidate {
    let [samples, film, shading, bounces] = split.samples;
    let method = match method {
        Method::WarpedArea(method) => Method::WarpedArea(WarpedArea {
            samples,
            allocation,
            // One number for both kinds.
            sign_changes: (film + shading).div_ceil(2),
            field: softened(film, shading, bounces),
            seed,
            ..method.clone()
        }),
        Method::EdgeSampling(method) => Method::EdgeSampling(EdgeSampling {
            samples,
            primary: film,
            secondary: shading,
            bounces,
            seed,
            ..method.clone()
        }),
    };
    Candidate { method, expected_squared_error: split.variance, shares: split.shares }
}

/// The sum of an image's channels by pixel, weighted by the squares of another's; 0 where it is not finite.
fn weighted(variance: &Image, weights: Option<&Image>) -> Vec<f64> {
    let of = |i: usize, v: DVec3| match weights {
        Some(weights) => v.dot(weights.pixels[i] * weights.pixels[i]),
        None => v.element_sum(),
    };
    let finite = |v: f64| if v.is_finite() { v } else { 0.0 };
    variance.pixels.iter().enumerate().map(|(i, v)| finite(of(i, *v))).collect()
}
