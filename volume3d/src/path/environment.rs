//! Environment and directional emission.

use flatland::calculus::{Number, Rgb, Vec3};
use std::f64::consts::{PI, TAU};

use super::calculus::Calculus;
use super::lights::LightId;
use super::texture::lookup;
use crate::scene::{Environment, Light, Scene, Wrap};

/// Radiance of one light at infinity, from a direction.
pub(crate) fn distant<C: Calculus>(
    scene: &Scene,
    calculus: &C,
    id: LightId,
    direction: Vec3<C::Number>,
) -> Rgb<C::Number> {
    match id {
        LightId::Light(index) => match &scene.lights()[index as usize] {
            Light::Directional { direction: along, irradiance, kappa, .. } if kappa.is_finite() => {
                let axis = Vec3::turned(-*along, calculus.pose(index as usize));
                let apart = direction - axis;
                let lobe = (apart.dot(apart) * (-0.5 * kappa)).exp();
                let norm = kappa / (-TAU * (-2.0 * kappa).exp_m1());
                calculus.intensity(index as usize, *irradiance) * (lobe * norm)
            }
            _ => Rgb::constant(glam::DVec3::ZERO),
        },
        LightId::Environment => match &scene.description.environment {
            Some(Environment::Map { texture, scale, to_world, .. }) => {
                let turn = calculus.environment_turn();
                let [x, y, z] = [to_world.x_axis, to_world.y_axis, to_world.z_axis]
                    .map(|axis| Vec3::turned(axis, turn).dot(direction));
                let around = atan2(x, -z) * (1.0 / TAU);
                let up = y.value().clamp(-1.0, 1.0);
                let slope = -1.0 / (1.0 - up * up).max(f64::MIN_POSITIVE).sqrt();
                let down = y.chain(up.acos(), slope) * (1.0 / PI);
                let image = &scene.description.textures[*texture];
                // Rows are at v = j/(h − 1), with the first and last at the poles; rows of textures are at
                // (j + ½)/h.
                let height = image.height as f64;
                let row = (down * (height - 1.0) + C::Number::constant(0.5)) * (1.0 / height);
                let t = C::Number::constant(1.0) - row;
                let wraps = [Wrap::Repeat, Wrap::Clamp];
                lookup(image, *texture, wraps, around, t, calculus) * C::Number::constant(*scale)
            }
            Some(Environment::Constant { radiance, .. }) => calculus.environment(*radiance),
            None => Rgb::constant(glam::DVec3::ZERO),
        },
        LightId::Shape(_) => Rgb::constant(glam::DVec3::ZERO),
    }
}

/// atan2(y, x): its value, and the derivative (x ẏ − y ẋ)/(x² + y²).
fn atan2<T: Number>(y: T, x: T) -> T {
    let (a, b) = (x.value(), y.value());
    let squared = (a * a + b * b).max(f64::MIN_POSITIVE);
    // The cross product has the exact value zero.
    T::constant(b.atan2(a)) + (y * a - x * b) * (1.0 / squared)
}
