//! Orthographic sensors, approximated by distant perspective cameras.
//!
//! The camera is [`FAR`] times half the sensor's width behind the sensor. Its rays are parallel to within
//! 1/FAR: objects at a depth z in front of the sensor appear smaller by z/(FAR w), with w half the width,
//! which is 0.2 % for a depth of ten widths. Images and derivatives are those of that camera, which rotates
//! about the sensor.

use glam::{DAffine3, DVec2, DVec3};

use super::clip::Clips;
use super::object::Object;
use crate::io::Error;
use crate::scene::Camera;

/// Distance of the camera behind the sensor, in half widths of the sensor.
const FAR: f64 = 1e4;

/// Tolerance of orthogonality of the axes. Matrices are often written with five or six digits.
const TOLERANCE: f64 = 1e-4;

/// The film covers [−1, 1] along x, in the frame of `to_world`, and along y by its aspect ratio.
pub(super) fn camera<'a>(object: &Object<'a>) -> Result<(Camera, Clips<'a>), Error> {
    let (element, map) = object.affine("to_world")?.unwrap_or((object.element, DAffine3::IDENTITY));
    let m = map.matrix3;
    let [x, y, z] = [m.x_axis, m.y_axis, m.z_axis].map(DVec3::length);
    let axes = [(m.x_axis, x), (m.y_axis, y), (m.z_axis, z)].map(|(axis, length)| axis / length);
    let [left, up, forward] = axes;
    let is_frame = axes.iter().all(|axis| axis.is_finite())
        && [left.dot(up), up.dot(forward), forward.dot(left)].iter().all(|c| c.abs() < TOLERANCE);
    if !is_frame {
        let expected = "scales along x, y and z, and a rigid motion";
        return Err(element.bad_value("transform", &format!("{m}"), expected));
    }
    // Exactly orthonormal.
    let left = up.cross(forward).normalize();
    let up = forward.cross(left);
    let left = if m.determinant() < 0.0 { -left } else { left };
    let behind = FAR * x;
    object.note(format!("the orthographic sensor is read as a perspective one {behind} behind it, whose rays are nearly parallel"));
    let clips = Clips::read(object)?.of_sensor(object.element, z, behind);
    object.float("shutter_open")?;
    object.float("shutter_close")?;
    let camera = Camera {
        origin: map.translation - behind * forward,
        right: -left,
        up,
        forward,
        field_of_view: 2.0 * (1.0 / FAR).atan(),
        principal_point: DVec2::ZERO,
        pixel_aspect: x / y,
        lens: None,
        orthographic: Some(behind),
    };
    Ok((camera, clips))
}
