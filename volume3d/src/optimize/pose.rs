//! Rigid placement and scale of objects.

use glam::{DAffine3, DMat3, DQuat, DVec3};

use crate::geometry::Mesh;
use crate::gradient::Tangent;
use crate::scene::{Environment, Light, Object, Parts, Placement, Scene};

/// Objects at rest that move together.
#[derive(Clone, Debug)]
pub(super) struct Rest {
    pub(super) object: Object,
    /// The centre of rotation and scale.
    pub(super) centre: DVec3,
    pub(super) parts: Parts,
    /// The rest state of each shape, implicit surface and light of its parts.
    pub(super) meshes: Vec<Mesh>,
    pub(super) placements: Vec<Placement>,
    pub(super) lights: Vec<Light>,
    /// The rest rotation of the environment map, if it turns with the rest.
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

/// Similarity transform p = c₀ + t + s R (p₀ − c₀).
#[derive(Clone, Copy, Debug)]
pub(super) struct Pose {
    pub(super) translation: DVec3,
    pub(super) rotation: DQuat,
    pub(super) scale: f64,
}

/// Derivative by a pose.
#[derive(Clone, Copy, Debug)]
pub(super) struct PoseGradient {
    pub(super) translation: DVec3,
    /// By a further turn about the moving centre.
    pub(super) rotation: DVec3,
    pub(super) scale: f64,
}

impl Pose {
    /// The map from rest to the placed state, about the centre c₀.
    pub(super) fn map(&self, centre: DVec3) -> DAffine3 {
        let about = DAffine3::from_scale_rotation_translation(
            DVec3::splat(self.scale),
            self.rotation,
            self.translation + centre,
        );
        about * DAffine3::from_translation(-centre)
    }

    /// The image of a point at rest. The centre maps exactly to the moved centre.
    fn point(&self, centre: DVec3, rest: DVec3) -> DVec3 {
        centre + self.translation + self.rotation * (self.scale * (rest - centre))
    }

    /// The placement of an implicit surface.
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

    /// Sets the position and rotation of a light from those of the light at rest.
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
            // The light was replaced by one of another kind.
            _ => {}
        }
    }

    /// Pulls the derivative by everything that the pose moves, as it is now, back to the pose.
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

/// The rotation vector of a rotation, the shorter way round.
pub(super) fn rotation_vector(turn: DQuat) -> DVec3 {
    let turn = if turn.w < 0.0 { -turn } else { turn };
    // Twice the half angle, from its sine and cosine: accurate for small angles, too.
    let (axis, sine) = (turn.xyz(), turn.xyz().length());
    if sine > 0.0 { axis * (2.0 * sine.atan2(turn.w) / sine) } else { DVec3::ZERO }
}
