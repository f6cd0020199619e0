//! Random streams addressed by their purpose, so that results depend only on the seed and never on the order
//! or the number of threads.

use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

/// The generator of all estimators.
pub type Stream = Xoshiro256PlusPlus;

/// The stream of `seed` that belongs to `address` (a pixel, a sample, a purpose).
///
/// Each word of the address is mixed in by the `SplitMix64` finaliser (Steele, Lea and Flood
/// 2014), so neighbouring pixels get unrelated streams.
#[must_use]
pub fn stream(seed: u64, address: &[u64]) -> Stream {
    let state = address.iter().fold(mix(seed), |state, &word| mix(state ^ mix(word)));
    Stream::seed_from_u64(state)
}

fn mix(word: u64) -> u64 {
    let mut z = word.wrapping_add(0x9E37_79B9_7F4A_7C15);
    z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    z ^ (z >> 31)
}

/// A uniform number in the open interval (0, 1): 2⁻⁵² (k + ½), never 0 or 1, so that its logarithm is finite.
#[expect(clippy::cast_precision_loss, reason = "53 bits fit a double exactly")]
pub fn open01(rng: &mut impl Rng) -> f64 {
    ((rng.next_u64() >> 12) as f64 + 0.5) * f64::EPSILON
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn streams_differ_and_repeat() {
        let first = |seed, address: &[u64]| open01(&mut stream(seed, address));
        assert_eq!(first(1, &[2, 3]).to_bits(), first(1, &[2, 3]).to_bits());
        assert_ne!(first(1, &[2, 3]).to_bits(), first(1, &[3, 2]).to_bits());
        assert_ne!(first(1, &[2, 3]).to_bits(), first(2, &[2, 3]).to_bits());
    }

    #[test]
    fn the_interval_is_open_at_both_ends() {
        struct Constant(u64);
        impl rand::TryRng for Constant {
            type Error = std::convert::Infallible;
            fn try_next_u32(&mut self) -> Result<u32, Self::Error> {
                Ok(self.0 as u32)
            }
            fn try_next_u64(&mut self) -> Result<u64, Self::Error> {
                Ok(self.0)
            }
            fn try_fill_bytes(&mut self, _: &mut [u8]) -> Result<(), Self::Error> {
                Ok(())
            }
        }
        assert!(open01(&mut Constant(0)) > 0.0);
        assert!(open01(&mut Constant(u64::MAX)) < 1.0);
    }

    #[test]
    fn open_interval_has_mean_one_half() {
        let mut rng = stream(7, &[]);
        let mean = (0..100_000).map(|_| open01(&mut rng)).sum::<f64>() / 1e5;
        assert!((mean - 0.5).abs() < 6.0 * (1.0_f64 / 12.0 / 1e5).sqrt());
    }
}
