//! Clipping planes of a camera, accepted only if they cut nothing.
//!
//! A plane that cuts a surface creates a discontinuity of the image that is not an edge of a mesh. Such
//! discontinuities are not modelled: a plane that cuts nothing in the film's view has no effect, and
//! otherwise the scene is refused. Only primary visibility counts, because mirror images and later bounces
//! are not clipped. Occlusion is ignored.

use glam::{DVec2, DVec3};

use super::element::Element;
use super::object::Object;
use crate::io::{Error, SceneProblem};
use crate::scene::{Camera, Film, Shape};

/// Mitsuba's default near plane.
const DEFAULT_NEAR: f64 = 1e-2;

/// Area on the film, in pixels², below which a cut is attributed to rounding.
const TOUCHES: f64 = 1e-9;

/// The planes of a sensor, `near_clip` first.
#[derive(Debug, Default)]
pub(super) struct Clips<'a>([Option<Clip<'a>>; 2]);

/// A plane perpendicular to the optical axis.
#[derive(Debug)]
struct Clip<'a> {
    name: &'static str,
    element: &'a Element,
    distance: f64,
    /// The distance of the camera behind the sensor from which distances are measured.
    behind: f64,
    /// 1 for a far plane, −1 for a near plane.
    sign: f64,
}

impl<'a> Clips<'a> {
    pub(super) fn read(object: &Object<'a>) -> Result<Self, Error> {
        let plane = |name, sign| {
            let distance = object.positive(name)?;
            let clip = |(element, distance)| Clip { name, element, distance, behind: 0.0, sign };
            Ok::<_, Error>(object.parameter(name).zip(distance).map(clip))
        };
        let planes = [plane("near_clip", -1.0)?, plane("far_clip", 1.0)?];
        match &planes {
            [Some(near), Some(far)] if near.distance >= far.distance => {
                Err(far.element.bad_value(far.name, far.value(), "a number greater than near_clip"))
            }
            _ => Ok(Self(planes)),
        }
    }

    /// The planes of an orthographic sensor, whose camera stands behind it. Nothing behind the sensor is
    /// visible, so there is always a near plane. As in Mitsuba, the near plane is scaled with the sensor, and
    /// the distance between the planes is not.
    pub(super) fn of_sensor(self, element: &'a Element, scale: f64, behind: f64) -> Self {
        let [near, far] = self.0;
        let near =
            near.unwrap_or(Clip { name: "near_clip", element, distance: DEFAULT_NEAR, behind, sign: -1.0 });
        let start = scale * near.distance;
        let far = far.map(|far| Clip { distance: start + (far.distance - near.distance), ..far });
        let near = Clip { distance: start, ..near };
        Self(
            [Some(near), far]
                .map(|clip| clip.map(|clip| Clip { distance: clip.distance + behind, behind, ..clip })),
        )
    }

    /// The distance of the far plane, if there is one.
    pub(super) fn far(&self) -> Option<f64> {
        self.0.iter().flatten().find(|clip| clip.sign > 0.0).map(|clip| clip.distance)
    }

    /// Refuses a scene if a plane cuts a visible surface.
    pub(super) fn check(&self, camera: &Camera, film: &Film, shapes: &[Shape]) -> Result<(), Error> {
        let view = View::new(camera, film);
        self.0.iter().flatten().try_for_each(|clip| clip.check(&view, shapes))
    }
}

impl Clip<'_> {
    fn value(&self) -> &str {
        self.element.attribute("value").unwrap_or("default")
    }

    /// The error names the shape with the largest cut area.
    fn check(&self, view: &View<'_>, shapes: &[Shape]) -> Result<(), Error> {
        let mut worst: Option<(f64, &Shape)> = None;
        for shape in shapes {
            let positions = shape.mesh.positions();
            for triangle in shape.mesh.triangles() {
                let corners = triangle.map(|k| view.local(positions[k as usize]));
                let Some(excess) = view.excess(corners, self.distance, self.sign) else { continue };
                if worst.is_none_or(|(most, _)| excess > most) {
                    worst = Some((excess, shape));
                }
            }
        }
        let Some((excess, shape)) = worst else { return Ok(()) };
        Err(self.element.error(SceneProblem::Clip {
            name: self.name,
            value: self.value().to_owned(),
            shape: shape.id.clone(),
            distance: self.distance + self.sign * excess - self.behind,
        }))
    }
}

