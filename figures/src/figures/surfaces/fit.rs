//! A grid of distances that is fitted to views, and what it measures.

use std::f64::consts::PI;

use flatland::sdf::Sdf as _;
use glam::DVec3;
use volume3d::Image;
use volume3d::geometry::Mesh;
use volume3d::gradient::{Progress, WarpedArea, render};
use volume3d::optimize::{
    Adam, Fit, GridSteps, Loss, Objective, Optimizer, Parameters, Plan, Schedule, View,
};
use volume3d::scene::{Camera, Description, Environment, Film, Filter, Integrator, Material, Scene};
use volume3d::sdf::analytic::Knot;
use volume3d::sdf::{Grid, Interpolation, isosurface};

use crate::context::Context;
use crate::figures::common::seed_of;
use crate::space::Clock;
use crate::space::chamfer::{chamfer, hausdorff};
use crate::space::target::{self, DIAGONAL};

/// Half the side of the cube of the grid.
const HALF: f64 = 1.0;
/// The radius of the ball that fits begin with.
pub(super) const RADIUS: f64 = 0.5;
/// λ of smooth steps.
pub(super) const SMOOTHING: f64 = 1.0;
/// Adam's rate at first, in cells.
pub(super) const RATE: f64 = 0.5;
/// How slowly Adam forgets squares.
const BETA2: f64 = 0.99;
/// Resolutions that the loss compares.
pub(super) const LEVELS: usize = 4;
/// Views that no step sees.
const HELD_OUT: usize = 4;
/// Streams of random numbers.
const TARGETS: u64 = 1;
const STEPS: u64 = 2;
const LOOKS: u64 = 3;

/// How much a fit may spend.
#[derive(Clone, Copy, Debug)]
pub(super) struct Effort {
    /// The film's side in pixels.
    pub(super) side: usize,
    pub(super) views: usize,
    /// Views of which each step sees the gradient.
    pub(super) batch: usize,
    /// Cells along an axis at first; each phase has twice those of the one before.
    pub(super) cells: usize,
    /// Steps of each phase.
    pub(super) phases: [u64; 3],
    /// Samples a pixel of a step's image, and of its gradient.
    pub(super) samples: usize,
    /// Samples a pixel of targets and of what is shown.
    pub(super) shown: usize,
    /// Points on each surface, for distances between them.
    pub(super) points: usize,
    /// Cells of the meshes that distances are measured of.
    meshed: usize,
    /// Steps between two distances of the curve.
    every: u64,
    /// Fits of each subject, with seeds of their own.
    pub(super) seeds: u64,
}

impl Effort {
    pub(super) fn new(context: &Context) -> Self {
        let draft = Self {
            side: 24,
            views: 6,
            batch: 2,
            cells: 8,
            phases: [12, 8, 4],
            samples: 2,
            shown: 16,
            points: 1000,
            meshed: 32,
            every: 8,
            seeds: 1,
        };
        let full = Self {
            side: 64,
            views: 16,
            batch: 2,
            cells: 16,
            phases: [80, 80, 80],
            samples: 4,
            shown: 128,
            points: 100_000,
            meshed: 96,
            every: 10,
            seeds: 3,
        };
        context.spend(draft, full)
    }

    pub(super) fn steps(&self) -> u64 {
        self.phases.iter().sum()
    }

    /// The steps after which grids become finer.
    fn refine(&self) -> Vec<u64> {
        vec![self.phases[0], self.phases[0] + self.phases[1]]
    }
}

/// What is found from its views, from a ball.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Subject {
    Bunny,
    /// A ring, which the ball is not.
    Knot,
}

impl Subject {
    pub(super) const ALL: [Self; 2] = [Self::Bunny, Self::Knot];

    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Bunny => "bunny",
            Self::Knot => "trefoil",
        }
    }

    pub(super) fn target(self) -> anyhow::Result<Mesh> {
        match self {
            Self::Bunny => target::bunny(),
            Self::Knot => {
                let knot = Knot::new(DVec3::ZERO, (2, 3), (0.6, 0.25), 0.15)?;
                target::placed(isosurface(&knot, (DVec3::splat(-1.1), DVec3::splat(1.1)), 64)?)
            }
        }
    }
}

