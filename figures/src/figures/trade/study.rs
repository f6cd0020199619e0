//! The scene of the study, and the bias of a warp on it to a few parts in a thousand.

use flatland::estimator::{Exact, Method};
use flatland::plane::fields::AuxiliaryField;
use flatland::plane::{Film, Filter, Motion, Polygon, Scene, Shade, Shape};
use flatland::random::{open01, stream};
use flatland::warp::{Warp, WarpField};
use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::cells::{Cell, graded};
use super::regression::{Bias, regress};

/// Pixels a side.
pub(super) const SIDE: usize = 4;
/// The auxiliary kernel's κ wherever it is not what varies, in 1/pixel²: a width of 0.15 pixels.
pub(super) const KAPPA: f64 = 44.0;
/// Cells that one task of a thread takes on.
const TASK: usize = 64;

/// A white quadrilateral that moves over black, and its exact gradient image.
pub(super) struct Study {
    pub(super) scene: Scene,
    pub(super) film: Film,
    pub(super) motion: Motion,
    pub(super) velocities: Vec<DVec2>,
    /// dI/dθ of every pixel.
    pub(super) exact: Vec<f64>,
}

impl Study {
    /// The scene of the figure.
    pub(super) fn new() -> anyhow::Result<Self> {
        let corners = [(1.1, 1.4), (2.9, 1.0), (3.2, 2.6), (1.5, 3.1)];
        let scene = white_over_black(corners.map(|(x, y)| DVec2::new(x, y)).to_vec())?;
        let film = Film::new(SIDE, SIDE, Filter::Tent)?;
        let turn = Motion::rotate([0], DVec2::new(2.2, 2.0));
        let motion = Motion::translate([0], DVec2::new(1.0, 0.3)).and(turn);
        let velocities = motion.velocities(&scene)?;
        let image = Exact.forward(&scene, &motion, &film)?.mean;
        let exact = image.pixels().iter().map(|pixel| pixel.x).collect();
        Ok(Self { scene, film, motion, velocities, exact })
    }

    /// The bias of the area integral with a warp of auxiliary rays, from `batches` independent means
    /// of one sample in every cell of a partition that is finer towards the silhouette.
    ///
    /// Stratified samples that serve all pixels at once have the same mean as the method's own and
    /// far less variance, in which the bias of hundreds of rays would drown.
    pub(super) fn bias(&self, warp: Warp, kappa: f64, batches: usize, seed: u64) -> Bias {
        let field = AuxiliaryField { scene: &self.scene, velocities: &self.velocities, warp, kappa };
        let edges: Vec<[DVec2; 2]> =
            self.scene.edges().map(|(_, edge)| edge.map(|v| self.scene.vertices()[v])).collect();
        let cells = graded(self.film.extent(), &edges, kappa);
        let tasks: Vec<&[Cell]> = cells.chunks(TASK).collect();
        let parts: Vec<Vec<f64>> = (0..batches * tasks.len())
            .into_par_iter()
            .map(|i| self.stratified(&field, tasks[i % tasks.len()], (seed, i as u64)))
            .collect();
        let images: Vec<Vec<f64>> = parts.chunks(tasks.len()).map(sum).collect();
        regress(&self.exact, &images)
    }

    /// What one sample in each of the cells adds to every pixel.
    fn stratified(
        &self,
        field: &AuxiliaryField<'_>,
        cells: &[Cell],
        (seed, address): (u64, u64),
    ) -> Vec<f64> {
        let mut rng = stream(seed, &[address]);
        let mut image = vec![0.0; self.exact.len()];
        for cell in cells {
            let u = cell.low + cell.size * DVec2::new(open01(&mut rng), open01(&mut rng));
            let (v, _) = field.at(u, &mut rng);
            // ∇·(V h f), f constant but for its jump; less ½ everywhere, since ∫ ∇·(V h) du = 0.
            let f = self.scene.value(self.scene.hit(u).as_ref(), u).x - 0.5;
            for (i, value) in image.iter_mut().enumerate() {
                let centre = self.film.centre(i % SIDE, i / SIDE);
                let flow = self.film.filter_gradient(centre, u).dot(v.value);
                let growth = self.film.filter_value(centre, u) * v.divergence;
                *value += cell.size.x * cell.size.y * f * (flow + growth);
            }
        }
        image
    }
}

/// A white polygon over black.
pub(super) fn white_over_black(corners: Vec<DVec2>) -> anyhow::Result<Scene> {
    let shape = Shape::new(Polygon::simple(corners)?, Shade::constant(DVec3::ONE));
    Ok(Scene::new(DVec3::ZERO, vec![shape])?)
}

/// The sum of images.
fn sum(images: &[Vec<f64>]) -> Vec<f64> {
    let mut total = vec![0.0; images.first().map_or(0, Vec::len)];
    for image in images {
        total.iter_mut().zip(image).for_each(|(t, v)| *t += v);
    }
    total
}

/// A seed for the part of the study that the words name: 52 bits of their stream.
pub(super) fn seed_of(seed: u64, words: &[u64]) -> u64 {
    (open01(&mut stream(seed, words)) * 2f64.powi(52)) as u64
}
