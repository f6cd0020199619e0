//! Light on a ground past bodies that pass through one another, through the light, or through the ground.
//!
//! Positions are generic, and every case has a crossing. Emitters are out of the camera's sight, as is
//! everything else except bodies that stand in the ground.

use flatland::plane::Filter;
use glam::{DMat3, DVec3};

use super::direct::{DirectCase, camera_motion, fits, ground, lamp};
use super::moves::Affine;
use super::stage::in_plane;
use crate::choices::choices;
use crate::dice::Dice;
use crate::space::constants::{BOX_FACES, box_corners};
use crate::space::coverage::{Mesh, Motion, crossings};
use crate::space::direct::DirectScene;
use crate::space::irradiance::Surface;

choices! {
    /// The bodies that pass through one another.
    LitCrossingKind {
        /// The camera sees the ground alone.
        UNSEEN {
            /// A black plate through the lamp.
            Plate,
            /// A black box through the lamp.
            Block,
            /// A lamp through a black ceiling.
            Ceiling,
            /// Two black plates through one another, in front of the lamp.
            Shadows,
        }
        /// The camera sees the bodies that pass through the ground.
        SEEN {
            /// A black plate that stands in the ground, in front of the camera.
            Fence,
            /// A black box sunk into the ground, in front of the camera.
            Sunk,
        }
    }
}

choices! {
    /// The parameters that θ changes.
    LitCrossingMoving {
        /// The camera: all crossings are at rest in the world.
        Camera,
        /// The lamp.
        Lamp,
        /// One black body.
        Body,
        /// Every body and the lamp, each on its own, and the ground.
        All,
    }
}

/// Parameters that determine a case.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LitCrossing {
    /// The seed of everything that has no knob of its own.
    pub seed: u64,
    /// The bodies that cross.
    pub kind: LitCrossingKind,
    /// The motion.
    pub moving: LitCrossingMoving,
}

impl LitCrossing {
    /// The case with these knobs: the same on every machine and in every thread.
    pub fn build(&self) -> DirectCase {
        let purpose = |attempt: u64| 3_000_000 + 100 * attempt + 10 * self.kind as u64 + self.moving as u64;
        let case = (0..1000).find_map(|attempt| {
            let mut stage = Stage::new(Dice::new(self.seed, purpose(attempt)));
            stage.furnish(self.kind)?;
            stage.crosses().then_some(())?;
            stage.set_in_motion(self.moving);
            Some(DirectCase { scene: stage.scene, label: format!("{self:?}") })
        });
        case.unwrap_or_else(|| panic!("no case for {self:?}"))
    }
}

/// A scene under construction above the plane z = 0. The first body is the lamp.
struct Stage {
    dice: Dice,
    scene: DirectScene,
    bodies: Vec<std::ops::Range<usize>>,
}

impl Stage {
    fn new(mut dice: Dice) -> Self {
        let scene = ground(&mut dice, |dice| dice.pick(&[Filter::Box, Filter::Tent]));
        Self { dice, scene, bodies: vec![] }
    }

    /// Adds the content; `None` where something is visible that must not be.
    fn furnish(&mut self, kind: LitCrossingKind) -> Option<()> {
        let dice = &mut self.dice;
        let at = DVec3::new(dice.between(-1.0, 1.0), dice.between(0.2, 1.8), dice.between(1.5, 2.5));
        let lamp = at + dice.vector3(0.1);
        let tilt =
            if kind == LitCrossingKind::Ceiling { dice.direction() } else { dice.tilted(-DVec3::Z, 0.5) };
        let ring = dice.ring(lamp, tilt, 0.7);
        self.lamp(ring)?;
        let dice = &mut self.dice;
        match kind {
            LitCrossingKind::Plate => {
                let n = dice.direction();
                let ring = dice.ring(at, n, 0.7);
                self.unseen(vec![ring])
            }
            LitCrossingKind::Block => {
                let block = dice.block(at, 0.35);
                self.unseen(block)
            }
            LitCrossingKind::Ceiling => {
                let n = dice.tilted(DVec3::Z, 0.3);
                let ring = dice.ring(at, n, 1.5);
                self.unseen(vec![ring])
            }
            LitCrossingKind::Shadows => {
                let foot = DVec3::new(dice.between(-0.3, 0.3), dice.between(-0.3, 0.3), 0.0);
                let middle = foot.lerp(at, dice.between(0.4, 0.7));
                for _ in 0..2 {
                    let centre = middle + self.dice.vector3(0.1);
                    let n = self.dice.direction();
                    let ring = self.dice.ring(centre, n, 0.4);
                    self.unseen(vec![ring])?;
                }
                Some(())
            }
            LitCrossingKind::Fence => {
                let (foot, n) = (dice.vector3(0.2).with_z(dice.between(-0.1, 0.1)), dice.direction());
                let ring = dice.ring(foot, n, 0.5);
                self.add(vec![ring]);
                Some(())
            }
            LitCrossingKind::Sunk => {
                let foot = dice.vector3(0.2).with_z(dice.between(-0.05, 0.1));
                let block = dice.block(foot, 0.25);
                self.add(block);
                Some(())
            }
        }
    }

