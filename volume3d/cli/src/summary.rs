//! Messages of several commands about their results.

use volume3d::Image;
use volume3d::gradient::{Contribution, Regions, Source};

/// Warning about the interior term alone.
pub(super) const INTERIOR: &str = "WARNING: the interior term alone is biased where silhouettes, shadows or edges of \
    lights move; it also misses the motion of all shadows of point and parallel lights\n";

/// Warning that no sample saw the change.
pub(super) const NOTHING_SEEN: &str = "WARNING: no sample saw the image change. The derivative is 0, or the change is too \
    small or too rare for this number of samples; the stated error of 0 is then wrong. Try more --spp, and another \
    --method\n";

/// A line with the sum over pixels of each channel and of all channels.
pub(super) fn totals(regions: &Regions) -> String {
    let Regions { total, total_error, sum_error, .. } = regions;
    let channel = |c: usize| format!("{:.4e} ± {:.1e}", total[c], total_error[c]);
    let (red, green, blue) = (channel(0), channel(1), channel(2));
    let sum = total.element_sum();
    format!("total: red {red}, green {green}, blue {blue}; together {sum:.4e} ± {sum_error:.1e}\n")
}

/// Root mean square over all pixels and channels.
pub(super) fn root_mean_square(image: &Image) -> f64 {
    let pixels = &image.pixels;
    (pixels.iter().map(|p| p.length_squared()).sum::<f64>() / (3 * pixels.len()) as f64).sqrt()
}

/// A warning about one sample with a large share of the sum of |gradient|.
pub(super) fn outlier(largest: Contribution, share: f64) -> String {
    let Contribution { column, row, sample, source, .. } = largest;
    let what = match source {
        Source::Path => "path",
        Source::Jump => "edge sample",
    };
    format!(
        "WARNING: one sample carries {:.1}% of the sum of |gradient|: {what} {sample} at column {column}, row {row}. \
         Tails are heavy, and errors larger than stated: try another --seed, more --spp, another --method, or for \
         meshes --field softened\n",
        100.0 * share
    )
}
