//! Samples moved by T(u') = u' + (θ − θ₀) V(u'), and which of them change sides.

use flatland::plane::Scene;
use flatland::plane::exact::Arrangement;
use flatland::plane::fields::{AuxiliaryField, DirectField};
use flatland::random::{Stream, open01, stream};
use flatland::warp::{BoundaryFunction, Debias, Plane, Warp, WarpField, Weighting};
use glam::DVec2;
use rayon::prelude::*;

use super::scene::{Example, SIDE};
use crate::plot::{Color, Palette};

/// The width κ^−½ of the auxiliary kernel here, in pixels. The narrower, the steeper V between shapes that
/// move differently, and the sooner T folds: this one is as wide as the shapes.
pub(super) const KERNEL_WIDTH: f64 = 8.0;
/// The exponent γ and the scale of B, for a V that follows silhouettes closely.
const GAMMA: f64 = 2.0;
const BOUNDARY_SCALE: f64 = 0.6;
/// Auxiliary rays for each V; many, because here V is applied as a map and not averaged.
pub(super) const AUXILIARY_RAYS: usize = 256;

/// A construction of V, and its value at every sample.
pub(super) struct Moved {
    pub(super) name: &'static str,
    pub(super) color: Color,
    /// V at each sample, at θ₀.
    pub(super) velocities: Vec<DVec2>,
}

/// Sample points with the shape seen at each, at θ₀.
pub(super) struct Samples {
    pub(super) points: Vec<DVec2>,
    pub(super) seen: Vec<Option<usize>>,
    pub(super) moved: Vec<Moved>,
}

impl Samples {
    /// `side`² points, one in each cell of a grid over the window, and V of every construction there.
    pub(super) fn new(
        example: &Example,
        arrangement: &Arrangement<'_>,
        window: Window,
        side: usize,
        seed: u64,
    ) -> Self {
        let points = window.jittered(side, seed);
        let (scene, velocities) = (&example.scene, example.velocities.as_slice());
        let kappa = KERNEL_WIDTH.powi(-2);
        let boundary = BoundaryFunction::KernelScaledSquared { scale: BOUNDARY_SCALE };
        let weighting = Weighting::BoundaryAware { gamma: GAMMA, boundary };
        let warp = Warp { weighting, debias: Debias::Consistent { rays: AUXILIARY_RAYS }, ..Warp::default() };
        let oracle = arrangement.oracle(velocities);
        let apply = |name, color, field: &dyn WarpField<Plane>| {
            let velocity = |(i, u): (usize, &DVec2)| field.at(*u, &mut stream(seed, &[1, i as u64])).0.value;
            Moved { name, color, velocities: points.par_iter().enumerate().map(velocity).collect() }
        };
        let still = vec![DVec2::ZERO; points.len()];
        let auxiliary = AuxiliaryField { scene, velocities, warp, kappa };
        let moved = vec![
            Moved { name: "no warp: V = 0", color: Palette::GREY, velocities: still },
            apply("direct field", Palette::PURPLE, &DirectField { scene, velocities }),
            apply("boundary-aware field", Palette::BLUE, &auxiliary),
            apply("oracle field", Palette::GREEN, &oracle),
        ];
        let seen = points.iter().map(|&u| seen(scene, u)).collect();
        Self { points, seen, moved }
    }

    /// Position of each sample at θ under the construction, and whether it sees another shape there.
    pub(super) fn at(&self, moved: &Moved, displaced: &Scene, theta: f64) -> Vec<(DVec2, bool)> {
        let places = self.points.par_iter().zip(&moved.velocities).zip(&self.seen);
        places
            .map(|((u, v), before)| {
                let u = *u + theta * *v;
                (u, seen(displaced, u) != *before)
            })
            .collect()
    }

    /// The number of samples that see another shape at θ than at θ₀.
    pub(super) fn changed(&self, moved: &Moved, displaced: &Scene, theta: f64) -> usize {
        self.at(moved, displaced, theta).iter().filter(|(_, changed)| *changed).count()
    }
}

fn seen(scene: &Scene, u: DVec2) -> Option<usize> {
    scene.hit(u).map(|hit| hit.shape())
}

/// A square of the image plane.
#[derive(Clone, Copy, Debug)]
pub(super) struct Window {
    pub(super) low: DVec2,
    pub(super) side: f64,
}

impl Window {
    /// The whole film.
    pub(super) const FILM: Self = Self { low: DVec2::ZERO, side: SIDE as f64 };

    /// One point in each cell of a grid of `side`² cells.
    fn jittered(self, side: usize, seed: u64) -> Vec<DVec2> {
        let cell = self.side / side as f64;
        let mut rng: Stream = stream(seed, &[0]);
        let mut place = |i: usize| (i as f64 + open01(&mut rng)) * cell;
        (0..side * side).map(|i| self.low + DVec2::new(place(i % side), place(i / side))).collect()
    }
}
