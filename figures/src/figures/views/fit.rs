//! A fit of a mesh to its views, and its measurements.

use std::time::Instant;

use flatland::random::{open01, stream};
use glam::DVec3;
use volume3d::Image;
use volume3d::geometry::Mesh;
use volume3d::gradient::{Progress, WarpedArea, render};
use volume3d::optimize::{Adam, LargeSteps, Loss, Parameters};
use volume3d::scene::{Camera, Scene};

use super::scene::Light;
use super::shapes::{Subject, subdivided};
use crate::context::Context;
use crate::seeds::seed_of;
use crate::space::Clock;
use crate::space::chamfer::chamfer;
use crate::space::target::DIAGONAL;

/// λ of the large steps, and the number of vertices that it refers to; λ grows with their number, for the
/// same smoothness in space.
pub(super) const LAMBDA: (f64, usize) = (6.0, 2562);
/// Adam's rate at the first step and at the last, in scene units. Smoothing leaves a small part of it.
pub(super) const RATES: [f64; 2] = [0.2, 0.02];
/// Adam's decay rate for squared gradients: gradients shrink by orders of magnitude during so short a fit.
const BETA2: f64 = 0.95;
/// Number of resolutions that the loss compares.
pub(super) const LEVELS: usize = 4;

/// Effort of a fit.
#[derive(Clone, Copy, Debug)]
pub(super) struct Effort {
    /// The film's side in pixels.
    pub(super) side: usize,
    pub(super) views: usize,
    /// Views per step of the gradient.
    pub(super) batch: usize,
    /// Steps on the first mesh, and on each that is twice as fine as the one before.
    pub(super) phases: &'static [usize],
    /// Samples a pixel of a step's image and of its gradient.
    pub(super) samples: [usize; 2],
    /// Samples a pixel of targets and of shown images.
    pub(super) shown: usize,
    /// Points on each surface, for distances between them.
    pub(super) points: usize,
    /// Steps between two frames, and between two distances of the curve.
    pub(super) every: usize,
    pub(super) coarse: bool,
}

impl Effort {
    pub(super) const FULL: Self = Self {
        side: 128,
        views: 16,
        batch: 2,
        phases: &[100, 120],
        samples: [16, 4],
        shown: 128,
        points: 10_000,
        every: 10,
        coarse: false,
    };
    pub(super) const SHORT: Self = Self {
        side: 48,
        views: 10,
        phases: &[60, 60],
        samples: [8, 4],
        shown: 64,
        points: 4000,
        ..Self::FULL
    };
    /// A fit while one waits.
    pub(super) const LIVE: Self = Self {
        side: 48,
        views: 8,
        batch: 1,
        phases: &[60, 50],
        samples: [8, 2],
        shown: 32,
        points: 2000,
        every: 5,
        coarse: true,
    };
    /// Just enough to show that everything runs.
    pub(super) const SKETCH: Self =
        Self { side: 12, views: 4, phases: &[1, 1], shown: 4, points: 200, every: 4, ..Self::LIVE };

    pub(super) fn steps(&self) -> usize {
        self.phases.iter().sum()
    }
}

/// Processor seconds by activity.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Seconds {
    /// Moving the scene to new parameters.
    pub(super) update: f64,
    pub(super) image: f64,
    pub(super) gradient: f64,
    /// Losses, large steps and Adam.
    pub(super) optimiser: f64,
    /// Elapsed wall-clock time, measurements included.
    pub(super) wall: f64,
}

impl Seconds {
    pub(super) fn total(&self) -> f64 {
        self.update + self.image + self.gradient + self.optimiser
    }
}

/// A shown view: target, start and fit.
pub(super) struct Shown {
    pub(super) target: Vec<DVec3>,
    pub(super) start: Vec<DVec3>,
    pub(super) fit: Vec<DVec3>,
}

/// State of a fit at a step.
pub(super) struct Moment {
    pub(super) step: usize,
    /// Chamfer distance in parts of the target's diagonal.
    pub(super) chamfer: f64,
    /// The held-out view that is shown.
    pub(super) picture: Vec<DVec3>,
}

pub(super) struct Fit {
    pub(super) subject: Subject,
    pub(super) light: Light,
    pub(super) effort: Effort,
    /// A view used by the fit, and one held out.
    pub(super) shown: [Shown; 2],
    /// The loss of every step, of its views.
    pub(super) losses: Vec<f64>,
    pub(super) moments: Vec<Moment>,
    /// The mean of |I − T| on held-out views: of the start, of the fit, and of the target itself by other
    /// samples.
    pub(super) held_out: [f64; 3],
    pub(super) seconds: Seconds,
    pub(super) mesh: Mesh,
}

