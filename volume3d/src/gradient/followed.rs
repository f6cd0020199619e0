//! Points that warps follow.

use flatland::warp::Domain as _;
use glam::DVec3;

use super::nearest_jump::Nearest;
use crate::Sphere;
use crate::scene::{Hit, MaterialPoint, Scene, Surface};

/// A point that a warp follows: what an auxiliary ray hit, or a point of a curve.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FollowedPoint {
    pub(crate) followed: Followed,
    /// How far away it is.
    pub(crate) distance: f64,
    /// The direction in which it is seen.
    pub(crate) direction: DVec3,
    /// 1 − B: velocities may fade away from jumps, and the field stays continuous and consistent.
    pub(crate) falloff: f64,
    /// The normal of the face it is seen from, where the jump nearest to it is that face's horizon.
    ///
    /// What ends there may be as near as the face's own edges, and moves along the horizon as fast as it likes, v/t: such
    /// velocities have no variance, and no effect. The horizon itself moves only across.
    pub(crate) horizon: Option<DVec3>,
}

/// What a point moves with.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Followed {
    /// Nothing: a ray left the scene.
    Nothing,
    /// Matter of a triangle.
    Material(MaterialPoint),
    /// A point of an edge of a mesh.
    Edge {
        /// Between which positions.
        ends: [u32; 2],
        /// How far it is from the first of them on the way to the other.
        along: f64,
    },
    /// A level set of an implicit surface, which moves with G = −φ̇ ∇φ/|∇φ|².
    LevelSet {
        /// Which surface.
        implicit: u32,
        /// Where.
        x: DVec3,
    },
    /// A crossing, and how far along it the point is.
    Crossing {
        /// Which.
        index: u32,
        /// From 0 to 1.
        along: f64,
    },
}

impl FollowedPoint {
    /// What a ray from a point hit, or did not.
    pub(crate) fn by_ray(
        scene: &Scene,
        hit: Option<Hit>,
        origin: DVec3,
        direction: DVec3,
        falloff: f64,
    ) -> Self {
        let followed = hit.map_or(Followed::Nothing, |hit| match hit.surface {
            Surface::Triangle(triangle) => Followed::Material(scene.material_point(triangle, &hit)),
            Surface::Implicit(implicit) => {
                Followed::LevelSet { implicit, x: origin + hit.distance * direction }
            }
        });
        let distance = hit.map_or(f64::INFINITY, |h| h.distance);
        Self { followed, distance, direction, falloff, horizon: None }
    }

    /// The angular velocity that counts, from the velocity of the point beyond the viewer's.
    pub(crate) fn angular(&self, velocity: DVec3) -> DVec3 {
        let apparent = match self.horizon {
            None => velocity,
            Some(normal) => normal * normal.dot(velocity),
        };
        Sphere::project(self.direction, apparent) * (self.falloff / self.distance)
    }

    /// The transpose: what a covector of the angular velocity gives to the velocity.
    pub(crate) fn angular_transpose(&self, covector: DVec3) -> DVec3 {
        let c = Sphere::project(self.direction, covector) * (self.falloff / self.distance);
        match self.horizon {
            None => c,
            Some(normal) => normal * normal.dot(c),
        }
    }

    /// The same point, moving with the nearest point of a crossing, where that is the nearest jump and near: the curve
    /// slides over both of its surfaces, and velocities of hits must be its own where their weight has no bound.
    pub(crate) fn or_crossing(self, nearest: Nearest, falloff: f64) -> Self {
        match nearest.crossing {
            Some((index, along)) if falloff > 0.0 => {
                Self { followed: Followed::Crossing { index, along }, ..self }
            }
            _ => self,
        }
    }
}

impl Followed {
    pub(crate) fn is_nothing(&self) -> bool {
        matches!(self, Self::Nothing)
    }

    /// Its velocity, from those of all positions of meshes, which move no level set.
    #[inline]
    pub(crate) fn velocity(&self, scene: &Scene, velocities: &[DVec3]) -> DVec3 {
        match self {
            Self::Nothing | Self::LevelSet { .. } => DVec3::ZERO,
            Self::Material(point) => point.velocity(velocities),
            Self::Edge { ends: [first, last], along } => {
                (1.0 - along) * velocities[*first as usize] + along * velocities[*last as usize]
            }
            Self::Crossing { index, along } => {
                scene.crossings().get(*index).velocity(&scene.triangles, *along, velocities)
            }
        }
    }

    /// The transpose: what a covector of its velocity gives to that of each position.
    pub(crate) fn scatter(&self, scene: &Scene, covector: DVec3, mut add: impl FnMut(u32, DVec3)) {
        match self {
            Self::Nothing | Self::LevelSet { .. } => {}
            Self::Material(point) => point.scatter(covector, add),
            Self::Edge { ends: [first, last], along } => {
                add(*first, (1.0 - along) * covector);
                add(*last, along * covector);
            }
            Self::Crossing { index, along } => {
                scene.crossings().get(*index).scatter(&scene.triangles, *along, covector, add);
            }
        }
    }
}
