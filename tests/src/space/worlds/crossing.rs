//! Meshes before a camera whose triangles pass through one another.
//!
//! Of every case at least one crossing is seen. Positions are generic: no triangles overlap in one
//! plane, no corner is in another's plane. Where θ bends a rectangle that something crosses, or
//! pieces hide each other in a ring, the exact reference says so and the next attempt is taken.

use std::ops::Range;

use flatland::plane::Filter;
use glam::{DVec2, DVec3};

use super::coverage::CoverageCase;
use super::dice::Dice;
use super::moves::Affine;
use super::solids::Solid;
use crate::space::coverage::{Camera, Crossing, Mesh, Motion, ProjectedScene, crossings};

/// What passes through what.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum CrossingKind {
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

/// What θ changes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum CrossingMoving {
    /// A plate before what crosses; the crossing rests.
    Front,
    /// The camera: the crossing rests in the world.
    Camera,
    /// One of the bodies that cross, as an affine map.
    One,
    /// Every body, each on its own.
    All,
    /// One vertex of a body of triangles.
    Vertex,
    /// Every body and the camera.
    Mixed,
}

impl CrossingKind {
    /// All of them.
    pub const ALL: [Self; 6] =
        [Self::Plates, Self::Leaves, Self::Solids, Self::Sunk, Self::Crease, Self::Three];
}

impl CrossingMoving {
    /// The crossing rests in the world.
    pub const AT_REST: [Self; 2] = [Self::Front, Self::Camera];
    /// It moves.
    pub const MOVING: [Self; 4] = [Self::One, Self::All, Self::Vertex, Self::Mixed];
}

/// All that a case depends on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CrossingKnobs {
    /// Everything that has no knob of its own.
    pub seed: u64,
    /// What crosses.
    pub kind: CrossingKind,
    /// What θ changes.
    pub moving: CrossingMoving,
    /// The pixel filter.
    pub filter: Filter,
}

impl CrossingKnobs {
    /// Knobs of a kind and a motion, the filter drawn from a seed.
    #[must_use]
    pub fn random(seed: u64, kind: CrossingKind, moving: CrossingMoving) -> Self {
        let filter = Dice::new(seed, 500 + kind as u64).pick(&[Filter::Box, Filter::Tent, Filter::Gaussian]);
        Self { seed, kind, moving, filter }
    }

    /// The case with these knobs: the same on every machine and in every thread.
    ///
    /// # Panics
    /// If a thousand attempts show no crossing, which is a mistake in this file.
    #[must_use]
    pub fn build(&self) -> CoverageCase {
        let purpose = |attempt: u64| 1_000_000 + 100 * attempt + 10 * self.kind as u64 + self.moving as u64;
        let case = (0..1000).find_map(|attempt| self.attempt(Dice::new(self.seed, purpose(attempt))));
        case.unwrap_or_else(|| panic!("no case for {self:?}"))
    }

