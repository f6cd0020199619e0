//! Auxiliary rays with their weights, and the visible shapes as θ grows.

use flatland::random::stream;
use flatland::transport::{Camera, Origin, World, WorldError};
use flatland::warp::{Debias, Line, Term, Warp};
use serde::Serialize;

use super::state::State;

/// Auxiliary rays that are drawn where their number is random.
const RAYS: usize = 16;
/// Drawn length of a ray that meets nothing.
const FAR: f64 = 12.0;
/// Growth of θ to either side, and the steps on the way.
const SWING: f64 = 0.25;
const STEPS: i32 = 6;

/// An auxiliary ray.
#[derive(Debug, Serialize)]
pub(super) struct Ray {
    end: [f64; 2],
    /// Its place on the film, in pixels.
    at: f64,
    /// Its part of the sum of all weights.
    pub(super) share: f64,
    /// The shape that it hits; −1 for none.
    shape: i32,
}

/// The shape seen at equally spaced places of the film, at one θ.
#[derive(Debug, Serialize)]
pub(super) struct Moment {
    theta: f64,
    /// By the number of the shape; −1 for none.
    seen: Vec<i32>,
}

/// The auxiliary rays around the state's place on the film.
pub(super) fn rays(state: &State, world: &World, camera: &Camera, warp: Warp) -> Vec<Ray> {
    let debias = Debias::Consistent { rays: state.rays().unwrap_or(RAYS) };
    let origin = Origin::free(camera.position);
    let mut dice = stream(state.seed(), &[1 << 40]);
    let warp = Warp { debias, ..warp };
    let stencil = warp.stencil::<Line, _>(state.place(), state.kappa(), &mut dice, |at| {
        let (direction, hit) = (camera.direction(at), world.trace(origin, camera.direction(at)));
        let ends = hit.as_ref().map(|h| world.segments()[h.segment].ends());
        let far = |end| camera.project(end).map_or(f64::INFINITY, |p: f64| (p - at).abs());
        let distance = ends.map_or(f64::INFINITY, |[a, b]| far(a).min(far(b)));
        let shape = hit.as_ref().map_or(-1, |h| world.segments()[h.segment].shape as i32);
        let end = hit.map_or(origin.point + FAR * direction, |h| world.point(&h));
        ((end.to_array(), at, shape), distance)
    });
    let ray = |term: &Term<f64, ([f64; 2], f64, i32)>| {
        let (end, at, shape) = term.hit;
        Ray { end, at, share: term.weight, shape }
    };
    stencil.terms().iter().map(ray).collect()
}

/// Number of film points whose visible shapes are shown while θ oscillates.
pub(super) fn swing(state: &State, places: usize) -> Result<Vec<Moment>, WorldError> {
    let moment = |step: i32| {
        let theta = SWING * f64::from(step) / f64::from(STEPS);
        let moved = state.moved(theta);
        let (world, camera) = (moved.world()?, moved.camera());
        let origin = Origin::free(camera.position);
        let width = camera.film.pixels as f64;
        let seen = (0..places).map(|place| {
            let u = width * (place as f64 + 0.5) / places as f64;
            let hit = world.trace(origin, camera.direction(u));
            hit.map_or(-1, |hit| world.segments()[hit.segment].shape as i32)
        });
        Ok(Moment { theta, seen: seen.collect() })
    };
    (-STEPS..=STEPS).map(moment).collect()
}
