//! Shadows on a ground, seen by a camera.

use flatland::plane::Filter;
use glam::{DMat3, DVec2, DVec3};

use super::dice::Dice;
use super::moves::Affine;
use crate::space::coverage::{Camera, CameraMotion};
use crate::space::direct::DirectScene;
use crate::space::irradiance::{Ground, Sides, Surface, World};

/// A scene that moves.
#[derive(Clone, Debug)]
pub struct DirectCase {
    /// 3 × 3 or 4 × 4 pixels. The ground's triangle reaches far beyond what they show.
    pub scene: DirectScene,
    /// The knobs, in words: what a failing test should print.
    pub label: String,
}

/// What there is above the ground.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum DirectKind {
    /// An emitter.
    Open,
    /// An emitter and one or two occluders, whose penumbras are seen.
    Shadow,
    /// Two emitters, one or two occluders, and a uniform environment.
    Glowing,
}

/// What θ changes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum DirectMoving {
    /// The ground, along a line.
    Ground,
    /// The ground, about an axis.
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

impl DirectKind {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Open, Self::Shadow, Self::Glowing];
}

impl DirectMoving {
    /// All of them.
    pub const ALL: [Self; 6] =
        [Self::Ground, Self::GroundRotation, Self::Camera, Self::Emitters, Self::Occluders, Self::Mixed];
}

/// All that a case depends on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DirectKnobs {
    /// Everything that has no knob of its own.
    pub seed: u64,
    /// What there is.
    pub kind: DirectKind,
    /// What θ changes.
    pub moving: DirectMoving,
    /// The pixel filter.
    pub filter: Filter,
}

impl DirectKnobs {
    /// Knobs of a kind, all others drawn from a seed.
    #[must_use]
    pub fn random(seed: u64, kind: DirectKind) -> Self {
        let mut dice = Dice::new(seed, u64::MAX - kind as u64);
        let filter = dice.pick(&[Filter::Box, Filter::Tent, Filter::Gaussian]);
        Self { seed, kind, moving: dice.pick(&DirectMoving::ALL), filter }
    }

    /// Knobs drawn from a seed.
    #[must_use]
    pub fn any(seed: u64) -> Self {
        Self::random(seed, Dice::new(seed, u64::MAX / 2).pick(&DirectKind::ALL))
    }

    /// The case with these knobs: the same on every machine and in every thread.
    ///
    /// # Panics
    /// If a generator is wrong: in a thousand arrangements in a row, the camera sees too much.
    #[must_use]
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

/// What is being built, above the plane z = 0.
struct Stage {
    dice: Dice,
    scene: DirectScene,
    emitters: usize,
}

impl Stage {
    fn new(mut dice: Dice, filter: Filter) -> Self {
        let camera = camera(&mut dice);
        let ground = [0.0, 1.0, 2.0].map(|k| {
            let angle = k * std::f64::consts::TAU / 3.0 + 0.3;
            (40.0 * DVec2::from_angle(angle)).extend(0.0)
        });
        let scene = DirectScene {
            world: World::default(),
            ground: Ground { corners: ground, velocities: [DVec3::ZERO; 3] },
            albedo: dice.colour(),
            camera,
            camera_motion: CameraMotion::default(),
            filter,
        };
        Self { dice, scene, emitters: 0 }
    }

