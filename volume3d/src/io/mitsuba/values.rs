//! Numbers, vectors and colours in attributes.

use glam::DVec3;

use super::element::Element;
use crate::io::Error;
use crate::io::image::from_srgb;

/// The words of a value: Mitsuba separates them by spaces and commas.
pub(super) fn words(value: &str) -> impl Iterator<Item = &str> {
    value.split(|c: char| c.is_ascii_whitespace() || c == ',').filter(|word| !word.is_empty())
}

/// A finite number.
pub(super) fn number(element: &Element, name: &str, value: &str) -> Result<f64, Error> {
    let number = value.trim().parse().ok().filter(|x: &f64| x.is_finite());
    number.ok_or_else(|| element.bad_value(name, value, "a finite number"))
}

/// All numbers of an attribute.
pub(super) fn numbers(element: &Element, name: &str, value: &str) -> Result<Vec<f64>, Error> {
    words(value).map(|word| number(element, name, word)).collect()
}

/// Three numbers in a required attribute.
pub(super) fn triple(element: &Element, attribute: &'static str) -> Result<DVec3, Error> {
    let value = element.required(attribute)?;
    match numbers(element, attribute, value)?[..] {
        [x, y, z] => Ok(DVec3::new(x, y, z)),
        _ => Err(element.bad_value(attribute, value, "three numbers")),
    }
}

/// A vector given as x, y and z, or as a value of three numbers or of one number for all.
pub(super) fn vector(element: &Element, default: f64) -> Result<DVec3, Error> {
    if let Some(value) = element.attribute("value") {
        if let Some(name) = ["x", "y", "z"].iter().find(|name| element.attribute(name).is_some()) {
            return Err(element.bad_value(name, value, "either value or x, y and z"));
        }
        return match numbers(element, "value", value)?[..] {
            [x] => Ok(DVec3::splat(x)),
            [x, y, z] => Ok(DVec3::new(x, y, z)),
            _ => Err(element.bad_value("value", value, "one or three numbers")),
        };
    }
    let component = |name| element.attribute(name).map_or(Ok(default), |value| number(element, name, value));
    Ok(DVec3::new(component("x")?, component("y")?, component("z")?))
}

/// A colour in linear RGB, given by `<rgb>`, `<srgb>`, `<float>` or `<integer>`. `#rrggbb` and the three
/// numbers of `<srgb>` are sRGB.
pub(super) fn colour(element: &Element) -> Result<DVec3, Error> {
    let value = element.required("value")?;
    let tag = element.tag.as_str();
    if let Some(digits) =
        value.trim().strip_prefix('#').filter(|_| matches!(tag, "rgb" | "srgb" | "spectrum"))
    {
        let code = u32::from_str_radix(digits, 16).ok().filter(|_| digits.len() == 6);
        let code =
            code.ok_or_else(|| element.bad_value("value", value, "#rrggbb with hexadecimal digits"))?;
        let [_, r, g, b] = code.to_be_bytes().map(|x| from_srgb(f64::from(x) / 255.0));
        return Ok(DVec3::new(r, g, b));
    }
    let linear = |c: DVec3| if tag == "srgb" { c.map(from_srgb) } else { c };
    match (tag, &numbers(element, "value", value)?[..]) {
        (_, &[grey]) => Ok(linear(DVec3::splat(grey))),
        ("rgb" | "srgb" | "spectrum", &[r, g, b]) => Ok(linear(DVec3::new(r, g, b))),
        ("rgb" | "srgb" | "spectrum", _) => Err(element.bad_value("value", value, "one or three numbers")),
        _ => Err(element.bad_value("value", value, "one number")),
    }
}
