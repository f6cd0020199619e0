//! Normalised filter weights by a control variate: the image of a constant scene is constant.
//!
//! A pixel is the integral ∫ h L, estimated by M = Σ h L/n over n samples. The sum of the weights, H = Σ h/n,
//! is not one but has noise, which scales with the radiance. A control variate removes it. Divide the samples
//! into independent classes, and let c be an estimate of the radiance near the pixel from all classes but
//! one. With e the expectation of the sum H of that class,
//!
//! > S = M − (H − e) c
//!
//! has the expectation of M, as E(H − e) c = E(H − e) E c = 0: the image stays unbiased, unlike the ratio
//! M/H. If the radiance is constant, so is c, and S = e c exactly. To first order S is M e/H. Classes
//! contribute to one another's estimates and are therefore slightly correlated where radiance varies within a
//! pixel: the reported standard errors are a few per cent too small with two samples, and correct with many.

use super::filter::integral;
use crate::gradient::film::FilmPlane;
use crate::gradient::run::groups::{groups, parts};

/// Independent classes of samples.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::gradient) enum UnitWeights {
    /// No correction, or all weights are one.
    Untouched,
    /// The groups of samples.
    Groups,
    /// Cells of one parity of column and row, as there is one group only.
    Parities,
}

/// Weights of three neighbouring cells along an axis in the local radiance estimate of the middle one. Over
/// all nine cells, each parity has a weight of one quarter.
const NEARNESS: [f64; 3] = [0.25, 0.5, 0.25];

/// Number of parities of column and row.
const PARITIES: usize = 4;

/// A class's sums for a pixel: weights, then local radiance (RGB).
pub(in crate::gradient) type Level = [f64; 4];

impl UnitWeights {
    /// Classes for cells with separate random numbers.
    pub(in crate::gradient) fn of_own_numbers(film: &FilmPlane, samples: usize) -> Self {
        match Self::of_shared_numbers(film, samples) {
            Self::Untouched if !film.is_box() => Self::Parities,
            other => other,
        }
    }

    /// Classes for cells that share random numbers, where a single group has no independent counterpart.
    pub(in crate::gradient) fn of_shared_numbers(film: &FilmPlane, samples: usize) -> Self {
        if film.is_box() || groups(samples) < 2 { Self::Untouched } else { Self::Groups }
    }

    /// Number of classes.
    pub(in crate::gradient) fn classes(self, samples: usize) -> usize {
        match self {
            Self::Parities => PARITIES,
            Self::Untouched | Self::Groups => groups(samples),
        }
    }

    /// Class of a group's samples in a cell.
    #[inline]
    pub(in crate::gradient) fn class(self, cell: (usize, usize), group: usize) -> usize {
        match self {
            Self::Parities => parity(cell),
            Self::Untouched | Self::Groups => group,
        }
    }

    /// Whether there is an estimate of the light near a pixel.
    #[inline]
    pub(in crate::gradient) fn estimates(self) -> bool {
        self != Self::Untouched
    }

    /// Takes the noise of weights out of the sums of a pixel, of which the first three are its light, by
    /// class. `even` is, along columns and rows, the part of the pixel's filter that is over cells at even
    /// distances from its own. Returned are how many of them are left: one for each group.
    pub(in crate::gradient) fn correct<const K: usize>(
        self,
        samples: usize,
        (own_cell, even): ((usize, usize), [f64; 2]),
        sums: &mut [[f64; K]],
        levels: &[Level],
    ) -> usize {
        let even = match self {
            Self::Untouched => return sums.len(),
            Self::Groups => None,
            Self::Parities => Some(even),
        };
        let mut all = [0.0; 3];
        for [_, light @ ..] in levels {
            (0..3).for_each(|c| all[c] += light[c]);
        }
        let parts: Vec<f64> = parts(samples).collect();
        for (class, (sum, [weights, light @ ..])) in sums.iter_mut().zip(levels).enumerate() {
            // Expected sum of the class's weights, and the number of samples in the estimate.
            let (expected, others) = match even {
                None => {
                    let own = parts[class] * samples as f64;
                    (own, samples as f64 - own)
                }
                Some(even) => {
                    let beside = class ^ parity(own_cell);
                    let along = |axis: usize| match beside >> axis & 1 {
                        0 => even[axis],
                        _ => 1.0 - even[axis],
                    };
                    (along(0) * along(1), 1.0 - 1.0 / PARITIES as f64)
                }
            };
            for c in 0..3 {
                sum[c] -= (weights - expected) * ((all[c] - light[c]) / others);
            }
        }
        if even.is_none() {
            return sums.len();
        }
        if let Some((first, rest)) = sums.split_first_mut() {
            for sum in rest {
                first.iter_mut().zip(sum).for_each(|(first, own)| *first += *own);
            }
        }
        1
    }
}

