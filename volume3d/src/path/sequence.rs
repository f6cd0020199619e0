//! Low-discrepancy samples: scrambled Sobol' points in independent pairs of dimensions.

use flatland::random::{Stream, stream};
use rand::Rng;

/// Random numbers of one sample. All samples of a cell use the same dimensions for the same purposes, and in
/// every pair of dimensions they are the first two of Sobol's sequence: a (0, 2)-net, of which any power of
/// two is stratified in all dyadic boxes.
///
/// Each pair is scrambled separately (Owen 1995; the hash of Laine and Karras 2011 in the form of Burley
/// 2020) and its samples are permuted, so that pairs are mutually independent. A final random digital shift
/// makes each single sample exactly uniform, whatever the quality of the hash: estimates are unbiased.
#[derive(Clone, Debug)]
pub(crate) struct Draws<'p> {
    /// Prepared pairs not drawn yet.
    prepared: &'p [Fixed],
    /// Bits of the sample's index, reversed.
    reversed: u32,
    /// Generator of the scrambles of further pairs.
    rng: Stream,
    /// State of the digital shifts of pairs, if they are shifted.
    shift: Option<u64>,
}

/// A pair of numbers as multiples of 2⁻⁵².
type Fixed = [u64; 2];

/// Random numbers without prepared pairs.
pub(crate) type Sequence = Draws<'static>;

impl Sequence {
    /// Sample `index` of the sequence with this address.
    pub(crate) fn new(seed: u64, address: &[u64], index: usize) -> Self {
        Self { prepared: &[], reversed: reversed(index), rng: stream(seed, address), shift: None }
    }
}

impl Draws<'_> {
    /// The points after a digital shift of every pair by random bits that depend only on `key`.
    ///
    /// Shifted points keep their stratification. Given the points, the shifts of two keys are independent,
    /// and each single one is uniform: means of any integrands over the samples of two keys are uncorrelated,
    /// whatever the common sequence.
    pub(crate) fn shifted(self, key: u64) -> Self {
        Self { shift: Some(key), ..self }
    }

    /// The next two dimensions.
    #[inline]
    pub(crate) fn pair(&mut self) -> [f64; 2] {
        let [x, y] = match self.prepared.split_first() {
            Some((&next, rest)) => {
                self.prepared = rest;
                next
            }
            None => self.made(),
        };
        let Some(state) = &mut self.shift else { return [unit(x), unit(y)] };
        *state = state.wrapping_add(GAMMA);
        let bits = mix(*state);
        // The digits of Sobol's points, which are the first 32.
        [unit(x ^ bits >> 32 << BELOW), unit(y ^ (bits & 0xFFFF_FFFF) << BELOW)]
    }

    fn made(&mut self) -> Fixed {
        Keys::draw(&mut self.rng).pair(self.reversed)
    }

    /// The next dimension.
    #[inline]
    pub(crate) fn one(&mut self) -> f64 {
        self.pair()[0]
    }
}

/// Prepared first pairs of a sequence's samples, for cells that share them.
#[derive(Clone, Debug)]
pub(crate) struct PreparedSequence {
    /// Pairs, sample by sample.
    pairs: Vec<Fixed>,
    depth: usize,
    rng: Stream,
}

impl PreparedSequence {
    /// Prepares `depth` pairs of each of `samples` samples of the sequence with this address.
    pub(crate) fn new(seed: u64, address: &[u64], samples: usize, depth: usize) -> Self {
        let mut rng = stream(seed, address);
        let keys: Vec<Keys> = (0..depth).map(|_| Keys::draw(&mut rng)).collect();
        let of_sample = |index| keys.iter().map(move |keys| keys.pair(reversed(index)));
        Self { pairs: (0..samples).flat_map(of_sample).collect(), depth, rng }
    }

    /// The numbers of [`Sequence::new`], bit for bit.
    #[inline]
    pub(crate) fn sample(&self, index: usize) -> Draws<'_> {
        let prepared = &self.pairs[index * self.depth..(index + 1) * self.depth];
        Draws { prepared, reversed: reversed(index), rng: self.rng.clone(), shift: None }
    }
}

fn reversed(index: usize) -> u32 {
    (index as u32).reverse_bits()
}

/// Keys of a pair's scramble, equal for all samples of a sequence.
#[derive(Clone, Copy)]
struct Keys([u64; 2]);

impl Keys {
    fn draw(rng: &mut Stream) -> Self {
        Self([rng.next_u64(), rng.next_u64()])
    }

    fn pair(self, reversed: u32) -> Fixed {
        let Self(keys) = self;
        let index = scramble(reversed, keys[0] as u32);
        // The first dimension is the index with its bits reversed.
        let x = scramble(index, (keys[0] >> 32) as u32) ^ (mix(keys[1]) >> 32) as u32;
        let y = scramble(second(index), keys[1] as u32) ^ mix(keys[0] ^ keys[1]) as u32;
        // Bits below the thirty-second are equal for all samples of a cell, which is harmless.
        [fixed(x, keys[1] >> 32), fixed(y, keys[0] >> 32)]
    }
}