/// Number of held-out views.
const HELD_OUT: usize = 4;
/// Streams of random numbers.
const TARGETS: u64 = 1;
const ORDER: u64 = 2;
const STEPS: u64 = 3;
const LOOKS: u64 = 4;

/// Cameras with their target images.
struct Views {
    cameras: Vec<Camera>,
    targets: Vec<Image>,
}

impl Views {
    fn new(cameras: Vec<Camera>, scene: &mut Scene, samples: usize, seed: u64) -> anyhow::Result<Self> {
        let targets = look(&cameras, scene, samples, seed)?;
        Ok(Self { cameras, targets })
    }
}

/// A scene's images.
fn look(cameras: &[Camera], scene: &mut Scene, samples: usize, seed: u64) -> anyhow::Result<Vec<Image>> {
    let mut images = vec![];
    for (i, camera) in (0..).zip(cameras) {
        scene.set_camera(camera.clone())?;
        images.push(render(scene, samples, seed_of(seed, &[i]), &Progress::none())?.image);
    }
    Ok(images)
}

/// The mean over images, pixels and channels of |a − b|.
fn mean_error(a: &[Image], b: &[Image]) -> f64 {
    let pixels = |images: &[Image]| images.iter().flat_map(|i| i.pixels.clone()).collect::<Vec<DVec3>>();
    let (a, b) = (pixels(a), pixels(b));
    let differences = a.iter().zip(&b).map(|(a, b)| (*a - *b).abs().element_sum());
    differences.sum::<f64>() / (3 * a.len()) as f64
}

impl Fit {
    /// Fits one subject in one light.
    pub(super) fn new(
        context: &Context,
        effort: Effort,
        subject: Subject,
        light: Light,
    ) -> anyhow::Result<Self> {
        let wall = Instant::now();
        let seed =
            |words: &[u64]| seed_of(context.seed(), &[&[13, subject as u64, light as u64], words].concat());
        let (target, start) = (subject.target()?, subject.start(effort.coarse)?);
        let (known, unknown) = (light.cameras(effort.views, 0.0), light.cameras(HELD_OUT, 1.0));
        let (mut truth, _) = light.scene(target.clone(), known[0].clone(), effort.side)?;
        let known = Views::new(known, &mut truth, effort.shown, seed(&[TARGETS, 0]))?;
        let unknown = Views::new(unknown, &mut truth, effort.shown, seed(&[TARGETS, 1]))?;
        let again = look(&unknown.cameras, &mut truth, effort.shown, seed(&[TARGETS, 2]))?;
        let (mut scene, shape) = light.scene(start, known.cameras[0].clone(), effort.side)?;
        let chosen = [known.cameras[effort.views / 2].clone(), unknown.cameras[HELD_OUT / 2].clone()];
        let starts = look(&chosen, &mut scene, effort.shown, seed(&[LOOKS, 0]))?;
        let held_out_start = look(&unknown.cameras, &mut scene, effort.shown, seed(&[LOOKS, 1]))?;

        let mut run = Run {
            context,
            effort,
            known: &known,
            seed: seed(&[STEPS]),
            order: Order { seed: seed(&[ORDER]), views: effort.views, left: vec![], rounds: 0 },
            losses: vec![],
            seconds: Seconds::default(),
        };
        let mut moments = vec![];
        let mut moment = |step: usize, scene: &mut Scene| -> anyhow::Result<()> {
            let mesh = &scene.description().shapes[shape].mesh;
            let chamfer = chamfer(mesh, &target, effort.points, seed(&[LOOKS, 2])) / DIAGONAL;
            let picture = look(&chosen[1..], scene, effort.shown / 4, seed(&[LOOKS, 3]))?.remove(0);
            moments.push(Moment { step, chamfer, picture: picture.pixels });
            Ok(())
        };
        moment(0, &mut scene)?;
        for (phase, &steps) in effort.phases.iter().enumerate() {
            if phase > 0 {
                let finer = subdivided(&scene.description().shapes[shape].mesh)?;
                scene.set_meshes([(shape, finer)])?;
            }
            let what = format!("{}, {}", subject.name(), light.name());
            run.descend(&mut scene, shape, steps, &what, &mut moment)?;
        }
        let fits = look(&chosen, &mut scene, effort.shown, seed(&[LOOKS, 4]))?;
        let held_out_fit = look(&unknown.cameras, &mut scene, effort.shown, seed(&[LOOKS, 5]))?;
        let chosen_targets = [known.targets[effort.views / 2].clone(), unknown.targets[HELD_OUT / 2].clone()];
        let mut shown = chosen_targets
            .into_iter()
            .zip(starts)
            .zip(fits)
            .map(|((target, start), fit)| [target, start, fit].map(|image| image.pixels))
            .map(|[target, start, fit]| Shown { target, start, fit });
        let shown = std::array::from_fn(|_| shown.next().expect("two views"));
        let held_out =
            [held_out_start, held_out_fit, again].map(|images| mean_error(&images, &unknown.targets));
        let Run { losses, mut seconds, .. } = run;
        seconds.wall = wall.elapsed().as_secs_f64();
        let mesh = scene.description().shapes[shape].mesh.clone();
        Ok(Self { subject, light, effort, shown, losses, moments, held_out, seconds, mesh })
    }

