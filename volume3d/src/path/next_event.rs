//! Next-event estimation.

use flatland::calculus::{Number, Rgb, Vec3};
use glam::DVec3;

use super::bsdf::Sampled;
use super::calculus::{Calculus, Warped};
use super::emission::emitted;
use super::environment::distant;
use super::integrator::{Paths, Vertex, reflect, warp};
use super::lights::{LightId, LightSample};
use super::sequence::Draws;
use super::spot::profile;
use crate::scene::{Light, Surface};

impl Paths<'_> {
    /// Direct light reflected at a point, from a sampled light; a light without extent that is visible is
    /// returned.
    #[inline]
    pub(super) fn next_event<C: Calculus>(
        &self,
        calculus: &mut C,
        vertex: Vertex<'_, '_, C::Number>,
        samples: &mut Draws<'_>,
    ) -> (Rgb<C::Number>, Option<LightSample>) {
        let zero = Rgb::constant(DVec3::ZERO);
        let Vertex { point, shading } = vertex;
        let (choice, [a, b]) = (samples.one(), samples.pair());
        let x = point.position.value();
        if shading.is_ideal() {
            return (zero, None);
        }
        let Some(towards) = self.lights.sample(self.scene, x, [choice, a, b]) else { return (zero, None) };
        let LightSample { id, sampled: Sampled { direction, density }, distance, surface, delta } = towards;
        let border = match id {
            LightId::Shape(shape) if !shading.transmits() => {
                let kernel = || self.kernels.of_light(self.scene, &self.lights, id, shading, x, None);
                calculus.border(point.position, point.surface, shape, kernel)
            }
            _ => None,
        };
        let border = border.map_or(zero, |b| {
            shading.evaluate(Vec3::constant(b.direction)) * Rgb::constant(b.light) * b.speed
        });
        let hidden = || self.scene.shadowed_before(x, point.surface, direction, distance, surface);
        if !shading.receives(direction) || hidden() {
            return (border + zero, None);
        }
        if delta {
            return (border, Some(towards));
        }
        let weight = density / (density + shading.density(direction));
        let (reflected, emitted) =
            self.light_along(calculus, vertex, (id, surface), direction, weight / density);
        (border + reflected * emitted, None)
    }

    /// Reflected light of one emitter along a sampled direction, in which its surface is seen (or none): f
    /// cos θ of the warped direction, with Jacobian and weight, and the radiance from there.
    ///
    /// Light that next-event estimation can sample is a separate integral with its own kernel, and both
    /// sampling strategies use the same field.
    #[inline]
    pub(super) fn light_along<C: Calculus>(
        &self,
        calculus: &mut C,
        vertex: Vertex<'_, '_, C::Number>,
        (id, seen): (LightId, Option<Surface>),
        direction: DVec3,
        weight: f64,
    ) -> (Rgb<C::Number>, Rgb<C::Number>) {
        let Vertex { point, shading } = vertex;
        let x = point.position.value();
        let warped = if calculus.warps_light() {
            let kernel = || self.kernels.of_light(self.scene, &self.lights, id, shading, x, seen);
            warp(calculus, vertex, direction, kernel)
        } else {
            Warped::still(direction)
        };
        let emitted = match (id, seen) {
            (LightId::Shape(_), Some(Surface::Triangle(triangle))) => {
                emitted(self.scene, calculus, (point.position, warped.direction), triangle)
            }
            (id, _) => distant(self.scene, calculus, id, warped.direction),
        };
        (reflect(shading, &warped, weight), emitted)
    }

    /// Light from a point or a single direction, if it is visible.
    pub(super) fn delta_light<C: Calculus>(
        &self,
        calculus: &C,
        Vertex { point, shading }: Vertex<'_, '_, C::Number>,
        towards: &LightSample,
    ) -> Rgb<C::Number> {
        let LightId::Light(index) = towards.id else { return Rgb::constant(DVec3::ZERO) };
        let index = index as usize;
        let weight = C::Number::constant(1.0 / towards.sampled.density);
        match &self.scene.lights()[index] {
            Light::Directional { direction, irradiance, .. } => {
                let direction = Vec3::turned(-*direction, calculus.pose(index));
                shading.evaluate(direction) * calculus.intensity(index, *irradiance) * weight
            }
            light @ (Light::Point { position, .. }
            | Light::Spot { position, .. }
            | Light::Projector { position, .. }) => {
                let place = Vec3::constant(*position);
                let place = calculus.pose(index).map_or(place, |shift| place + shift);
                let way = place - point.position;
                let falloff = C::Number::constant(1.0) / way.dot(way);
                let way = way.normalized();
                shading.evaluate(way)
                    * profile(self.scene, calculus, (index, light), -way)
                    * calculus.intensity(index, light.power())
                    * (falloff * weight)
            }
        }
    }
}
