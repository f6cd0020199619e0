//! The state of a path between two surfaces.

use flatland::calculus::{Number, Rgb, Vec3};
use glam::DVec3;

use crate::scene::Hit;

/// Continuation of a path.
#[derive(Clone, Copy, Debug)]
pub(super) struct Scattered<T> {
    pub(super) origin: Vec3<T>,
    pub(super) direction: Vec3<T>,
    pub(super) throughput: Rgb<T>,
    /// Accumulated compression of radiance, η²: Russian roulette must not treat it as loss.
    pub(super) compression: f64,
    pub(super) hit: Option<Hit>,
}

impl<T: Number> Scattered<T> {
    /// Start of a path.
    pub(super) fn new(origin: Vec3<T>, direction: Vec3<T>, hit: Option<Hit>) -> Self {
        Self::underway(origin, direction, Rgb::constant(DVec3::ONE), hit)
    }

    /// A path that has only been reflected so far.
    pub(super) fn underway(
        origin: Vec3<T>,
        direction: Vec3<T>,
        throughput: Rgb<T>,
        hit: Option<Hit>,
    ) -> Self {
        Self { origin, direction, throughput, compression: 1.0, hit }
    }
}
