//! Every method on a rotation, against edge sampling with many samples.

use glam::DVec3;
use volume3d::gradient::render;

use super::scene::Setting;
use crate::context::Context;
use crate::figures::common::Priced;
use crate::ratio::Ratio;
use crate::seeds::seed_of;
use crate::space::{Clock, Compared, METHODS, Method, Reference, Task};

/// The method whose many samples are the reference: it is unbiased, and its samples have light tails.
const REFERENCE: &str = "edge-sampling";
pub(super) const REFERENCE_RUNS: u64 = 4;
/// The step of finite differences in pixels, for a point at unit distance from the axis.
const STEP: f64 = 0.08;

/// One scene by every method.
pub(super) struct Study {
    pub(super) setting: Setting,
    pub(super) shown: Shown,
    pub(super) reference: Reference,
    pub(super) entries: Vec<Entry>,
}

/// Image and gradient image on a finer film, for readers.
pub(super) struct Shown {
    pub(super) side: usize,
    pub(super) image: Vec<DVec3>,
    pub(super) gradient: Vec<DVec3>,
}

/// One method on one scene.
pub(super) struct Entry {
    pub(super) method: &'static Method,
    pub(super) samples: usize,
    pub(super) runs: u64,
    /// Seconds of one run.
    pub(super) seconds: f64,
    pub(super) compared: Compared,
    pub(super) non_finite: usize,
}

impl Entry {
    /// Relative variance × processor seconds: the cost of a given precision.
    pub(super) fn cost(&self) -> f64 {
        self.compared.variance.value * self.seconds
    }

    /// The slope on the reference, quiet pixels weighing more.
    pub(super) fn quiet(&self) -> Ratio {
        self.compared.quiet_slope
    }

    /// Whether a slope is farther from 1, or bias² from 0, than chance explains.
    pub(super) fn is_biased(&self) -> bool {
        let off = |slope: Ratio| (slope.value - 1.0).abs() > SURE * slope.error.max(LEAST);
        let bias2 = self.compared.bias2;
        off(self.compared.true_slope) || off(self.quiet()) || bias2.value > SURE * bias2.error
    }

    /// Its bias, where one is found, and its cost.
    pub(super) fn priced(&self) -> Priced {
        let slope = (self.quiet().value - 1.0).abs();
        let bias = if self.is_biased() { slope.max(self.compared.bias2.value.max(0.0).sqrt()) } else { 0.0 };
        Priced { name: self.method.name.to_owned(), bias, cost: self.cost() }
    }

    /// Whether a bias of a tenth would go unnoticed.
    pub(super) fn is_vague(&self) -> bool {
        SURE * self.compared.true_slope.error.min(self.quiet().error) > 0.1
    }
}

/// Number of standard errors from which a difference counts as significant. With few runs the standard error
/// itself is uncertain.
pub(super) const SURE: f64 = 4.0;

/// Lower bound on the error of slopes: the reference has noise, finite differences have a step.
const LEAST: f64 = 2.5e-3;

impl Study {
    /// Measures on a setting; what is shown is a finer one of the same scene.
    pub(super) fn new(context: &Context, [setting, finer]: [Setting; 2], index: u64) -> anyhow::Result<Self> {
        let name = setting.name;
        let progress = |what: &str| context.progress(&format!("{name}{what}"));
        let image = render(&finer.scene, context.spend(64, 512), context.seed(), &progress(""))?;
        let task = |samples: usize, words: &[u64]| Task {
            scene: &setting.scene,
            change: &setting.change,
            samples,
            step: STEP * setting.pixel,
            seed: seed_of(context.seed(), words),
        };
        let estimate = |method: &Method, task: &Task<'_>| -> anyhow::Result<_> {
            Ok(method.estimate(task, &progress(&format!(": {}", method.name)))?)
        };
        let many = context.spend(64, 2048);
        let best = Method::of_key(REFERENCE).unwrap_or(&METHODS[0]);
        let of_shown = Task {
            scene: &finer.scene,
            change: &finer.change,
            samples: context.spend(48, 1024),
            step: STEP * finer.pixel,
            seed: seed_of(context.seed(), &[12, index, 98]),
        };
        let shown = Shown {
            side: finer.side(),
            image: image.image.pixels,
            gradient: estimate(best, &of_shown)?.gradient.pixels,
        };
        let reference = (0..REFERENCE_RUNS)
            .map(|run| Ok(estimate(best, &task(many, &[12, index, 99, run]))?.gradient.pixels))
            .collect::<anyhow::Result<Vec<_>>>()?;
        let reference = Reference::of_runs(reference);
        let runs = context.spend(4, 24);
        let mut entries = vec![];
        for (number, method) in METHODS.iter().enumerate() {
            let (mut gradients, mut non_finite) = (vec![], 0);
            let samples = method.samples * context.spend(1, 8);
            let clock = Clock::start();
            for run in 0..runs {
                let result = estimate(method, &task(samples, &[12, index, number as u64, run]))?;
                non_finite += result.non_finite.len();
                gradients.push(result.gradient.pixels);
            }
            let seconds = clock.seconds() / runs as f64;
            let compared = Compared::new(&gradients, &reference);
            entries.push(Entry { method, samples, runs, seconds, compared, non_finite });
        }
        Ok(Self { setting, shown, reference, entries })
    }
}
