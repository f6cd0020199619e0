//! The sample that contributes most to a gradient image: heavy tails are seen while they are drawn.

use super::result::NonFinite;

/// What a sample was drawn of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Source {
    /// A path from the camera.
    Path,
    /// A point of a jump: of an edge, or of a curve on which interpolated normals make light jump.
    Jump,
}

/// What one sample contributes to a gradient image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contribution {
    /// The column of its cell in the image; −1 and the width are beside it.
    pub column: isize,
    /// The cell's row.
    pub row: isize,
    /// The sample's number, among those of its cell or its jump.
    pub sample: usize,
    /// How many samples there are in all.
    pub among: usize,
    /// What it was drawn of.
    pub source: Source,
    /// Σ |·| over pixels and channels of its part of the mean over samples.
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
}