    /// The distance at the end.
    pub(super) fn chamfer(&self) -> f64 {
        self.moments.last().map_or(f64::NAN, |moment| moment.chamfer)
    }
}

/// Order of the views: each once per round, reshuffled for every round.
struct Order {
    seed: u64,
    views: usize,
    left: Vec<usize>,
    rounds: u64,
}

impl Order {
    fn next(&mut self) -> usize {
        loop {
            if let Some(view) = self.left.pop() {
                return view;
            }
            let mut rng = stream(self.seed, &[self.rounds]);
            let mut drawn: Vec<(f64, usize)> = (0..self.views).map(|view| (open01(&mut rng), view)).collect();
            drawn.sort_by(|a, b| a.0.total_cmp(&b.0));
            self.left = drawn.into_iter().map(|(_, view)| view).collect();
            self.rounds += 1;
        }
    }
}

/// A descent over all phases.
struct Run<'v> {
    context: &'v Context,
    effort: Effort,
    known: &'v Views,
    seed: u64,
    order: Order,
    losses: Vec<f64>,
    seconds: Seconds,
}

impl Run<'_> {
    /// Some steps on one mesh.
    fn descend(
        &mut self,
        scene: &mut Scene,
        shape: usize,
        steps: usize,
        what: &str,
        moment: &mut dyn FnMut(usize, &mut Scene) -> anyhow::Result<()>,
    ) -> anyhow::Result<()> {
        let parameters = Parameters::new(scene, &["shape.vertex_positions"])?;
        let clock = Clock::start();
        let mesh = &scene.description().shapes[shape].mesh;
        let lambda = LAMBDA.0 * mesh.positions().len() as f64 / LAMBDA.1 as f64;
        let large_steps = LargeSteps::new(mesh, lambda)?;
        self.seconds.optimiser += clock.seconds();
        let (mut adam, mut x) = (Adam::new(0.0).uniform(), parameters.values(scene));
        adam.beta2 = BETA2;
        let active = parameters.active(scene);
        for _ in 0..steps {
            let (step, all) = (self.losses.len(), self.effort.steps());
            self.context.step(&format!("{what}: step {} of {all}", step + 1));
            let part = step as f64 / all as f64;
            adam.rate = RATES[0] * (RATES[1] / RATES[0]).powf(part);
            let (mut gradient, mut loss) = (vec![0.0; x.len()], 0.0);
            for turn in 0..self.effort.batch {
                let view = self.order.next();
                let seed = seed_of(self.seed, &[step as u64, turn as u64]);
                scene.set_camera(self.known.cameras[view].clone())?;
                let clock = Clock::start();
                let [of_image, samples] = self.effort.samples;
                let image = render(scene, of_image, seed, &Progress::none())?.image;
                self.seconds.image += clock.seconds();
                let clock = Clock::start();
                let target = &self.known.targets[view];
                let (of_view, adjoint) = Loss::Multiscale { levels: LEVELS }.of(&image, target)?;
                loss += of_view / self.effort.batch as f64;
                self.seconds.optimiser += clock.seconds();
                let clock = Clock::start();
                // At one seed, the samples of a gradient differ from those of an image.
                let method = WarpedArea { samples, seed, ..WarpedArea::default() };
                let by_scene = method.reverse(scene, &adjoint, &active, &Progress::none())?.by_parameter;
                let by_x = parameters.gradient(scene, &x, &by_scene);
                gradient.iter_mut().zip(by_x).for_each(|(sum, g)| *sum += g);
                self.seconds.gradient += clock.seconds();
            }
            let clock = Clock::start();
            let movement = large_steps.solve(&adam.step(&large_steps.solve(&gradient)));
            parameters.retract(&mut x, &movement);
            self.seconds.optimiser += clock.seconds();
            let clock = Clock::start();
            parameters.apply(&x, scene)?;
            self.seconds.update += clock.seconds();
            self.losses.push(loss);
            if (step + 1).is_multiple_of(self.effort.every) || step + 1 == all {
                moment(step + 1, scene)?;
            }
        }
        Ok(())
    }
}
