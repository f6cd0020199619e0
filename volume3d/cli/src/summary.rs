//! What the commands say of their results.

use volume3d::Image;
use volume3d::gradient::{Contribution, Regions, Source};

/// What is said where the interior term is not the whole.
pub(super) const INTERIOR: &str = "WARNING: the interior term alone is biased where silhouettes, shadows or borders of \
    lights move, and under point and parallel lights all shadows stand still\n";

/// Warning that no sample saw the change.
pub(super) const NOTHING_SEEN: &str = "WARNING: no sample saw the image change. The derivative is 0, or what changes is too \
    small or too rare for so few samples; the stated error of 0 cannot tell. Try more --spp, and another --method\n";

/// The sum of all pixels by channel, and of all of them.
pub(super) fn totals(regions: &Regions) -> String {
    let Regions { total, total_error, sum_error, .. } = regions;
    let channel = |c: usize| format!("{:.4e} ± {:.1e}", total[c], total_error[c]);
    let (red, green, blue) = (channel(0), channel(1), channel(2));
    let sum = total.element_sum();
    format!("total: red {red}, green {green}, blue {blue}; together {sum:.4e} ± {sum_error:.1e}\n")
}

/// √ mean of squares over all pixels and channels.
pub(super) fn root_mean_square(image: &Image) -> f64 {
    let pixels = &image.pixels;
    (pixels.iter().map(|p| p.length_squared()).sum::<f64>() / (3 * pixels.len()) as f64).sqrt()
}

/// A warning of one sample that has a share of the sum of |gradient|.
pub(super) fn outlier(largest: Contribution, share: f64) -> String {
    let Contribution { column, row, sample, source, .. } = largest;
    let what = match source {
        Source::Path => "path",
        Source::Jump => "sample of a jump",
    };
    format!(
        "WARNING: one sample carries {:.1}% of the sum of |gradient|: {what} {sample} at column {column}, row {row}. Tails \
         are heavy, and errors larger than stated: try another --seed, more --spp, and another --method or --field: softened, for meshes\n",
        100.0 * share
    )
}
