//! Affine velocity fields of bodies.

use glam::{DMat3, DVec3};

use crate::dice::Dice;
use crate::space::irradiance::Surface;

/// An affine velocity field, under which flat bodies stay flat: ṗ = A (p − centre) + b.
#[derive(Clone, Copy, Debug)]
pub(super) struct Affine {
    linear: DMat3,
    centre: DVec3,
    constant: DVec3,
}

impl Affine {
    pub(super) fn translation(constant: DVec3) -> Self {
        Self { linear: DMat3::ZERO, centre: DVec3::ZERO, constant }
    }

    /// Rotation about an axis through `centre`, with the angular velocity `angular`.
    pub(super) fn rotation(centre: DVec3, angular: DVec3) -> Self {
        let linear =
            DMat3::from_cols(angular.cross(DVec3::X), angular.cross(DVec3::Y), angular.cross(DVec3::Z));
        Self { linear, centre, constant: DVec3::ZERO }
    }

    /// Scaling about `centre`, at `rate` times the distance.
    pub(super) fn scaling(centre: DVec3, rate: f64) -> Self {
        Self { linear: DMat3::from_diagonal(DVec3::splat(rate)), centre, constant: DVec3::ZERO }
    }

    fn velocity(&self, p: DVec3) -> DVec3 {
        self.linear * (p - self.centre) + self.constant
    }

    /// Adds the field at some points to their velocities.
    pub(super) fn carry(&self, points: &[DVec3], velocities: &mut [DVec3]) {
        for (v, p) in velocities.iter_mut().zip(points) {
            *v += self.velocity(*p);
        }
    }

    /// Adds the field at all corners of some surfaces to their velocities.
    pub(super) fn carry_surfaces(&self, surfaces: &mut [Surface]) {
        surfaces.iter_mut().for_each(|surface| self.carry(&surface.vertices, &mut surface.velocities));
    }

    /// A translation, rotation or scaling around `centre`, with speeds of about `speed` at a distance of
    /// `radius`.
    pub(super) fn any(dice: &mut Dice, centre: DVec3, radius: f64, speed: f64) -> Self {
        let centre = centre + dice.vector3(radius);
        match dice.count(0, 2) {
            0 => Self::translation(dice.vector3(speed)),
            1 => Self::rotation(centre, dice.vector3(speed / radius)),
            _ => Self::scaling(centre, dice.sign() * dice.between(0.3, 1.0) * speed / radius),
        }
    }
}
