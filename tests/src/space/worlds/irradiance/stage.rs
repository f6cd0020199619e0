//! A scene under construction: emitters and occluders around a receiver.

use std::ops::Range;

use glam::{DVec2, DVec3};

use super::{IrradianceKind, IrradianceMoving};
use crate::dice::Dice;
use crate::space::irradiance::{Ground, Ray, Sides, Surface, World};
use crate::space::worlds::moves::Affine;
use crate::space::worlds::stage::in_plane;

/// Minimum distance of every surface's plane from the receiver, in units of the world, except where the
/// emitter is near.
const CLEARANCE: f64 = 0.03;

/// A scene under construction: the receiver is at 0 and faces +z.
pub(super) struct Stage {
    pub(super) dice: Dice,
    pub(super) world: World,
    pub(super) ground: Ground,
    pub(super) ray: Ray,
    emitters: usize,
    /// The size of everything near the receiver.
    clearance: f64,
}

impl Stage {
    pub(super) fn new(dice: Dice) -> Self {
        let ground = Ground { corners: [DVec3::ZERO; 3], velocities: [DVec3::ZERO; 3] };
        let ray = Ray::still(DVec3::Z, -DVec3::Z);
        Self { dice, world: World::default(), ground, ray, emitters: 0, clearance: CLEARANCE }
    }

    pub(super) fn furnish(&mut self, kind: IrradianceKind, occluders: usize) {
        let (emitter, occluders) = match kind {
            IrradianceKind::Open => {
                for _ in 0..self.dice.count(0, 1) {
                    let emitter = self.emitter();
                    self.add_emitter(emitter);
                }
                (self.emitter(), 0)
            }
            IrradianceKind::Occluded
            | IrradianceKind::Small
            | IrradianceKind::Large
            | IrradianceKind::FarFromOrigin => (self.emitter(), occluders.max(1)),
            IrradianceKind::Glowing => {
                self.world.environment = self.dice.colour();
                let emitter = self.emitter();
                self.add_emitter(emitter);
                (self.emitter(), occluders)
            }
            IrradianceKind::Horizon => (self.crossing(), occluders),
            IrradianceKind::NearEmitter => (self.near(), occluders.min(2)),
            IrradianceKind::TinyEmitter => (self.tiny(), occluders),
            IrradianceKind::AlignedEdges => (self.emitter(), occluders.max(1)),
        };
        let target = emitter.clone();
        self.add_emitter(emitter);
        for i in 0..occluders {
            let occluder = if kind == IrradianceKind::AlignedEdges && i == 0 {
                self.aligned(&target)
            } else if self.dice.chance(0.75) {
                self.covering(&target)
            } else {
                self.aside()
            };
            self.world.surfaces.push(Surface::occluder(occluder));
        }
        self.lay_ground();
    }

    fn add_emitter(&mut self, corners: Vec<DVec3>) {
        let mut surface = Surface::emitter(corners, self.dice.colour() * self.dice.between(0.5, 4.0));
        // The receiver sees the front, except of one in ten.
        let faces_away = area(&surface.vertices).dot(surface.vertices[0]) > 0.0;
        if faces_away != self.dice.chance(0.1) {
            surface.vertices.reverse();
        }
        surface.sides = if self.dice.chance(0.3) { Sides::Both } else { Sides::Front };
        self.world.surfaces.push(surface);
        self.emitters += 1;
    }

    /// A triangle or quadrilateral about a point, seen from the receiver at a cosine of 0.3 or more, with a
    /// plane that keeps its distance from the receiver.
    fn flat(&mut self, centre: DVec3, radius: f64) -> Vec<DVec3> {
        let count = self.dice.count(3, 4);
        let ring = self.dice.convex_ring(radius, count);
        loop {
            let normal = self.dice.direction();
            let distance = normal.dot(centre).abs();
            if distance > 0.3 * centre.length() && distance > self.clearance {
                return in_plane(centre, normal, &ring);
            }
        }
    }

