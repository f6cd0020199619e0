//! Test scenes: surfaces in front of a camera, and masks.

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use flatland::sdf::shapes::{Ball, Parametric, ShapeError};
use flatland::sdf::{Jet, Sdf, SecondOrder};
use glam::{DMat3, DVec3};

use crate::gradient::FilmPlane;
use crate::optimize::MaskLoss;
use crate::scene::{Camera, Description, Film, Filter, Implicit, Material, Placement, Scene};
use crate::sdf::network::{Architecture, Network};
use crate::sdf::{Grid, Interpolation};

/// Columns and rows of all films: unequal, and with no pixel at the centre.
pub(super) const SIZE: (usize, usize) = (20, 16);

/// The surface seen from a distance of 3 units in front of the origin.
pub(super) fn scene(surface: impl Implicit) -> Scene {
    scaled(surface, 1.0)
}

/// The surface with the camera `scale` times as far away.
pub(super) fn scaled(surface: impl Implicit, scale: f64) -> Scene {
    let camera = Camera::look_at(DVec3::new(0.3, 0.2, -3.0) * scale, DVec3::ZERO, DVec3::Y, 0.8);
    let film = Film {
        width: SIZE.0,
        height: SIZE.1,
        crop: None,
        sample_border: true,
        filter: Filter::Tent { radius: 1.0 },
    };
    let mut description = Description::new(camera, film);
    let clay = description.add_material(Material::diffuse("clay", DVec3::splat(0.5)));
    description.add_implicit("shape", surface, clay);
    Scene::new(description).expect("a scene")
}

/// The settings of IDR within the unit ball.
pub(super) fn loss() -> MaskLoss {
    MaskLoss::new(Ball::new(DVec3::ZERO, 1.0).expect("a ball"))
}

pub(super) fn ball(radius: f64) -> Ball<DVec3> {
    Ball::new(DVec3::new(0.05, -0.1, 0.08), radius).expect("a ball")
}

/// A ball on 16³ nodes, rotated and translated.
pub(super) fn turned_grid() -> Scene {
    let corners = (DVec3::splat(-1.0), DVec3::splat(1.0));
    let distance = |x: DVec3| x.length() - 0.5 - 0.1 * (3.0 * x.x).sin() * (2.0 * x.y).cos();
    let grid = Grid::sampled(Interpolation::Cubic, corners, 15, distance).expect("a grid");
    assert_eq!(grid.nodes().len(), 16 * 16 * 16);
    let mut scene = scene(grid);
    let mut shape = scene.description().implicits[0].clone();
    let rotation = DMat3::from_euler(glam::EulerRot::XYZ, 0.3, -0.8, 1.1);
    shape.placement = Placement { scale: 0.9, rotation, translation: DVec3::new(0.1, -0.05, 0.2) };
    scene.set_implicit(0, shape).expect("a grid elsewhere");
    scene
}

/// A network whose surface is within the unit ball; narrow networks are far from spheres after
/// initialisation.
pub(super) fn network() -> Scene {
    let architecture = Architecture { hidden: 4, width: 16, sharpness: 100.0, frequencies: 0 };
    let axes = [DVec3::X, DVec3::Y, DVec3::Z, DVec3::splat(0.58), DVec3::new(0.58, -0.58, 0.58)];
    let is_within =
        |network: &Network| axes.iter().all(|&x| network.value(x) > 0.1 && network.value(-x) > 0.1);
    let drawn = (0..).map(|seed| Network::sphere(architecture, 0.25, seed).expect("a network"));
    let network = drawn.into_iter().find(is_within).expect("such a network");
    scene(network.with_slope_bound(3.0).expect("a bound"))
}

/// The rays through the centres of all pixels.
pub(super) fn rays(scene: &Scene) -> Vec<DVec3> {
    let film = FilmPlane::new(scene);
    let ray = |(x, y)| film.ray(film.point(x + film.reach, y + film.reach, [0.5; 2]));
    (0..SIZE.0 * SIZE.1).map(|i| ray((i % SIZE.0, i / SIZE.0))).collect()
}

/// The mask rendered by the path tracer.
pub(super) fn outline(scene: &Scene) -> Vec<bool> {
    let origin = scene.description().camera.origin;
    rays(scene).into_iter().map(|ray| scene.closest(origin, ray, None).is_some()).collect()
}

/// A mask of the left half of all pixels: some are covered, some are missing, some are in excess.
pub(super) fn left_half() -> Vec<bool> {
    (0..SIZE.0 * SIZE.1).map(|i| i % SIZE.0 < SIZE.0 / 2).collect()
}

/// A ball that counts its evaluations, and is NaN beyond a plane.
#[derive(Clone, Debug)]
pub(super) struct Watched {
    pub(super) ball: Ball<DVec3>,
    pub(super) good_below: f64,
    pub(super) asked: Arc<AtomicUsize>,
}

impl PartialEq for Watched {
    fn eq(&self, other: &Self) -> bool {
        self.ball == other.ball
    }
}

impl Sdf<DVec3> for Watched {
    fn jet(&self, x: DVec3) -> Jet<DVec3> {
        self.asked.fetch_add(1, Ordering::Relaxed);
        let spoilt = if x.x < self.good_below { 0.0 } else { f64::NAN };
        let jet = self.ball.jet(x);
        Jet { value: jet.value + spoilt, ..jet }
    }

    fn second_order(&self, x: DVec3) -> SecondOrder<DVec3> {
        self.ball.second_order(x)
    }

    fn parameter_count(&self) -> usize {
        self.ball.parameter_count()
    }

    fn rate(&self, x: DVec3, direction: &[f64]) -> Jet<DVec3> {
        self.ball.rate(x, direction)
    }

    fn add_parameter_gradient(&self, x: DVec3, covector: Jet<DVec3>, gradient: &mut [f64]) {
        self.ball.add_parameter_gradient(x, covector, gradient);
    }
}

impl Parametric<DVec3> for Watched {
    fn parameters(&self) -> Vec<f64> {
        Parametric::parameters(&self.ball)
    }

    fn with_parameters(&self, parameters: &[f64]) -> Result<Self, ShapeError> {
        Ok(Self { ball: Parametric::with_parameters(&self.ball, parameters)?, ..self.clone() })
    }
}
