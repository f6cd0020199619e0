//! Joint fits of all parameters, each to pictures with independent noise.

use volume3d::Image;
use volume3d::gradient::{ActiveParameters, Gradient, GradientError, Progress, WarpedArea, render};
use volume3d::optimize::{Adam, Fit, Loss, Objective, Parameters, Plan, Schedule, View};
use volume3d::scene::Scene;

use super::scene::{NAMES, cameras, film, start, truth};
use crate::context::Context;
use crate::seeds::seed_of;
use crate::space::Clock;

/// The first step of Adam for each of [`NAMES`]: scene units, radians, reflectance, radiance, reflectance.
const RATES: [f64; 5] = [0.02, 0.04, 0.04, 1.5, 0.06];
/// Light and reflectance separate slowly: early gradients must not dominate the end.
const BETA2: f64 = 0.98;

/// Effort of the study.
#[derive(Clone, Copy, Debug)]
pub(super) struct Effort {
    /// The film's side in pixels.
    pub(super) side: usize,
    /// Steps of a fit.
    pub(super) steps: u64,
    /// Fits, each to pictures of its own.
    pub(super) fits: u64,
    /// Samples a pixel of targets, of images and of gradients.
    pub(super) samples: [usize; 3],
}

impl Effort {
    pub(super) const FULL: Self = Self { side: 28, steps: 400, fits: 12, samples: [256, 16, 8] };
    pub(super) const SHORT: Self = Self { steps: 300, fits: 6, ..Self::FULL };
    /// One fit while one waits.
    pub(super) const LIVE: Self = Self { side: 24, steps: 160, fits: 1, samples: [256, 8, 4] };
    /// Just enough to show that everything runs.
    pub(super) const SKETCH: Self = Self { side: 8, steps: 2, fits: 2, samples: [8, 2, 2] };
}

/// Results of all fits.
pub(super) struct Study {
    pub(super) effort: Effort,
    pub(super) groups: Vec<Found>,
    /// Pictures of the first fit, by view: target, start, fit.
    pub(super) pictures: Vec<[Image; 3]>,
    /// The floor's texture: true, initial, and the mean of all fits.
    pub(super) textures: [Vec<f64>; 3],
    /// The mean loss of each step of the first fit.
    pub(super) losses: Vec<f64>,
    /// Processor seconds of one fit.
    pub(super) seconds: f64,
}

/// The numbers of one parameter.
#[derive(Clone, Debug)]
pub(super) struct Found {
    pub(super) name: &'static str,
    pub(super) numbers: Vec<Number>,
}

/// One number, over all fits.
#[derive(Clone, Copy, Debug)]
pub(super) struct Number {
    pub(super) truth: f64,
    pub(super) start: f64,
    pub(super) mean: f64,
    /// The standard deviation of one fit.
    pub(super) deviation: f64,
    /// The standard error of the mean.
    pub(super) error: f64,
}

impl Number {
    fn new(truth: f64, start: f64, values: &[f64]) -> Self {
        let n = values.len() as f64;
        let mean = values.iter().sum::<f64>() / n;
        let deviation = (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1.0)).sqrt();
        Self { truth, start, mean, deviation, error: deviation / n.sqrt() }
    }

    /// Distance of the mean from the truth in standard errors.
    pub(super) fn score(&self) -> f64 {
        if self.error > 0.0 { (self.mean - self.truth) / self.error } else { 0.0 }
    }
}

impl Found {
    fn mean_square(&self, of: impl Fn(&Number) -> f64) -> f64 {
        (self.numbers.iter().map(|n| of(n).powi(2)).sum::<f64>() / self.numbers.len() as f64).sqrt()
    }

    /// Root mean squares over the numbers: distance of the start from the truth, of the mean of all fits from
    /// the truth, and of one fit from that mean.
    pub(super) fn distances(&self) -> [f64; 3] {
        [
            self.mean_square(|n| n.start - n.truth),
            self.mean_square(|n| n.mean - n.truth),
            self.mean_square(|n| n.deviation),
        ]
    }

    /// The standard error of the mean, and how far it is from the truth in those.
    pub(super) fn error(&self) -> f64 {
        self.mean_square(|n| n.error)
    }

    /// The root mean square of the scores: about 1 if nothing but chance keeps the means from the truth.
    pub(super) fn score(&self) -> f64 {
        self.mean_square(Number::score)
    }
}

