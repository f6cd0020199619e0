//! Random samples of a wave's paths at a vertex: a light point and a direction, separate or common.

use glam::DVec3;

use super::row::{Lamps, ROWS, Vectors};
use crate::geometry::Sheaf;
use crate::lanes::WIDTH;
use crate::path::bsdf::diffuse;
use crate::path::emitter::Spot;
use crate::path::integrator::Paths;
use crate::path::lights::Place;
use crate::path::sequence::Draws;
use crate::scene::Surface;

/// Random numbers of the paths of a wave.
#[derive(Clone)]
#[expect(clippy::large_enum_variant, reason = "one a wave, on the stack")]
pub(super) enum LaneDraws<'d> {
    /// Common to all paths.
    Alike(Draws<'d>),
    /// Separate for each path.
    Own([Draws<'d>; Sheaf::MOST]),
}

impl<'d> LaneDraws<'d> {
    pub(super) fn of(&self, at: usize) -> &Draws<'d> {
        match self {
            Self::Alike(draws) => draws,
            Self::Own(draws) => &draws[at],
        }
    }
}

/// Samples of the paths at a vertex.
pub(super) struct Step<'d> {
    /// Random numbers up to the vertex.
    pub(super) before: LaneDraws<'d>,
    pub(super) lamps: [Lamps; ROWS],
    /// Triangles of the light points.
    pub(super) targets: [u32; Sheaf::MOST],
    /// The light point common to all paths, if there is one.
    pub(super) common: Option<DVec3>,
    /// Sampled directions, about z.
    pub(super) locals: [Vectors; ROWS],
    pub(super) depth: usize,
    pub(super) goes_on: bool,
}

impl<'d> Step<'d> {
    /// Samples at the next vertex, given the bit masks of active lanes of each row, the index of the segment,
    /// and whether there is another one.
    pub(super) fn draw(
        paths: &Paths<'_>,
        draws: &mut LaneDraws<'d>,
        active: [u32; ROWS],
        (depth, goes_on): (usize, bool),
    ) -> Self {
        let mut step = Self {
            before: draws.clone(),
            lamps: [Lamps::NONE; ROWS],
            targets: [Sheaf::NONE; Sheaf::MOST],
            common: None,
            locals: [Vectors::ZERO; ROWS],
            depth,
            goes_on,
        };
        match draws {
            LaneDraws::Alike(draws) => {
                let (lamp, local) = drawn(paths, draws);
                step.common = lamp.as_ref().map(|lamp| lamp.spot.point);
                for at in 0..Sheaf::MOST {
                    lamp.iter().for_each(|lamp| step.take_lamp(at, lamp));
                    step.locals[at / WIDTH].set(at % WIDTH, local.to_array());
                }
            }
            LaneDraws::Own(draws) => {
                for (at, draws) in draws.iter_mut().enumerate() {
                    if active[at / WIDTH] >> (at % WIDTH) & 1 == 1 {
                        let (lamp, local) = drawn(paths, draws);
                        lamp.iter().for_each(|lamp| step.take_lamp(at, lamp));
                        step.locals[at / WIDTH].set(at % WIDTH, local.to_array());
                    }
                }
            }
        }
        step
    }

    fn take_lamp(&mut self, at: usize, Sight { spot, triangle, radiance, probability, area }: &Sight) {
        let (lamps, lane) = (&mut self.lamps[at / WIDTH], at % WIDTH);
        lamps.point.set(lane, spot.point.to_array());
        lamps.normal.set(lane, spot.normal.to_array());
        lamps.radiance.set(lane, *radiance);
        (lamps.probability[lane], lamps.area[lane]) = (*probability, *area);
        self.targets[at] = *triangle;
    }
}

/// A light point.
struct Sight {
    spot: Spot,
    triangle: u32,
    radiance: [f64; 3],
    probability: f64,
    area: f64,
}

/// The light point, if it belongs to a mesh, and the direction about z that a path samples at a vertex.
fn drawn(paths: &Paths<'_>, draws: &mut Draws<'_>) -> (Option<Sight>, DVec3) {
    let (choice, [a, b]) = (draws.one(), draws.pair());
    let lamp = paths.lights.place([choice, a, b]).and_then(|place| {
        let Surface::Triangle(triangle) = place.spot.surface else { return None };
        let radiance = paths.radiance_of(place.spot.surface).to_array();
        let Place { spot, probability, area } = place;
        Some(Sight { spot, triangle, radiance, probability, area })
    });
    let (c, [a, b]) = (draws.one(), draws.pair());
    (lamp, diffuse::sample([a, b, c]))
}
