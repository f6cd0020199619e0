//! What paths of a wave draw at a vertex: a point of a light and a direction, each its own or one for all of
//! them.

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

/// The random numbers of the paths of a wave.
#[derive(Clone)]
#[expect(clippy::large_enum_variant, reason = "one a wave, on the stack")]
pub(super) enum LaneDraws<'d> {
    /// Of all of them.
    Alike(Draws<'d>),
    /// Of each.
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

/// Draws of paths at a vertex.
pub(super) struct Step<'d> {
    /// Random numbers up to the vertex.
    pub(super) before: LaneDraws<'d>,
    pub(super) lamps: [Lamps; ROWS],
    /// The triangles that the lights are points of.
    pub(super) targets: [u32; Sheaf::MOST],
    /// The point of a light that all paths have in common, if they have one.
    pub(super) common: Option<DVec3>,
    /// The directions that are sampled, about z.
    pub(super) locals: [Vectors; ROWS],
    pub(super) depth: usize,
    pub(super) goes_on: bool,
}

impl<'d> Step<'d> {
    /// What paths draw at their next vertex. Given are the lanes of rows that are under way, as bits, which
    /// segment this is, and whether there is another.
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

/// A point of a light.
struct Sight {
    spot: Spot,
    triangle: u32,
    radiance: [f64; 3],
    probability: f64,
    area: f64,
}

/// The point of a light, if it is one of a mesh, and the direction about z that a path draws at a vertex.
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
