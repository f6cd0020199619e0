//! Samples that are no numbers.

/// A sample that was not finite: left out of the sums, and reported here.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NonFinite {
    /// The cell's column in the image; −1 and the width are beside it.
    pub column: isize,
    /// The cell's row.
    pub row: isize,
    /// The sample's number.
    pub sample: usize,
}