/// The weight of a cell, at a distance of −1, 0 or 1 along an axis, in the estimate of the light near the
/// pixel x of n. Where no sample falls beside the film, the cell on the other side stands for the one that is
/// missing.
#[inline]
pub(in crate::gradient) fn nearness(film: &FilmPlane, axis: usize, x: usize, distance: isize) -> f64 {
    let weight = NEARNESS[(distance + 1) as usize];
    if !film.is_cut() {
        return weight;
    }
    let n = film.size()[axis];
    let is_missing = |distance: isize| x.checked_add_signed(distance).is_none_or(|cell| cell >= n);
    match distance {
        0 if n == 1 => 1.0,
        0 => weight,
        _ if is_missing(-distance) => 2.0 * weight,
        _ => weight,
    }
}

/// For every pixel along an axis, the part of its filter that is over cells at even distances from its own.
pub(in crate::gradient) fn even_parts(film: &FilmPlane, axis: usize) -> Vec<f64> {
    let (reach, n) = (film.reach, film.size()[axis]);
    let over: Vec<f64> =
        (0..=reach).map(|at| integral(film.filter(), at as f64 - 0.5, at as f64 + 0.5)).collect();
    let part = |x: usize| {
        let (before, behind) = if film.is_cut() { (x, n - 1 - x) } else { (reach, reach) };
        let cells = (1..=before.min(reach)).rev().chain(0..=behind.min(reach));
        let (mut even, mut all) = (0.0, 0.0);
        for distance in cells {
            all += over[distance];
            even += if distance % 2 == 0 { over[distance] } else { 0.0 };
        }
        if film.is_cut() { even / all } else { even }
    };
    (0..n).map(part).collect()
}

/// Whether column and row are odd, as bits.
fn parity((i, j): (usize, usize)) -> usize {
    i & 1 | (j & 1) << 1
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::gradient::tests::film;
    use crate::scene::{Camera, Description, Filter, Scene};

    /// Each parity of cells has one quarter of the estimate, and the expected weights sum to one.
    #[test]
    fn parities_share_a_filter() {
        for filter in
            [Filter::Tent { radius: 1.0 }, Filter::Tent { radius: 2.3 }, Filter::Gaussian { deviation: 0.5 }]
        {
            let camera = Camera::look_at(DVec3::Z, DVec3::ZERO, DVec3::Y, 0.8);
            let scene = Scene::new(Description::new(camera, film(5, filter))).unwrap();
            let film = FilmPlane::new(&scene);
            assert_eq!(UnitWeights::of_shared_numbers(&film, 1), UnitWeights::Untouched);
            assert_eq!(UnitWeights::of_own_numbers(&film, 2), UnitWeights::Groups);
            assert_eq!(UnitWeights::of_own_numbers(&film, 1), UnitWeights::Parities);
            let even = even_parts(&film, 0)[2];
            let reach = film.reach as i32;
            let odd: f64 = (-reach..=reach)
                .filter(|at| at % 2 != 0)
                .map(|at| integral(filter, f64::from(at) - 0.5, f64::from(at) + 0.5))
                .sum();
            assert!((even + odd - 1.0).abs() < 1e-13, "{filter:?} {even} {odd}");
        }
        let quarter: f64 =
            [0, 2].iter().flat_map(|&b| [0, 2].map(|a: usize| NEARNESS[a] * NEARNESS[b])).sum();
        assert_eq!(quarter, 1.0 / PARITIES as f64);
        assert_eq!(NEARNESS[1] * NEARNESS[1], 1.0 / PARITIES as f64);
    }
}
