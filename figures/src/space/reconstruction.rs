//! Surfaces fitted to views, and their measurements.

use flatland::sdf::Sdf as _;
use flatland::sdf::shapes::{Ball, ShapeError};
use glam::DVec3;
use volume3d::Image;
use volume3d::geometry::Mesh;
use volume3d::gradient::{Progress, WarpedArea};
use volume3d::optimize::{
    Adam, Fit, FitError, GridSteps, Loss, MaskLoss, MaskTerm, Objective, Optimizer, Parameters, Penalty,
    Plan, Schedule, View,
};
use volume3d::scene::{Camera, Scene, SceneError};
use volume3d::sdf::network::{Architecture, Network};
use volume3d::sdf::{Baked, Grid, Interpolation, isosurface};

use super::Clock;
use super::chamfer::{chamfer, hausdorff};
use super::studio::{Light, Subject, cameras, clay, empty, film, look};
use super::target::DIAGONAL;
use crate::context::Context;
use crate::seeds::seed_of;

/// Half the side of the cube of a grid.
const HALF: f64 = 1.0;
/// Radius of the initial ball of fits.
pub(crate) const RADIUS: f64 = 0.5;
/// λ of the smooth steps of a grid.
pub(crate) const SMOOTHING: f64 = 1.0;
/// The weight of a network's eikonal term.
pub(crate) const EIKONAL: f64 = 0.1;
/// Adam's decay rate for squared gradients.
const BETA2: f64 = 0.99;
/// Factor on the weight of masks: IDR's is beside a loss of colours in [−1, 1] that is summed over channels,
/// six times [`Loss::L1`].
pub(crate) const MASKS: f64 = 1.0 / 6.0;
/// Number of held-out views.
const HELD_OUT: usize = 4;
/// Streams of random numbers.
const TARGETS: u64 = 1;
const STEPS: u64 = 2;
const LOOKS: u64 = 3;

/// Effort of a fit.
#[derive(Clone, Debug)]
pub(crate) struct Effort {
    /// The film's side in pixels.
    pub(crate) side: usize,
    pub(crate) views: usize,
    /// Views per step of the gradient.
    pub(crate) batch: usize,
    /// Initial number of cells along an axis; each phase doubles it.
    pub(crate) cells: usize,
    /// Steps of each phase.
    pub(crate) phases: Vec<u64>,
    /// Pixels of a view used by a step; all if `None`.
    pub(crate) pixels: Option<usize>,
    /// The steps after which networks are traced directly, if ever.
    pub(crate) finish: Option<u64>,
    /// Samples a pixel of a step's image, and of its gradient.
    pub(crate) samples: usize,
    /// Samples a pixel of targets and of shown images.
    pub(crate) shown: usize,
    /// Points on each surface, for distances between them.
    pub(crate) points: usize,
    /// Cells of the meshes used to measure distances.
    pub(crate) meshed: usize,
    /// Steps between two distances of the curve.
    pub(crate) every: u64,
    pub(crate) loss: Loss,
}

impl Effort {
    pub(crate) fn steps(&self) -> u64 {
        self.phases.iter().sum()
    }

    /// The steps after which grids are refined.
    fn refine(&self) -> Vec<u64> {
        let ends = self.phases.iter().scan(0, |sum, phase| {
            *sum += phase;
            Some(*sum)
        });
        ends.take(self.phases.len() - 1).collect()
    }
}

/// Representation of the surface.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Made {
    /// The nodes of a grid of distances; Adam's rate is in cells.
    Grid,
    /// A network on a grid.
    Network(Architecture),
}

/// Function that corrupts a mask, given its size and the number of its view.
pub(crate) type Spoil = fn(&[bool], (usize, usize), u64) -> anyhow::Result<Vec<bool>>;

/// Supervision of a fit.
#[derive(Clone, Debug)]
pub(crate) enum Supervision {
    /// Pictures alone, by warped-area sampling.
    WarpedArea,
    /// Pictures without the motion of silhouettes, and the loss of corrupted masks: IDR.
    Masks(Spoil),
    /// Pictures without the motion of silhouettes, and nothing else.
    Interior,
}

/// Identity and settings of a fit.
#[derive(Clone, Debug)]
pub(crate) struct Setup {
    /// The number of the figure, for seeds and progress.
    pub(crate) figure: u64,
    /// Name for progress messages.
    pub(crate) name: String,
    pub(crate) subject: Subject,
    pub(crate) light: Light,
    /// The number of its seed, from 1 on.
    pub(crate) number: u64,
    pub(crate) made: Made,
    /// Adam's initial rate.
    pub(crate) rate: f64,
    pub(crate) supervision: Supervision,
}

/// State of a fit at a step.
pub(crate) struct Moment {
    pub(crate) step: u64,
    /// Chamfer distance in parts of the target's diagonal.
    pub(crate) chamfer: f64,
}

