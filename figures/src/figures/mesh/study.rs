//! The gradient image by three methods, whole and term by term.

use std::time::Instant;

use glam::DVec3;
use volume3d::gradient::{
    EdgeSampling, FiniteDifference, GradientError, GradientImage, Progress, Tangent, WarpedArea, render,
};
use volume3d::scene::Scene;

use super::scene::{Light, bunny};
use crate::context::Context;
use crate::figures::common::seed_of;
use crate::ratio::Ratio;
use crate::space::{Reference, Runs};

/// Independent runs of each method: their spread is the error of everything that is said about it.
pub(super) const RUNS: u64 = 4;

/// The step of finite differences in pixels, and the distance from the axis at which it is that much. A quarter of a pixel
/// blurs edges by as much and so makes the gradient 5 % too small.
pub(super) const STEP: f64 = 0.08;
const RADIUS: f64 = 0.5;

/// What a gradient image is the sum of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Part {
    Whole,
    /// What changes while all jumps stand still.
    Interior,
    /// Silhouettes, seen by the camera.
    Primary,
    /// Jumps seen from shading points, in light that comes straight from the lamp: shadows.
    Shadow,
    /// The rest of the secondary term: jumps in light that other surfaces scatter.
    Indirect,
}

impl Part {
    pub(super) const ALL: [Self; 5] =
        [Self::Whole, Self::Interior, Self::Primary, Self::Shadow, Self::Indirect];

    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Whole => "whole gradient",
            Self::Interior => "interior",
            Self::Primary => "primary: silhouettes",
            Self::Shadow => "secondary: direct light",
            Self::Indirect => "secondary: indirect light",
        }
    }

    /// In names of files.
    pub(super) fn file(self) -> &'static str {
        ["whole", "interior", "primary", "shadow", "indirect"][self as usize]
    }
}

/// The runs of one method that tells terms apart: one image for every part and run.
pub(super) struct Apart {
    pub(super) samples: usize,
    pub(super) seconds: f64,
    parts: [Vec<Vec<DVec3>>; 5],
}

/// The runs of finite differences.
pub(super) struct Differences {
    pub(super) samples: usize,
    pub(super) seconds: f64,
    pub(super) step: f64,
    runs: Vec<Vec<DVec3>>,
}

pub(super) struct Study {
    pub(super) side: usize,
    pub(super) scene: Scene,
    pub(super) triangles: usize,
    pub(super) image: Vec<DVec3>,
    pub(super) warped: Apart,
    pub(super) edges: Apart,
    pub(super) differences: Differences,
}

type Estimate<'a> = &'a dyn Fn(&Scene, &Tangent, u64, &Progress) -> Result<GradientImage, GradientError>;

impl Study {
    pub(super) fn new(context: &Context) -> anyhow::Result<Self> {
        let side = context.spend(80, 192);
        let (scene, change) = bunny(side, Light::All)?;
        let image = render(&scene, context.spend(128, 1024), context.seed(), &context.progress("11 image"))?;
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
        Ok(Self { side, scene, triangles, image: image.pixels, warped, edges, differences })
    }
}

/// All runs of a method, with all light and with direct light only. Each method has random numbers of its own, or the noise
/// that they share would pass for agreement.
fn apart(
    context: &Context,
    (name, stream): (&str, u64),
    side: usize,
    samples: usize,
    estimate: Estimate<'_>,
) -> anyhow::Result<Apart> {
    let start = Instant::now();
    let mut parts: [Vec<Vec<DVec3>>; 5] = Default::default();
    for run in 0..RUNS {
        let seed = seed_of(context.seed(), &[11, stream, run]);
        let terms = |light: Light, what: &str| -> anyhow::Result<GradientImage> {
            let (scene, change) = bunny(side, light)?;
            Ok(estimate(&scene, &change, seed, &context.progress(&format!("11 {name}, {what}")))?)
        };
        let all = terms(Light::All, "all light")?;
        let direct = terms(Light::Direct, "direct light")?;
        let (Some(terms), Some(direct)) = (all.terms, direct.terms) else {
            anyhow::bail!("{name} does not tell the terms apart");
        };
        let indirect = terms.secondary.iter().zip(&direct.secondary).map(|(all, direct)| *all - *direct);
        parts[Part::Indirect as usize].push(indirect.collect());
        parts[Part::Shadow as usize].push(direct.secondary);
        parts[Part::Primary as usize].push(terms.primary);
        parts[Part::Interior as usize].push(terms.interior);
        parts[Part::Whole as usize].push(all.gradient);
    }
    Ok(Apart { samples: samples * RUNS as usize, seconds: start.elapsed().as_secs_f64(), parts })
}

fn differences(context: &Context, scene: &Scene, change: &Tangent, step: f64) -> anyhow::Result<Differences> {
    let start = Instant::now();
    let samples = context.spend(48, 1024);
    let runs = (0..RUNS).map(|run| {
        let method = FiniteDifference { samples, step, seed: seed_of(context.seed(), &[11, 2, run]) };
        Ok(method.forward(scene, change, &context.progress("11 finite differences"))?.gradient)
    });
    let runs = runs.collect::<anyhow::Result<_>>()?;
    let seconds = start.elapsed().as_secs_f64();
    Ok(Differences { samples: samples * RUNS as usize, seconds, step, runs })
}

impl Apart {
    /// The mean over all runs.
    pub(super) fn mean(&self, part: Part) -> Vec<DVec3> {
        self.reference(part).gradient
    }

    pub(super) fn reference(&self, part: Part) -> Reference {
        Reference::of_runs(self.parts[part as usize].clone())
    }

    /// How a part agrees with another estimate of it.
    pub(super) fn agreement(&self, part: Part, reference: &Reference) -> Agreement {
        Agreement::new(&self.parts[part as usize], reference)
    }
}

impl Differences {
    pub(super) fn reference(&self) -> Reference {
        Reference::of_runs(self.runs.clone())
    }

    pub(super) fn agreement(&self, reference: &Reference) -> Agreement {
        Agreement::new(&self.runs, reference)
    }
}

/// How the mean of all runs agrees with a reference whose own noise is taken out.
#[derive(Clone, Copy, Debug)]
pub(super) struct Agreement {
    /// 1 if both are right.
    pub(super) slope: Ratio,
    /// Mean squared error over the reference's mean square.
    pub(super) error: f64,
}

impl Agreement {
    fn new(runs: &[Vec<DVec3>], reference: &Reference) -> Self {
        let compared = Runs::new(runs, reference);
        let measured = compared.measured();
        let error = measured.bias2 + measured.variance / runs.len() as f64;
        let signal = 1.0 - reference.floor / reference.power();
        Self { slope: compared.true_slope(), error: error / signal }
    }
}
