//! Colours in sRGB and the palette shared by all figures.

/// A colour: sRGB-encoded red, green, blue and straight alpha, each in [0, 1].
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Color {
    pub(crate) rgb: [f32; 3],
    pub(crate) alpha: f32,
}

impl Color {
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
    pub(crate) const fn hex(rgb: u32) -> Self {
        let [_, red, green, blue] = rgb.to_be_bytes();
        Self { rgb: [red as f32 / 255.0, green as f32 / 255.0, blue as f32 / 255.0], alpha: 1.0 }
    }

    /// The opaque colour of an encoded triple; channels are clamped to [0, 1], NaN becomes 0.
    pub(crate) fn from_rgb(rgb: [f32; 3]) -> Self {
        Self { rgb: rgb.map(|c| if c.is_nan() { 0.0 } else { c.clamp(0.0, 1.0) }), alpha: 1.0 }
    }

    /// This colour at opacity `alpha`.
    pub(crate) const fn alpha(self, alpha: f32) -> Self {
        Self { alpha, ..self }
    }

    /// Linear interpolation from `self` (t = 0) to `other` (t = 1) in encoded sRGB.
    pub(crate) fn mix(self, other: Self, t: f32) -> Self {
        let t = t.clamp(0.0, 1.0);
        let between = |a: f32, b: f32| a + (b - a) * t;
        Self {
            rgb: std::array::from_fn(|i| between(self.rgb[i], other.rgb[i])),
            alpha: between(self.alpha, other.alpha),
        }
    }

    /// A paler tint, for fills under lines of the colour itself.
    pub(crate) fn tint(self, amount: f32) -> Self {
        self.mix(Self::WHITE, amount)
    }

    /// The colour in tiny-skia's type.
    pub(super) fn to_skia(self) -> tiny_skia::Color {
        let [red, green, blue] = Self::from_rgb(self.rgb).rgb;
        tiny_skia::Color::from_rgba(red, green, blue, self.alpha).unwrap_or(tiny_skia::Color::TRANSPARENT)
    }
}

/// Categorical colours that stay apart for colour-blind readers and in grey print.
///
/// Okabe and Ito's "Color Universal Design" set, the yellow darkened to an ochre so that thin lines of it
/// show on white, and a dark grey for references.
pub(crate) struct Palette;

impl Palette {
    pub(crate) const BLUE: Color = Color::hex(0x00_72_b2);
    pub(crate) const VERMILION: Color = Color::hex(0xd5_5e_00);
    pub(crate) const GREEN: Color = Color::hex(0x00_9e_73);
    pub(crate) const PURPLE: Color = Color::hex(0xb8_5c_94);
    pub(crate) const ORANGE: Color = Color::hex(0xe6_9f_00);
    pub(crate) const SKY: Color = Color::hex(0x56_b4_e9);
    pub(crate) const OCHRE: Color = Color::hex(0xa8_8f_00);
    pub(crate) const GREY: Color = Color::hex(0x4a_4f_57);
}