    /// `None` where something cannot be put out of the camera's sight.
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
            let radiance = self.dice.colour() * self.dice.between(1.0, 6.0);
            // Of one side, it faces down.
            let [a, b, c] = [0, 1, 2].map(|k| emitter[k]);
            let corners =
                if (b - a).cross(c - a).z > 0.0 { emitter.into_iter().rev().collect() } else { emitter };
            let sides = if self.dice.chance(0.3) { Sides::Both } else { Sides::Front };
            self.scene.world.surfaces.push(Surface { sides, ..Surface::emitter(corners, radiance) });
        }
        self.emitters = emitters;
        for _ in 0..occluders {
            let light = self.scene.world.surfaces[0].vertices.iter().sum::<DVec3>()
                / self.scene.world.surfaces[0].vertices.len() as f64;
            let occluder = self.unseen(|dice| {
                // Before the light as seen from somewhere near the middle of the view.
                let from = DVec3::new(dice.between(-0.3, 0.3), dice.between(-0.3, 0.3), 0.0);
                (from.lerp(light, dice.between(0.25, 0.7)), dice.between(0.1, 0.4))
            })?;
            self.scene.world.surfaces.push(Surface::occluder(occluder));
        }
        Some(())
    }

    /// A triangle or quadrilateral that is above the ground and that the camera does not see.
    fn unseen(&mut self, place: impl Fn(&mut Dice) -> (DVec3, f64)) -> Option<Vec<DVec3>> {
        (0..100).find_map(|_| {
            let ((centre, radius), count) = (place(&mut self.dice), self.dice.count(3, 4));
            let ring = self.dice.convex_ring(radius, count);
            let (x, y) = self.dice.direction().any_orthonormal_pair();
            let corners: Vec<_> = ring.iter().map(|p| centre + p.x * x + p.y * y).collect();
            let fits = corners.iter().all(|c| c.z > 0.1) && is_unseen(&self.scene.camera, &corners);
            fits.then_some(corners)
        })
    }

    fn set_in_motion(&mut self, moving: DirectMoving) {
        let count = self.scene.world.surfaces.len();
        match moving {
            DirectMoving::Ground => {
                let affine = Affine::translation(self.dice.vector(1.0));
                self.move_ground(&affine);
            }
            DirectMoving::GroundRotation => {
                let affine = Affine::rotation(self.dice.vector(0.5), self.dice.vector(0.5));
                self.move_ground(&affine);
            }
            DirectMoving::Camera => {
                self.scene.camera_motion = CameraMotion {
                    origin: self.dice.vector(1.0),
                    angular: self.dice.vector(0.3),
                    field_of_view: self.dice.between(-0.2, 0.2),
                };
            }
            DirectMoving::Occluders if count > self.emitters => self.move_surfaces(self.emitters..count),
            DirectMoving::Emitters | DirectMoving::Occluders => self.move_surfaces(0..self.emitters),
            DirectMoving::Mixed => {
                for part in DirectMoving::ALL.into_iter().filter(|part| *part != DirectMoving::Mixed) {
                    self.set_in_motion(part);
                }
            }
        }
    }

    fn move_ground(&mut self, affine: &Affine) {
        let ground = &mut self.scene.ground;
        for (v, p) in ground.velocities.iter_mut().zip(&ground.corners) {
            *v += affine.velocity(*p);
        }
    }

    fn move_surfaces(&mut self, range: std::ops::Range<usize>) {
        let affine =
            Affine::any(&mut self.dice, self.scene.world.surfaces[range.start].vertices[0], 1.0, 1.0);
        for surface in &mut self.scene.world.surfaces[range] {
            for (v, p) in surface.velocities.iter_mut().zip(&surface.vertices) {
                *v += affine.velocity(*p);
            }
        }
    }
}

/// A camera that looks down on the ground around 0 from y < 0; it sees about 1 of it across.
pub(super) fn camera(dice: &mut Dice) -> Camera {
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

/// Whether some side of the pyramid of view, widened by filters of up to two pixels, or the camera's
/// own plane, has all corners outside.
pub(super) fn is_unseen(camera: &Camera, corners: &[DVec3]) -> bool {
    let widest = 1.0 + 4.0 / camera.width as f64;
    let slope = 1.1 * widest * (0.5 * camera.field_of_view).tan();
    let beyond = |axis: DVec3| {
        corners.iter().all(|c| {
            let d = *c - camera.origin;
            d.dot(axis) > slope * d.dot(camera.forward)
        })
    };
    let sides = [camera.right, -camera.right, camera.up, -camera.up];
    sides.into_iter().any(beyond) || corners.iter().all(|c| (*c - camera.origin).dot(camera.forward) < 0.0)
}
