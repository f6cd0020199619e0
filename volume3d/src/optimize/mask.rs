//! Masks and their degradation: dilation, erosion, holes.
//!
//! A mask states for every pixel whether the object is visible in it, row by row from the top. Studies of
//! [supervision by masks](super::MaskLoss) degrade good masks to measure the effect on the shape.

use flatland::random::stream;
use rand::RngExt as _;

/// Pixel adjacency.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Neighbourhood {
    /// The four pixels that share an edge: k steps reach |Δx| + |Δy| ≤ k, a diamond.
    Four,
    /// The eight pixels that share an edge or a corner: k steps reach max(|Δx|, |Δy|) ≤ k, a square.
    Eight,
}

/// Errors of mask operations.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MaskError {
    /// The number of pixels does not match the size.
    #[error("a mask of {width} x {height} pixels with {found} values")]
    Size {
        /// Columns.
        width: usize,
        /// Rows.
        height: usize,
        /// Values.
        found: usize,
    },
    /// A fraction is not in [0, 1].
    #[error("holes of the part {fraction} of a mask, which must be in [0, 1]")]
    Fraction {
        /// The fraction.
        fraction: f64,
    },
    /// The side of the holes is 0.
    #[error("holes with sides of 0 pixels")]
    NoSide,
}

/// Dilation by `steps` pixels: the mask of the pixels that are within this many steps of the object. `size`
/// is columns and rows.
///
/// # Errors
/// [`MaskError::Size`].
pub fn dilated(
    mask: &[bool],
    size: (usize, usize),
    steps: usize,
    neighbourhood: Neighbourhood,
) -> Result<Vec<bool>, MaskError> {
    check(mask, size)?;
    let mut mask = mask.to_vec();
    for _ in 0..steps {
        let larger: Vec<bool> =
            (0..mask.len()).map(|pixel| is_reached(&mask, size, pixel, neighbourhood)).collect();
        // Converged.
        if larger == mask {
            break;
        }
        mask = larger;
    }
    Ok(mask)
}

/// Erosion by `steps` pixels: the dilation of the background. Beyond the image's border is not background, so
/// that an object that reaches the border stays there.
///
/// # Errors
/// [`MaskError::Size`].
pub fn eroded(
    mask: &[bool],
    size: (usize, usize),
    steps: usize,
    neighbourhood: Neighbourhood,
) -> Result<Vec<bool>, MaskError> {
    let background: Vec<bool> = mask.iter().map(|seen| !seen).collect();
    let background = dilated(&background, size, steps, neighbourhood)?;
    Ok(background.into_iter().map(|seen| !seen).collect())
}

/// The mask with holes: a fraction of the object's pixels, rounded to whole ones, becomes background, in
/// squares of side `side` pixels around random pixels of the object. The last square stops at the required
/// number; squares may overlap, and cut into the outline. The background stays.
///
/// 5 % in squares as wide as a tenth of the object is a segmentation with local failures.
///
/// # Errors
/// [`MaskError`] if the size does not match, the fraction is not in [0, 1], or the side is 0.
pub fn with_holes(
    mask: &[bool],
    size: (usize, usize),
    fraction: f64,
    side: usize,
    seed: u64,
) -> Result<Vec<bool>, MaskError> {
    check(mask, size)?;
    if !(0.0..=1.0).contains(&fraction) {
        return Err(MaskError::Fraction { fraction });
    }
    if side == 0 {
        return Err(MaskError::NoSide);
    }
    let mut centres: Vec<usize> = (0..mask.len()).filter(|&pixel| mask[pixel]).collect();
    let mut left = (fraction * centres.len() as f64).round() as usize;
    let mut random = stream(seed, &[]);
    for last in (1..centres.len()).rev() {
        centres.swap(last, random.random_range(0..=last));
    }
    let mut holed = mask.to_vec();
    for centre in centres {
        if left == 0 {
            break;
        }
        if !holed[centre] {
            continue;
        }
        let range = |at: usize, count: usize| {
            let first = at.saturating_sub(side / 2);
            first..at.saturating_add(side - side / 2).min(count)
        };
        for y in range(centre / size.0, size.1) {
            for x in range(centre % size.0, size.0) {
                let pixel = &mut holed[y * size.0 + x];
                if *pixel && left > 0 {
                    (*pixel, left) = (false, left - 1);
                }
            }
        }
    }
    Ok(holed)
}

/// The indices of `count` random pixels of an image of `pixels` pixels, uniform and with replacement. Empty
/// for an image without pixels.
#[must_use]
pub fn random_pixels(pixels: usize, count: usize, seed: u64) -> Vec<usize> {
    let mut random = stream(seed, &[]);
    let count = if pixels == 0 { 0 } else { count };
    (0..count).map(|_| random.random_range(0..pixels)).collect()
}

fn check(mask: &[bool], (width, height): (usize, usize)) -> Result<(), MaskError> {
    let found = mask.len();
    let is_whole = width.checked_mul(height) == Some(found);
    if is_whole { Ok(()) } else { Err(MaskError::Size { width, height, found }) }
}

