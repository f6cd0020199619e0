//! Colour maps from scalar fields to pictures.

use super::{
    color::Color,
    raster::Raster,
    scale::{Kind, Scale},
};

/// Viridis (Smith and van der Walt, matplotlib, CC0) at 33 equidistant points: perceptually uniform.
const VIRIDIS: [u32; 33] = [
    0x440154, 0x470d60, 0x48186a, 0x482374, 0x472d7b, 0x453781, 0x424086, 0x3e4989, 0x3b528b, 0x375b8d,
    0x33638d, 0x2f6b8e, 0x2c728e, 0x297a8e, 0x26828e, 0x23898e, 0x21918c, 0x1f988b, 0x1fa088, 0x22a785,
    0x28ae80, 0x32b67a, 0x3fbc73, 0x4ec36b, 0x5ec962, 0x70cf57, 0x84d44b, 0x98d83e, 0xaddc30, 0xc2df23,
    0xd8e219, 0xece51b, 0xfde725,
];

// The two arms of the signed map. Both fall through the same Oklab lightnesses, from 1 at zero to 0.31
// at the ends, so that equal magnitudes look equally strong whatever their sign.
const NEGATIVE: [u32; 17] = [
    0xffffff, 0xe6f3ff, 0xcce6ff, 0xb3d9ff, 0x99ccff, 0x80beff, 0x65b0ff, 0x4aa1fe, 0x3892f4, 0x2983e8,
    0x1d75db, 0x1467cb, 0x0f5ab9, 0x0e4da6, 0x0e4192, 0x0f367c, 0x0e2c66,
];
const POSITIVE: [u32; 17] = [
    0xffffff, 0xffece5, 0xffd9cb, 0xffc6b1, 0xffb196, 0xff9a7a, 0xf98765, 0xf07453, 0xe56244, 0xd85237,
    0xc9422c, 0xb93424, 0xa8281e, 0x961e1a, 0x831717, 0x6f1115, 0x5b0e12,
];

fn along(stops: &[u32], t: f64) -> Color {
    let place = t.clamp(0.0, 1.0) * (stops.len() - 1) as f64;
    let index = (place as usize).min(stops.len() - 2);
    Color::hex(stops[index]).mix(Color::hex(stops[index + 1]), (place - index as f64) as f32)
}

/// A colour map over a range of values.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Shading {
    /// Whether the map runs from blue through white to red, or else from dark violet to yellow.
    signed: bool,
    pub(crate) scale: Scale,
}

impl Shading {
    /// Magnitudes from `low` to `high`.
    pub(crate) fn sequential(low: f64, high: f64) -> Self {
        Self { signed: false, scale: Scale::new(Kind::Linear, low, high) }
    }

    /// Positive magnitudes from `low` to `high` by their logarithm; other values take the lowest colour.
    pub(crate) fn log(low: f64, high: f64) -> Self {
        Self { signed: false, scale: Scale::new(Kind::Log, low, high) }
    }

    /// Signed values from −`limit` to `limit`, white at zero.
    pub(crate) fn signed(limit: f64) -> Self {
        let limit = if limit.is_finite() && limit != 0.0 { limit.abs() } else { 1.0 };
        Self { signed: true, scale: Scale::new(Kind::Linear, -limit, limit) }
    }

    /// Signed values, the limit being the `quantile` (0.99 for noisy gradients, 1 for exact ones) of the
    /// finite non-zero magnitudes, so that a few outliers do not wash out the picture.
    pub(crate) fn signed_covering<'a>(values: impl IntoIterator<Item = &'a f64>, quantile: f64) -> Self {
        let mut magnitudes: Vec<f64> =
            values.into_iter().map(|value| value.abs()).filter(|m| m.is_finite() && *m > 0.0).collect();
        magnitudes.sort_by(f64::total_cmp);
        let last = magnitudes.len().saturating_sub(1);
        let index = (quantile.clamp(0.0, 1.0) * last as f64).round() as usize;
        Self::signed(magnitudes.get(index).copied().unwrap_or(1.0))
    }

    /// The colour of a value; grey for NaN.
    pub(crate) fn color(&self, value: f64) -> Color {
        if value.is_nan() {
            return Color::UNDEFINED;
        }
        let clamped = value.clamp(self.scale.low(), self.scale.high());
        let t = self.scale.position(clamped).unwrap_or(0.0);
        match self.signed {
            false => along(&VIRIDIS, t),
            true if t < 0.5 => along(&NEGATIVE, 1.0 - 2.0 * t),
            true => along(&POSITIVE, 2.0 * t - 1.0),
        }
    }

    /// The picture of a field of `width` columns given row by row.
    pub(crate) fn raster(&self, width: usize, values: &[f64]) -> Raster {
        self.placed(Raster::new(width, values.iter().map(|value| self.color(*value).rgb).collect()))
    }

    /// A picture in these colours: signed ones contain white, which becomes dark on dark pages.
    pub(super) fn placed(&self, raster: Raster) -> Raster {
        if self.signed { raster } else { raster.kept() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Oklab lightness (Ottosson 2020) of an sRGB colour.
    fn lightness(color: Color) -> f64 {
        let linear = |c: f32| {
            let c = f64::from(c);
            if c <= 0.04045 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) }
        };
        let [r, g, b] = color.rgb.map(linear);
        let l = (0.4122214708 * r + 0.5363325363 * g + 0.0514459929 * b).cbrt();
        let m = (0.2119034982 * r + 0.6806995451 * g + 0.1073969566 * b).cbrt();
        let s = (0.0883024619 * r + 0.2817188376 * g + 0.6299787005 * b).cbrt();
        0.2104542553 * l + 0.7936177850 * m - 0.0040720468 * s
    }

    #[test]
    fn signed_map_is_symmetric_around_white() {
        let shading = Shading::signed(3.0);
        assert_eq!(shading.color(0.0), Color::WHITE);
        for step in 0..=100 {
            let value = 0.03 * f64::from(step);
            let (minus, plus) = (lightness(shading.color(-value)), lightness(shading.color(value)));
            assert!((minus - plus).abs() < 0.01, "value {value}: lightness {minus} and {plus}");
        }
    }
}