/// How far a fit has come at a step.
pub(super) struct Moment {
    pub(super) step: u64,
    /// Chamfer distance in parts of the target's diagonal.
    pub(super) chamfer: f64,
}

/// One fit.
pub(super) struct Reconstruction {
    pub(super) subject: Subject,
    /// The number of its seed, from 1 on.
    pub(super) number: u64,
    pub(super) moments: Vec<Moment>,
    /// The distance within which 95 % of both surfaces are, in parts of the diagonal.
    pub(super) hausdorff: f64,
    /// 10 log₁₀ of 1 over the mean square difference of each held-out view, in decibels: of radiances, the sky being 1.
    pub(super) decibels: Vec<f64>,
    /// A held-out view: of the target, at first, and after each phase.
    pub(super) target: Vec<DVec3>,
    pub(super) stages: Vec<Vec<DVec3>>,
    /// Processor seconds, without what is measured besides.
    pub(super) seconds: f64,
    pub(super) mesh: Mesh,
}

/// Cameras around the origin, spread evenly; `turn` turns them all about the vertical, in radians.
fn cameras(count: usize, turn: f64) -> Vec<Camera> {
    const DISTANCE: f64 = 5.0;
    const FIELD_OF_VIEW: f64 = 0.45;
    let camera = |i: usize| {
        let y = 0.95 * (2.0 * (i as f64 + 0.5) / count as f64 - 1.0);
        let angle = PI * (3.0 - 5.0_f64.sqrt()) * i as f64 + turn;
        let ring = (1.0 - y * y).sqrt();
        let eye = DISTANCE * DVec3::new(ring * angle.cos(), y, ring * angle.sin());
        Camera::look_at(eye, DVec3::ZERO, DVec3::Y, FIELD_OF_VIEW)
    };
    (0..count).map(camera).collect()
}

