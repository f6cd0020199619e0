//! The sample with the largest contribution to a gradient, which reveals heavy tails.

use crate::gradient::run::non_finite::NonFinite;

/// Kind of sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Source {
    /// A path from the camera.
    Path,
    /// A point of a discontinuity: of an edge, or of a curve on which interpolated normals are discontinuous.
    Jump,
}

/// A sample counts as an outlier if it has at least this fraction of Σ |gradient|
const OUTLIER_SHARE: f64 = 0.02;
/// and at least this multiple of the average contribution of one sample.
const OUTLIER_EXCESS: f64 = 256.0;

/// Contribution of one sample to a gradient.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contribution {
    /// Column of the sample's cell; −1 and the image width are the cells outside it.
    pub column: isize,
    /// Row of the cell.
    pub row: isize,
    /// Index of the sample within its cell or discontinuity.
    pub sample: usize,
    /// Number of samples in total; in reverse mode, of those that contribute.
    pub among: usize,
    /// Kind of sample.
    pub source: Source,
    /// Σ |·| over pixels and channels of the sample's part of the mean over samples; in reverse mode, over
    /// coordinates of positions.
    pub amount: f64,
}

impl Contribution {
    pub(in crate::gradient) fn new(at: NonFinite, source: Source, amount: f64) -> Self {
        let NonFinite { column, row, sample } = at;
        Self { column, row, sample, among: 0, source, amount }
    }

    /// Replaces `kept` by `other` if that is larger; equal ones keep the first.
    pub(in crate::gradient) fn keep_larger(kept: &mut Option<Self>, other: Option<Self>) {
        if let Some(other) = other
            && kept.is_none_or(|k| other.amount > k.amount)
        {
            *kept = Some(other);
        }
    }

    /// The larger of two, with `among` the sum of both.
    pub(in crate::gradient) fn merge(kept: &mut Option<Self>, other: Option<Self>) {
        let among = |one: Option<Self>| one.map_or(0, |c| c.among);
        let both = among(*kept) + among(other);
        Self::keep_larger(kept, other);
        if let Some(kept) = kept {
            kept.among = both;
        }
    }

    /// `self` if it is an outlier, given its share of the whole.
    pub(in crate::gradient) fn if_outlier(self, share: f64) -> Option<Self> {
        (share >= OUTLIER_SHARE && share * self.among as f64 >= OUTLIER_EXCESS).then_some(self)
    }
}