/// Bits of a number after the thirty-second.
const BELOW: u32 = 20;

/// A number whose first 32 bits are x and whose last 20 are the bits of `fraction`.
fn fixed(x: u32, fraction: u64) -> u64 {
    u64::from(x) << BELOW | fraction & ((1 << BELOW) - 1)
}

/// Midpoint of the interval of length 2⁻⁵² that begins there, in (0, 1).
#[inline]
fn unit(fixed: u64) -> f64 {
    (fixed as f64 + 0.5) * f64::EPSILON
}

/// The second dimension of Sobol's sequence, with its bits reversed: bit j is the sum modulo 2 of the index's
/// bits k for which the binomial coefficient (k over j) is odd. By Lucas' theorem these are the k that
/// contain all bits of j, so that the sums can be computed one bit of k at a time.
fn second(mut index: u32) -> u32 {
    index ^= (index >> 1) & 0x5555_5555;
    index ^= (index >> 2) & 0x3333_3333;
    index ^= (index >> 4) & 0x0F0F_0F0F;
    index ^= (index >> 8) & 0x00FF_00FF;
    index ^ (index >> 16)
}

/// Nested uniform scramble of the bits of x, given in reverse order: each bit is flipped by a hash of the
/// bits above it.
fn scramble(mut x: u32, seed: u32) -> u32 {
    x ^= x.wrapping_mul(0x3D20_ADEA);
    x = x.wrapping_add(seed);
    x = x.wrapping_mul((seed >> 16) | 1);
    x ^= x.wrapping_mul(0x0552_6C56);
    x ^= x.wrapping_mul(0x53A2_2864);
    x.reverse_bits()
}

/// 2⁶⁴ over the golden ratio.
const GAMMA: u64 = 0x9E37_79B9_7F4A_7C15;

#[inline]
fn mix(word: u64) -> u64 {
    let mut z = word.wrapping_add(GAMMA);
    z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    z ^ (z >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Direction numbers are v₀ = 2³¹, v ← v ⊕ v/2.
    #[test]
    fn the_second_dimension_is_that_of_its_direction_numbers() {
        let by_definition = |index: u32| {
            let directions = std::iter::successors(Some(1_u32 << 31), |v| Some(v ^ (v >> 1)));
            (0..32).zip(directions).filter(|(k, _)| index >> k & 1 == 1).fold(0, |sum, (_, v)| sum ^ v)
        };
        for index in (0..40).chain([0xDEAD_BEEF, 0x1234_5678, u32::MAX]) {
            assert_eq!(second(index).reverse_bits(), by_definition(index), "{index}");
        }
    }

    /// Also for pairs after the prepared ones.
    #[test]
    fn prepared_pairs_are_those_that_are_drawn() {
        let prepared = PreparedSequence::new(3, &[1, 2], 5, 4);
        for index in 0..5 {
            let (mut ahead, mut drawn) = (prepared.sample(index), Sequence::new(3, &[1, 2], index));
            for _ in 0..7 {
                assert_eq!(ahead.pair(), drawn.pair());
            }
        }
    }

    #[test]
    fn powers_of_two_fill_all_dyadic_boxes() {
        for seed in 0..20 {
            for dimension in 0..3 {
                let points: Vec<[f64; 2]> = (0..64)
                    .map(|i| {
                        let mut s = Sequence::new(seed, &[3], i);
                        for _ in 0..dimension {
                            s.pair();
                        }
                        s.pair()
                    })
                    .collect();
                for log in 0..=6 {
                    let (columns, rows) = (1 << log, 64 >> log);
                    let mut count = [0; 64];
                    for [x, y] in &points {
                        let (i, j) = ((x * f64::from(columns)) as usize, (y * f64::from(rows)) as usize);
                        count[j * columns as usize + i] += 1;
                    }
                    assert_eq!(count, [1; 64], "{seed} {dimension} {log}");
                }
            }
        }
    }

    #[test]
    fn single_samples_are_uniform_and_pairs_independent() {
        let n = 200_000;
        let (mut means, mut products) = ([0.0; 4], [0.0; 2]);
        for seed in 0..n {
            let mut s = Sequence::new(seed, &[], 5);
            let ([a, b], [c, d]) = (s.pair(), s.pair());
            for (mean, x) in means.iter_mut().zip([a, b, c, d]) {
                *mean += (x - 0.5) / n as f64;
            }
            products[0] += (a - 0.5) * (b - 0.5) / n as f64;
            products[1] += (a - 0.5) * (c - 0.5) / n as f64;
        }
        // Standard deviations 0.29/√n and 0.083/√n.
        assert!(means.iter().all(|m| m.abs() < 5.0 * 0.29 / (n as f64).sqrt()), "{means:?}");
        assert!(products.iter().all(|p| p.abs() < 5.0 * 0.084 / (n as f64).sqrt()), "{products:?}");
    }
}
