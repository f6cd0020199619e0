//! Warps of directions and of the film, for all types of field.

use flatland::sdf::Jet;
use flatland::warp::{Field, LinearField, Plane, Stencil};
use glam::{DVec2, DVec3};

use super::followed::FollowedPoint;
use super::jump_mean::{JumpMean, LevelSetTap};
use super::rigid_motion::RigidMotion;
use crate::Sphere;
use crate::gradient::CameraTangent;
use crate::gradient::film::FilmPlane;

/// Warp of the directions at a bounce.
#[derive(Clone, Debug)]
pub(crate) enum DirectionWarp {
    /// Weighted mean over auxiliary rays.
    Rays(Stencil<Sphere, FollowedPoint>),
    /// One rigid motion.
    Rigid(RigidMotion<Sphere>),
    /// Mean over nearby discontinuities.
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

impl DirectionWarp {
    /// Contribution of implicit surfaces to the field, from φ̇ and ∇φ̇ relative to the viewer.
    pub(crate) fn level_set_field(&self, rate: impl FnMut(&LevelSetTap) -> Jet<DVec3>) -> Field<DVec3> {
        match self {
            Self::Rays(_) | Self::Rigid(_) => Field::ZERO,
            Self::JumpMean(mean) => mean.level_set_field(rate),
        }
    }

    /// Transpose of [`level_set_field`](Self::level_set_field): hands each surface its covector in a·V + b
    /// ∇·V.
    pub(crate) fn scatter_level_sets(&self, a: DVec3, b: f64, add: impl FnMut(&LevelSetTap, Jet<DVec3>)) {
        match self {
            Self::Rays(_) | Self::Rigid(_) => {}
            Self::JumpMean(mean) => mean.scatter_level_sets(a, b, add),
        }
    }
}

impl LinearField for DirectionWarp {
    type Vector = DVec3;
    type Source = FollowedPoint;
    type Rate = DVec3;

    /// The field, from the angular velocity of each followed point.
    fn field(&self, velocity: impl FnMut(&FollowedPoint) -> DVec3) -> Field<DVec3> {
        match self {
            Self::Rays(stencil) => stencil.field(velocity),
            Self::Rigid(motion) => motion.field(velocity),
            Self::JumpMean(mean) => mean.field(velocity),
        }
    }

    /// Transpose of `field`: hands each point its covector in a·V + b ∇·V.
    fn scatter(&self, a: DVec3, b: f64, add: impl FnMut(&FollowedPoint, DVec3)) {
        match self {
            Self::Rays(stencil) => stencil.scatter(a, b, add),
            Self::Rigid(motion) => motion.scatter(a, b, add),
            Self::JumpMean(mean) => mean.scatter(a, b, add),
        }
    }
}

/// Warp of film points, in pixels.
///
/// Linear in the apparent velocities of the followed points, the rates of the directions in which the camera
/// sees them.
#[derive(Clone, Debug)]
pub(crate) struct FilmWarp {
    pub(crate) field: FilmField,
    pub(crate) film: FilmPlane,
}

/// Type of field on the film.
#[derive(Clone, Debug)]
pub(crate) enum FilmField {
    /// Weighted mean over auxiliary rays.
    Rays(Stencil<Plane, FollowedPoint>),
    /// One rigid motion.
    Rigid(RigidMotion<Plane>),
    /// Mean over discontinuities near a direction. With j ∝ 1/cos³ θ the film area per steradian, ∇·V on the
    /// film is ∇·(j V)/j on directions.
    JumpMean(JumpMean, DVec3),
}

impl FilmWarp {
    /// Whether its coefficients are finite.
    pub(crate) fn is_finite(&self) -> bool {
        match &self.field {
            FilmField::Rays(_) | FilmField::Rigid(_) => true,
            FilmField::JumpMean(mean, _) => mean.is_finite(),
        }
    }

    /// Apparent velocity of a point seen along a direction: `relative` = (ẋ − ȯ)/distance less the apparent
    /// motion due to the camera's rotation and zoom.
    pub(crate) fn apparent(&self, direction: DVec3, relative: DVec3, camera: &CameraTangent) -> DVec3 {
        relative - camera.rotation.cross(direction) + self.film.zoom(direction) * camera.field_of_view
    }

    /// Contribution of implicit surfaces to the field, from φ̇ and ∇φ̇ relative to the camera.
    pub(crate) fn level_set_field(&self, rate: impl FnMut(&LevelSetTap) -> Jet<DVec3>) -> Field<DVec2> {
        match &self.field {
            FilmField::Rays(_) | FilmField::Rigid(_) => Field::ZERO,
            FilmField::JumpMean(mean, direction) => self.on_film(*direction, mean.level_set_field(rate)),
        }
    }

