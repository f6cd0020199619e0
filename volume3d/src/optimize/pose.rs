//! Where a shape is as a whole.

use glam::{DAffine3, DQuat, DVec3};

use crate::geometry::Mesh;
use crate::gradient::Tangent;
use crate::scene::Scene;

/// A shape before it is placed.
#[derive(Clone, Debug)]
pub(super) struct Rest {
    pub(super) shape: usize,
    pub(super) mesh: Mesh,
    /// The mean of its vertices.
    pub(super) centre: DVec3,
}

impl Rest {
    pub(super) fn new(scene: &Scene, shape: usize) -> Self {
        let mesh = scene.description().shapes[shape].mesh.clone();
        let count = mesh.positions().len().max(1) as f64;
        let centre = mesh.positions().iter().sum::<DVec3>() / count;
        Self { shape, mesh, centre }
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

    /// The derivative by the pose from that by positions and given normals.
    pub(super) fn pull(
        &self,
        centre: DVec3,
        scene: &Scene,
        shape: usize,
        gradient: &Tangent,
    ) -> PoseGradient {
        let moving = centre + self.translation;
        let mut pulled = PoseGradient { translation: DVec3::ZERO, rotation: DVec3::ZERO, scale: 0.0 };
        let positions = scene.description().shapes[shape].mesh.positions();
        for (x, g) in positions.iter().zip(gradient.positions_of(scene, shape)) {
            let arm = *x - moving;
            pulled.translation += *g;
            pulled.rotation += arm.cross(*g);
            pulled.scale += arm.dot(*g) / self.scale;
        }
        for i in scene.normal_range(shape) {
            pulled.rotation += scene.normals[i].cross(gradient.normals[i]);
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