/// One fit.
pub(crate) struct Reconstruction {
    pub(crate) subject: Subject,
    pub(crate) light: Light,
    /// Number of views used by the fit.
    pub(crate) views: usize,
    /// The number of its seed, from 1 on.
    pub(crate) number: u64,
    pub(crate) moments: Vec<Moment>,
    /// The distance within which 95 % of both surfaces are, in parts of the diagonal.
    pub(crate) hausdorff: f64,
    /// 10 log₁₀ of 1 over the mean square difference of each held-out view, in decibels: of radiances, the
    /// sky being 1.
    pub(crate) decibels: Vec<f64>,
    /// A held-out view: of the target, at first, and after each phase.
    pub(crate) target: Vec<DVec3>,
    pub(crate) stages: Vec<Vec<DVec3>>,
    /// Processor seconds, without those of measurements.
    pub(crate) seconds: f64,
    pub(crate) mesh: Mesh,
    /// Step after which the surface vanished, if it did.
    pub(crate) vanished: Option<u64>,
}

impl Reconstruction {
    pub(crate) fn new(context: &Context, effort: &Effort, setup: &Setup) -> anyhow::Result<Self> {
        let Setup { figure, ref name, subject, light, number, .. } = *setup;
        let seed = |words: &[u64]| seed_of(context.seed(), &[&[figure, subject as u64], words].concat());
        let (target, film) = (subject.target()?, film(effort.side));
        let mut truth = empty(film, light);
        let material = clay(&mut truth);
        truth.add_shape("truth", target.clone(), material);
        let mut truth = Scene::new(truth)?;
        let (known, unknown) = (cameras(effort.views, 0.0), cameras(HELD_OUT, 1.0));
        let targets = look(&known, &mut truth, effort.shown, seed(&[TARGETS, 0]))?;
        let held_out = look(&unknown, &mut truth, effort.shown, seed(&[TARGETS, 1]))?;
        let mut masks = vec![None; known.len()];
        if let Supervision::Masks(spoil) = setup.supervision {
            for (i, mask) in (0..).zip(covered(&known, subject, effort, seed(&[TARGETS, 2]))?) {
                masks[i as usize] = Some(spoil(&mask, (effort.side, effort.side), i)?);
            }
        }
        let views = known.into_iter().zip(targets).zip(masks).enumerate();
        let views = views.map(|(i, ((camera, target), mask))| View {
            name: format!("view {i}"),
            camera: Some(camera),
            film,
            target,
            weights: None,
            mask,
        });
        let (mut scene, rate) = start(effort, setup)?;
        let mut fit = begun(effort, setup, views.collect(), &scene, rate, seed(&[STEPS, number]))?;

        let chosen = HELD_OUT / 2;
        let moment = |scene: &Scene, step| -> anyhow::Result<Moment> {
            let mesh = meshed(scene, effort.meshed)?;
            let chamfer = chamfer(&mesh, &target, effort.points, seed(&[LOOKS, 0])) / DIAGONAL;
            Ok(Moment { step, chamfer })
        };
        let stage = |scene: &mut Scene| -> anyhow::Result<Vec<DVec3>> {
            let camera = &unknown[chosen..=chosen];
            Ok(look(camera, scene, effort.shown, seed(&[LOOKS, 1]))?.remove(0).pixels)
        };
        let (mut moments, mut stages, mut seconds, mut vanished) = (vec![], vec![], 0.0, None);
        loop {
            let step = fit.steps_taken();
            let ends = fit.is_done() || vanished.is_some();
            if step.is_multiple_of(effort.every) || ends {
                moments.push(moment(&scene, step)?);
            }
            if step == 0 || effort.refine().contains(&step) || ends {
                stages.push(stage(&mut scene)?);
            }
            if ends {
                break;
            }
            let all = effort.steps();
            context.step(&format!("{name}, seed {number}: step {} of {all}", step + 1));
            let clock = Clock::start();
            let warps = matches!(setup.supervision, Supervision::WarpedArea);
            let reverse = |scene: &Scene, adjoint: &Image, active: &_, seed: u64, progress: &Progress| {
                let method = WarpedArea { samples: effort.samples, warps, seed, ..WarpedArea::default() };
                method.reverse(scene, adjoint, active, progress)
            };
            match fit.step(&mut scene, &reverse, &Progress::none()) {
                Ok(()) => {}
                // A network may lose its surface entirely. The surface before that is measured.
                Err(FitError::Scene(SceneError::Implicit { error: ShapeError::Unmade { .. }, .. })) => {
                    vanished = Some(step);
                }
                Err(error) => return Err(error.into()),
            }
            seconds += clock.seconds();
        }
        let images = look(&unknown, &mut scene, effort.shown, seed(&[LOOKS, 2]))?;
        let decibels = images.iter().zip(&held_out).map(|(a, b)| decibels(a, b)).collect();
        let mesh = meshed(&scene, effort.meshed)?;
        let hausdorff = hausdorff(&mesh, &target, effort.points, seed(&[LOOKS, 3])) / DIAGONAL;
        let target = held_out[chosen].pixels.clone();
        Ok(Self {
            subject,
            light,
            views: effort.views,
            number,
            moments,
            hausdorff,
            decibels,
            target,
            stages,
            seconds,
            mesh,
            vanished,
        })
    }

