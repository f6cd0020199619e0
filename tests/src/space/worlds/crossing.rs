//! Meshes in front of a camera whose triangles pass through one another.
//!
//! At least one crossing is visible in every case. Positions are generic: no triangles overlap in one plane,
//! no corner is in another's plane. Where θ bends a rectangle that another body crosses, or pieces occlude
//! each other cyclically, the exact reference reports it and the next attempt is taken.

use flatland::plane::Filter;
use glam::{DVec2, DVec3};

use super::coverage::CoverageCase;
use super::moves::Affine;
use super::stage::{Body, Stage};
use crate::choices::choices;
use crate::dice::Dice;
use crate::space::coverage::{Camera, Crossing, ProjectedScene, crossings};

choices! {
    /// The bodies that pass through one another.
    CrossingKind {
        /// Two flat convex plates: the crossing ends where an edge of one pierces the other, or at both
        /// borders of one.
        Plates,
        /// Three to five triangles.
        Leaves,
        /// Two closed solids.
        Solids,
        /// A closed solid sunk into a rectangular floor.
        Sunk,
        /// A plate through the ridge of a roof: the crossing has a kink.
        Crease,
        /// Three plates through a common point, in which their crossings meet.
        Three,
    }
}

choices! {
    /// The parameters that θ changes.
    CrossingMoving {
        /// The crossing is at rest in the world.
        AT_REST {
            /// A plate in front of the crossing bodies; the crossing is at rest.
            Front,
            /// The camera: the crossing is at rest in the world.
            Camera,
        }
        /// The crossing moves.
        MOVING {
            /// One of the crossing bodies, by an affine map.
            One,
            /// Every body, each on its own.
            All,
            /// One vertex of a body of triangles.
            Vertex,
            /// Every body and the camera.
            Mixed,
        }
    }
}

/// Parameters that determine a case.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CrossingKnobs {
    /// The seed of everything that has no knob of its own.
    pub seed: u64,
    /// The bodies that cross.
    pub kind: CrossingKind,
    /// The motion.
    pub moving: CrossingMoving,
    /// The pixel filter.
    pub filter: Filter,
}

impl CrossingKnobs {
    /// Knobs of a kind and a motion, the filter drawn from a seed.
    pub fn random(seed: u64, kind: CrossingKind, moving: CrossingMoving) -> Self {
        let filter = Dice::new(seed, 500 + kind as u64).pick(&[Filter::Box, Filter::Tent, Filter::Gaussian]);
        Self { seed, kind, moving, filter }
    }

    /// The case with these knobs: the same on every machine and in every thread.
    pub fn build(&self) -> CoverageCase {
        let purpose = |attempt: u64| 1_000_000 + 100 * attempt + 10 * self.kind as u64 + self.moving as u64;
        let case = (0..1000).find_map(|attempt| self.attempt(Dice::new(self.seed, purpose(attempt))));
        case.unwrap_or_else(|| panic!("no case for {self:?}"))
    }

    fn attempt(&self, dice: Dice) -> Option<CoverageCase> {
        let mut hub = Hub::new(dice);
        hub.furnish(self.kind);
        hub.set_in_motion(self.moving);
        let found = crossings(&hub.stage.mesh, &hub.stage.motion).ok()?;
        let is_generic = match self.kind {
            CrossingKind::Plates | CrossingKind::Solids | CrossingKind::Sunk => !found.is_empty(),
            CrossingKind::Leaves | CrossingKind::Crease => found.len() >= 2,
            CrossingKind::Three => meet(&found),
        };
        if !is_generic || !found.iter().any(|crossing| hub.shows(crossing)) {
            return None;
        }
        let Stage { mesh, camera, motion, .. } = hub.stage;
        ProjectedScene::new(&mesh, &camera, &motion, self.filter).ok()?.derivative().ok()?;
        Some(CoverageCase { mesh, camera, motion, filter: self.filter, label: format!("{self:?}") })
    }
}