    fn emitter(&mut self) -> Vec<DVec3> {
        let (centre, radius) = (self.above(1.0, 2.0), self.dice.between(0.2, 0.6));
        self.flat(centre, radius)
    }

    /// A point at a distance, not near the horizon.
    fn above(&mut self, near: f64, far: f64) -> DVec3 {
        loop {
            let direction = self.dice.direction();
            if direction.z > 0.3 {
                return direction * self.dice.between(near, far);
            }
        }
    }

    fn crossing(&mut self) -> Vec<DVec3> {
        loop {
            let side = DVec2::from_angle(self.dice.between(0.0, std::f64::consts::TAU));
            let centre = (side * self.dice.between(1.0, 1.5)).extend(self.dice.between(-0.1, 0.2));
            let corners = self.flat(centre, 0.6);
            let above = corners.iter().filter(|c| c.z > 0.02).count();
            let below = corners.iter().filter(|c| c.z < -0.02).count();
            if above > 0 && below > 0 && above + below == corners.len() {
                return corners;
            }
        }
    }

    fn near(&mut self) -> Vec<DVec3> {
        let height = self.dice.scale(1e-3, 1e-2);
        let radius = height * self.dice.scale(0.3, 100.0);
        self.clearance = 0.1 * height;
        let count = self.dice.count(3, 4);
        let ring = self.dice.convex_ring(radius, count);
        let aside = DVec2::from_angle(self.dice.between(0.0, std::f64::consts::TAU)) * radius;
        let centre = (aside * self.dice.between(0.0, 1.0)).extend(height);
        // A tilt small enough that the plane stays away from the receiver.
        let tilt = self.dice.vector3(0.3 * height / radius.max(height));
        in_plane(centre, (DVec3::Z + tilt).normalize(), &ring)
    }

    fn tiny(&mut self) -> Vec<DVec3> {
        let (centre, radius) = (self.above(1.0, 2.0), self.dice.scale(1e-6, 1e-2));
        self.flat(centre, radius)
    }

    /// An occluder between receiver and emitter: about a point in front of it, or with an edge through one.
    fn covering(&mut self, emitter: &[DVec3]) -> Vec<DVec3> {
        let share = self.dice.between(0.3, 0.7);
        let target = share * inside(emitter, [(); 4].map(|()| self.dice.between(0.1, 1.0)));
        let extent = emitter.iter().map(|c| c.distance(emitter[0])).fold(0.0, f64::max);
        let radius = if self.dice.chance(0.5) {
            share * extent * self.dice.between(0.2, 0.6)
        } else {
            share * target.length().min(1.0) * self.dice.between(0.2, 0.5)
        };
        loop {
            let corners = self.flat(target, radius);
            let middle = corners[0].lerp(corners[1], self.dice.between(0.2, 0.8));
            // Moved within its own plane.
            let shift = if self.dice.chance(0.5) { target - middle } else { DVec3::ZERO };
            let corners: Vec<_> = corners.iter().map(|c| *c + shift).collect();
            if corners.iter().all(|c| c.length() > self.clearance) {
                return corners;
            }
        }
    }

    fn aside(&mut self) -> Vec<DVec3> {
        let scale = self.clearance / CLEARANCE;
        let (centre, radius) = (self.above(0.4, 1.5), self.dice.between(0.1, 0.3));
        self.flat(centre * scale, radius * scale)
    }

    /// A triangle with an edge seen along an edge of the emitter.
    fn aligned(&mut self, emitter: &[DVec3]) -> Vec<DVec3> {
        let k = self.dice.count(0, emitter.len() - 1);
        let (a, b) = (emitter[k], emitter[(k + 1) % emitter.len()]);
        let middle = emitter.iter().sum::<DVec3>() / emitter.len() as f64;
        loop {
            let gap = self.dice.scale(1e-9, 1e-3);
            let [p, q] = [a, b].map(|end| self.dice.between(0.4, 0.8) * (end + self.dice.vector3(gap)));
            // Within the emitter, or outside.
            let third = if self.dice.chance(0.5) { middle } else { a + b - middle };
            let corners = vec![p, q, self.dice.between(0.4, 0.8) * (third + self.dice.vector3(0.1))];
            let area = area(&corners);
            if area.normalize().dot(p).abs() > 0.1 {
                return corners;
            }
        }
    }

