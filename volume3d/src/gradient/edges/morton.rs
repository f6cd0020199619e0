//! Space-filling curve in the scene's bounding box (Morton 1966).

use glam::DVec3;

use crate::scene::Scene;

/// Positions along the curve.
pub(super) struct Curve {
    low: DVec3,
    scale: DVec3,
}

/// Bits per coordinate.
const BITS: u32 = 20;

impl Curve {
    pub(super) fn new(scene: &Scene) -> Self {
        let (low, high) = scene.bounds().unwrap_or_default();
        let cells = f64::from((1_u32 << BITS) - 1);
        Self { low, scale: cells / (high - low).max(DVec3::splat(f64::MIN_POSITIVE)) }
    }

    pub(super) fn at(&self, p: DVec3) -> u64 {
        let [x, y, z] = ((p - self.low) * self.scale).to_array().map(|x| apart(x as u64));
        x | y << 1 | z << 2
    }
}

/// Spreads the lowest 20 bits, with two zero bits between neighbours.
fn apart(mut bits: u64) -> u64 {
    bits &= (1 << BITS) - 1;
    for (shift, kept) in [
        (32, 0x001f_0000_0000_ffff),
        (16, 0x001f_0000_ff00_00ff),
        (8, 0x100f_00f0_0f00_f00f),
        (4, 0x10c3_0c30_c30c_30c3),
        (2, 0x1249_2492_4924_9249),
    ] {
        bits = (bits | bits << shift) & kept;
    }
    bits
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bits_are_put_apart_one_by_one() {
        for bits in [0, 1, 0b1011, 0xf_ffff, 0x9_3a7c] {
            let expected: u64 = (0..BITS).map(|k| (bits >> k & 1) << (3 * k)).sum();
            assert_eq!(apart(bits), expected, "{bits:x}");
        }
    }
}
