//! Camera paths over numbers, with film point and directions warped as in the path tracer.

use flatland::calculus::Vec3;
use glam::DVec3;

use super::curve::Eye;
use super::sensor::Vertex;
use crate::path::{Calculus, Kernel, LightId, Paths, Plain, SurfacePoint, VisibilityDomain};
use crate::scene::Surface;

/// The last shading point of a path, and the direction from it to the next vertex or, if there is none, the
/// direction in which it is seen. `vertices` are the shading points, last first.
pub(super) fn warped_ray<C: Calculus>(
    paths: &Paths<'_>,
    calculus: &mut C,
    eye: &Eye<'_, C::Number>,
    vertices: &[Vertex],
    next: Option<&Vertex>,
) -> (Vec3<C::Number>, Vec3<C::Number>) {
    let scene = paths.scene;
    let mut viewer = eye.frame.origin.value();
    let (mut origin, mut direction) = (eye.frame.origin, eye.film.direction(eye.frame, eye.at));
    for (k, vertex) in vertices.iter().enumerate().rev() {
        let distance = viewer.distance(vertex.position);
        origin = SurfacePoint::new(scene, calculus, origin, direction, vertex.surface, distance).position;
        let Some(next) = (if k > 0 { Some(&vertices[k - 1]) } else { next }) else { break };
        let towards = (next.position - vertex.position).normalize();
        direction = Vec3::constant(towards);
        if eye.warps
            && let Some(kernel) =
                kernel(paths, viewer, vertex, VisibilityDomain::Radiance, Some(next.surface))
        {
            direction = calculus.warp(origin, vertex.surface, towards, kernel).direction;
        }
        viewer = vertex.position;
    }
    (origin, direction)
}

/// The kernel of a direction in which a surface is seen, that of `Paths::scatter`: for all radiance if paths
/// reflect again at their next vertex. `None` if nothing is reflected.
pub(super) fn kernel(
    paths: &Paths<'_>,
    viewer: DVec3,
    vertex: &Vertex,
    sees: VisibilityDomain,
    surface: Option<Surface>,
) -> Option<Kernel> {
    let (plain, point) = (Plain { scene: paths.scene }, seen(paths, viewer, vertex));
    let shading = point.shading(paths.scene, &plain)?;
    Some(paths.kernels.of_bounce(&shading, sees, surface))
}

/// The kernel of a direction towards a light, that of `Paths::light_along`. `None` if nothing is reflected.
pub(super) fn light_kernel(
    paths: &Paths<'_>,
    viewer: DVec3,
    vertex: &Vertex,
    light: LightId,
) -> Option<Kernel> {
    let (plain, point) = (Plain { scene: paths.scene }, seen(paths, viewer, vertex));
    let shading = point.shading(paths.scene, &plain)?;
    Some(paths.kernels.of_light(paths.scene, &paths.lights, light, &shading, vertex.position, None))
}

/// A vertex as seen from the one before.
fn seen(paths: &Paths<'_>, viewer: DVec3, vertex: &Vertex) -> SurfacePoint<f64> {
    let plain = Plain { scene: paths.scene };
    let along = Vec3::constant((vertex.position - viewer).normalize());
    let (origin, distance) = (Vec3::constant(viewer), viewer.distance(vertex.position));
    SurfacePoint::new(paths.scene, &plain, origin, along, vertex.surface, distance)
}
