//! The sample that contributes most to a gradient: heavy tails are seen while they are drawn.

use super::non_finite::NonFinite;

/// What a sample was drawn of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Source {
    /// A path from the camera.
    Path,
    /// A point of a jump: of an edge, or of a curve on which interpolated normals make light jump.
    Jump,
}

/// A sample with at least this part of Σ |gradient| counts as an outlier,
const OUTLIER_SHARE: f64 = 0.02;
/// if it has at least so many times the part of one sample of as many that are alike.
const OUTLIER_EXCESS: f64 = 256.0;

/// What one sample contributes to a gradient.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contribution {
    /// The column of its cell in the image; −1 and the width are beside it.
    pub column: isize,
    /// The cell's row.
    pub row: isize,
    /// The sample's number, among those of its cell or its jump.
    pub sample: usize,
    /// How many samples there are in all; in reverse mode, how many contribute anything.
    pub among: usize,
    /// What it was drawn of.
    pub source: Source,
    /// Σ |·| over pixels and channels of its part of the mean over samples; in reverse mode, over coordinates of
    /// positions.
    pub amount: f64,
}

impl Contribution {
    pub(super) fn new(at: NonFinite, source: Source, amount: f64) -> Self {
        let NonFinite { column, row, sample } = at;
        Self { column, row, sample, among: 0, source, amount }
    }

    /// Puts the larger of two in the place of the first, which stays if they are equal.
    pub(super) fn keep_larger(kept: &mut Option<Self>, other: Option<Self>) {
        if let Some(other) = other
            && kept.is_none_or(|k| other.amount > k.amount)
        {
            *kept = Some(other);
        }
    }

    /// The larger of two, among the samples of both.
    pub(super) fn merge(kept: &mut Option<Self>, other: Option<Self>) {
        let among = |one: Option<Self>| one.map_or(0, |c| c.among);
        let both = among(*kept) + among(other);
        Self::keep_larger(kept, other);
        if let Some(kept) = kept {
            kept.among = both;
        }
    }

    /// Itself, if tails are heavy: it has a large share of a whole.
    pub(super) fn if_outlier(self, share: f64) -> Option<Self> {
        (share >= OUTLIER_SHARE && share * self.among as f64 >= OUTLIER_EXCESS).then_some(self)
    }
}