/// View volume of a film, in the frame of the camera: x to the right, y up, z into the scene.
struct View<'a> {
    camera: &'a Camera,
    /// x ≥ left · z and so on.
    left: f64,
    right: f64,
    bottom: f64,
    top: f64,
    /// The size of a pixel at z = 1.
    pixel: DVec2,
}

impl<'a> View<'a> {
    fn new(camera: &'a Camera, film: &Film) -> Self {
        let [width, height] = [film.width, film.height].map(|n| n as f64);
        let pixel = 2.0 * (0.5 * camera.field_of_view).tan() / width;
        // The reach of the filter beyond the border of its pixel.
        let margin = film.filter.radius() - 0.5;
        let tall = pixel / camera.pixel_aspect;
        let centre = (camera.principal_point + 0.5) * DVec2::new(width, height);
        let (x, y, w, h) = match film.crop {
            Some(crop) => (crop.x as f64, crop.y as f64, crop.width as f64, crop.height as f64),
            None => (0.0, 0.0, width, height),
        };
        Self {
            camera,
            left: (x - margin - centre.x) * pixel,
            right: (x + w + margin - centre.x) * pixel,
            bottom: (centre.y - y - h - margin) * tall,
            top: (centre.y - y + margin) * tall,
            pixel: DVec2::new(pixel, tall),
        }
    }

    fn local(&self, point: DVec3) -> DVec3 {
        let Camera { origin, right, up, forward, .. } = self.camera;
        let offset = point - *origin;
        DVec3::new(offset.dot(*right), offset.dot(*up), offset.dot(*forward))
    }

    /// The distance by which the visible part of a triangle exceeds a plane, if it does.
    fn excess(&self, corners: [DVec3; 3], distance: f64, sign: f64) -> Option<f64> {
        let beyond = |p: DVec3| sign * (p.z - distance);
        if corners.iter().all(|&p| beyond(p) <= 0.0) {
            return None;
        }
        let mut polygon = corners.to_vec();
        clip(&mut polygon, beyond);
        clip(&mut polygon, |p| p.z);
        // The additional view through the points of a lens, whose image planes are shifted.
        let beside = |z: f64| self.camera.lens.map_or(0.0, |l| l.radius * (1.0 + z / l.focus_distance));
        clip(&mut polygon, |p| p.x - self.left * p.z + beside(p.z));
        clip(&mut polygon, |p| self.right * p.z - p.x + beside(p.z));
        clip(&mut polygon, |p| p.y - self.bottom * p.z + beside(p.z));
        clip(&mut polygon, |p| self.top * p.z - p.y + beside(p.z));
        let excess = polygon.iter().map(|&p| beyond(p)).fold(0.0, f64::max);
        (self.area(&polygon) > TOUCHES && excess > 0.0).then_some(excess)
    }

    /// The area of a visible polygon in pixels².
    fn area(&self, polygon: &[DVec3]) -> f64 {
        // Only a corner at the pinhole itself is not in front; such a polygon is seen edge-on.
        let seen = |p: &DVec3| p.truncate() / (self.pixel * p.z.max(f64::MIN_POSITIVE));
        let Some(first) = polygon.first().map(seen) else { return 0.0 };
        let pairs = polygon.iter().zip(polygon.iter().skip(1));
        let twice: f64 = pairs.map(|(a, b)| (seen(a) - first).perp_dot(seen(b) - first)).sum();
        0.5 * twice.abs()
    }
}

/// Clips a convex polygon where `inside`, which is affine, is negative (Sutherland and Hodgman).
fn clip(polygon: &mut Vec<DVec3>, inside: impl Fn(DVec3) -> f64) {
    let corners = std::mem::take(polygon);
    for (i, &b) in corners.iter().enumerate() {
        let a = corners[(i + corners.len() - 1) % corners.len()];
        let (at_a, at_b) = (inside(a), inside(b));
        if (at_a < 0.0) != (at_b < 0.0) {
            polygon.push(a + (b - a) * (at_a / (at_a - at_b)));
        }
        if at_b >= 0.0 {
            polygon.push(b);
        }
    }
}
