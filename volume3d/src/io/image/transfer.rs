//! Transfer functions of integer images.

use super::from_srgb;
use crate::io::ImageProblem;

/// Transfer function of a picture's integers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Encoding {
    /// As declared by the file: for a PNG its chunks cICP, sRGB, iCCP (taken as sRGB) and gAMA, in this
    /// order, otherwise sRGB.
    #[default]
    File,
    /// sRGB, whatever the file declares.
    Srgb,
    /// Linear, whatever the file declares.
    Linear,
}

/// Transfer function from [0, 1] to linear values.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Transfer {
    Srgb,
    Power(f64),
}

impl Transfer {
    pub(super) const LINEAR: Self = Self::Power(1.0);

    pub(super) fn of(encoding: Encoding, bytes: &[u8]) -> Result<Self, ImageProblem> {
        match encoding {
            Encoding::File => Ok(of_png(bytes)?.unwrap_or(Self::Srgb)),
            Encoding::Srgb => Ok(Self::Srgb),
            Encoding::Linear => Ok(Self::LINEAR),
        }
    }

    pub(super) fn linear(self, x: f64) -> f64 {
        match self {
            Self::Srgb => from_srgb(x),
            Self::Power(1.0) => x,
            Self::Power(exponent) => x.powf(exponent),
        }
    }
}

/// The transfer function declared by the chunks before the pixels of a PNG (PNG, third edition, 4.3); `None`
/// for other files.
fn of_png(bytes: &[u8]) -> Result<Option<Transfer>, ImageProblem> {
    let Some(mut rest) = bytes.strip_prefix(b"\x89PNG\r\n\x1a\n") else { return Ok(None) };
    let (mut gamma, mut profile) = (None, false);
    while let Some((head, after)) = rest.split_first_chunk::<8>() {
        let length = u32::from_be_bytes([head[0], head[1], head[2], head[3]]) as usize;
        let Some((data, after)) = after.split_at_checked(length) else { break };
        match (&head[4..], data) {
            (b"IDAT", _) => break,
            (b"cICP", &[primaries, transfer, ..]) => {
                return match (primaries, transfer) {
                    (1 | 2, 13) => Ok(Some(Transfer::Srgb)),
                    (1 | 2, 8) => Ok(Some(Transfer::LINEAR)),
                    _ => Err(ImageProblem::Colours { primaries, transfer }),
                };
            }
            (b"sRGB" | b"iCCP", _) => profile = true,
            (b"gAMA", &[a, b, c, d]) => {
                let value = u32::from_be_bytes([a, b, c, d]);
                gamma = (value > 0).then(|| Transfer::Power(100_000.0 / f64::from(value)));
            }
            _ => {}
        }
        // Skips the checksum.
        rest = after.get(4..).unwrap_or_default();
    }
    Ok(if profile { Some(Transfer::Srgb) } else { gamma })
}

/// The covered pixels of a mask: above half of the range, or above 0 if it has the integers 0 and 1 only.
#[must_use]
pub fn covered(mask: &crate::Image) -> Vec<bool> {
    // The integer 1 of 8 bits.
    const ONE: f64 = 1.0 / 255.0;
    let mean = |p: &glam::DVec3| p.element_sum() / 3.0;
    let largest = mask.pixels.iter().map(mean).fold(0.0, f64::max);
    let limit = if largest <= ONE * (1.0 + 1e-6) { 0.5 * largest } else { 0.5 };
    mask.pixels.iter().map(|p| mean(p) > limit).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Image;
    use glam::DVec3;

    fn png(chunks: &[(&[u8], &[u8])]) -> Vec<u8> {
        let mut bytes = b"\x89PNG\r\n\x1a\n".to_vec();
        for (name, data) in chunks {
            bytes.extend((data.len() as u32).to_be_bytes());
            bytes.extend(*name);
            bytes.extend(*data);
            bytes.extend([0; 4]);
        }
        bytes
    }

    #[test]
    fn chunks_say_what_integers_mean() {
        let said = |chunks: &[(&[u8], &[u8])]| Transfer::of(Encoding::File, &png(chunks)).unwrap();
        let gamma = |value: u32| value.to_be_bytes();
        let end: (&[u8], &[u8]) = (b"IDAT", &[]);
        assert_eq!(said(&[end]), Transfer::Srgb);
        assert_eq!(said(&[(b"IHDR", &[0; 13]), (b"gAMA", &gamma(100_000)), end]), Transfer::LINEAR);
        assert_eq!(said(&[(b"gAMA", &gamma(50_000)), end]), Transfer::Power(2.0));
        assert_eq!(said(&[(b"gAMA", &gamma(100_000)), (b"sRGB", &[0]), end]), Transfer::Srgb);
        assert_eq!(said(&[(b"sRGB", &[0]), (b"cICP", &[1, 8, 0, 1]), end]), Transfer::LINEAR);
        assert_eq!(said(&[end, (b"gAMA", &gamma(100_000))]), Transfer::Srgb);
        assert_eq!(said(&[(b"gAMA", &gamma(0)), end]), Transfer::Srgb);
        let error = Transfer::of(Encoding::File, &png(&[(b"cICP", &[9, 16, 0, 1]), end])).unwrap_err();
        assert!(error.to_string().contains("colour primaries 9"), "{error}");
        let bytes = png(&[(b"gAMA", &gamma(50_000)), end]);
        assert_eq!(Transfer::of(Encoding::Linear, &bytes).unwrap(), Transfer::LINEAR);
        assert_eq!(Transfer::of(Encoding::Srgb, &bytes).unwrap(), Transfer::Srgb);
        assert_eq!(Transfer::Power(2.0).linear(0.5), 0.25);
    }

    #[test]
    fn masks_of_zero_and_one_are_masks() {
        let of = |values: &[f64]| {
            let pixels = values.iter().map(|x| DVec3::splat(*x / 255.0)).collect();
            covered(&Image { width: values.len(), height: 1, pixels })
        };
        assert_eq!(of(&[0.0, 1.0, 0.0]), [false, true, false]);
        assert_eq!(of(&[0.0, 255.0, 1.0, 100.0, 128.0]), [false, true, false, false, true]);
        assert_eq!(of(&[0.0, 0.0]), [false, false]);
    }
}
