//! The warps of directions and of the film, whatever their fields are made of.

use flatland::warp::{Field, LinearField, Plane, Stencil};
use glam::{DVec2, DVec3};

use super::CameraTangent;
use super::film::FilmPlane;
use super::followed::FollowedPoint;
use super::jump_mean::JumpMean;
use super::rigid_motion::RigidMotion;
use crate::Sphere;

/// A warp of the directions at a bounce.
#[derive(Clone, Debug)]
pub(crate) enum DirectionWarp {
    /// The mean of what auxiliary rays see.
    Rays(Stencil<Sphere, FollowedPoint>),
    /// One rigid motion.
    Rigid(RigidMotion<Sphere>),
    /// From the edges near by.
    JumpMean(JumpMean),
}

impl DirectionWarp {
    /// Whether its coefficients are finite.
    pub(crate) fn is_finite(&self) -> bool {
        match self {
            Self::Rays(_) | Self::Rigid(_) => true,
            Self::JumpMean(mean) => mean.is_finite(),
        }
    }
}

impl LinearField for DirectionWarp {
    type Vector = DVec3;
    type Source = FollowedPoint;
    type Rate = DVec3;

    /// The field, from the angular velocity of each point that is followed.
    fn field(&self, velocity: impl FnMut(&FollowedPoint) -> DVec3) -> Field<DVec3> {
        match self {
            Self::Rays(stencil) => stencil.field(velocity),
            Self::Rigid(motion) => motion.field(velocity),
            Self::JumpMean(mean) => mean.field(velocity),
        }
    }

    /// The transpose: hands each point its covector in a·V + b ∇·V.
    fn scatter(&self, a: DVec3, b: f64, add: impl FnMut(&FollowedPoint, DVec3)) {
        match self {
            Self::Rays(stencil) => stencil.scatter(a, b, add),
            Self::Rigid(motion) => motion.scatter(a, b, add),
            Self::JumpMean(mean) => mean.scatter(a, b, add),
        }
    }
}

/// A warp of film points.
#[derive(Clone, Debug)]
pub(crate) enum FilmWarp {
    /// The mean of what auxiliary rays see.
    Rays(Stencil<Plane, FollowedPoint>),
    /// One rigid motion.
    Rigid(RigidMotion<Plane>),
    /// From the edges near by, on directions. With j ∝ 1/cos³ θ the area of the film a steradian,
    /// ∇·V on the film is ∇·(j V)/j on directions.
    JumpMean(JumpMean, DVec3),
}

/// What a covector gives to (ẋ − ȯ)/distance, and to the rates of the camera's rotation and field of view.
pub(crate) type Covectors = (DVec3, DVec3, f64);

impl FilmWarp {
    /// Whether its coefficients are finite.
    pub(crate) fn is_finite(&self) -> bool {
        match self {
            Self::Rays(_) | Self::Rigid(_) => true,
            Self::JumpMean(mean, _) => mean.is_finite(),
        }
    }

    /// The field in pixels, from (ẋ − ȯ)/distance of each point that is followed.
    pub(crate) fn field(
        &self,
        film: &FilmPlane,
        change: &CameraTangent,
        mut relative: impl FnMut(&FollowedPoint) -> DVec3,
    ) -> Field<DVec2> {
        let on_film = |seen: &FollowedPoint| film.velocity(seen.direction).of(relative(seen), change);
        match self {
            Self::Rays(stencil) => stencil.field(on_film),
            Self::Rigid(motion) => motion.field(on_film),
            Self::JumpMean(mean, direction) => {
                let field = mean.field(|seen| {
                    let zoom = film.zoom(seen.direction) * change.field_of_view;
                    relative(seen) - change.rotation.cross(seen.direction) + zoom
                });
                let tilt = film.forward().dot(field.value) / film.forward().dot(*direction);
                Field {
                    value: film.velocity(*direction).across(field.value),
                    divergence: field.divergence - 3.0 * tilt,
                }
            }
        }
    }

    /// The transpose: hands each point what a·V + b ∇·V gives.
    pub(crate) fn scatter(
        &self,
        film: &FilmPlane,
        a: DVec2,
        b: f64,
        mut add: impl FnMut(&FollowedPoint, Covectors),
    ) {
        match self {
            Self::Rays(stencil) => {
                stencil.scatter(a, b, |seen, c| add(seen, film.velocity(seen.direction).transpose(c)));
            }
            Self::Rigid(motion) => {
                motion.scatter(a, b, |seen, c| add(seen, film.velocity(seen.direction).transpose(c)));
            }
            Self::JumpMean(mean, direction) => {
                let (across, ..) = film.velocity(*direction).transpose(a);
                let tilt = film.forward() * (3.0 * b / film.forward().dot(*direction));
                mean.scatter(across - tilt, b, |seen, c| {
                    let rotation = -seen.direction.cross(c);
                    add(seen, (c, rotation, film.zoom(seen.direction).dot(c)));
                });
            }
        }
    }
}
