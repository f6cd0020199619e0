//! Emitters, occluders and a receiver.

mod stage;

use glam::{DMat3, DVec3};

use crate::choices::choices;
use crate::dice::Dice;
use crate::space::irradiance::{Ground, Ray, Receiver, Surface, World};
use stage::Stage;

/// A receiver, its world, and their motion.
#[derive(Clone, Debug)]
pub struct IrradianceCase {
    /// Everything but the ground.
    pub world: World,
    /// The intersection of the ray with the ground, by [`Receiver::on_ray`] of the next two.
    pub receiver: Receiver,
    /// The receiver's surface, small enough that nothing else meets it.
    pub ground: Ground,
    /// An unobstructed ray to the ground's front.
    pub ray: Ray,
    /// The knobs in words, for failure messages.
    pub label: String,
}

choices! {
    /// The content between light and receiver, or its degeneracy.
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
        /// Degenerate kinds.
        DEGENERATE {
            /// An emitter that crosses the receiver's horizon.
            Horizon,
            /// An emitter at a distance of 10⁻³ to 10⁻² of the others', with a size from that distance to 100
            /// times it.
            NearEmitter,
            /// An emitter of 10⁻⁶ to 10⁻² of its distance in size.
            TinyEmitter,
            /// An occluder with an edge seen within 10⁻⁹ to 10⁻³ of an emitter's.
            AlignedEdges,
            /// [`Occluded`](Self::Occluded) with a unit of length of 10⁻⁶.
            Small,
            /// Occluders with a unit of length of 10⁶.
            Large,
            /// Occluders at a distance of 10⁶ from the origin.
            FarFromOrigin,
        }
    }
}

choices! {
    /// The parameters that θ changes.
    IrradianceMoving {
        /// Translation of the ground.
        Ground,
        /// Rotation of the ground about an axis.
        GroundRotation,
        /// The ray, which then meets another point of the ground.
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

/// Parameters that determine a case.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct IrradianceKnobs {
    /// The seed of everything that has no knob of its own.
    pub seed: u64,
    /// The content.
    pub kind: IrradianceKind,
    /// The motion.
    pub moving: IrradianceMoving,
    /// The number of occluders, 0 to 4; some kinds have none or need one.
    pub occluders: usize,
}

impl IrradianceKnobs {
    /// Knobs of a kind, all others drawn from a seed.
    pub fn random(seed: u64, kind: IrradianceKind) -> Self {
        let mut dice = Dice::new(seed, u64::MAX - kind as u64);
        Self { seed, kind, moving: dice.pick(&IrradianceMoving::ALL), occluders: dice.count(0, 4) }
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

/// Affine map from the stage to the world.
struct Map {
    linear: DMat3,
    place: DVec3,
}

impl Map {
    fn point(&self, p: DVec3) -> DVec3 {
        self.linear * p + self.place
    }
}
