//! Non-finite samples.

/// A sample that was not finite: excluded from the sums and reported here.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NonFinite {
    /// Column of the sample's cell; −1 and the image width are the cells outside it.
    pub column: isize,
    /// Row of the cell.
    pub row: isize,
    /// Index of the sample.
    pub sample: usize,
}
