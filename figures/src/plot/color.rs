//! Colours in sRGB and the palette shared by all figures.

use std::fmt;

/// A colour: sRGB-encoded red, green, blue and straight alpha, each in [0, 1].
#[derive(Clone, Copy, PartialEq)]
pub(crate) struct Color {
    /// Red, green, blue; sRGB-encoded.
    pub(crate) rgb: [f32; 3],
    /// Opacity.
    pub(crate) alpha: f32,
}

impl Color {
    /// White.
    pub(crate) const WHITE: Self = Self::hex(0xff_ff_ff);
    /// Text and emphasised lines: nearly black.
    pub(crate) const INK: Self = Self::hex(0x1c_20_26);
    /// Captions, tick labels, secondary text.
    pub(crate) const MUTED: Self = Self::hex(0x55_5d_68);
    /// Axis spines and outlines.
    pub(crate) const SPINE: Self = Self::hex(0x8a_92_9c);
    /// Grid lines and quiet frames.
    pub(crate) const GRID: Self = Self::hex(0xe5_e8_ec);
    /// Undefined values (NaN) in colour-mapped images.
    pub(crate) const UNDEFINED: Self = Self::hex(0xa0_a0_a0);

    /// The opaque colour 0xRRGGBB.
    #[must_use]
    pub(crate) const fn hex(rgb: u32) -> Self {
        Self {
            rgb: [
                ((rgb >> 16) & 0xff) as f32 / 255.0,
                ((rgb >> 8) & 0xff) as f32 / 255.0,
                (rgb & 0xff) as f32 / 255.0,
            ],
            alpha: 1.0,
        }
    }

    /// The opaque colour of an encoded triple; channels are clamped to [0, 1], NaN becomes 0.
    #[must_use]
    pub(crate) fn from_rgb(rgb: [f32; 3]) -> Self {
        Self {
            rgb: rgb.map(|channel| if channel.is_nan() { 0.0 } else { channel.clamp(0.0, 1.0) }),
            alpha: 1.0,
        }
    }

    /// The same colour at opacity `alpha`.
    #[must_use]
    pub(crate) const fn alpha(self, alpha: f32) -> Self {
        Self { alpha, ..self }
    }

    /// The way from `self` (t = 0) to `other` (t = 1), straight in encoded sRGB.
    #[must_use]
    pub(crate) fn mix(self, other: Self, t: f32) -> Self {
        let t = t.clamp(0.0, 1.0);
        let between = |a: f32, b: f32| a + (b - a) * t;
        Self {
            rgb: std::array::from_fn(|i| between(self.rgb[i], other.rgb[i])),
            alpha: between(self.alpha, other.alpha),
        }
    }

    /// A paler tint, for fills under lines of the colour itself.
    #[must_use]
    pub(crate) fn tint(self, amount: f32) -> Self {
        self.mix(Self::WHITE, amount)
    }

    /// The colour tiny-skia draws with.
    pub(super) fn to_skia(self) -> tiny_skia::Color {
        let [red, green, blue] = Self::from_rgb(self.rgb).rgb;
        let alpha = if self.alpha.is_nan() { 0.0 } else { self.alpha.clamp(0.0, 1.0) };
        tiny_skia::Color::from_rgba(red, green, blue, alpha).unwrap_or(tiny_skia::Color::TRANSPARENT)
    }
}

impl fmt::Debug for Color {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [red, green, blue] = self.rgb.map(|channel| (255.0 * channel).round() as u8);
        write!(formatter, "#{red:02x}{green:02x}{blue:02x}@{}", self.alpha)
    }
}

/// Categorical colours that stay apart for colour-blind readers and in grey print.
///
/// Okabe and Ito's "Color Universal Design" set, the yellow darkened so that thin lines of it show
/// on white.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Palette;

impl Palette {
    /// Blue.
    pub(crate) const BLUE: Color = Color::hex(0x00_72_b2);
    /// Vermilion.
    pub(crate) const VERMILION: Color = Color::hex(0xd5_5e_00);
    /// Bluish green.
    pub(crate) const GREEN: Color = Color::hex(0x00_9e_73);
    /// Reddish purple.
    pub(crate) const PURPLE: Color = Color::hex(0xb8_5c_94);
    /// Orange.
    pub(crate) const ORANGE: Color = Color::hex(0xe6_9f_00);
    /// Sky blue.
    pub(crate) const SKY: Color = Color::hex(0x56_b4_e9);
    /// Ochre, for Okabe and Ito's yellow.
    pub(crate) const OCHRE: Color = Color::hex(0xa8_8f_00);
    /// Dark grey, for references and ground truth.
    pub(crate) const GREY: Color = Color::hex(0x4a_4f_57);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hex_and_mix() {
        assert_eq!(Color::hex(0xff_00_80).rgb[0], 1.0);
        assert_eq!(Color::hex(0).mix(Color::WHITE, 0.5).rgb, [0.5; 3]);
        assert_eq!(Color::from_rgb([f32::NAN, 2.0, -1.0]).rgb, [0.0, 1.0, 0.0]);
    }
}
