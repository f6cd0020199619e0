//! Transforms.

use glam::{DAffine3, DMat3, DMat4, DVec3};

use super::element::Element;
use super::journal::Journal;
use super::values::{number, numbers, triple, vector};
use crate::io::{Error, SceneProblem};

/// Deviation of an axis's length from 1 above which a note is written: unit vectors are often given with
/// three digits.
const UNIT_TOLERANCE: f64 = 1e-3;

/// Tolerance of orthogonality and equal length of the axes of a rigid motion, for products of axes divided by
/// the squared length. A rotation by θ about an axis of length 1 − δ has products that are off by up to 4δ,
/// and δ may be [`UNIT_TOLERANCE`] without a note; the rest is for matrices written with few digits.
const RIGID_TOLERANCE: f64 = 5.0 * UNIT_TOLERANCE;

/// The product of a transform's steps, the first applied first.
pub(super) fn matrix(element: &Element) -> Result<DMat4, Error> {
    element.check_attributes(&["name"])?;
    let mut product = DMat4::IDENTITY;
    for step in &element.children {
        step.check_childless()?;
        product = self::step(step)? * product;
    }
    if product.is_finite() {
        Ok(product)
    } else {
        Err(element.bad_value("transform", &format!("{product}"), "numbers that do not overflow"))
    }
}

fn step(element: &Element) -> Result<DMat4, Error> {
    match element.tag.as_str() {
        "translate" => {
            element.check_attributes(&["x", "y", "z", "value"])?;
            Ok(DMat4::from_translation(vector(element, 0.0)?))
        }
        "scale" => {
            element.check_attributes(&["x", "y", "z", "value"])?;
            Ok(DMat4::from_mat3(DMat3::from_diagonal(vector(element, 1.0)?)))
        }
        "rotate" => {
            element.check_attributes(&["x", "y", "z", "value", "angle"])?;
            let angle = number(element, "angle", element.required("angle")?)?;
            let axis = vector(element, 0.0)?;
            if axis == DVec3::ZERO {
                return Err(element.bad_value("axis", &format!("{axis}"), "a vector other than 0"));
            }
            Ok(DMat4::from_mat3(turn(axis, angle)))
        }
        "lookat" => look_at(element),
        "matrix" => rows(element),
        tag => Err(element.error(SceneProblem::Tag {
            tag: tag.to_owned(),
            parent: "<transform>".to_owned(),
            supported: "translate, rotate, scale, lookat, matrix".to_owned(),
        })),
    }
}

/// Mitsuba's matrix of a `<rotate>` about an axis a of any length,
/// cos θ 1 + (1 − cos θ) a aᵀ + sin θ \[a\]×. It is a rotation if a has length 1.
fn turn(axis: DVec3, degrees: f64) -> DMat3 {
    // Quarter turns are exact: a floor stays flat.
    let (sine, cosine) = match degrees.rem_euclid(360.0) {
        0.0 => (0.0, 1.0),
        90.0 => (1.0, 0.0),
        180.0 => (0.0, -1.0),
        270.0 => (-1.0, 0.0),
        _ => degrees.to_radians().sin_cos(),
    };
    let cross = DMat3::from_cols(axis.cross(DVec3::X), axis.cross(DVec3::Y), axis.cross(DVec3::Z));
    let outer = DMat3::from_cols(axis * axis.x, axis * axis.y, axis * axis.z);
    DMat3::IDENTITY * cosine + outer * (1.0 - cosine) + cross * sine
}

/// Notes rotation axes within an element that are not of length 1, which Mitsuba 3 does not normalise either.
pub(super) fn note_axes(root: &Element, journal: &Journal) {
    let mut left = vec![root];
    while let Some(element) = left.pop() {
        left.extend(element.children.iter().rev());
        if let Some(length) = other_length(element) {
            journal.note_image(
                element,
                format!(
                    "the axis of this rotation has length {length:.4}: taken as it is, as in Mitsuba 3, its matrix is no \
                     rotation; give it length 1"
                ),
            );
        }
    }
}

/// x to the left, y up, z to the target.
fn look_at(element: &Element) -> Result<DMat4, Error> {
    element.check_attributes(&["origin", "target", "up"])?;
    let (origin, target) = (triple(element, "origin")?, triple(element, "target")?);
    let direction = (target - origin).try_normalize();
    let direction = direction
        .ok_or_else(|| element.bad_value("target", &format!("{target}"), "a point other than the origin"))?;
    // Without `up`, the perpendicular direction is that of Mitsuba.
    let up = match element.attribute("up") {
        Some(_) => triple(element, "up")?,
        None => across(direction)[0],
    };
    let left = up.cross(direction).try_normalize();
    let left = left.ok_or_else(|| {
        element.bad_value("up", &format!("{up}"), "a vector that is not parallel to the view")
    })?;
    let up = direction.cross(left);
    Ok(DMat4::from_cols(left.extend(0.0), up.extend(0.0), direction.extend(0.0), origin.extend(1.0)))
}

/// Two unit vectors that complete one to a frame (Duff et al. 2017).
pub(super) fn across(n: DVec3) -> [DVec3; 2] {
    let sign = 1.0_f64.copysign(n.z);
    let a = -1.0 / (sign + n.z);
    let b = n.x * n.y * a;
    [DVec3::new(1.0 + sign * n.x * n.x * a, sign * b, -sign * n.x), DVec3::new(b, sign + n.y * n.y * a, -n.y)]
}

