//! Where something is as a whole.

use glam::{DAffine3, DMat3, DQuat, DVec3};

use crate::geometry::Mesh;
use crate::gradient::Tangent;
use crate::scene::{Environment, Light, Object, Parts, Placement, Scene};

/// What moves as one before it is placed.
#[derive(Clone, Debug)]
pub(super) struct Rest {
    pub(super) object: Object,
    /// About what it is turned and scaled.
    pub(super) centre: DVec3,
    pub(super) parts: Parts,
    /// Of each shape, implicit surface and light of its parts.
    pub(super) meshes: Vec<Mesh>,
    pub(super) placements: Vec<Placement>,
    pub(super) lights: Vec<Light>,
    /// Of the environment map, if it turns with the rest.
    pub(super) environment: Option<DMat3>,
}

impl Rest {
    pub(super) fn new(scene: &Scene, object: Object) -> Self {
        let d = scene.description();
        let parts = d.moved_with(object);
        Self {
            object,
            centre: d.centre_of(&parts),
            meshes: parts.shapes.iter().map(|&s| d.shapes[s].mesh.clone()).collect(),
            placements: parts.implicits.iter().map(|&i| d.implicits[i].placement).collect(),
            lights: parts.lights.iter().map(|&l| d.lights[l].clone()).collect(),
            environment: match d.environment {
                Some(Environment::Map { to_world, .. }) if parts.environment => Some(to_world),
                _ => None,
            },
            parts,
        }
    }
}

/// p = c₀ + t + s R (p₀ − c₀).
#[derive(Clone, Copy, Debug)]
pub(super) struct Pose {
    pub(super) translation: DVec3,
    pub(super) rotation: DQuat,
    pub(super) scale: f64,
}

/// The derivative by a pose.
#[derive(Clone, Copy, Debug)]
pub(super) struct PoseGradient {
    pub(super) translation: DVec3,
    /// By a further turn about the moving centre.
    pub(super) rotation: DVec3,
    pub(super) scale: f64,
}

impl Pose {
    /// From rest to the place, about the centre c₀.
    pub(super) fn map(&self, centre: DVec3) -> DAffine3 {
        let about = DAffine3::from_scale_rotation_translation(
            DVec3::splat(self.scale),
            self.rotation,
            self.translation + centre,
        );
        about * DAffine3::from_translation(-centre)
    }

    /// Where a point at rest comes to. What is at the centre is exactly where the centre is.
    fn point(&self, centre: DVec3, rest: DVec3) -> DVec3 {
        centre + self.translation + self.rotation * (self.scale * (rest - centre))
    }

    /// Where an implicit surface stands.
    pub(super) fn placement(&self, centre: DVec3, rest: Placement) -> Placement {
        Placement {
            scale: rest.scale,
            rotation: self.turned(rest.rotation),
            translation: self.point(centre, rest.translation),
        }
    }

    pub(super) fn turned(&self, rest: DMat3) -> DMat3 {
        DMat3::from_quat(self.rotation) * rest
    }

    /// Gives a light the place and turn of one at rest.
    pub(super) fn place(&self, centre: DVec3, at_rest: &Light, light: &mut Light) {
        match (light, at_rest) {
            (Light::Point { position, .. }, Light::Point { position: rest, .. }) => {
                *position = self.point(centre, *rest);
            }
            (Light::Spot { position, to_world, .. }, Light::Spot { position: rest, to_world: frame, .. })
            | (
                Light::Projector { position, to_world, .. },
                Light::Projector { position: rest, to_world: frame, .. },
            ) => {
                *position = self.point(centre, *rest);
                *to_world = self.turned(*frame);
            }
            (Light::Directional { direction, .. }, Light::Directional { direction: rest, .. }) => {
                *direction = self.rotation * *rest;
            }
            // Another light has taken its place.
            _ => {}
        }
    }

    /// The derivative by the pose from that by all that it moves, as it is now.
    pub(super) fn pull(&self, rest: &Rest, scene: &Scene, gradient: &Tangent) -> PoseGradient {
        let d = scene.description();
        let moving = rest.centre + self.translation;
        let mut pulled = PoseGradient { translation: DVec3::ZERO, rotation: DVec3::ZERO, scale: 0.0 };
        let mut point = |x: DVec3, g: DVec3| {
            let arm = x - moving;
            pulled.translation += g;
            pulled.rotation += arm.cross(g);
            pulled.scale += arm.dot(g) / self.scale;
        };
        for &shape in &rest.parts.shapes {
            let positions = d.shapes[shape].mesh.positions();
            positions.iter().zip(gradient.positions_of(scene, shape)).for_each(|(x, g)| point(*x, *g));
        }
        for &implicit in &rest.parts.implicits {
            point(d.implicits[implicit].placement.translation, gradient.implicits[implicit].translation);
        }
        for &light in &rest.parts.lights {
            if let Some(position) = d.lights[light].position() {
                point(position, gradient.pose[light]);
            }
        }
        for &shape in &rest.parts.shapes {
            for i in scene.normal_range(shape) {
                pulled.rotation += scene.normals[i].cross(gradient.normals[i]);
            }
        }
        for &implicit in &rest.parts.implicits {
            pulled.rotation += gradient.implicits[implicit].rotation;
        }
        for &light in &rest.parts.lights {
            pulled.rotation += match d.lights[light] {
                Light::Directional { .. } => gradient.pose[light],
                Light::Spot { .. } | Light::Projector { .. } => gradient.light_rotation[light],
                Light::Point { .. } => DVec3::ZERO,
            };
        }
        if rest.parts.environment {
            pulled.rotation += gradient.environment_rotation;
        }
        pulled
    }
}

/// The rotation vector of a turn, the shorter way round.
pub(super) fn rotation_vector(turn: DQuat) -> DVec3 {
    let turn = if turn.w < 0.0 { -turn } else { turn };
    // Twice the angle's half from its sine and cosine, which is exact for small angles, too.
    let (axis, sine) = (turn.xyz(), turn.xyz().length());
    if sine > 0.0 { axis * (2.0 * sine.atan2(turn.w) / sine) } else { DVec3::ZERO }
}