    /// Transpose of [`level_set_field`](Self::level_set_field): hands each surface its covector in a·V + b
    /// ∇·V.
    pub(crate) fn scatter_level_sets(&self, a: DVec2, b: f64, add: impl FnMut(&LevelSetTap, Jet<DVec3>)) {
        if let FilmField::JumpMean(mean, direction) = &self.field {
            mean.scatter_level_sets(self.on_film_transpose(*direction, a, b), b, add);
        }
    }

    /// Maps a field of directions to film points.
    fn on_film(&self, direction: DVec3, Field { value, divergence }: Field<DVec3>) -> Field<DVec2> {
        let tilt = self.film.forward().dot(value) / self.film.forward().dot(direction);
        Field { value: self.film.jacobian(direction).apply(value), divergence: divergence - 3.0 * tilt }
    }

    /// Transpose of [`on_film`](Self::on_film): covector a of a·V + b ∇·V for directions.
    fn on_film_transpose(&self, direction: DVec3, a: DVec2, b: f64) -> DVec3 {
        let tilt = self.film.forward() * (3.0 * b / self.film.forward().dot(direction));
        self.film.jacobian(direction).transpose(a) - tilt
    }

    /// φ̇ and ∇φ̇ of a static surface relative to a camera that translates, rotates and zooms.
    ///
    /// They equal those for a static camera in a space that moves by −(ȯ + A r), r = x − o, with A
    /// r = w × r − g r_⊥: g is the growth rate of the image, and r_⊥ is the component of r orthogonal to the
    /// camera's axis, measured from the image centre's direction.
    pub(crate) fn camera_rate(&self, tap: &LevelSetTap, camera: &CameraTangent) -> Jet<DVec3> {
        let growth = self.film.growth() * camera.field_of_view;
        let (r, gradient) = (tap.point() - self.film.still.origin.value(), tap.there.jet.gradient);
        let velocity =
            self.film.origin_rate(camera) + camera.rotation.cross(r) - growth * self.film.across(r);
        let turned = -camera.rotation.cross(gradient) - growth * self.film.across_transpose(gradient);
        tap.there.advected(velocity) + Jet { value: 0.0, gradient: turned }
    }

    /// Transpose of [`camera_rate`](Self::camera_rate): covectors of translation, rotation and field of view.
    pub(crate) fn camera_rate_transpose(
        &self,
        tap: &LevelSetTap,
        covector: Jet<DVec3>,
    ) -> (DVec3, DVec3, f64) {
        let (r, gradient) = (tap.point() - self.film.still.origin.value(), tap.there.jet.gradient);
        let c = tap.there.advected_transpose(covector);
        let turned = r.cross(c) - gradient.cross(covector.gradient);
        let rotation = turned + self.film.origin_rate_transpose(c);
        let growth =
            -c.dot(self.film.across(r)) - covector.gradient.dot(self.film.across_transpose(gradient));
        (c, rotation, growth * self.film.growth())
    }

    /// Transpose of [`apparent`](Self::apparent): covectors of rotation and field of view.
    pub(crate) fn apparent_transpose(&self, direction: DVec3, covector: DVec3) -> (DVec3, f64) {
        (-direction.cross(covector), self.film.zoom(direction).dot(covector))
    }
}

impl LinearField for FilmWarp {
    type Vector = DVec2;
    type Source = FollowedPoint;
    type Rate = DVec3;

    /// The field, from the apparent velocity of each followed point.
    fn field(&self, mut velocity: impl FnMut(&FollowedPoint) -> DVec3) -> Field<DVec2> {
        let film = &self.film;
        let on_film = |seen: &FollowedPoint| film.jacobian(seen.direction).apply(velocity(seen));
        match &self.field {
            FilmField::Rays(stencil) => stencil.field(on_film),
            FilmField::Rigid(motion) => motion.field(on_film),
            FilmField::JumpMean(mean, direction) => self.on_film(*direction, mean.field(velocity)),
        }
    }

    /// Transpose of `field`: hands each point its covector in a·V + b ∇·V.
    fn scatter(&self, a: DVec2, b: f64, mut add: impl FnMut(&FollowedPoint, DVec3)) {
        let film = &self.film;
        let on_film = |seen: &FollowedPoint, c| add(seen, film.jacobian(seen.direction).transpose(c));
        match &self.field {
            FilmField::Rays(stencil) => stencil.scatter(a, b, on_film),
            FilmField::Rigid(motion) => motion.scatter(a, b, on_film),
            FilmField::JumpMean(mean, direction) => {
                mean.scatter(self.on_film_transpose(*direction, a, b), b, add);
            }
        }
    }
}
