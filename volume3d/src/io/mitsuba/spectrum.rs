//! Conversion of spectra to linear sRGB.
//!
//! The integrals ∫ s(λ) x̄(λ) dλ and so on, with the observer of 1931, are converted to linear sRGB (ITU-R
//! BT.709 primaries, D65). Light transport uses these three numbers, an approximation wherever two spectra
//! are multiplied: that of a lamp by that of a wall, or η and k in Fresnel's formulas.

use glam::{DMat3, DVec3};

use super::cie::{D65, FIRST, LAST, OBSERVER};
use super::element::Element;
use super::values::{self, number, numbers};
use crate::io::Error;

/// Constant texture plugins, which are read as spectra.
pub(super) const CONSTANT: [&str; 7] =
    ["uniform", "d65", "srgb", "rawconstant", "blackbody", "regular", "irregular"];

/// The quantity of a spectrum, which determines its conversion.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Meaning {
    /// Seen under D65, so that 1 at all wavelengths is white; within [0, 1].
    Reflectance,
    /// η and k: as reflectance, but unbounded.
    Index,
    /// Power by wavelength: 1 at all wavelengths is equal-energy white, of luminance 1.
    Emission,
}

/// A spectrum converted to a colour.
pub(super) struct Colour {
    pub(super) rgb: DVec3,
    /// The kind of conversion, if it is an approximation.
    pub(super) approximation: Option<&'static str>,
}

const CONVERTED: &str = ", by the CIE observer of 1931";
const CLAMPED: &str = ", by the CIE observer of 1931, and clamped to the colours there are in sRGB";

/// From XYZ to linear sRGB (ITU-R BT.709-6), column by column.
const TO_SRGB: DMat3 = DMat3::from_cols_array(&[
    3.240_479, -0.969_256, 0.055_648, -1.537_150, 1.875_991, -0.204_043, -0.498_535, 0.041_556, 1.057_311,
]);

/// The colour of a `<spectrum>` or `<blackbody>`: one number, pairs of wavelength and value, or a plugin.
pub(super) fn colour(element: &Element, meaning: Meaning) -> Result<Colour, Error> {
    let exact = |rgb| Ok(Colour { rgb, approximation: None });
    if element.tag == "blackbody" {
        element.check_attributes(&["name", "temperature", "scale"])?;
        let text = element.required("temperature")?;
        let temperature = number(element, "temperature", text.trim().trim_end_matches(['K', 'k']))?;
        let scale = element.attribute("scale").map_or(Ok(1.0), |scale| number(element, "scale", scale))?;
        return black_body(element, temperature, scale);
    }
    if let Some(plugin) = element.attribute("type") {
        element.check_attributes(&["name", "type", "id"])?;
        let float = |name: &str, default: Option<f64>| match (element.value_of(name), default) {
            (Some(value), _) => number(element, name, value),
            (None, Some(default)) => Ok(default),
            (None, None) => Err(element.bad_value(name, "", "a finite number")),
        };
        let list = |name: &str| numbers(element, name, element.value_of(name).unwrap_or_default());
        return match plugin {
            "uniform" => exact(DVec3::splat(float("value", Some(1.0))?)),
            // D65 is the white of sRGB.
            "d65" => exact(DVec3::splat(float("scale", Some(1.0))?)),
            "rawconstant" => {
                let child = element.children.iter().find(|c| c.attribute("name") == Some("value"));
                let value = child.map(|child| match child.tag.as_str() {
                    "vector" | "point" => values::vector(child, 0.0),
                    _ => values::colour(child),
                });
                exact(value.ok_or_else(|| element.bad_value("value", "", "a number or three"))??)
            }
            "srgb" => {
                let child = element.children.iter().find(|c| c.attribute("name") == Some("color"));
                exact(child.map_or(Ok(DVec3::ONE), values::colour)?)
            }
            "blackbody" => black_body(element, float("temperature", None)?, float("scale", Some(1.0))?),
            "regular" => {
                let (first, last) = (float("wavelength_min", None)?, float("wavelength_max", None)?);
                let values = list("values")?;
                let step = (last - first) / (values.len().max(2) - 1) as f64;
                let pair = |(i, value)| (first + i as f64 * step, value);
                convert(element, &values.into_iter().enumerate().map(pair).collect::<Vec<_>>(), meaning)
            }
            "irregular" => {
                let (wavelengths, values) = (list("wavelengths")?, list("values")?);
                if wavelengths.len() != values.len() {
                    let expected = "as many values as wavelengths";
                    return Err(element.bad_value("values", &values.len().to_string(), expected));
                }
                convert(element, &wavelengths.into_iter().zip(values).collect::<Vec<_>>(), meaning)
            }
            _ => Err(element.unsupported(
                format!("spectrum \"{plugin}\""),
                "supported: uniform, d65, srgb, rawconstant, blackbody, regular, irregular",
            )),
        };
    }
    element.check_attributes(&["name", "value", "filename"])?;
    let value = element.required("value")?;
    if !value.contains(':') {
        let rgb = values::colour(element)?;
        let is_grey = rgb == DVec3::splat(rgb.x) && !value.contains('#');
        return match meaning {
            Meaning::Emission if is_grey => convert(element, &[(FIRST, rgb.x), (LAST, rgb.x)], meaning),
            _ => exact(rgb),
        };
    }
    let pair = |word: &str| {
        let (wavelength, value) =
            word.split_once(':').ok_or_else(|| element.bad_value("value", word, "wavelength:value"))?;
        Ok((number(element, "wavelength", wavelength)?, number(element, "value", value)?))
    };
    convert(element, &values::words(value).map(pair).collect::<Result<Vec<_>, Error>>()?, meaning)
}