/// What is seen: clay of one colour in an even light from everywhere, with its own shadows.
fn empty(film: Film) -> (Description, usize) {
    let mut description = Description::new(cameras(1, 0.0).remove(0), film);
    description.integrator = Integrator { max_depth: Some(2), rr_depth: 2 };
    description.environment = Some(Environment::Constant { id: "sky".to_owned(), radiance: DVec3::ONE });
    let clay = description.add_material(Material::diffuse("clay", DVec3::new(0.75, 0.55, 0.4)));
    (description, clay)
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

impl Reconstruction {
    pub(super) fn new(context: &Context, subject: Subject, number: u64) -> anyhow::Result<Self> {
        let effort = Effort::new(context);
        let seed = |words: &[u64]| seed_of(context.seed(), &[&[16, subject as u64], words].concat());
        let film = Film {
            width: effort.side,
            height: effort.side,
            crop: None,
            filter: Filter::Tent { radius: 1.0 },
        };
        let target = subject.target()?;
        let (mut truth, clay) = empty(film);
        truth.add_shape("truth", target.clone(), clay);
        let mut truth = Scene::new(truth)?;
        let (known, unknown) = (cameras(effort.views, 0.0), cameras(HELD_OUT, 1.0));
        let targets = look(&known, &mut truth, effort.shown, seed(&[TARGETS, 0]))?;
        let held_out = look(&unknown, &mut truth, effort.shown, seed(&[TARGETS, 1]))?;

        let box_of = (DVec3::splat(-HALF), DVec3::splat(HALF));
        let ball = Grid::sampled(Interpolation::Cubic, box_of, effort.cells, |x| x.length() - RADIUS)?;
        let rate = RATE * ball.spacing().x;
        let (mut scene, clay) = empty(film);
        scene.add_implicit("surface", ball, clay);
        let mut scene = Scene::new(scene)?;
        let view = |(i, (camera, target)): (usize, (Camera, Image))| View {
            name: format!("view {i}"),
            camera: Some(camera),
            film,
            target,
            weights: None,
        };
        let views = known.into_iter().zip(targets).enumerate().map(view).collect();
        let objective = Objective {
            views,
            loss: Loss::Multiscale { levels: LEVELS },
            penalties: vec![],
            silhouettes: None,
            image_samples: effort.samples,
        };
        let grid = GridSteps { smoothing: SMOOTHING, redistance: true, refine: effort.refine() };
        let mut adam = Adam::new(rate);
        adam.beta2 = BETA2;
        let plan = Plan {
            steps: effort.steps(),
            schedule: Schedule::default(),
            views_per_step: effort.batch,
            seed: seed(&[STEPS, number]),
        };
        let parameters = Parameters::new(&scene, &["surface.sdf"])?;
        let x = parameters.values(&scene);
        let optimizer = Optimizer { grid: Some(grid), ..adam.into() };
        let mut fit = Fit::new(parameters, x, objective, vec![optimizer], plan);

        let chosen = HELD_OUT / 2;
        let (mut moments, mut stages, mut seconds) = (vec![], vec![], 0.0);
        loop {
            let step = fit.steps_taken();
            if step.is_multiple_of(effort.every) || fit.is_done() {
                let mesh = meshed(&scene, effort.meshed)?;
                let chamfer = chamfer(&mesh, &target, effort.points, seed(&[LOOKS, 0])) / DIAGONAL;
                moments.push(Moment { step, chamfer });
            }
            if step == 0 || effort.refine().contains(&step) || fit.is_done() {
                let camera = &unknown[chosen..=chosen];
                stages.push(look(camera, &mut scene, effort.shown, seed(&[LOOKS, 1]))?.remove(0).pixels);
            }
            if fit.is_done() {
                break;
            }
            let (name, all) = (subject.name(), effort.steps());
            context.step(&format!("16 {name}, seed {number}: step {} of {all}", step + 1));
            let clock = Clock::start();
            let reverse = |scene: &Scene, adjoint: &Image, active: &_, seed: u64, progress: &Progress| {
                let method = WarpedArea { samples: effort.samples, seed, ..WarpedArea::default() };
                method.reverse(scene, adjoint, active, progress)
            };
            fit.step(&mut scene, &reverse, &Progress::none())?;
            seconds += clock.seconds();
        }
        let images = look(&unknown, &mut scene, effort.shown, seed(&[LOOKS, 2]))?;
        let decibels = images.iter().zip(&held_out).map(|(a, b)| decibels(a, b)).collect();
        let mesh = meshed(&scene, effort.meshed)?;
        let hausdorff = hausdorff(&mesh, &target, effort.points, seed(&[LOOKS, 3])) / DIAGONAL;
        let target = held_out[chosen].pixels.clone();
        Ok(Self { subject, number, moments, hausdorff, decibels, target, stages, seconds, mesh })
    }

    /// The Chamfer distance at the end.
    pub(super) fn chamfer(&self) -> f64 {
        self.moments.last().map_or(f64::NAN, |moment| moment.chamfer)
    }

    /// V − E + F, where every edge has two triangles.
    pub(super) fn euler(&self) -> i64 {
        self.mesh.positions().len() as i64 - self.mesh.triangles().len() as i64 / 2
    }

    /// The worst held-out view.
    pub(super) fn worst_decibels(&self) -> f64 {
        self.decibels.iter().copied().fold(f64::INFINITY, f64::min)
    }
}

/// The surface that a scene has, as a mesh.
fn meshed(scene: &Scene, cells: usize) -> anyhow::Result<Mesh> {
    let surface = &scene.description().implicits[0];
    let bounds = surface.bounds().unwrap_or((DVec3::splat(-HALF), DVec3::splat(HALF)));
    Ok(isosurface(surface, bounds, cells)?)
}

fn decibels(a: &Image, b: &Image) -> f64 {
    let squares = a.pixels.iter().zip(&b.pixels).map(|(a, b)| (*a - *b).length_squared());
    -10.0 * (squares.sum::<f64>() / (3 * a.pixels.len()) as f64).log10()
}
