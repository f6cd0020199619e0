//! Chains: points of a path at ideal boundaries, from one direction that is integrated over to the next.
//!
//! A sample of the film, or of the directions at a bounce, determines all points up to the first one that
//! scatters. Light is discontinuous where any of them changes surface, and every sequence of branches is an
//! integral with its own warp (Theory 12). A path therefore starts again with another warp at every ideal
//! boundary.

use flatland::calculus::{Rgb, Vec3};
use glam::DVec3;

use super::bsdf::Branch;
use super::calculus::Calculus;
use super::scattered::Scattered;
use crate::scene::Hit;

/// Origin and direction of a ray.
pub(crate) type Ray<T> = (Vec3<T>, Vec3<T>);

/// Destination of a path's light: one sum for every warp of the film.
pub(crate) trait Parts<C: Calculus> {
    /// The sum of the current warp.
    fn total(&mut self) -> &mut Rgb<C::Number>;

    /// Begins the sum of the light through a chain, or of one light without extent. The result is the camera
    /// ray with the warp of that part; `None` if all parts have one warp.
    fn begin(&mut self, calculus: &mut C, chain: &[Branch], light: Option<usize>) -> Option<Ray<C::Number>>;

    /// Continues the sum before the last one that was begun.
    fn resume(&mut self);

    /// Whether light through chains from the first point, and of lights without extent there, is left out: it
    /// belongs to other parts.
    fn is_first_alone(&self) -> bool {
        false
    }
}

/// One warp for all light.
impl<C: Calculus> Parts<C> for Rgb<C::Number> {
    fn total(&mut self) -> &mut Self {
        self
    }

    fn begin(&mut self, _: &mut C, _: &[Branch], _: Option<usize>) -> Option<Ray<C::Number>> {
        None
    }

    fn resume(&mut self) {}
}

/// The part of the light that the first point scatters.
pub(crate) struct FirstAlone(pub(crate) Rgb<f64>);

impl<C: Calculus<Number = f64>> Parts<C> for FirstAlone {
    fn total(&mut self) -> &mut Rgb<f64> {
        &mut self.0
    }

    fn begin(&mut self, _: &mut C, _: &[Branch], _: Option<usize>) -> Option<Ray<f64>> {
        None
    }

    fn resume(&mut self) {}

    fn is_first_alone(&self) -> bool {
        true
    }
}

/// An ideal boundary on a path.
#[derive(Clone, Copy, Debug)]
pub(super) struct Passed {
    pub(super) hit: Hit,
    pub(super) numbers: [f64; 3],
    /// Weight of Russian roulette there.
    pub(super) survival: f64,
}

/// Where the direction was chosen that determines a chain.
#[derive(Clone, Debug)]
pub(super) enum Departure<T> {
    Film,
    Bounce {
        /// The path that arrives there.
        arriving: Scattered<T>,
        hit: Hit,
        direction: DVec3,
        density: f64,
    },
}

/// The chain since the last departure.
#[derive(Clone, Debug)]
pub(super) struct Trail<T> {
    pub(super) departure: Departure<T>,
    pub(super) branches: Vec<Branch>,
    pub(super) passed: Vec<Passed>,
    /// Whether any point of the path was at an ideal boundary.
    pub(super) has_passed: bool,
}

impl<T> Trail<T> {
    pub(super) fn new() -> Self {
        Self { departure: Departure::Film, branches: vec![], passed: vec![], has_passed: false }
    }

    /// Begins a chain at a bounce.
    pub(super) fn depart(&mut self, departure: Departure<T>) {
        self.departure = departure;
        self.branches.clear();
        self.passed.clear();
    }

    pub(super) fn pass(&mut self, branch: Branch, passed: Passed) {
        self.branches.push(branch);
        self.passed.push(passed);
        self.has_passed = true;
    }
}