    /// A triangle about the receiver and a ray to it, both within the clearance.
    fn lay_ground(&mut self) {
        let radius = 0.5 * self.clearance;
        let turn = self.dice.between(0.0, std::f64::consts::TAU);
        self.ground.corners = std::array::from_fn(|k| {
            let angle = turn + std::f64::consts::TAU * (k as f64 + self.dice.between(-0.1, 0.1)) / 3.0;
            (radius * self.dice.between(0.6, 1.0) * DVec2::from_angle(angle)).extend(0.0)
        });
        let eye = self.above(0.2, 0.6) * self.clearance;
        self.ray = Ray::still(eye, -eye.normalize());
    }

    pub(super) fn set_in_motion(&mut self, moving: IrradianceMoving) {
        let emitters = 0..self.emitters;
        match moving {
            IrradianceMoving::Ground => {
                let affine = Affine::translation(self.dice.vector3(self.clearance / CLEARANCE));
                affine.carry(&self.ground.corners, &mut self.ground.velocities);
            }
            IrradianceMoving::GroundRotation => {
                let axis = self.dice.vector3(self.clearance);
                let affine = Affine::rotation(axis, self.dice.vector3(1.0));
                affine.carry(&self.ground.corners, &mut self.ground.velocities);
            }
            IrradianceMoving::Ray => {
                self.ray.origin_velocity += self.dice.vector3(self.clearance / CLEARANCE);
                self.ray.direction_rate += self.dice.vector3(1.0);
            }
            IrradianceMoving::Emitter => {
                let i = self.dice.count(0, self.emitters - 1);
                self.move_surfaces(i..i + 1);
            }
            IrradianceMoving::Occluders if self.emitters < self.world.surfaces.len() => {
                self.move_surfaces(self.emitters..self.world.surfaces.len());
            }
            IrradianceMoving::Occluders => self.move_surfaces(emitters),
            IrradianceMoving::Vertex => {
                let i = self.dice.count(0, self.world.surfaces.len() - 1);
                let surface = &mut self.world.surfaces[i];
                let k = self.dice.count(0, surface.vertices.len() - 1);
                let next = (k + 1) % surface.vertices.len();
                let before = (k + surface.vertices.len() - 1) % surface.vertices.len();
                let edges = [next, before].map(|v| surface.vertices[v] - surface.vertices[k]);
                let combined: DVec3 =
                    edges.iter().map(|e| *e * (self.dice.sign() * self.dice.between(0.3, 1.0))).sum();
                surface.velocities[k] += combined;
            }
            IrradianceMoving::Mixed => {
                for part in IrradianceMoving::ALL {
                    if part != IrradianceMoving::Mixed && part != IrradianceMoving::Vertex {
                        self.set_in_motion(part);
                    }
                }
            }
        }
    }

    /// Moves all of them by one affine field, at a speed that makes changes of order one.
    fn move_surfaces(&mut self, range: Range<usize>) {
        let first = &self.world.surfaces[range.start].vertices;
        let (centre, extent) = (first[0], first[0].distance(first[1]));
        let affine = Affine::any(&mut self.dice, centre, extent, extent);
        affine.carry_surfaces(&mut self.world.surfaces[range]);
    }
}

/// Twice the area of the first three corners, times their normal.
fn area(corners: &[DVec3]) -> DVec3 {
    (corners[1] - corners[0]).cross(corners[2] - corners[0])
}

/// The mean of a polygon's corners with these weights.
fn inside(corners: &[DVec3], weights: [f64; 4]) -> DVec3 {
    let sum: f64 = weights[..corners.len()].iter().sum();
    corners.iter().zip(weights).map(|(c, w)| *c * (w / sum)).sum()
}
