//! Shadows on a ground, seen by a camera.

use std::f64::consts::TAU;

use flatland::plane::Filter;
use glam::{DMat3, DVec2, DVec3};

use super::moves::Affine;
use super::stage::in_plane;
use crate::choices::choices;
use crate::dice::Dice;
use crate::space::coverage::{Camera, CameraMotion};
use crate::space::direct::DirectScene;
use crate::space::irradiance::{Ground, Sides, Surface, World};

/// A moving scene.
#[derive(Clone, Debug)]
pub struct DirectCase {
    /// A scene of 3 × 3 or 4 × 4 pixels. The ground's triangle reaches far beyond the field of view.
    pub scene: DirectScene,
    /// The knobs in words, for failure messages.
    pub label: String,
}

choices! {
    /// The content above the ground.
    DirectKind {
        /// An emitter.
        Open,
        /// An emitter and one or two occluders, whose penumbras are seen.
        Shadow,
        /// Two emitters, one or two occluders, and a uniform environment.
        Glowing,
    }
}

choices! {
    /// The parameters that θ changes.
    DirectMoving {
        /// Translation of the ground.
        Ground,
        /// Rotation of the ground about an axis.
        GroundRotation,
        /// The camera: position, direction and field of view.
        Camera,
        /// The emitters, all alike.
        Emitters,
        /// The occluders, all alike; the emitters where there is none.
        Occluders,
        /// Everything at once.
        Mixed,
    }
}

/// Parameters that determine a case.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DirectKnobs {
    /// The seed of everything that has no knob of its own.
    pub seed: u64,
    /// The content.
    pub kind: DirectKind,
    /// The motion.
    pub moving: DirectMoving,
    /// The pixel filter.
    pub filter: Filter,
}

impl DirectKnobs {
    /// Knobs of a kind, all others drawn from a seed.
    pub fn random(seed: u64, kind: DirectKind) -> Self {
        let mut dice = Dice::new(seed, u64::MAX - kind as u64);
        let filter = dice.pick(&[Filter::Box, Filter::Tent, Filter::Gaussian]);
        Self { seed, kind, moving: dice.pick(&DirectMoving::ALL), filter }
    }

    /// Knobs drawn from a seed.
    pub fn any(seed: u64) -> Self {
        Self::random(seed, Dice::new(seed, u64::MAX / 2).pick(&DirectKind::ALL))
    }

    /// The case with these knobs: the same on every machine and in every thread.
    pub fn build(&self) -> DirectCase {
        for attempt in 0..1000 {
            let dice = Dice::new(self.seed, 1000 * self.kind as u64 + attempt);
            let mut stage = Stage::new(dice, self.filter);
            if stage.furnish(self.kind).is_some() {
                stage.set_in_motion(self.moving);
                return DirectCase { scene: stage.scene, label: format!("{self:?}") };
            }
        }
        panic!("no arrangement in which the camera sees the ground only: {self:?}");
    }
}

/// A scene under construction above the plane z = 0.
struct Stage {
    dice: Dice,
    scene: DirectScene,
    emitters: usize,
}

impl Stage {
    fn new(mut dice: Dice, filter: Filter) -> Self {
        let scene = ground(&mut dice, |_| filter);
        Self { dice, scene, emitters: 0 }
    }

    /// Adds the content; `None` where something cannot be put out of the camera's sight.
    fn furnish(&mut self, kind: DirectKind) -> Option<()> {
        let (emitters, occluders) = match kind {
            DirectKind::Open => (1, 0),
            DirectKind::Shadow => (1, self.dice.count(1, 2)),
            DirectKind::Glowing => (2, self.dice.count(1, 2)),
        };
        if kind == DirectKind::Glowing {
            self.scene.world.environment = self.dice.colour();
        }
        for _ in 0..emitters {
            let emitter = self.unseen(|dice| {
                let centre =
                    DVec3::new(dice.between(-1.5, 1.5), dice.between(0.0, 2.5), dice.between(1.5, 3.0));
                (centre, dice.between(0.3, 0.8))
            })?;
            self.scene.world.surfaces.push(lamp(&mut self.dice, emitter));
        }
        self.emitters = emitters;
        for _ in 0..occluders {
            let light = self.scene.world.surfaces[0].vertices.iter().sum::<DVec3>()
                / self.scene.world.surfaces[0].vertices.len() as f64;
            let occluder = self.unseen(|dice| {
                // In front of the light as seen from a point near the middle of the view.
                let from = DVec3::new(dice.between(-0.3, 0.3), dice.between(-0.3, 0.3), 0.0);
                (from.lerp(light, dice.between(0.25, 0.7)), dice.between(0.1, 0.4))
            })?;
            self.scene.world.surfaces.push(Surface::occluder(occluder));
        }
        Some(())
    }

