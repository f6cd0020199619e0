//! Neyman's optimal allocation of samples to parts.

/// Number of parts: area, curves on the film, curves before lights seen from shading points, and curves
/// before everything else.
pub(super) const PARTS: usize = 4;

/// Samples of all parts, and the resulting variance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Split {
    pub(super) samples: [usize; PARTS],
    pub(super) variance: f64,
    /// Shares of the variance.
    pub(super) shares: [f64; PARTS],
}

/// Least standard deviation assumed for a part, relative to the noisiest part, if the pilot saw no noise in
/// it; if none has any, all are assumed equal.
const UNSEEN: f64 = 0.05;

/// The split with the least variance in a given time, for parts with these variances of one sample each. Each
/// part has at least one sample, the first at least a given number; a part of zero cost does not exist.
/// `unseen` is the fraction of a part's samples that may contribute if none did in the pilot; they then count
/// like those of the noisiest part.
pub(super) fn split(
    variances: [f64; PARTS],
    costs: [f64; PARTS],
    unseen: [f64; PARTS],
    time: f64,
    first: usize,
) -> Split {
    let largest = variances.iter().copied().fold(0.0, f64::max).sqrt();
    let floor = |i: usize| match variances[i] {
        _ if largest == 0.0 => 1.0,
        0.0 => UNSEEN.max(unseen[i].sqrt()) * largest,
        _ => UNSEEN * largest,
    };
    let deviations: [f64; PARTS] = std::array::from_fn(|i| variances[i].sqrt().max(floor(i)));
    let least = |i: usize| if i == 0 { first } else { 1 };
    let sum: f64 = (0..PARTS).map(|i| deviations[i] * costs[i].sqrt()).sum();
    let samples: [usize; PARTS] = std::array::from_fn(|i| {
        let best = if costs[i] > 0.0 { time * deviations[i] / (costs[i].sqrt() * sum) } else { 0.0 };
        (best.round() as usize).max(least(i))
    });
    // Unseen parts count as they do in the split.
    let counted =
        |i: usize| if costs[i] > 0.0 && largest > 0.0 { deviations[i].powi(2) } else { variances[i] };
    let by_part: [f64; PARTS] = std::array::from_fn(|i| counted(i) / samples[i] as f64);
    let variance: f64 = by_part.iter().sum();
    Split { samples, variance, shares: by_part.map(|v| if variance > 0.0 { v / variance } else { 0.0 }) }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Comparison with all splits of a small budget, and with the closed form (Σ σ √c)²/T.
    #[test]
    fn no_other_split_is_better() {
        let (variances, costs, time) = ([4.0, 9.0, 1.0, 0.0], [1.0, 4.0, 2.0, 0.0], 400.0);
        let none = [0.0; 4];
        let found = split(variances, costs, none, time, 2);
        let closed: f64 = (0..PARTS).map(|i| f64::sqrt(variances[i] * costs[i])).sum::<f64>().powi(2) / time;
        assert!((found.variance / closed - 1.0).abs() < 0.01, "{found:?} {closed}");
        let of = |n: [usize; PARTS]| -> f64 { (0..3).map(|i| variances[i] / n[i] as f64).sum() };
        for a in 1..400 {
            for b in 1..100 {
                let left = time - a as f64 - 4.0 * b as f64;
                if left >= 2.0 {
                    assert!(of([a, b, (left / 2.0) as usize, 1]) >= 0.99 * closed);
                }
            }
        }
        assert!((found.shares.iter().sum::<f64>() - 1.0).abs() < 1e-12);
    }

    /// Parts without noise in the pilot, nonexistent parts, and a budget too small for anything.
    #[test]
    fn every_part_has_samples() {
        let (few, many) = ([0.0; 4], [0.25; 4]);
        let unseen = split([1.0, 0.0, 0.0, 0.0], [1.0, 1.0, 0.0, 0.0], few, 100.0, 2);
        assert!(unseen.samples[1] > 2 && unseen.samples[2] == 1, "{unseen:?}");
        // The smaller the pilot, the larger an unseen part may be.
        let more = split([1.0, 0.0, 0.0, 0.0], [1.0, 1.0, 0.0, 0.0], many, 100.0, 2);
        assert!(more.samples[1] == 33 && more.variance > 2.0 * unseen.variance, "{more:?} {unseen:?}");
        assert_eq!(split([1.0; 4], [3.0; 4], few, 1.0, 5).samples, [5, 1, 1, 1]);
        let none = split([0.0; 4], [1.0; 4], few, 40.0, 2);
        assert_eq!((none.samples, none.variance), ([10; 4], 0.0));
    }
}