    fn attempt(&self, dice: Dice) -> Option<CoverageCase> {
        let mut stage = Stage::new(dice);
        stage.furnish(self.kind);
        let mut motion =
            Motion { positions: vec![DVec3::ZERO; stage.mesh.positions.len()], ..Motion::default() };
        if self.moving == CrossingMoving::Front {
            stage.front(&mut motion);
        }
        stage.set_in_motion(self.moving, &mut motion);
        let found = crossings(&stage.mesh, &motion).ok()?;
        let is_generic = match self.kind {
            CrossingKind::Plates | CrossingKind::Solids | CrossingKind::Sunk => !found.is_empty(),
            CrossingKind::Leaves | CrossingKind::Crease => found.len() >= 2,
            CrossingKind::Three => meet(&found),
        };
        if !is_generic || !found.iter().any(|crossing| stage.shows(crossing)) {
            return None;
        }
        let Stage { mesh, camera, .. } = stage;
        ProjectedScene::cut(&mesh, &camera, &motion, self.filter).ok()?.derivative().ok()?;
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

/// One thing: its vertices, about where it is, and how large.
#[derive(Clone, Debug)]
struct Body {
    vertices: Range<usize>,
    centre: DVec3,
    radius: f64,
}

/// What is being built around a hub.
struct Stage {
    dice: Dice,
    camera: Camera,
    mesh: Mesh,
    bodies: Vec<Body>,
    hub: DVec3,
    /// Of what is about the hub: two to three pixels.
    radius: f64,
}

impl Stage {
    fn new(mut dice: Dice) -> Self {
        let frame = dice.frame();
        let camera = Camera {
            origin: dice.vector(2.0),
            right: frame.x_axis,
            up: frame.y_axis,
            forward: -frame.z_axis,
            field_of_view: dice.between(0.4, 1.3),
            width: dice.count(4, 8),
            height: dice.count(4, 8),
        };
        let mesh = Mesh { positions: vec![], triangles: vec![], radiance: vec![], background: dice.colour() };
        let size = DVec2::new(camera.width as f64, camera.height as f64);
        let (depth, u) = (dice.between(2.0, 5.0), DVec2::new(dice.between(0.3, 0.7), dice.between(0.3, 0.7)));
        let hub = camera.origin + depth * camera.direction(u * size);
        let radius = (dice.between(2.0, 3.0) / camera.pixels_per_slope()).min(0.3) * depth;
        Self { dice, camera, mesh, bodies: vec![], hub, radius }
    }

    fn furnish(&mut self, kind: CrossingKind) {
        let r = self.radius;
        match kind {
            CrossingKind::Plates => (0..2).for_each(|_| self.plate(0.3 * r, r)),
            CrossingKind::Three => (0..3).for_each(|_| self.plate(0.2 * r, r)),
            CrossingKind::Leaves => {
                let count = self.dice.count(3, 5);
                (0..count).for_each(|_| self.plate(0.6 * r, 0.7 * r));
            }
            CrossingKind::Solids => {
                self.solid(self.hub, 0.8 * r);
                let (offset, size) = (self.dice.vector(0.8 * r), self.dice.between(0.5, 0.9) * r);
                self.solid(self.hub + offset, size);
            }
            CrossingKind::Sunk => {
                let (normal, size) = (self.facing(0.3), 2.0 * r);
                let ring = [(-1.0, -0.8), (1.0, -0.8), (1.0, 0.8), (-1.0, 0.8)];
                self.flat(self.hub, normal, size, &ring.map(|(x, y)| size * DVec2::new(x, y)));
                let height = self.dice.between(-0.2, 0.3) * r;
                self.solid(self.hub + height * normal, 0.7 * r);
            }
            CrossingKind::Crease => self.crease(),
        }
    }

    /// A triangle or, if of four corners, two.
    fn flat(&mut self, centre: DVec3, normal: DVec3, radius: f64, ring: &[DVec2]) {
        let (x, y) = normal.any_orthonormal_pair();
        let corners: Vec<_> = ring.iter().map(|p| centre + p.x * x + p.y * y).collect();
        let triangles: Vec<_> = (2..corners.len()).map(|k| [0, k - 1, k]).collect();
        self.add(centre, radius, corners, &triangles);
        if triangles.len() == 2 && self.dice.chance(0.5) {
            let last = self.mesh.radiance.len() - 1;
            self.mesh.radiance[last] = self.mesh.radiance[last - 1];
        }
    }

    fn plate(&mut self, off: f64, radius: f64) {
        let centre = self.hub + self.dice.vector(off);
        let (normal, corners) = (self.facing(0.2), self.dice.count(3, 4));
        let ring = self.dice.convex_ring(radius, corners);
        self.flat(centre, normal, radius, &ring);
    }

    fn solid(&mut self, centre: DVec3, radius: f64) {
        let solid = Solid::random(&mut self.dice);
        let largest = solid.corners.iter().map(|c| c.length()).fold(0.0, f64::max);
        let corners = solid.corners.iter().map(|c| centre + *c * (radius / largest)).collect();
        self.add(centre, radius, corners, &solid.triangles);
    }

    /// Two triangles on a ridge, and one through it.
    fn crease(&mut self) {
        let (hub, r) = (self.hub, self.radius);
        let sight = (hub - self.camera.origin).normalize();
        let ridge =
            (self.dice.direction().reject_from(sight).normalize() + 0.3 * self.dice.direction()).normalize();
        let across = sight.cross(ridge).normalize();
        let wing = |dice: &mut Dice, side: f64| {
            hub + side * dice.between(0.6, 1.0) * r * across
                + dice.between(0.1, 0.6) * r * sight
                + dice.between(-0.5, 0.5) * r * ridge
        };
        let (left, right) = (wing(&mut self.dice, -1.0), wing(&mut self.dice, 1.0));
        let corners = vec![hub - r * ridge, hub + r * ridge, left, right];
        let turned = self.is_seen_from_front([corners[0], corners[1], corners[2]]);
        let triangles = if turned { [[0, 1, 2], [1, 0, 3]] } else { [[1, 0, 2], [0, 1, 3]] };
        self.add(hub, r, corners, &triangles);
        let normal = loop {
            let normal = (ridge + 0.8 * self.dice.direction()).normalize();
            if normal.dot(sight).abs() > 0.15 {
                break -normal.dot(sight).signum() * normal;
            }
        };
        let (centre, ring) = (hub + self.dice.vector(0.3 * r), self.dice.convex_ring(0.8 * r, 3));
        self.flat(centre, normal, 0.8 * r, &ring);
    }

    /// A plate wholly before all else, that moves.
    fn front(&mut self, motion: &mut Motion) {
        let share = self.dice.between(0.3, 0.5);
        let to = self.hub + self.dice.vector(0.6 * self.radius);
        let centre = self.camera.origin + share * (to - self.camera.origin);
        let radius = 0.6 * share * self.radius;
        let (normal, corners) = (self.facing(0.5), self.dice.count(3, 4));
        let ring = self.dice.convex_ring(radius, corners);
        self.flat(centre, normal, radius, &ring);
        motion.positions.resize(self.mesh.positions.len(), DVec3::ZERO);
        self.carry(self.bodies.len() - 1, motion);
    }

    /// A normal that looks to the camera from the hub, at a cosine of this or more.
    fn facing(&mut self, cosine: f64) -> DVec3 {
        let sight = (self.hub - self.camera.origin).normalize();
        loop {
            let normal = self.dice.direction();
            if normal.dot(sight) < -cosine {
                return normal;
            }
        }
    }

    fn is_seen_from_front(&self, [a, b, c]: [DVec3; 3]) -> bool {
        (b - a).cross(c - a).dot(self.camera.origin - a) > 0.0
    }

    /// Adds a body. Open triangles are turned to the camera; those of solids look outwards as given.
    fn add(&mut self, centre: DVec3, radius: f64, corners: Vec<DVec3>, triangles: &[[usize; 3]]) {
        let start = self.mesh.positions.len();
        let is_open = triangles.len() <= 2;
        for t in triangles {
            let is_turned = is_open && !self.is_seen_from_front(t.map(|v| corners[v]));
            let t = if is_turned { [t[0], t[2], t[1]] } else { *t };
            self.mesh.triangles.push(t.map(|v| v + start));
            let radiance = self.dice.colour();
            self.mesh.radiance.push(radiance);
        }
        self.mesh.positions.extend(corners);
        self.bodies.push(Body { vertices: start..self.mesh.positions.len(), centre, radius });
    }

    /// Moves a body by about a pixel per unit of θ.
    fn carry(&mut self, body: usize, motion: &mut Motion) {
        let Body { vertices, centre, radius } = self.bodies[body].clone();
        let affine = Affine::any(&mut self.dice, centre, radius, 0.5 * radius);
        for vertex in vertices {
            motion.positions[vertex] += affine.velocity(self.mesh.positions[vertex]);
        }
    }

    fn set_in_motion(&mut self, moving: CrossingMoving, motion: &mut Motion) {
        let count = self.bodies.len();
        match moving {
            CrossingMoving::Front => {}
            CrossingMoving::Camera => {
                let camera = &mut motion.camera;
                match self.dice.count(0, 3) {
                    0 | 1 => camera.origin = self.dice.vector(self.radius),
                    2 => camera.angular = self.dice.vector(0.3),
                    _ => {
                        camera.origin = self.dice.vector(self.radius);
                        camera.angular = self.dice.vector(0.3);
                        camera.field_of_view = self.dice.sign() * self.dice.between(0.1, 0.4);
                    }
                }
            }
            CrossingMoving::One => {
                let body = self.dice.count(0, count - 1);
                self.carry(body, motion);
            }
            CrossingMoving::All => (0..count).for_each(|body| self.carry(body, motion)),
            CrossingMoving::Vertex => {
                let vertex = self.dice.count(0, self.mesh.positions.len() - 1);
                motion.positions[vertex] = self.dice.vector(self.radius);
            }
            CrossingMoving::Mixed => {
                self.set_in_motion(CrossingMoving::All, motion);
                self.set_in_motion(CrossingMoving::Camera, motion);
            }
        }
    }

    /// Whether the middle of a crossing is seen on the film.
    fn shows(&self, crossing: &Crossing) -> bool {
        let middle = 0.5 * (crossing.ends[0] + crossing.ends[1]) - self.camera.origin;
        let Camera { right, up, forward, width, height, .. } = self.camera;
        let slopes = DVec2::new(middle.dot(right), middle.dot(up)) / middle.dot(forward);
        let u = self.camera.pixels_per_slope() * slopes;
        if u.abs().cmpgt(0.5 * DVec2::new(width as f64, height as f64)).any() {
            return false;
        }
        let hides = |t: &[usize; 3]| {
            let [a, b, c] = t.map(|v| self.mesh.positions[v] - self.camera.origin);
            let normal = (b - a).cross(c - a);
            let x = middle * (normal.dot(a) / normal.dot(middle));
            let is_inside =
                [(a, b), (b, c), (c, a)].iter().all(|(p, q)| (*q - *p).cross(x - *p).dot(normal) > 0.0);
            is_inside && x.dot(middle) > 0.0 && x.dot(middle) < middle.length_squared()
        };
        let others = self.mesh.triangles.iter().enumerate();
        !others.filter(|(t, _)| !crossing.triangles.contains(t)).any(|(_, t)| hides(t))
    }
}