/// Whether a pixel or one of its neighbours belongs to the object.
fn is_reached(
    mask: &[bool],
    (width, height): (usize, usize),
    pixel: usize,
    neighbourhood: Neighbourhood,
) -> bool {
    let (x, y) = (pixel % width, pixel / width);
    let around = |at: usize, count: usize| at.saturating_sub(1)..(at + 2).min(count);
    let mut near = around(y, height).flat_map(|v| around(x, width).map(move |u| (u, v)));
    near.any(|(u, v)| {
        let counts = neighbourhood == Neighbourhood::Eight || u == x || v == y;
        counts && mask[v * width + u]
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: (usize, usize) = (13, 9);

    fn only(at: impl Fn(usize, usize) -> bool) -> Vec<bool> {
        (0..SIZE.0 * SIZE.1).map(|i| at(i % SIZE.0, i / SIZE.0)).collect()
    }

    #[test]
    fn a_pixel_grows_to_a_diamond_or_a_square() {
        let pixel = only(|x, y| (x, y) == (5, 3));
        for k in 0..20 {
            let diamond = only(|x, y| x.abs_diff(5) + y.abs_diff(3) <= k);
            let square = only(|x, y| x.abs_diff(5).max(y.abs_diff(3)) <= k);
            assert_eq!(dilated(&pixel, SIZE, k, Neighbourhood::Four), Ok(diamond));
            assert_eq!(dilated(&pixel, SIZE, k, Neighbourhood::Eight), Ok(square));
        }
        assert_eq!(dilated(&pixel, SIZE, usize::MAX, Neighbourhood::Four), Ok(vec![true; 117]));
    }

    #[test]
    fn erosion_takes_back_what_dilation_gave_and_leaves_the_border() {
        let block = only(|x, y| (4..9).contains(&x) && (3..6).contains(&y));
        let larger = dilated(&block, SIZE, 2, Neighbourhood::Eight).expect("a mask");
        assert_eq!(eroded(&larger, SIZE, 2, Neighbourhood::Eight), Ok(block));
        let half = only(|x, _| x < 6);
        assert_eq!(eroded(&half, SIZE, 2, Neighbourhood::Four), Ok(only(|x, _| x < 4)));
        assert_eq!(eroded(&[true; 117], SIZE, 50, Neighbourhood::Four), Ok(vec![true; 117]));
        assert_eq!(eroded(&half, SIZE, 50, Neighbourhood::Eight), Ok(vec![false; 117]));
    }

    #[test]
    fn holes_take_as_many_pixels_as_asked_for() {
        let block = only(|x, y| x < 10 && y > 1);
        let count = |mask: &[bool]| mask.iter().filter(|seen| **seen).count();
        for (fraction, side) in
            [(0.0, 1), (0.05, 1), (0.05, 3), (0.5, 2), (0.93, 4), (1.0, 1), (1.0, usize::MAX)]
        {
            let holed = with_holes(&block, SIZE, fraction, side, 3).expect("a mask");
            let taken = (fraction * count(&block) as f64).round() as usize;
            assert_eq!(count(&holed), count(&block) - taken, "{fraction} {side}");
            assert!(holed.iter().zip(&block).all(|(holed, whole)| *whole || !holed));
            assert_eq!(with_holes(&block, SIZE, fraction, side, 3), Ok(holed));
        }
        let holed = |seed| with_holes(&block, SIZE, 0.05, 2, seed).expect("a mask");
        assert!((0..9).any(|seed| holed(seed) != holed(9)));
        assert_eq!(with_holes(&[], (0, 4), 0.5, 2, 0), Ok(vec![]));
    }

    #[test]
    fn bad_masks_and_holes_are_refused() {
        let size = MaskError::Size { width: 3, height: 2, found: 5 };
        assert_eq!(dilated(&[true; 5], (3, 2), 1, Neighbourhood::Four), Err(size.clone()));
        assert_eq!(eroded(&[true; 5], (3, 2), 1, Neighbourhood::Four), Err(size.clone()));
        assert_eq!(with_holes(&[true; 5], (3, 2), 0.1, 1, 0), Err(size));
        assert!(dilated(&[], (usize::MAX, 2), 1, Neighbourhood::Four).is_err());
        assert_eq!(with_holes(&[true; 6], (3, 2), 0.1, 0, 0), Err(MaskError::NoSide));
        for fraction in [-0.1, 1.1, f64::NAN] {
            let refused = with_holes(&[true; 6], (3, 2), fraction, 1, 0);
            assert!(matches!(refused, Err(MaskError::Fraction { .. })));
        }
    }

    #[test]
    fn random_pixels_are_all_as_likely() {
        let drawn = random_pixels(10, 10_000, 4);
        for pixel in 0..10 {
            let count = drawn.iter().filter(|drawn| **drawn == pixel).count() as f64;
            // Six standard deviations of a binomial count.
            assert!((count - 1000.0).abs() < 6.0 * 900_f64.sqrt(), "{pixel}: {count}");
        }
        assert_eq!(drawn, random_pixels(10, 10_000, 4));
        assert!(random_pixels(0, 5, 1).is_empty());
    }
}
