//! The gradient image by three methods, whole and term by term.

use std::time::Instant;

use glam::DVec3;
use volume3d::gradient::{
    EdgeSampling, FiniteDifference, GradientError, GradientImage, Progress, Tangent, WarpedArea, render,
};
use volume3d::scene::Scene;

use super::scene::{Light, bunny};
use crate::context::Context;
use crate::ratio::Ratio;
use crate::seeds::seed_of;
use crate::space::{Compared, Reference};

/// Independent runs of each method: their spread is the error of all reported numbers.
pub(super) const RUNS: u64 = 4;

/// The step of finite differences in pixels, and the distance from the axis at which it is that large. A
/// quarter of a pixel blurs edges by as much and so makes the gradient 5 % too small.
pub(super) const STEP: f64 = 0.08;
const RADIUS: f64 = 0.5;

/// Term of a gradient image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Part {
    Whole,
    /// The change at fixed discontinuities.
    Interior,
    /// Silhouettes, seen by the camera.
    Primary,
    /// Discontinuities seen from shading points, in light that comes straight from the lamp: shadows.
    Shadow,
    /// The rest of the secondary term: discontinuities in light that other surfaces scatter.
    Indirect,
}

impl Part {
    pub(super) const ALL: [Self; 5] =
        [Self::Whole, Self::Interior, Self::Primary, Self::Shadow, Self::Indirect];

    /// The name on pages, and the name in files.
    pub(super) fn names(self) -> [&'static str; 2] {
        match self {
            Self::Whole => ["whole gradient", "whole"],
            Self::Interior => ["interior", "interior"],
            Self::Primary => ["primary: silhouettes", "primary"],
            Self::Shadow => ["secondary: direct light", "shadow"],
            Self::Indirect => ["secondary: indirect light", "indirect"],
        }
    }
}

/// The runs of one method: one image for every part, if it separates terms, and run.
pub(super) struct Parts {
    pub(super) samples: usize,
    pub(super) seconds: f64,
    parts: [Vec<Vec<DVec3>>; 5],
}

pub(super) struct Study {
    pub(super) side: usize,
    pub(super) scene: Scene,
    pub(super) triangles: usize,
    pub(super) image: Vec<DVec3>,
    pub(super) warped: Parts,
    pub(super) edges: Parts,
    /// Whole gradients only.
    pub(super) differences: Parts,
    /// The step of finite differences in radians.
    pub(super) step: f64,
}

type Estimate<'a> = &'a dyn Fn(&Scene, &Tangent, u64, &Progress) -> Result<GradientImage, GradientError>;

impl Study {
    pub(super) fn new(context: &Context) -> anyhow::Result<Self> {
        let side = context.spend(80, 192);
        let (scene, change) = bunny(side, Light::All)?;
        let image = render(&scene, context.spend(128, 1024), context.seed(), &context.progress("image"))?;
        let samples = context.spend(12, 128);
        let warped = apart(context, ("warped area", 0), side, samples, &|scene, change, seed, progress| {
            WarpedArea { samples, seed, ..WarpedArea::default() }.forward_terms(scene, change, progress)
        })?;
        let samples = context.spend(16, 256);
        let edges = apart(context, ("edge sampling", 1), side, samples, &|scene, change, seed, progress| {
            EdgeSampling { samples, seed, ..EdgeSampling::default() }.forward_terms(scene, change, progress)
        })?;
        let camera = &scene.description().camera;
        let pixel = 2.0 * (0.5 * camera.field_of_view).tan() * camera.origin.length() / side as f64;
        let step = STEP * pixel / RADIUS;
        let differences = differences(context, &scene, &change, step)?;
        let triangles = scene.description().shapes.iter().map(|s| s.mesh.triangles().len()).sum();
        Ok(Self { side, scene, triangles, image: image.image.pixels, warped, edges, differences, step })
    }
}

/// All runs of a method, with all light and with direct light only. Each method has its own random numbers;
/// otherwise shared noise would pass for agreement.
fn apart(
    context: &Context,
    (name, stream): (&str, u64),
    side: usize,
    samples: usize,
    estimate: Estimate<'_>,
) -> anyhow::Result<Parts> {
    let start = Instant::now();
    let mut parts: [Vec<Vec<DVec3>>; 5] = Default::default();
    for run in 0..RUNS {
        let seed = seed_of(context.seed(), &[11, stream, run]);
        let terms = |light: Light, what: &str| -> anyhow::Result<GradientImage> {
            let (scene, change) = bunny(side, light)?;
            Ok(estimate(&scene, &change, seed, &context.progress(&format!("{name}, {what}")))?)
        };
        let all = terms(Light::All, "all light")?;
        let direct = terms(Light::Direct, "direct light")?;
        let (Some(terms), Some(direct)) = (all.terms, direct.terms) else {
            anyhow::bail!("{name} does not tell the terms apart");
        };
        let indirect =
            terms.secondary.pixels.iter().zip(&direct.secondary.pixels).map(|(all, direct)| *all - *direct);
        parts[Part::Indirect as usize].push(indirect.collect());
        parts[Part::Shadow as usize].push(direct.secondary.pixels);
        parts[Part::Primary as usize].push(terms.primary.pixels);
        parts[Part::Interior as usize].push(terms.interior.pixels);
        parts[Part::Whole as usize].push(all.gradient.pixels);
    }
    Ok(Parts { samples: samples * RUNS as usize, seconds: start.elapsed().as_secs_f64(), parts })
}

fn differences(context: &Context, scene: &Scene, change: &Tangent, step: f64) -> anyhow::Result<Parts> {
    let start = Instant::now();
    let samples = context.spend(48, 1024);
    let runs = (0..RUNS).map(|run| {
        let method = FiniteDifference { samples, step, seed: seed_of(context.seed(), &[11, 2, run]) };
        Ok(method.forward(scene, change, &context.progress("finite differences"))?.gradient.pixels)
    });
    let parts = [runs.collect::<anyhow::Result<_>>()?, vec![], vec![], vec![], vec![]];
    Ok(Parts { samples: samples * RUNS as usize, seconds: start.elapsed().as_secs_f64(), parts })
}

impl Parts {
    /// The mean over all runs.
    pub(super) fn mean(&self, part: Part) -> Vec<DVec3> {
        self.reference(part).gradient
    }

    fn reference(&self, part: Part) -> Reference {
        Reference::of_runs(self.parts[part as usize].clone())
    }

    /// Agreement of the mean of all runs of a part with another method's, whose own noise is removed: the
    /// slope, 1 if both are right, and the mean squared error over the other's mean square.
    pub(super) fn agreement(&self, part: Part, other: &Self) -> (Ratio, f64) {
        let (runs, reference) = (&self.parts[part as usize], other.reference(part));
        let compared = Compared::new(runs, &reference);
        let error = compared.bias2.value + compared.variance.value / runs.len() as f64;
        (compared.true_slope, error / (1.0 - reference.floor / reference.power()))
    }
}
