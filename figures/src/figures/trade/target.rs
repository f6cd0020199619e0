//! The derivative that all methods estimate, with its exact value.

use flatland::estimator::{Exact, Method};
use flatland::plane::exact::Arrangement;
use flatland::plane::{Film, Filter, Image, Motion, Polygon, Scene, Shade, Shape};
use glam::{DVec2, DVec3};

use super::regression::{Bias, regress};
use crate::figures::common::{dot, seconds};

/// Pixels a side.
pub(super) const SIDE: usize = 4;
/// The auxiliary kernel's κ wherever it is not varied, in 1/pixel²: a width of 0.15 pixels.
pub(super) const KAPPA: f64 = 44.0;
/// Vertices of the star whose coordinates are all differentiated.
pub(super) const VERTICES: usize = 64;

/// The requested derivative.
pub(super) enum Ask {
    /// The derivative of every pixel, for one motion: forward mode.
    Pixels { motion: Motion, velocities: Vec<DVec2> },
    /// The derivative of the loss with this adjoint image, for every coordinate of every vertex: reverse
    /// mode.
    Vertices { adjoint: Image },
}

/// The requested derivative, and its exact value.
pub(super) struct Target {
    pub(super) scene: Scene,
    pub(super) film: Film,
    pub(super) ask: Ask,
    pub(super) exact: Vec<f64>,
    norm: f64,
}

/// Variance and cost of a method, per sample of one pixel.
#[derive(Clone, Copy, Debug)]
pub(super) struct Spread {
    /// Σ variance/Σ exact².
    pub(super) variance: f64,
    /// Number of visibility queries.
    pub(super) rays: f64,
}

/// An estimate of all components.
struct Answer {
    mean: Vec<f64>,
    /// Σ of the squared standard errors.
    squares: f64,
    rays: u64,
}

impl Target {
    /// The gradient image of a translating and rotating quadrilateral.
    pub(super) fn image() -> anyhow::Result<Self> {
        let scene = quadrilateral()?;
        let turn = Motion::rotate([0], DVec2::new(2.2, 2.0));
        let motion = Motion::translate([0], DVec2::new(1.0, 0.3)).and(turn);
        let velocities = motion.velocities(&scene)?;
        Self::new(scene, Film::new(SIDE, SIDE, Filter::Tent)?, Ask::Pixels { motion, velocities })
    }

    /// All vertex coordinates of a star, for the loss ½ ‖I − J‖² with J the quadrilateral's image.
    pub(super) fn vertices() -> anyhow::Result<Self> {
        let corner = |i: usize| {
            let angle = 0.1 + i as f64 * std::f64::consts::TAU / VERTICES as f64;
            let radius = if i.is_multiple_of(2) { 1.35 } else { 1.1 };
            DVec2::new(2.0, 2.05) + radius * DVec2::from_angle(angle)
        };
        let scene = white_over_black((0..VERTICES).map(corner).collect())?;
        let film = Film::new(SIDE, SIDE, Filter::Tent)?;
        let primal =
            |scene: &Scene| -> anyhow::Result<Image> { Ok(Arrangement::new(scene, &film)?.primal(&film)) };
        let adjoint = primal(&scene)?.zip(&primal(&quadrilateral()?)?, |a, b| DVec3::X * (a - b));
        Self::new(scene, film, Ask::Vertices { adjoint })
    }

    fn new(scene: Scene, film: Film, ask: Ask) -> anyhow::Result<Self> {
        let mut target = Self { scene, film, ask, exact: vec![], norm: 0.0 };
        target.exact = target.answer(&Exact)?.mean;
        target.norm = dot(&target.exact, &target.exact);
        Ok(target)
    }

    fn answer(&self, method: &dyn Method) -> anyhow::Result<Answer> {
        match &self.ask {
            Ask::Pixels { motion, .. } => {
                let image = method.forward(&self.scene, motion, &self.film)?;
                let squares = image.standard_error.pixels().iter().map(|e| e.x * e.x).sum();
                let mean = image.mean.pixels().iter().map(|pixel| pixel.x).collect();
                Ok(Answer { mean, squares, rays: image.rays })
            }
            Ask::Vertices { adjoint } => {
                let gradient = method.reverse(&self.scene, &self.film, adjoint)?;
                let squares = gradient.standard_error.iter().map(|e| e.length_squared()).sum();
                let mean = gradient.mean.iter().flat_map(DVec2::to_array).collect();
                Ok(Answer { mean, squares, rays: gradient.rays })
            }
        }
    }

    /// Mean and variance of a method, from `runs` runs that take `samples` a pixel each.
    pub(super) fn measure(
        &self,
        runs: usize,
        samples: usize,
        method: impl Fn(usize) -> Box<dyn Method>,
    ) -> anyhow::Result<(Bias, Spread)> {
        let answers =
            (0..runs).map(|run| self.answer(&*method(run))).collect::<anyhow::Result<Vec<Answer>>>()?;
        let count = (runs * samples) as f64;
        let squares: f64 = answers.iter().map(|a| a.squares).sum();
        let rays: u64 = answers.iter().map(|a| a.rays).sum();
        let spread = Spread {
            variance: squares / runs as f64 * samples as f64 / self.norm,
            rays: rays as f64 / count / (SIDE * SIDE) as f64,
        };
        let means: Vec<Vec<f64>> = answers.into_iter().map(|a| a.mean).collect();
        Ok((regress(&self.exact, &means), spread))
    }

    /// Seconds that one thread takes for a sample of one pixel.
    pub(super) fn seconds(&self, samples: usize, method: &dyn Method) -> anyhow::Result<f64> {
        Ok(seconds(|| self.answer(method))? / (samples * SIDE * SIDE) as f64)
    }
}

/// The quadrilateral of the study.
fn quadrilateral() -> anyhow::Result<Scene> {
    let corners = [(1.1, 1.4), (2.9, 1.0), (3.2, 2.6), (1.5, 3.1)];
    white_over_black(corners.map(|(x, y)| DVec2::new(x, y)).to_vec())
}

/// A white polygon over black.
fn white_over_black(corners: Vec<DVec2>) -> anyhow::Result<Scene> {
    let shape = Shape::new(Polygon::simple(corners)?, Shade::constant(DVec3::ONE));
    Ok(Scene::new(DVec3::ZERO, vec![shape])?)
}
