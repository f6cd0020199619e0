//! Spot and projector lights.

use flatland::calculus::{Number, Rgb, Vec3};
use glam::{DMat3, DVec3};

use super::calculus::Calculus;
use super::texture::lookup;
use crate::scene::{Light, Scene};

/// Relative intensity of a point, spot or projector light along a unit direction.
pub(super) fn profile<C: Calculus>(
    scene: &Scene,
    calculus: &C,
    (index, light): (usize, &Light),
    direction: Vec3<C::Number>,
) -> Rgb<C::Number> {
    let (none, all) = (Rgb::constant(DVec3::ZERO), Rgb::constant(DVec3::ONE));
    let one = C::Number::constant(1.0);
    let local = |to_world: &DMat3| {
        let turn = calculus.light_turn(index);
        [to_world.x_axis, to_world.y_axis, to_world.z_axis]
            .map(|axis| Vec3::turned(axis, turn).dot(direction))
    };
    let slide = |texture: Option<usize>, [u, v]: [C::Number; 2]| {
        texture.map_or(all, |index| {
            let image = &scene.description.textures[index];
            lookup(image, index, [image.wrap; 2], u, v, calculus)
        })
    };
    match light {
        Light::Point { .. } | Light::Directional { .. } => all,
        Light::Spot { to_world, cutoff, beam, texture, .. } => {
            let [x, y, z] = local(to_world);
            let cosine = z.value().clamp(-1.0, 1.0);
            if cosine <= cutoff.cos() {
                return none;
            }
            let part = if cosine >= beam.cos() {
                one
            } else {
                let angle = z.chain(cosine.acos(), -1.0 / (1.0 - cosine * cosine).sqrt());
                (C::Number::constant(*cutoff) - angle) * (1.0 / (cutoff - beam))
            };
            let place = [x, y].map(|x| C::Number::constant(0.5) + x / (z * (2.0 * cutoff.tan())));
            slide(*texture, place) * part
        }
        Light::Projector { to_world, field_of_view, aspect, texture, .. } => {
            let [x, y, z] = local(to_world);
            if z.value() <= 0.0 {
                return none;
            }
            let width = (0.5 * field_of_view).tan();
            let half = C::Number::constant(0.5);
            let place = [half - x / (z * (2.0 * width)), half - y / (z * (2.0 * width / aspect))];
            if place.iter().any(|u| !(0.0..=1.0).contains(&u.value())) {
                return none;
            }
            slide(*texture, place) * (C::Number::constant(std::f64::consts::PI) / (z.squared() * z))
        }
    }
}