impl Study {
    pub(super) fn new(context: &Context, effort: Effort) -> anyhow::Result<Self> {
        let scene = truth(effort.side)?;
        let parameters = Parameters::new(&scene, &NAMES)?;
        let exact = parameters.values(&scene);
        let (mut all, mut pictures, mut losses) = (vec![], vec![], vec![]);
        let clock = Clock::start();
        for run in 0..effort.fits {
            let seed = seed_of(context.seed(), &[15, run]);
            let what = format!("fit {} of {}", run + 1, effort.fits);
            let mut fit = fit(effort, seed)?;
            let mut scene = truth(effort.side)?;
            fit.apply(&mut scene)?;
            let starts = if run == 0 { look(&fit, &mut scene, effort)? } else { vec![] };
            while !fit.is_done() {
                context.step(&format!("{what}: step {}", fit.steps_taken() + 1));
                fit.step(
                    &mut scene,
                    &|s, a, p, seed, g| reverse(effort.samples[2], s, a, p, seed, g),
                    &Progress::none(),
                )?;
            }
            if run == 0 {
                let views = fit.objective().views.iter().zip(starts).zip(look(&fit, &mut scene, effort)?);
                pictures = views.map(|((view, start), fit)| [view.target.clone(), start, fit]).collect();
                losses = fit.state().records.iter().map(|record| record.loss).collect();
            }
            all.push(fit.state().x.clone());
        }
        let seconds = clock.seconds() / effort.fits as f64;
        let first = start(&exact);
        let number =
            |i: usize| Number::new(exact[i], first[i], &all.iter().map(|x| x[i]).collect::<Vec<_>>());
        let groups: Vec<Found> = NAMES
            .into_iter()
            .zip(parameters.groups())
            .map(|(name, group)| Found { name, numbers: group.range.clone().map(number).collect() })
            .collect();
        let floor = &groups[NAMES.len() - 1].numbers;
        let of = |pick: fn(&Number) -> f64| floor.iter().map(pick).collect::<Vec<f64>>();
        let textures = [of(|n| n.truth), of(|n| n.start), of(|n| n.mean)];
        Ok(Self { effort, groups, pictures, textures, losses, seconds })
    }

    /// All scores of all numbers.
    pub(super) fn scores(&self) -> impl Iterator<Item = f64> {
        self.groups.iter().flat_map(|group| group.numbers.iter().map(Number::score))
    }
}

/// A fit to pictures with independent noise.
fn fit(effort: Effort, seed: u64) -> anyhow::Result<Fit> {
    let mut scene = truth(effort.side)?;
    let parameters = Parameters::new(&scene, &NAMES)?;
    let exact = parameters.values(&scene);
    let [of_target, image_samples, _] = effort.samples;
    let mut views = vec![];
    for (i, camera) in (0..).zip(cameras()) {
        scene.set_camera(camera.clone())?;
        let target = render(&scene, of_target, seed_of(seed, &[i]), &Progress::none())?.image;
        views.push(View {
            name: i.to_string(),
            camera: Some(camera),
            film: film(effort.side),
            target,
            weights: None,
            mask: None,
        });
    }
    let views_per_step = views.len();
    let loss = Loss::L2;
    let objective = Objective {
        views,
        loss,
        penalties: vec![],
        masks: None,
        silhouettes: None,
        pixels: None,
        image_samples,
    };
    let optimizers = RATES.map(|rate| {
        let mut adam = Adam::new(rate);
        adam.beta2 = BETA2;
        adam.into()
    });
    let plan = Plan {
        steps: effort.steps,
        schedule: Schedule::default(),
        views_per_step,
        seed: seed_of(seed, &[100]),
    };
    Ok(Fit::new(parameters, start(&exact), objective, optimizers.to_vec(), plan))
}

fn reverse(
    samples: usize,
    scene: &Scene,
    adjoint: &Image,
    active: &ActiveParameters,
    seed: u64,
    progress: &Progress,
) -> Result<Gradient, GradientError> {
    WarpedArea { samples, seed, ..WarpedArea::default() }.reverse(scene, adjoint, active, progress)
}

/// Images of the true scene in all views.
fn look(fit: &Fit, scene: &mut Scene, effort: Effort) -> anyhow::Result<Vec<Image>> {
    let mut images = vec![];
    for view in 0..fit.objective().views.len() {
        fit.objective().look(scene, view)?;
        images.push(render(scene, effort.samples[0], 15, &Progress::none())?.image);
    }
    Ok(images)
}