/// Whether three crossings pass through one point.
fn meet(found: &[Crossing]) -> bool {
    let [a, b, c] = found else { return false };
    // The point of the first that is nearest to the second's line.
    let [p, q] = a.ends;
    let (d, e, w) = (q - p, b.ends[1] - b.ends[0], p - b.ends[0]);
    let (dd, de, ee) = (d.dot(d), d.dot(e), e.dot(e));
    let x = p + d * ((de * e.dot(w) - ee * d.dot(w)) / (dd * ee - de * de));
    let is_inside = |crossing: &Crossing| {
        let [p, q] = crossing.ends;
        p.distance(x) + x.distance(q) < p.distance(q) * (1.0 + 1e-9)
    };
    [a, b, c].into_iter().all(is_inside)
}

/// A scene under construction around a place.
struct Hub {
    stage: Stage,
    at: DVec3,
    /// Radius of the bodies around the place: two to three pixels.
    radius: f64,
}

impl Hub {
    fn new(dice: Dice) -> Self {
        let mut stage = Stage::new(dice);
        let dice = &mut stage.dice;
        let (depth, u) = (dice.between(2.0, 5.0), DVec2::new(dice.between(0.3, 0.7), dice.between(0.3, 0.7)));
        let pixels = dice.between(2.0, 3.0);
        let at = stage.place(u * stage.size(), depth);
        let radius = (pixels / stage.camera.pixels_per_slope()).min(0.3) * depth;
        Self { stage, at, radius }
    }

    fn furnish(&mut self, kind: CrossingKind) {
        let r = self.radius;
        match kind {
            CrossingKind::Plates => (0..2).for_each(|_| self.plate(0.3 * r, r)),
            CrossingKind::Three => (0..3).for_each(|_| self.plate(0.2 * r, r)),
            CrossingKind::Leaves => {
                let count = self.stage.dice.count(3, 5);
                (0..count).for_each(|_| self.plate(0.6 * r, 0.7 * r));
            }
            CrossingKind::Solids => {
                self.stage.solid(self.at, 0.8 * r);
                let (offset, size) =
                    (self.stage.dice.vector3(0.8 * r), self.stage.dice.between(0.5, 0.9) * r);
                self.stage.solid(self.at + offset, size);
            }
            CrossingKind::Sunk => {
                let (normal, size) = (self.stage.facing(self.at, 0.3), 2.0 * r);
                let ring = [(-1.0, -0.8), (1.0, -0.8), (1.0, 0.8), (-1.0, 0.8)];
                self.stage.flat(self.at, normal, size, &ring.map(|(x, y)| size * DVec2::new(x, y)));
                let height = self.stage.dice.between(-0.2, 0.3) * r;
                self.stage.solid(self.at + height * normal, 0.7 * r);
            }
            CrossingKind::Crease => self.crease(),
        }
    }

    fn plate(&mut self, off: f64, radius: f64) {
        let centre = self.at + self.stage.dice.vector3(off);
        let (normal, corners) = (self.stage.facing(self.at, 0.2), self.stage.dice.count(3, 4));
        let ring = self.stage.dice.convex_ring(radius, corners);
        self.stage.flat(centre, normal, radius, &ring);
    }

    /// Two triangles on a ridge, and one through it.
    fn crease(&mut self) {
        let (hub, r) = (self.at, self.radius);
        let sight = (hub - self.stage.camera.origin).normalize();
        let ridge = (self.stage.dice.direction().reject_from(sight).normalize()
            + 0.3 * self.stage.dice.direction())
        .normalize();
        let across = sight.cross(ridge).normalize();
        let wing = |dice: &mut Dice, side: f64| {
            hub + side * dice.between(0.6, 1.0) * r * across
                + dice.between(0.1, 0.6) * r * sight
                + dice.between(-0.5, 0.5) * r * ridge
        };
        let (left, right) = (wing(&mut self.stage.dice, -1.0), wing(&mut self.stage.dice, 1.0));
        let corners = vec![hub - r * ridge, hub + r * ridge, left, right];
        let turned = self.stage.is_seen_from_front([corners[0], corners[1], corners[2]]);
        let triangles = if turned { [[0, 1, 2], [1, 0, 3]] } else { [[1, 0, 2], [0, 1, 3]] };
        self.stage.add(hub, r, corners, &triangles);
        let normal = loop {
            let normal = (ridge + 0.8 * self.stage.dice.direction()).normalize();
            if normal.dot(sight).abs() > 0.15 {
                break -normal.dot(sight).signum() * normal;
            }
        };
        let (centre, ring) =
            (hub + self.stage.dice.vector3(0.3 * r), self.stage.dice.convex_ring(0.8 * r, 3));
        self.stage.flat(centre, normal, 0.8 * r, &ring);
    }

