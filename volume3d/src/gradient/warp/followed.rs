//! Points to which a warp attaches its velocity.

use flatland::warp::Domain as _;
use glam::DVec3;

use super::nearest_discontinuity::Nearest;
use crate::Sphere;
use crate::scene::{Hit, MaterialPoint, Scene, Surface};

/// A point that a warp follows: the hit of an auxiliary ray, or a point of a curve.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FollowedPoint {
    pub(crate) followed: Followed,
    /// Distance from the viewpoint.
    pub(crate) distance: f64,
    /// Direction in which it is seen.
    pub(crate) direction: DVec3,
    /// 1 − B, with B the boundary function: velocities may fade away from discontinuities; the field stays
    /// continuous and consistent.
    pub(crate) falloff: f64,
    /// Normal of the face it is seen from, if the nearest discontinuity is that face's horizon.
    ///
    /// Points near the horizon may be as close as the face's own edges, and move along it with unbounded
    /// velocity v/t. That component has no effect but infinite variance, so only the component across the
    /// horizon is kept.
    pub(crate) horizon: Option<DVec3>,
}

/// Attachment of a point: the object that it moves with.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Followed {
    /// Nothing: the ray left the scene.
    Nothing,
    /// A material point of a triangle.
    Material(MaterialPoint),
    /// A point of an edge of a mesh.
    Edge {
        /// Indices of the edge's positions.
        ends: [u32; 2],
        /// Position along the edge, from 0 at the first end to 1.
        along: f64,
    },
    /// A level set of an implicit surface, with velocity G = −φ̇ ∇φ/|∇φ|².
    LevelSet {
        /// Index of the surface.
        implicit: u32,
        /// The point.
        x: DVec3,
    },
    /// A point of a crossing.
    Crossing {
        /// Index of the crossing.
        index: u32,
        /// Position along it, from 0 to 1.
        along: f64,
    },
}

impl FollowedPoint {
    /// The hit or miss of a ray from a point.
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

    /// Angular velocity of the point, from its velocity relative to the viewer.
    pub(crate) fn angular(&self, velocity: DVec3) -> DVec3 {
        let apparent = match self.horizon {
            None => velocity,
            Some(normal) => normal * normal.dot(velocity),
        };
        Sphere::project(self.direction, apparent) * (self.falloff / self.distance)
    }

    /// Transpose of [`angular`](Self::angular): covector of the velocity, from that of the angular velocity.
    pub(crate) fn angular_transpose(&self, covector: DVec3) -> DVec3 {
        let c = Sphere::project(self.direction, covector) * (self.falloff / self.distance);
        match self.horizon {
            None => c,
            Some(normal) => normal * normal.dot(c),
        }
    }

    /// This direction, attached to the nearest point of a crossing where that is the nearest
    /// discontinuity: the curve slides over both of its surfaces, and velocities must be the curve's own
    /// where weights are unbounded.
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

    /// Velocity of the point from the velocities of all mesh positions; zero for level sets.
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

    /// Transpose of [`velocity`](Self::velocity): hands each position its part of a covector.
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
