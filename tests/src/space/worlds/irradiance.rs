//! Emitters, occluders and a receiver.

use std::ops::Range;

use glam::{DMat3, DVec2, DVec3};

use super::moves::Affine;
use super::stage::in_plane;
use crate::choices::choices;
use crate::dice::Dice;
use crate::space::irradiance::{Ground, Ray, Receiver, Sides, Surface, World};

/// A receiver, what it sees, and what θ does to them.
#[derive(Clone, Debug)]
pub struct IrradianceCase {
    /// All but the ground.
    pub world: World,
    /// Where the ray meets the ground: what [`Receiver::on_ray`] makes of the next two.
    pub receiver: Receiver,
    /// The receiver's surface. It is so small that nothing else meets it.
    pub ground: Ground,
    /// A ray to the ground's front, with nothing in its way.
    pub ray: Ray,
    /// The knobs, in words: what a failing test should print.
    pub label: String,
}

choices! {
    /// What there is between light and receiver, or what is degenerate about it.
    IrradianceKind {
        /// Kinds without anything degenerate.
        GENERIC {
            /// One or two emitters and nothing else.
            Open,
            /// One emitter and one to four occluders, most of which cover some of it.
            Occluded,
            /// Two emitters, occluders, and a uniform environment.
            Glowing,
        }
        /// All others.
        DEGENERATE {
            /// An emitter that crosses the receiver's horizon.
            Horizon,
            /// An emitter at a distance of 10⁻³ to 10⁻² of the others', from so small to 100 times as
            /// large.
            NearEmitter,
            /// An emitter of 10⁻⁶ to 10⁻² of its distance.
            TinyEmitter,
            /// An occluder with an edge seen within 10⁻⁹ to 10⁻³ of an emitter's.
            AlignedEdges,
            /// As [`Occluded`](Self::Occluded), with a unit of length of 10⁻⁶.
            Small,
            /// The same with 10⁶.
            Large,
            /// The same at a distance of 10⁶ from the origin.
            FarFromOrigin,
        }
    }
}

choices! {
    /// What θ changes.
    IrradianceMoving {
        /// The ground, along a line.
        Ground,
        /// The ground, about an axis.
        GroundRotation,
        /// The ray: another point of the ground.
        Ray,
        /// An emitter: translation, rotation or scale.
        Emitter,
        /// The occluders, all alike; an emitter where there is none.
        Occluders,
        /// One corner of one surface, in its plane.
        Vertex,
        /// Everything at once.
        Mixed,
    }
}

impl IrradianceKind {
    /// The unit of length.
    pub fn unit(self) -> f64 {
        match self {
            Self::Small => 1e-6,
            Self::Large => 1e6,
            _ => 1.0,
        }
    }
}

/// All that a case depends on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct IrradianceKnobs {
    /// Everything that has no knob of its own.
    pub seed: u64,
    /// What there is.
    pub kind: IrradianceKind,
    /// What θ changes.
    pub moving: IrradianceMoving,
    /// How many occluders, 0 to 4; some kinds have none or need one.
    pub occluders: usize,
}

/// No surface's plane is nearer to the receiver than this, in units of the world, except where the
/// emitter is near.
const CLEARANCE: f64 = 0.03;

impl IrradianceKnobs {
    /// Knobs of a kind, all others drawn from a seed.
    pub fn random(seed: u64, kind: IrradianceKind) -> Self {
        let mut dice = Dice::new(seed, u64::MAX - kind as u64);
        Self { seed, kind, moving: dice.pick(&IrradianceMoving::ALL), occluders: dice.count(0, 4) }
    }

    /// Knobs drawn from a seed.
    pub fn any(seed: u64) -> Self {
        Self::random(seed, Dice::new(seed, u64::MAX / 2).pick(&IrradianceKind::ALL))
    }

    /// The case with these knobs: the same on every machine and in every thread.
    pub fn build(&self) -> IrradianceCase {
        let mut stage = Stage::new(Dice::new(self.seed, self.kind as u64));
        stage.furnish(self.kind, self.occluders);
        stage.set_in_motion(self.moving);
        let (rotation, place) = (stage.dice.frame(), stage.dice.vector3(1.0));
        let far = if self.kind == IrradianceKind::FarFromOrigin { 1e6 } else { 1.0 };
        let map = Map { linear: rotation * self.kind.unit(), place: place * far * self.kind.unit() };
        let Stage { world, ground, ray, .. } = stage;
        let surfaces = world.surfaces.into_iter().map(|s| Surface {
            vertices: s.vertices.iter().map(|p| map.point(*p)).collect(),
            velocities: s.velocities.iter().map(|v| map.linear * *v).collect(),
            ..s
        });
        let world = World { surfaces: surfaces.collect(), ..world };
        let ground = Ground {
            corners: ground.corners.map(|p| map.point(p)),
            velocities: ground.velocities.map(|v| map.linear * v),
        };
        let ray = Ray {
            origin: map.point(ray.origin),
            direction: rotation * ray.direction,
            origin_velocity: map.linear * ray.origin_velocity,
            direction_rate: rotation * ray.direction_rate,
        };
        let receiver = Receiver::on_ray(&ray, &ground).expect("a ray to the ground");
        IrradianceCase { world, receiver, ground, ray, label: format!("{self:?}") }
    }
}

/// From the stage to the world.
struct Map {
    linear: DMat3,
    place: DVec3,
}

impl Map {
    fn point(&self, p: DVec3) -> DVec3 {
        self.linear * p + self.place
    }
}

/// What is being built: the receiver is at 0 and faces +z.
struct Stage {
    dice: Dice,
    world: World,
    ground: Ground,
    ray: Ray,
    emitters: usize,
    /// The size of everything near the receiver.
    clearance: f64,
}

impl Stage {
    fn new(dice: Dice) -> Self {
        let ground = Ground { corners: [DVec3::ZERO; 3], velocities: [DVec3::ZERO; 3] };
        let ray = Ray::still(DVec3::Z, -DVec3::Z);
        Self { dice, world: World::default(), ground, ray, emitters: 0, clearance: CLEARANCE }
    }

    fn furnish(&mut self, kind: IrradianceKind, occluders: usize) {
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
        // The front is what the receiver sees, but of one in ten.
        let faces_away = area(&surface.vertices).dot(surface.vertices[0]) > 0.0;
        if faces_away != self.dice.chance(0.1) {
            surface.vertices.reverse();
        }
        surface.sides = if self.dice.chance(0.3) { Sides::Both } else { Sides::Front };
        self.world.surfaces.push(surface);
        self.emitters += 1;
    }

    /// A triangle or quadrilateral about a point, seen from the receiver at a cosine of 0.3 or
    /// more, and with a plane that keeps its distance from it.
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
        // Tilted so little that the plane stays away from the receiver.
        let tilt = self.dice.vector3(0.3 * height / radius.max(height));
        in_plane(centre, (DVec3::Z + tilt).normalize(), &ring)
    }

    fn tiny(&mut self) -> Vec<DVec3> {
        let (centre, radius) = (self.above(1.0, 2.0), self.dice.scale(1e-6, 1e-2));
        self.flat(centre, radius)
    }

    /// An occluder between receiver and emitter: about a point before it, or with an edge through
    /// one.
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

    fn set_in_motion(&mut self, moving: IrradianceMoving) {
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

    /// All of them by one affine field, of a speed that makes changes of order one.
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