    /// A moving plate entirely in front of everything else.
    fn front(&mut self) {
        let share = self.stage.dice.between(0.3, 0.5);
        let to = self.at + self.stage.dice.vector3(0.6 * self.radius);
        let centre = self.stage.camera.origin + share * (to - self.stage.camera.origin);
        let radius = 0.6 * share * self.radius;
        let (normal, corners) = (self.stage.facing(self.at, 0.5), self.stage.dice.count(3, 4));
        let ring = self.stage.dice.convex_ring(radius, corners);
        self.stage.flat(centre, normal, radius, &ring);
        self.carry(self.stage.bodies.len() - 1);
    }

    /// Moves a body by about a pixel per unit of θ.
    fn carry(&mut self, body: usize) {
        let Body { centre, radius, .. } = self.stage.bodies[body];
        let affine = Affine::any(&mut self.stage.dice, centre, radius, 0.5 * radius);
        self.stage.carry(body, &affine);
    }

    fn set_in_motion(&mut self, moving: CrossingMoving) {
        let count = self.stage.bodies.len();
        match moving {
            CrossingMoving::Front => self.front(),
            CrossingMoving::Camera => {
                let camera = &mut self.stage.motion.camera;
                match self.stage.dice.count(0, 3) {
                    0 | 1 => camera.origin = self.stage.dice.vector3(self.radius),
                    2 => camera.angular = self.stage.dice.vector3(0.3),
                    _ => {
                        camera.origin = self.stage.dice.vector3(self.radius);
                        camera.angular = self.stage.dice.vector3(0.3);
                        camera.field_of_view = self.stage.dice.sign() * self.stage.dice.between(0.1, 0.4);
                    }
                }
            }
            CrossingMoving::One => {
                let body = self.stage.dice.count(0, count - 1);
                self.carry(body);
            }
            CrossingMoving::All => (0..count).for_each(|body| self.carry(body)),
            CrossingMoving::Vertex => {
                let vertex = self.stage.dice.count(0, self.stage.mesh.positions.len() - 1);
                self.stage.motion.positions[vertex] = self.stage.dice.vector3(self.radius);
            }
            CrossingMoving::Mixed => {
                self.set_in_motion(CrossingMoving::All);
                self.set_in_motion(CrossingMoving::Camera);
            }
        }
    }

    /// Whether the middle of a crossing is seen on the film.
    fn shows(&self, crossing: &Crossing) -> bool {
        let middle = 0.5 * (crossing.ends[0] + crossing.ends[1]) - self.stage.camera.origin;
        let Camera { right, up, forward, width, height, .. } = self.stage.camera;
        let slopes = DVec2::new(middle.dot(right), middle.dot(up)) / middle.dot(forward);
        let u = self.stage.camera.pixels_per_slope() * slopes;
        if u.abs().cmpgt(0.5 * DVec2::new(width as f64, height as f64)).any() {
            return false;
        }
        let hides = |t: &[usize; 3]| {
            let [a, b, c] = t.map(|v| self.stage.mesh.positions[v] - self.stage.camera.origin);
            let normal = (b - a).cross(c - a);
            let x = middle * (normal.dot(a) / normal.dot(middle));
            let is_inside =
                [(a, b), (b, c), (c, a)].iter().all(|(p, q)| (*q - *p).cross(x - *p).dot(normal) > 0.0);
            is_inside && x.dot(middle) > 0.0 && x.dot(middle) < middle.length_squared()
        };
        let others = self.stage.mesh.triangles.iter().enumerate();
        !others.filter(|(t, _)| !crossing.triangles.contains(t)).any(|(_, t)| hides(t))
    }
}
