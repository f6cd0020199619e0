//! Boundary term of flat emitters' borders, as seen from shading points (Theory 9).

use flatland::calculus::{Number, Vec3};
use flatland::random::open01;

use super::differential::Differential;
use crate::path::{BorderSample, Kernel, LightId, Paths, radiance_at};
use crate::scene::Surface;

/// One-point estimate of ∮ f L (v_b − V)·ν over the border of a flat emitter as seen from `origin` on surface
/// `from`: the border's motion relative to the warp, which therefore need not follow it. The warp must then
/// follow only the silhouettes of occluders, and its kernel may be as wide as the emitter.
///
/// `None` where the point is occluded or does not move.
pub(in crate::gradient) fn border<C: Differential>(
    calculus: &mut C,
    paths: &Paths<'_>,
    origin: Vec3<C::Number>,
    from: Surface,
    shape: u32,
    kernel: impl FnOnce() -> Kernel,
) -> Option<BorderSample<C::Number>> {
    let scene = paths.scene;
    let xi = open01(calculus.rng()?);
    let ends = paths.lights.border_ends(scene, shape, xi)?.map(|i| calculus.position(i));
    let moves = |p: Vec3<C::Number>| [p.x, p.y, p.z].iter().any(|x| !x.is_still());
    let moves = moves(origin) || ends.into_iter().any(moves);
    if !moves && !calculus.warps_light() {
        return None;
    }
    let border = paths.lights.border_point(scene, shape, xi)?;
    let kernel = kernel();
    let x = origin.value();
    let way = border.place - x;
    let distance = way.length();
    let direction = way / distance;
    if kernel.normal.dot(direction) <= 0.0 {
        return None;
    }
    if !moves && !calculus.may_warp(x, direction, &kernel) {
        return None;
    }
    if scene.shadowed(x, from, direction, distance) {
        return None;
    }
    let place = ends[0] + (ends[1] - ends[0]) * C::Number::constant(border.along);
    let material = (place - origin).normalized();
    let warped = calculus.warp(origin, from, direction, kernel);
    // Tangent of the border on the sphere of directions, and its outward normal.
    let tangent = border.edge - border.edge.dot(direction) * direction;
    let across = direction.cross(tangent).try_normalize()?;
    let outward = if across.dot(border.inside - border.place) > 0.0 { -across } else { across };
    let normal = Vec3::constant(outward);
    // The values agree up to rounding and cancel; the derivatives are v_b and V.
    let speed = material.dot(normal) - warped.direction.dot(normal);
    let speed = speed - C::Number::constant(speed.value());
    if speed.is_still() {
        return None;
    }
    let length = tangent.length() / distance * border.whole;
    let weight = length / paths.lights.probability(LightId::Shape(shape));
    let radiance = radiance_at(scene, border.triangle, border.weights);
    Some(BorderSample { direction, light: radiance * weight, speed })
}
