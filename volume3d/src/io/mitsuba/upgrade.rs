//! Upgrades files of versions 0.x and 1.x to version 2, as Mitsuba 2 and 3 do.

use super::element::Element;
use super::values;
use crate::io::Error;

/// Renames elements: `lookAt`, the kinds of plugins before 0.4, and parameters in camelCase.
pub(super) fn names(element: &mut Element) {
    let tag = match element.tag.as_str() {
        "lookAt" => "lookat",
        "luminaire" => "emitter",
        "camera" => "sensor",
        // Numbers without wavelengths were linear RGB.
        "spectrum" if element.attribute("value").is_some_and(|value| !value.contains(':')) => "rgb",
        tag => tag,
    };
    element.tag = tag.to_owned();
    if element.tag == "default" {
        return;
    }
    for (attribute, value) in &mut element.attributes {
        match attribute.as_str() {
            "name" => *value = snake_case(value),
            "type" if element.tag == "texture" && matches!(value.as_str(), "ldrtexture" | "hdrtexture") => {
                "bitmap".clone_into(value);
            }
            _ => {}
        }
    }
}

/// Converts `toWorld` to `to_world`, `intIOR` to `int_ior`.
fn snake_case(name: &str) -> String {
    let mut result = String::with_capacity(name.len() + 4);
    let mut before = ' ';
    let mut in_capitals = false;
    for c in name.chars() {
        let begins = c.is_ascii_uppercase() && before.is_ascii_lowercase();
        in_capitals = begins || (in_capitals && c.is_ascii_uppercase());
        if begins {
            result.push('_');
        }
        result.push(if in_capitals { c.to_ascii_lowercase() } else { c });
        before = c;
    }
    result
}

/// Upgrades parameters: `diffuse_reflectance` of diffuse materials, and scales and offsets of textures, which
/// become a transform with the offset applied first, as in Mitsuba's upgrade.
pub(super) fn parameters(element: &mut Element) -> Result<(), Error> {
    if element.tag == "bsdf" && element.attribute("type") == Some("diffuse") {
        for child in &mut element.children {
            let name = child.attributes.iter_mut().find(|(name, _)| name == "name");
            if let Some((_, name)) = name.filter(|(_, name)| name == "diffuse_reflectance") {
                "reflectance".clone_into(name);
            }
        }
    }
    let mut take = |name: &str| {
        let at = element.children.iter().position(|c| c.tag == "float" && c.attribute("name") == Some(name));
        at.map(|at| element.children.remove(at))
            .map(|child| values::number(&child, "value", child.required("value")?))
            .transpose()
    };
    let [both, u, v] = [take("uvscale")?, take("uscale")?, take("vscale")?];
    let offsets = [take("uoffset")?, take("voffset")?];
    if [both, u, v].iter().chain(&offsets).any(Option::is_some) {
        let xy = |x: f64, y: f64| [("x", x.to_string()), ("y", y.to_string())];
        let mut transform = element.another("transform", &[("name", "to_uv".to_owned())]);
        let [x, y] = offsets.map(Option::unwrap_or_default);
        transform.children.push(element.another("translate", &xy(x, y)));
        let both = both.unwrap_or(1.0);
        let (x, y) = (u.unwrap_or(both), v.unwrap_or(both));
        transform.children.push(element.another("scale", &xy(x, y)));
        element.children.push(transform);
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    #[test]
    fn names_in_camel_case() {
        let cases = [
            ("toWorld", "to_world"),
            ("maxDepth", "max_depth"),
            ("intIOR", "int_ior"),
            ("fovAxis", "fov_axis"),
            ("diffuseReflectance", "diffuse_reflectance"),
            ("alpha", "alpha"),
            ("Kd", "Kd"),
            ("a1B", "a1B"),
        ];
        for (old, new) in cases {
            assert_eq!(super::snake_case(old), new);
        }
    }
}