    /// The Chamfer distance at the end.
    pub(crate) fn chamfer(&self) -> f64 {
        self.moments.last().map_or(f64::NAN, |moment| moment.chamfer)
    }

    /// V − E + F, where every edge has two triangles.
    pub(crate) fn euler(&self) -> i64 {
        self.mesh.positions().len() as i64 - self.mesh.triangles().len() as i64 / 2
    }

    /// The worst held-out view.
    pub(crate) fn worst_decibels(&self) -> f64 {
        self.decibels.iter().copied().fold(f64::INFINITY, f64::min)
    }
}

/// Pixels that show the target in more than half of their filter's support, view by view.
fn covered(
    cameras: &[Camera],
    subject: Subject,
    effort: &Effort,
    seed: u64,
) -> anyhow::Result<Vec<Vec<bool>>> {
    let mut black = empty(film(effort.side), Light::Even);
    let material = black.add_material(volume3d::scene::Material::diffuse("black", DVec3::ZERO));
    black.add_shape("truth", subject.target()?, material);
    let images = look(cameras, &mut Scene::new(black)?, effort.shown, seed)?;
    Ok(images.iter().map(|image| image.pixels.iter().map(|p| p.x < 0.5).collect()).collect())
}

/// A ball, and Adam's rate in units of its parameters.
fn start(effort: &Effort, setup: &Setup) -> anyhow::Result<(Scene, f64)> {
    let corners = (DVec3::splat(-HALF), DVec3::splat(HALF));
    let mut scene = empty(film(effort.side), setup.light);
    let material = clay(&mut scene);
    let mut rate = setup.rate;
    match setup.made {
        Made::Grid => {
            let distance = |x: DVec3| x.length() - RADIUS;
            let ball = Grid::sampled(Interpolation::Cubic, corners, effort.cells, distance)?;
            rate *= ball.spacing().x;
            scene.add_implicit("surface", ball, material);
        }
        Made::Network(architecture) => {
            let network = Network::sphere(architecture, RADIUS, setup.number)?;
            scene.add_implicit("surface", Baked::new(network, corners, effort.cells)?, material);
        }
    }
    Ok((Scene::new(scene)?, rate))
}

fn begun(
    effort: &Effort,
    setup: &Setup,
    views: Vec<View>,
    scene: &Scene,
    rate: f64,
    seed: u64,
) -> anyhow::Result<Fit> {
    let refine = effort.refine();
    let (steps, penalties) = match setup.made {
        Made::Grid => (GridSteps { smoothing: SMOOTHING, redistance: true, refine, finish: None }, vec![]),
        Made::Network(_) => (
            GridSteps { refine, finish: effort.finish, ..GridSteps::default() },
            vec![Penalty::Eikonal { implicit: 0, weight: EIKONAL }],
        ),
    };
    let masks = match setup.supervision {
        Supervision::Masks(_) => {
            let usual = MaskLoss::new(Ball::new(DVec3::ZERO, 0.5 * DIAGONAL)?);
            Some(MaskTerm { implicit: 0, loss: MaskLoss { weight: MASKS * usual.weight, ..usual } })
        }
        _ => None,
    };
    let loss = effort.loss;
    let objective = Objective {
        views,
        loss,
        penalties,
        masks,
        silhouettes: None,
        pixels: effort.pixels,
        image_samples: effort.samples,
    };
    let mut adam = Adam::new(rate);
    adam.beta2 = BETA2;
    let plan =
        Plan { steps: effort.steps(), schedule: Schedule::default(), views_per_step: effort.batch, seed };
    let parameters = Parameters::new(scene, &["surface.sdf"])?;
    let x = parameters.values(scene);
    let optimizer = Optimizer { grid: Some(steps), ..adam.into() };
    Ok(Fit::new(parameters, x, objective, vec![optimizer], plan))
}

/// The surface of a scene as a mesh.
fn meshed(scene: &Scene, cells: usize) -> anyhow::Result<Mesh> {
    let surface = &scene.description().implicits[0];
    let bounds = surface.bounds().unwrap_or((DVec3::splat(-HALF), DVec3::splat(HALF)));
    Ok(isosurface(surface, bounds, cells)?)
}

fn decibels(a: &Image, b: &Image) -> f64 {
    let squares = a.pixels.iter().zip(&b.pixels).map(|(a, b)| (*a - *b).length_squared());
    -10.0 * (squares.sum::<f64>() / (3 * a.pixels.len()) as f64).log10()
}