    /// A triangle or quadrilateral above the ground, outside the camera's view.
    fn unseen(&mut self, place: impl Fn(&mut Dice) -> (DVec3, f64)) -> Option<Vec<DVec3>> {
        (0..100).find_map(|_| {
            let ((centre, radius), count) = (place(&mut self.dice), self.dice.count(3, 4));
            let ring = self.dice.convex_ring(radius, count);
            let corners = in_plane(centre, self.dice.direction(), &ring);
            fits(&self.scene.camera, &corners).then_some(corners)
        })
    }

    fn set_in_motion(&mut self, moving: DirectMoving) {
        let count = self.scene.world.surfaces.len();
        match moving {
            DirectMoving::Ground => {
                let affine = Affine::translation(self.dice.vector3(1.0));
                affine.carry(&self.scene.ground.corners, &mut self.scene.ground.velocities);
            }
            DirectMoving::GroundRotation => {
                let affine = Affine::rotation(self.dice.vector3(0.5), self.dice.vector3(0.5));
                affine.carry(&self.scene.ground.corners, &mut self.scene.ground.velocities);
            }
            DirectMoving::Camera => self.scene.camera_motion = camera_motion(&mut self.dice),
            DirectMoving::Occluders if count > self.emitters => self.move_surfaces(self.emitters..count),
            DirectMoving::Emitters | DirectMoving::Occluders => self.move_surfaces(0..self.emitters),
            DirectMoving::Mixed => {
                for part in DirectMoving::ALL.into_iter().filter(|part| *part != DirectMoving::Mixed) {
                    self.set_in_motion(part);
                }
            }
        }
    }

    fn move_surfaces(&mut self, range: std::ops::Range<usize>) {
        let affine =
            Affine::any(&mut self.dice, self.scene.world.surfaces[range.start].vertices[0], 1.0, 1.0);
        affine.carry_surfaces(&mut self.scene.world.surfaces[range]);
    }
}

/// A camera that looks down on the ground around 0 from y < 0; its field of view spans about 1 there.
fn camera(dice: &mut Dice) -> Camera {
    let target = DVec3::new(dice.between(-0.2, 0.2), dice.between(-0.2, 0.2), 0.0);
    let back = DVec3::new(dice.between(-0.3, 0.3), -1.0, dice.between(0.7, 1.5)).normalize();
    let distance = dice.between(2.0, 4.0);
    let forward = -back;
    let level = forward.cross(DVec3::Z).normalize();
    let roll = DMat3::from_axis_angle(forward, dice.between(-0.5, 0.5));
    let right = roll * level;
    let size = dice.count(3, 4);
    Camera {
        origin: target + distance * back,
        right,
        up: right.cross(forward),
        forward,
        field_of_view: 2.0 * (dice.between(0.3, 0.7) / distance).atan(),
        width: size,
        height: size,
    }
}

/// The bare ground, the plane z = 0, in front of such a camera.
pub(super) fn ground(dice: &mut Dice, filter: impl Fn(&mut Dice) -> Filter) -> DirectScene {
    let camera = camera(dice);
    let corner = |k: f64| (40.0 * DVec2::from_angle(k * TAU / 3.0 + 0.3)).extend(0.0);
    let ground = Ground { corners: [0.0, 1.0, 2.0].map(corner), velocities: [DVec3::ZERO; 3] };
    let (world, camera_motion) = (World::default(), CameraMotion::default());
    DirectScene { world, ground, albedo: dice.colour(), camera, camera_motion, filter: filter(dice) }
}

/// An emitter; a one-sided one faces down.
pub(super) fn lamp(dice: &mut Dice, ring: Vec<DVec3>) -> Surface {
    let radiance = dice.colour() * dice.between(1.0, 6.0);
    let sides = if dice.chance(0.3) { Sides::Both } else { Sides::Front };
    let [a, b, c] = [0, 1, 2].map(|k| ring[k]);
    let corners = if (b - a).cross(c - a).z > 0.0 { ring.into_iter().rev().collect() } else { ring };
    Surface { sides, ..Surface::emitter(corners, radiance) }
}

/// A random motion of the camera.
pub(super) fn camera_motion(dice: &mut Dice) -> CameraMotion {
    let (origin, angular) = (dice.vector3(1.0), dice.vector3(0.3));
    CameraMotion { origin, angular, field_of_view: dice.between(-0.2, 0.2) }
}

/// Whether all corners are above the ground and out of the camera's sight: some side of the pyramid of view,
/// widened by filters of up to two pixels, or the camera's own plane, has all of them outside.
pub(super) fn fits(camera: &Camera, corners: &[DVec3]) -> bool {
    let widest = 1.0 + 4.0 / camera.width as f64;
    let slope = 1.1 * widest * (0.5 * camera.field_of_view).tan();
    let beyond = |axis: DVec3| {
        corners.iter().all(|c| {
            let d = *c - camera.origin;
            d.dot(axis) > slope * d.dot(camera.forward)
        })
    };
    let sides = [camera.right, -camera.right, camera.up, -camera.up];
    let behind = || corners.iter().all(|c| (*c - camera.origin).dot(camera.forward) < 0.0);
    corners.iter().all(|c| c.z > 0.1) && (sides.into_iter().any(beyond) || behind())
}