    fn lamp(&mut self, ring: Vec<DVec3>) -> Option<()> {
        fits(&self.scene.camera, &ring).then_some(())?;
        self.scene.world.surfaces.push(lamp(&mut self.dice, ring));
        self.bodies.push(0..1);
        Some(())
    }

    fn unseen(&mut self, faces: Vec<Vec<DVec3>>) -> Option<()> {
        faces.iter().all(|face| fits(&self.scene.camera, face)).then(|| self.add(faces))
    }

    fn add(&mut self, faces: Vec<Vec<DVec3>>) {
        let start = self.scene.world.surfaces.len();
        self.scene.world.surfaces.extend(faces.into_iter().map(Surface::occluder));
        self.bodies.push(start..self.scene.world.surfaces.len());
    }

    /// Whether a triangle of one body crosses one of another, or of the ground, and both bodies rise above
    /// the ground.
    fn crosses(&self) -> bool {
        let mut mesh =
            Mesh { positions: vec![], triangles: vec![], radiance: vec![], background: DVec3::ZERO };
        let ground = &self.scene.ground.corners;
        let polygons = self.scene.world.surfaces.iter().map(|s| &s.vertices[..]).chain([&ground[..]]);
        for polygon in polygons {
            // Faces of a box share their corners.
            let mut vertex = |p: &DVec3| {
                mesh.positions.iter().position(|q| p == q).unwrap_or_else(|| {
                    mesh.positions.push(*p);
                    mesh.positions.len() - 1
                })
            };
            let ring: Vec<_> = polygon.iter().map(&mut vertex).collect();
            mesh.triangles.extend((2..ring.len()).map(|k| [ring[0], ring[k - 1], ring[k]]));
        }
        mesh.radiance = vec![DVec3::ZERO; mesh.triangles.len()];
        let still = Motion { positions: vec![DVec3::ZERO; mesh.positions.len()], ..Motion::default() };
        crossings(&mesh, &still).is_ok_and(|found| !found.is_empty())
    }

    fn carry(&mut self, body: usize) {
        let surfaces = self.bodies[body].clone();
        let centre = self.scene.world.surfaces[surfaces.start].vertices[0];
        let affine = Affine::any(&mut self.dice, centre, 0.5, 0.3);
        affine.carry_surfaces(&mut self.scene.world.surfaces[surfaces]);
    }

    fn set_in_motion(&mut self, moving: LitCrossingMoving) {
        match moving {
            LitCrossingMoving::Camera => self.scene.camera_motion = camera_motion(&mut self.dice),
            LitCrossingMoving::Lamp => self.carry(0),
            LitCrossingMoving::Body => {
                let body = self.dice.count(1, self.bodies.len() - 1);
                self.carry(body);
            }
            LitCrossingMoving::All => {
                (0..self.bodies.len()).for_each(|body| self.carry(body));
                let affine = Affine::rotation(self.dice.vector3(0.5), self.dice.vector3(0.3));
                affine.carry(&self.scene.ground.corners, &mut self.scene.ground.velocities);
            }
        }
    }
}

impl Dice {
    /// A direction within about an angle of another.
    fn tilted(&mut self, axis: DVec3, angle: f64) -> DVec3 {
        (axis + angle * self.direction()).normalize()
    }

    /// A triangle or quadrilateral.
    fn ring(&mut self, centre: DVec3, normal: DVec3, radius: f64) -> Vec<DVec3> {
        let corners = self.count(3, 4);
        in_plane(centre, normal, &self.convex_ring(radius, corners))
    }

    /// The faces of a box.
    fn block(&mut self, centre: DVec3, half: f64) -> Vec<Vec<DVec3>> {
        let frame: DMat3 = self.frame();
        let half = DVec3::from(std::array::from_fn(|_| self.between(0.6, 1.2) * half));
        let corners = box_corners(-half, half).map(|c| centre + frame * c);
        BOX_FACES.iter().map(|face| face.iter().map(|&v| corners[v]).collect()).collect()
    }
}
