//! Animated transforms: an `<animation>` is evaluated at the time of the shutter.

use glam::{DMat3, DMat4, DQuat, DVec3};

use super::element::Element;
use super::journal::Journal;
use super::transform;
use super::values::number;
use crate::io::Error;

/// Advice for an object that moves while the shutter is open.
const STOPPED: &str =
    "give shutter_open and shutter_close one value, or read leniently, at the middle of the two";

/// Replaces all `<animation>`s by `<transform>`s, evaluated at the time of the first sensor's shutter.
pub(super) fn stop(root: &mut Element, journal: &Journal) {
    if !has_animation(root) {
        return;
    }
    let sensor = root.children.iter().find(|child| child.tag == "sensor");
    let time = |name| {
        let value = sensor.and_then(|sensor| sensor.value_of(name));
        value.and_then(|value| value.trim().parse().ok()).filter(|t: &f64| t.is_finite()).unwrap_or(0.0)
    };
    let (open, close) = (time("shutter_open"), time("shutter_close"));
    stop_within(root, (open, close), journal);
}

fn has_animation(element: &Element) -> bool {
    element.tag == "animation" || element.children.iter().any(has_animation)
}

fn stop_within(element: &mut Element, shutter: (f64, f64), journal: &Journal) {
    for child in &mut element.children {
        if child.tag == "animation" {
            match stopped(child, shutter, journal) {
                Ok(transform) => *child = transform,
                Err(error) => {
                    let name = child.attribute("name").unwrap_or_default().to_owned();
                    let nothing = child.another("transform", &[("name", name)]);
                    journal.accept::<()>(Err(error), child, "the animation is left out");
                    *child = nothing;
                }
            }
        } else {
            stop_within(child, shutter, journal);
        }
    }
}

/// The transform of an animation while the shutter is open.
fn stopped(element: &Element, (open, close): (f64, f64), journal: &Journal) -> Result<Element, Error> {
    let keys = keys(element)?;
    let time = 0.5 * (open + close);
    if open != close && keys.len() > 1 && !journal.is_lenient {
        let what = format!("an <animation> while the shutter is open from {open} to {close}");
        return Err(element.unsupported(what, STOPPED));
    }
    let moved = if open == close { "" } else { ", the middle of the time for which the shutter is open" };
    journal.note(element, format!("the animation is still, as it is at {time}{moved}"));
    let after = keys.partition_point(|(at, _)| *at <= time);
    let matrix = match (keys.get(after.wrapping_sub(1)), keys.get(after)) {
        (Some((a, before)), Some(_)) if *a == time => *before,
        (Some((a, before)), Some((b, next))) => between(before, next, (time - a) / (b - a)),
        (Some((_, only)), None) | (None, Some((_, only))) => *only,
        (None, None) => DMat4::IDENTITY,
    };
    let name = element.attribute("name").unwrap_or_default().to_owned();
    let mut transform = element.another("transform", &[("name", name)]);
    let rows: Vec<String> = matrix.transpose().to_cols_array().iter().map(f64::to_string).collect();
    transform.children.push(element.another("matrix", &[("value", rows.join(" "))]));
    Ok(transform)
}

/// The keyframes of an animation, sorted by time.
fn keys(element: &Element) -> Result<Vec<(f64, DMat4)>, Error> {
    element.check_attributes(&["name"])?;
    let mut keys = vec![];
    for child in &element.children {
        if child.tag != "transform" {
            return Err(child
                .unsupported(format!("<{}> within <animation>", child.tag), "give <transform time=\"…\">"));
        }
        child.check_attributes(&["time"])?;
        let time = number(child, "time", child.required("time")?)?;
        if keys.last().is_some_and(|(last, _)| *last >= time) {
            return Err(child.bad_value(
                "time",
                &time.to_string(),
                "a time after that of the transform before",
            ));
        }
        let mut bare = child.another("transform", &[]);
        bare.children = child.children.iter().map(Element::copy).collect();
        keys.push((time, transform::matrix(&bare)?));
    }
    if keys.is_empty() {
        return Err(
            element.unsupported("an <animation> without a <transform time=\"…\">", "give two or more")
        );
    }
    Ok(keys)
}

/// Interpolation between two transforms, each decomposed into a stretch, a rotation and a translation
/// (Shoemake and Duff 1992): translation and stretch are interpolated linearly, and the rotation by the
/// shortest way.
fn between(first: &DMat4, second: &DMat4, part: f64) -> DMat4 {
    let [(s, p, a), (t, q, b)] = [first, second].map(|m| {
        let linear = DMat3::from_mat4(*m);
        let turn = transform::polar_rotation(linear);
        (m.w_axis.truncate(), DQuat::from_mat3(&turn), turn.transpose() * linear)
    });
    let stretch = a * (1.0 - part) + b * part;
    let shift: DVec3 = s.lerp(t, part);
    DMat4::from_translation(shift) * DMat4::from_quat(p.slerp(q, part)) * DMat4::from_mat3(stretch)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Halfway between two rotations about an axis is half the angle, whatever the stretch and translation.
    #[test]
    fn turns_are_by_their_angle() {
        let at = |angle: f64, scale: DVec3, x: f64| {
            DMat4::from_translation(x * DVec3::X) * DMat4::from_rotation_y(angle) * DMat4::from_scale(scale)
        };
        let (a, b) = (DVec3::new(1.0, 2.0, 3.0), DVec3::new(3.0, 2.0, 1.0));
        for part in [0.0, 0.25, 0.5, 1.0] {
            let found = between(&at(0.2, a, 1.0), &at(1.4, b, 3.0), part);
            let expected = at(0.2 + 1.2 * part, a.lerp(b, part), 1.0 + 2.0 * part);
            assert!(found.abs_diff_eq(expected, 1e-12), "{part}: {found} {expected}");
        }
        let mirrored = at(0.2, DVec3::new(-1.0, 1.0, 1.0), 0.0);
        assert!(between(&mirrored, &mirrored, 0.5).abs_diff_eq(mirrored, 1e-12));
    }
}
