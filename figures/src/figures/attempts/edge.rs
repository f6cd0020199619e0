//! A moving half-plane: the left side of x = 0, with one straight silhouette.

use flatland::plane::fields::{AuxiliaryField, DirectField};
use flatland::plane::{Motion, Polygon, Scene, Shade, Shape};
use flatland::random::stream;
use flatland::warp::{BoundaryFunction, Plane, Warp, WarpField, Weighting};
use glam::{DVec2, DVec3};
use rayon::prelude::*;

/// The kernel's concentration: lengths are in kernel widths.
pub(super) const KAPPA: f64 = 1.0;
/// Ratio of the number of estimates with the original's weight to that with the default's.
pub(super) const HEAVIER: usize = 4;
/// Further away than any auxiliary point.
const FAR: f64 = 60.0;

/// The scene and the velocity of its vertices: x to the right, one unit of length per unit of θ.
pub(super) struct Edge {
    pub(super) scene: Scene,
    pub(super) velocities: Vec<DVec2>,
}

impl Edge {
    pub(super) fn new() -> anyhow::Result<Self> {
        let corners = [(-FAR, -FAR), (0.0, -FAR), (0.0, FAR), (-FAR, FAR)].map(|(x, y)| DVec2::new(x, y));
        let shape = Shape::new(Polygon::simple(corners)?, Shade::constant(DVec3::ONE));
        let scene = Scene::new(DVec3::ZERO, vec![shape])?;
        let velocities = Motion::translate([0], DVec2::X).velocities(&scene)?;
        Ok(Self { scene, velocities })
    }
}

/// The boundary-aware weights that are shown: exponent γ and boundary function B.
#[derive(Clone, Copy, Debug)]
pub(super) struct Weight {
    pub(super) name: &'static str,
    pub(super) gamma: f64,
    pub(super) boundary: BoundaryFunction,
}

impl Weight {
    /// The default weight and the original's.
    pub(super) fn both() -> [Self; 2] {
        let of = |name, warp: Warp| match warp.weighting {
            Weighting::BoundaryAware { gamma, boundary } => Self { name, gamma, boundary },
            Weighting::Gaussian => unreachable!("both warps are boundary aware"),
        };
        [of("quadratic B", Warp::default()), of("linear B", Warp::original(1))]
    }

    /// D = exp(κ|u−u'|²/2) − 1.
    pub(super) fn distance(u: DVec2, other: DVec2) -> f64 {
        (0.5 * KAPPA * (u - other).length_squared()).exp_m1()
    }

    /// B(u') of the half-plane's scene; 1 on the background.
    pub(super) fn boundary(&self, scene: &Scene, other: DVec2) -> f64 {
        let hit = scene.hit(other);
        let limit = self.boundary.reach(KAPPA);
        self.boundary.value(scene.boundary_distance(hit.as_ref(), other, limit), KAPPA)
    }

    /// w = (D + B)^−γ.
    pub(super) fn value(&self, scene: &Scene, u: DVec2, other: DVec2) -> f64 {
        (Self::distance(u, other) + self.boundary(scene, other)).powf(-self.gamma)
    }

    pub(super) fn weighting(&self) -> Weighting {
        Weighting::BoundaryAware { gamma: self.gamma, boundary: self.boundary }
    }
}

/// V·x and ∇·V at a place, each with its standard error.
#[derive(Clone, Copy, Debug)]
pub(super) struct Reading {
    pub(super) x: f64,
    pub(super) value: [f64; 2],
    pub(super) error: [f64; 2],
}

/// One attempt along the line.
pub(super) struct Profile {
    pub(super) name: String,
    pub(super) readings: Vec<Reading>,
}

/// Sample places along the line: closer together near the silhouette, never on it.
pub(super) fn places(count: usize) -> Vec<f64> {
    let half = count / 2;
    (0..2 * half)
        .map(|i| {
            let t = (i as f64 + 0.5) / half as f64 - 1.0;
            3.0 * t * t.abs()
        })
        .collect()
}

/// Attempts 1, 2 and 3, the last with both weights, from `estimates` unbiased estimates; the original's
/// weight, whose tails are heavier, takes [`HEAVIER`] times as many.
pub(super) fn profiles(edge: &Edge, places: &[f64], estimates: usize, seed: u64) -> Vec<Profile> {
    let (scene, velocities) = (&edge.scene, edge.velocities.as_slice());
    let auxiliary = |warp| AuxiliaryField { scene, velocities, warp, kappa: KAPPA };
    let default = Warp::default();
    let gaussian = Warp { weighting: Weighting::Gaussian, ..default };
    let [quadratic, linear] = Weight::both();
    // A radial exponent of 1/6 lets the levels of a linear B converge as fast as those of a quadratic one.
    let original = Warp { weighting: linear.weighting(), radial_exponent: 1.0 / 6.0, ..default };
    let named = |weight: &Weight| format!("attempt 3: boundary-aware, γ = {}, {}", weight.gamma, weight.name);
    vec![
        profile("attempt 1: direct", &DirectField { scene, velocities }, places, 1, seed),
        profile("attempt 2: Gaussian", &auxiliary(gaussian), places, estimates, seed),
        profile(&named(&quadratic), &auxiliary(default), places, estimates, seed),
        profile(&named(&linear), &auxiliary(original), places, HEAVIER * estimates, seed),
    ]
}

fn profile(
    name: &str,
    field: &impl WarpField<Plane>,
    places: &[f64],
    estimates: usize,
    seed: u64,
) -> Profile {
    let readings = places.par_iter().enumerate().map(|(i, &x)| {
        let (mut mean, mut squares) = ([0.0; 2], [0.0; 2]);
        for k in 0..estimates {
            let mut rng = stream(seed, &[4, i as u64, k as u64]);
            let one = field.at(DVec2::new(x, 0.0), &mut rng).0;
            for (c, value) in [one.value.x, one.divergence].into_iter().enumerate() {
                let delta = value - mean[c];
                mean[c] += delta / (k + 1) as f64;
                squares[c] += delta * (value - mean[c]);
            }
        }
        let count = estimates as f64;
        let error = squares.map(|s| if estimates > 1 { (s / (count - 1.0) / count).sqrt() } else { 0.0 });
        Reading { x, value: mean, error }
    });
    Profile { name: name.to_owned(), readings: readings.collect() }
}