/// 16 numbers row by row, or 9 for the upper left part.
fn rows(element: &Element) -> Result<DMat4, Error> {
    element.check_attributes(&["value"])?;
    let value = element.required("value")?;
    let numbers = numbers(element, "value", value)?;
    match (<&[f64; 16]>::try_from(&numbers[..]), <&[f64; 9]>::try_from(&numbers[..])) {
        (Ok(m), _) => Ok(DMat4::from_cols_array(m).transpose()),
        (_, Ok(m)) => Ok(DMat4::from_mat3(DMat3::from_cols_array(m).transpose())),
        _ => Err(element.bad_value("value", value, "9 or 16 numbers")),
    }
}

/// A transform as an affine map.
pub(super) fn affine(element: &Element) -> Result<DAffine3, Error> {
    let m = matrix(element)?;
    if m.row(3).to_array() == [0.0, 0.0, 0.0, 1.0] {
        Ok(DAffine3::from_mat4(m))
    } else {
        Err(element.unsupported("a transform whose last row is not 0 0 0 1", "use an affine transform"))
    }
}

/// The transform of a shape, which must be invertible.
pub(super) fn invertible(element: &Element) -> Result<DAffine3, Error> {
    let map = affine(element)?;
    let determinant = map.matrix3.determinant();
    if determinant != 0.0 && map.inverse().is_finite() {
        Ok(map)
    } else {
        Err(element.bad_value("transform", &format!("{}", map.matrix3), "an invertible transform"))
    }
}

/// The length of the axis of a `<rotate>` that is not of length 1.
fn other_length(step: &Element) -> Option<f64> {
    // An invalid vector is an error where it is used.
    let length =
        Some(step).filter(|step| step.tag == "rotate").and_then(|step| vector(step, 0.0).ok())?.length();
    Some(length).filter(|length| (length - 1.0).abs() > UNIT_TOLERANCE)
}

/// Whether a transform has an axis of rotation that is not of length 1.
pub(super) fn has_other_axes(element: &Element) -> bool {
    element.children.iter().any(|step| other_length(step).is_some())
}

/// The map whose inverse Mitsuba uses as the inverse of the transform. It differs from the transform if a
/// `<rotate>` has an axis that is not of length 1, because Mitsuba inverts it by its transpose.
pub(super) fn inverse_of_inverse(element: &Element) -> Result<DAffine3, Error> {
    let mut product = DAffine3::IDENTITY;
    for step in &element.children {
        let m = self::step(step)?;
        product =
            DAffine3::from_mat4(if step.tag == "rotate" { m.inverse().transpose() } else { m }) * product;
    }
    Ok(product)
}

/// The transform of a sphere about `center` that keeps it a sphere: Q S₀₀ of the polar decomposition Q S of
/// the linear part, as in Mitsuba, with a note for any other S.
pub(super) fn of_sphere(element: &Element, center: DVec3, journal: &Journal) -> Result<DAffine3, Error> {
    let map = invertible(element)?;
    let turn = polar_rotation(map.matrix3);
    let stretch = turn.transpose() * map.matrix3;
    let factor = stretch.x_axis.x;
    if (stretch * (1.0 / factor)).abs_diff_eq(DMat3::IDENTITY, RIGID_TOLERANCE) {
        return Ok(map);
    }
    let text = format!(
        "the transform of this sphere stretches or shears it: a ball of {:.4} times its radius is shown, as in Mitsuba 3; \
         give an ellipsoid as a mesh",
        factor.abs()
    );
    journal.note_image(element, text);
    let linear = turn * factor;
    Ok(DAffine3 { matrix3: linear, translation: map.transform_point3(center) - linear * center })
}

/// The rotation nearest to a map, the orthogonal part of its polar decomposition, by Newton's iteration Q ←
/// (Q + Q⁻ᵀ)/2 (Higham 1986). A reflection is left in the stretch.
pub(super) fn polar_rotation(linear: DMat3) -> DMat3 {
    const STEPS: usize = 60;
    let mut q = if linear.determinant() < 0.0 { linear * -1.0 } else { linear };
    for _ in 0..STEPS {
        let next = (q + q.inverse().transpose()) * 0.5;
        if !next.is_finite() {
            return DMat3::IDENTITY;
        }
        q = next;
    }
    q
}

/// The rotation of a rigid motion, possibly with a uniform scale; its columns are the axes x, y and z.
pub(super) fn rotation(element: &Element, map: &DAffine3) -> Result<DMat3, Error> {
    let turn = orthogonal(element, map)?;
    if turn.determinant() < 0.0 {
        let expected = "a motion without a mirror (a positive determinant)";
        return Err(element.bad_value("transform", &format!("{}", map.matrix3), expected));
    }
    Ok(turn)
}

/// The rotation of a motion that may contain a reflection; x is then reversed.
pub(super) fn orthogonal(element: &Element, map: &DAffine3) -> Result<DMat3, Error> {
    let m = map.matrix3;
    let length = m.z_axis.length();
    let gram = (m.transpose() * m) * (1.0 / (length * length));
    let is_rigid = length > 0.0 && gram.is_finite() && gram.abs_diff_eq(DMat3::IDENTITY, RIGID_TOLERANCE);
    if !is_rigid {
        let expected = "a rigid motion (no shear, the same scale along all axes)";
        return Err(element.bad_value("transform", &format!("{m}"), expected));
    }
    let z = m.z_axis / length;
    let x = m.y_axis.cross(z).normalize_or(DVec3::X);
    let mirror = 1.0_f64.copysign(m.determinant());
    Ok(DMat3::from_cols(mirror * x, z.cross(x), z))
}
