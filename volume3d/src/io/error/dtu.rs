//! Errors of DTU folders.

use std::path::PathBuf;

use super::ArrayProblem;

/// Problem with a folder of pictures, masks and cameras.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum DtuProblem {
    /// The file is not a ZIP archive, or is damaged.
    #[error("not a readable NPZ archive: {0}")]
    Archive(#[from] rawzip::Error),
    /// Two arrays have the same name.
    #[error("there are two arrays \"{array}\"")]
    Twice {
        /// Their name, cut after 60 characters.
        array: String,
    },
    /// A required array is missing.
    #[error("there is no array \"{array}\"")]
    Missing {
        /// Its name.
        array: String,
    },
    /// A camera has no picture.
    #[error("there is an array \"{array}\", but there are only {images} images")]
    Unused {
        /// The array.
        array: String,
        /// The number of pictures.
        images: usize,
    },
    /// An array cannot be inflated.
    #[error("cannot decompress \"{array}\": {source}")]
    Damaged {
        /// Its name.
        array: String,
        /// The cause.
        source: std::io::Error,
    },
    /// An array is compressed by a method that NumPy does not use.
    #[error("\"{array}\" is compressed by a method that is not supported; write it with numpy.savez")]
    Compression {
        /// Its name.
        array: String,
    },
    /// An array is larger than a 4 × 4 matrix can be.
    #[error("\"{array}\" takes {limit} bytes or more; a matrix is smaller")]
    TooLarge {
        /// Its name.
        array: String,
        /// The limit.
        limit: u64,
    },
    /// An array cannot be parsed.
    #[error("\"{array}\": {problem}")]
    Array {
        /// Its name.
        array: String,
        /// The problem with the array.
        problem: ArrayProblem,
    },
    /// An array is not a matrix of 4 × 4 numbers.
    #[error("\"{array}\" has the shape {found:?}; expected [4, 4]")]
    Shape {
        /// Its name.
        array: String,
        /// Its shape.
        found: Vec<usize>,
    },
    /// A number of a matrix is NaN or infinite.
    #[error("row {row}, column {column} (from 0) of \"{array}\" is {value}; all must be finite")]
    NotFinite {
        /// The matrix.
        array: String,
        /// The row.
        row: usize,
        /// The column.
        column: usize,
        /// The number.
        value: f64,
    },
    /// A matrix is not that of a camera.
    #[error("world_mat_{index} · scale_mat_{index} is none of a camera: {what}")]
    Singular {
        /// The index of the image.
        index: usize,
        /// The reason.
        what: &'static str,
    },
    /// There are no pictures.
    #[error("there are no PNG images")]
    Empty,
    /// The numbers of pictures and masks differ.
    #[error("there are {images} images, but {masks} masks")]
    Count {
        /// The number of pictures.
        images: usize,
        /// The number of masks.
        masks: usize,
    },
    /// A picture and its mask, by the order of names, have different numbers in their names.
    #[error("image {index} (from 0) is \"{image}\", but the mask in its place is \"{mask}\"")]
    Pair {
        /// The index of the pair.
        index: usize,
        /// The picture's file name.
        image: String,
        /// The mask's file name.
        mask: String,
    },
    /// A picture and its mask differ in size.
    #[error(
        "the mask of image {index} (from 0) has {}×{} pixels, but the image, {}, has {}×{}",
        found.0, found.1, image.display(), expected.0, expected.1
    )]
    Size {
        /// The index of the pair.
        index: usize,
        /// The picture.
        image: PathBuf,
        /// Columns and rows of the picture.
        expected: (usize, usize),
        /// Columns and rows of the mask.
        found: (usize, usize),
    },
    /// There is no such picture.
    #[error("there is no image {index} (from 0), but {count}")]
    Index {
        /// The requested index.
        index: usize,
        /// The number of pictures.
        count: usize,
    },
    /// The axes of a camera are not orthogonal.
    #[error(
        "camera {index} (from 0) is skewed, which moves pixels at the border by {skew}; 0.001 is allowed: resample the picture"
    )]
    Skew {
        /// The index of the view.
        index: usize,
        /// |skew/f_y| times half the film's height.
        skew: f64,
    },
}
