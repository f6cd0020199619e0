//! Camera paths over numbers: film point and directions rest, or are warped as in the path tracer.

use flatland::calculus::{Number, Vec3};
use glam::{DVec2, DVec3};

use super::drawing::{CameraSubpath, Vertex};
use super::field::WarpField;
use crate::gradient::film::FilmPlane;
use crate::gradient::modes::differential::Differential;
use crate::path::{Frame, Kernel, LightId, Paths, Plain, SurfacePoint, VisibilityDomain};
use crate::scene::Surface;

/// Start of a path, over numbers.
#[derive(Clone, Copy, Debug)]
pub(super) struct Eye<'f, T> {
    /// The film, through the sampled point of the lens.
    pub(super) film: &'f FilmPlane,
    pub(super) frame: Frame<T>,
    /// Film point.
    pub(super) at: [T; 2],
}

impl<'f, T: Number> Eye<'f, T> {
    /// A film point that rests.
    pub(super) fn still(film: &'f FilmPlane, frame: Frame<T>, at: DVec2) -> Self {
        Self { film, frame, at: [T::constant(at.x), T::constant(at.y)] }
    }

    /// The start of a path, moved by V.
    pub(super) fn of<V: WarpField, C: Differential<Number = T>>(
        calculus: &mut C,
        frame: &Frame<T>,
        path: &CameraSubpath<'f>,
    ) -> Self {
        let frame = path.film.frame_through(calculus, frame);
        let still = Self::still(path.film, frame, path.at);
        if V::IS_ZERO {
            return still;
        }
        let seen = path.vertices.last().map(|first| first.surface);
        Self { at: calculus.film_warp(path.film, path.at, seen).at, ..still }
    }
}

/// The last vertex of a path, and the direction from it to the vertex `next` or, if there is none, that in
/// which it is seen. V moves the film point and all directions.
pub(super) fn end_of<V: WarpField, C: Differential>(
    paths: &Paths<'_>,
    calculus: &mut C,
    frame: &Frame<C::Number>,
    path: &CameraSubpath<'_>,
    next: Option<&Vertex>,
) -> (Vec3<C::Number>, Vec3<C::Number>) {
    let (scene, vertices) = (paths.scene, path.vertices);
    let eye = Eye::of::<V, C>(calculus, frame, path);
    let mut viewer = path.film.still.origin.value();
    let (mut origin, mut direction) = (eye.frame.origin, eye.film.direction(&eye.frame, eye.at));
    for (k, vertex) in vertices.iter().enumerate().rev() {
        let distance = viewer.distance(vertex.position);
        origin = SurfacePoint::new(scene, calculus, origin, direction, vertex.surface, distance).position;
        let Some(next) = (if k > 0 { Some(&vertices[k - 1]) } else { next }) else { break };
        let towards = (next.position - vertex.position).normalize();
        direction = Vec3::constant(towards);
        if !V::IS_ZERO
            && let Some(kernel) =
                kernel(paths, viewer, vertex, VisibilityDomain::Radiance, Some(next.surface))
        {
            direction = calculus.warp(origin, vertex.surface, towards, kernel).direction;
        }
        viewer = vertex.position;
    }
    (origin, direction)
}

/// The kernel of a path's last direction, in which a surface is seen: that of `Paths::scatter`. `None` if
/// nothing is reflected.
pub(super) fn kernel_beyond(
    paths: &Paths<'_>,
    path: &CameraSubpath<'_>,
    surface: Option<Surface>,
) -> Option<Kernel> {
    let limit = paths.scene.description.integrator.max_depth.unwrap_or(usize::MAX);
    let goes_on = path.vertices.len() + 1 < limit;
    let sees = if goes_on { VisibilityDomain::Radiance } else { VisibilityDomain::Distant };
    kernel(paths, viewer(path), path.vertices.first()?, sees, surface)
}

/// The kernel of a path's last direction, towards a light: that of `Paths::light_along`. `None` if nothing is
/// reflected.
pub(super) fn kernel_of_light(paths: &Paths<'_>, path: &CameraSubpath<'_>, light: LightId) -> Option<Kernel> {
    let last = path.vertices.first()?;
    let (plain, point) = (Plain { scene: paths.scene }, seen(paths, viewer(path), last));
    let shading = point.shading(paths.scene, &plain)?;
    Some(paths.kernels.of_light(paths.scene, &paths.lights, light, &shading, last.position, None))
}

/// The point from which a path's last vertex is seen.
fn viewer(path: &CameraSubpath<'_>) -> DVec3 {
    path.vertices.get(1).map_or(path.film.still.origin.value(), |vertex| vertex.position)
}

/// The kernel of a direction in which a surface is seen: for all radiance if paths reflect again at their
/// next vertex. `None` if nothing is reflected.
fn kernel(
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

/// A vertex as seen from the one before.
fn seen(paths: &Paths<'_>, viewer: DVec3, vertex: &Vertex) -> SurfacePoint<f64> {
    let plain = Plain { scene: paths.scene };
    let along = Vec3::constant((vertex.position - viewer).normalize());
    let (origin, distance) = (Vec3::constant(viewer), viewer.distance(vertex.position));
    SurfacePoint::new(paths.scene, &plain, origin, along, vertex.surface, distance)
}
