//! Why pictures with their cameras cannot be read.

use std::path::PathBuf;

use super::ArrayProblem;

/// What is wrong with a folder of pictures, masks and cameras.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum DtuProblem {
    /// The file is no ZIP archive, or a damaged one.
    #[error("not a readable NPZ archive: {0}")]
    Archive(#[from] rawzip::Error),
    /// Two arrays have one name.
    #[error("there are two arrays \"{array}\"")]
    Twice {
        /// Their name, cut after 60 characters.
        array: String,
    },
    /// An array that is needed is not there.
    #[error("there is no array \"{array}\"")]
    Missing {
        /// Its name.
        array: String,
    },
    /// There is a camera without a picture.
    #[error("there is an array \"{array}\", but there are only {images} images")]
    Unused {
        /// The array.
        array: String,
        /// How many pictures there are.
        images: usize,
    },
    /// An array cannot be inflated.
    #[error("cannot decompress \"{array}\": {source}")]
    Damaged {
        /// Its name.
        array: String,
        /// Why.
        source: std::io::Error,
    },
    /// An array is compressed by other means than NumPy does.
    #[error("\"{array}\" is compressed by a method that is not supported; write it with numpy.savez")]
    Compression {
        /// Its name.
        array: String,
    },
    /// An array is larger than any matrix.
    #[error("\"{array}\" takes {limit} bytes or more; a matrix is smaller")]
    TooLarge {
        /// Its name.
        array: String,
        /// The limit.
        limit: u64,
    },
    /// An array cannot be understood.
    #[error("\"{array}\": {problem}")]
    Array {
        /// Its name.
        array: String,
        /// What is wrong with it.
        problem: ArrayProblem,
    },
    /// An array is no matrix of 4 × 4 numbers.
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
    /// A matrix is none of a camera.
    #[error("world_mat_{index} · scale_mat_{index} is none of a camera: {what}")]
    Singular {
        /// Which.
        index: usize,
        /// Why.
        what: &'static str,
    },
    /// There are no pictures.
    #[error("there are no PNG images")]
    Empty,
    /// There are other numbers of pictures and of masks.
    #[error("there are {images} images, but {masks} masks")]
    Count {
        /// Pictures.
        images: usize,
        /// Masks.
        masks: usize,
    },
    /// A picture and the mask beside it in the order of names have other numbers.
    #[error("image {index} (from 0) is \"{image}\", but the mask in its place is \"{mask}\"")]
    Pair {
        /// Their place.
        index: usize,
        /// The picture's file name.
        image: String,
        /// The mask's file name.
        mask: String,
    },
    /// A picture and its mask have other sizes.
    #[error(
        "the mask of image {index} (from 0) has {}×{} pixels, but the image, {}, has {}×{}",
        found.0, found.1, image.display(), expected.0, expected.1
    )]
    Size {
        /// Their place.
        index: usize,
        /// The picture.
        image: PathBuf,
        /// Columns and rows of the picture.
        expected: (usize, usize),
        /// Those of the mask.
        found: (usize, usize),
    },
    /// There is no such picture.
    #[error("there is no image {index} (from 0), but {count}")]
    Index {
        /// Which was asked for.
        index: usize,
        /// How many there are.
        count: usize,
    },
}