/// Integration step in nanometres.
const STEP: f64 = 1.0;

/// The colour of a spectrum that is linear between its wavelengths, and 0 outside.
fn convert(element: &Element, pairs: &[(f64, f64)], meaning: Meaning) -> Result<Colour, Error> {
    let rises = pairs.windows(2).all(|w| w[0].0 < w[1].0);
    if pairs.len() < 2 || !rises {
        return Err(element.bad_value("wavelengths", "", "two or more, each greater than the one before"));
    }
    let spectrum = |wavelength: f64| {
        let after = pairs.partition_point(|(w, _)| *w <= wavelength).clamp(1, pairs.len() - 1);
        let ((w0, v0), (w1, v1)) = (pairs[after - 1], pairs[after]);
        let is_inside = wavelength >= pairs[0].0 && wavelength <= pairs[pairs.len() - 1].0;
        if is_inside { v0 + (v1 - v0) * (wavelength - w0) / (w1 - w0) } else { 0.0 }
    };
    let rgb = TO_SRGB * integrate(spectrum, meaning);
    if !rgb.is_finite() {
        return Err(element.bad_value("value", &rgb.to_string(), "numbers that do not overflow"));
    }
    let most = if meaning == Meaning::Reflectance { 1.0 } else { f64::INFINITY };
    let clamped = rgb.clamp(DVec3::ZERO, DVec3::splat(most));
    let approximation = Some(if clamped == rgb { CONVERTED } else { CLAMPED });
    Ok(Colour { rgb: clamped, approximation })
}

/// XYZ of a spectrum, with Y = 1 for one that is 1 at all wavelengths.
fn integrate(spectrum: impl Fn(f64) -> f64, meaning: Meaning) -> DVec3 {
    let (mut sum, mut white) = (DVec3::ZERO, 0.0);
    let count = ((LAST - FIRST) / STEP) as usize;
    for i in 0..=count {
        let wavelength = FIRST + i as f64 * STEP;
        let light = if meaning == Meaning::Emission { 1.0 } else { lerp(&D65, wavelength, |x| *x) };
        let observer = lerp(&OBSERVER, wavelength, |row| DVec3::from_array(*row));
        sum += observer * (light * spectrum(wavelength));
        white += observer.y * light;
    }
    sum / white
}

/// A table from [`FIRST`] to [`LAST`], linear between its rows.
fn lerp<T, V>(table: &[T], wavelength: f64, value: impl Fn(&T) -> V) -> V
where
    V: std::ops::Mul<f64, Output = V> + std::ops::Add<Output = V>,
{
    let at = (wavelength - FIRST) / (LAST - FIRST) * (table.len() - 1) as f64;
    let below = (at as usize).min(table.len() - 2);
    let part = at - below as f64;
    value(&table[below]) * (1.0 - part) + value(&table[below + 1]) * part
}

/// Planck's radiance in W m⁻² sr⁻¹ nm⁻¹.
fn black_body(element: &Element, temperature: f64, scale: f64) -> Result<Colour, Error> {
    // Planck's constant, the speed of light and Boltzmann's constant in SI units (2019).
    const H: f64 = 6.626_070_15e-34;
    const C: f64 = 299_792_458.0;
    const K: f64 = 1.380_649e-23;
    if temperature <= 0.0 {
        return Err(element.bad_value("temperature", &temperature.to_string(), "a number greater than 0"));
    }
    let planck = |nanometres: f64| {
        let w = nanometres * 1e-9;
        1e-9 * 2.0 * H * C * C / w.powi(5) / (H * C / (w * K * temperature)).exp_m1()
    };
    let rgb = TO_SRGB * integrate(planck, Meaning::Emission) * scale;
    Ok(Colour { rgb: rgb.max(DVec3::ZERO), approximation: Some(CONVERTED) })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A white surface is white, and equal energy has the colour that its chromaticity (1/3, 1/3) has in
    /// sRGB.
    #[test]
    fn whites() {
        let white = TO_SRGB * integrate(|_| 1.0, Meaning::Reflectance);
        assert!((white - DVec3::ONE).abs().max_element() < 1e-3, "{white}");
        let energy = TO_SRGB * integrate(|_| 1.0, Meaning::Emission);
        let expected = TO_SRGB * DVec3::ONE;
        assert!((energy - expected).abs().max_element() < 1e-3, "{energy} {expected}");
    }

    /// CIE 1931 chromaticity of black bodies: 0.3451, 0.3516 at 5000 K, and 0.4476, 0.4074 at 2856 K,
    /// illuminant A.
    #[test]
    fn black_bodies() {
        let file = std::sync::Arc::from(std::path::Path::new("s.xml"));
        let element = Element::new("blackbody", &file, (1, 1));
        for (temperature, x, y) in [(5000.0, 0.3451, 0.3516), (2856.0, 0.4476, 0.4074)] {
            let colour = black_body(&element, temperature, 1.0).unwrap();
            let xyz = TO_SRGB.inverse() * colour.rgb;
            let sum = xyz.element_sum();
            assert!((xyz.x / sum - x).abs() < 1e-3 && (xyz.y / sum - y).abs() < 1e-3, "{}", xyz / sum);
        }
    }
}
