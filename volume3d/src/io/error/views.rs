//! Errors of pictures with cameras.

use std::path::PathBuf;

use super::Error;

/// Problem with the cameras of pictures.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ViewsProblem {
    /// The file is not JSON.
    #[error("not valid JSON: {0}")]
    Json(#[from] serde_json::Error),
    /// The file is not UTF-8 text.
    #[error("not UTF-8 text")]
    Text,
    /// A key or a word is missing.
    #[error("there is no {what}; expected {expected}")]
    Missing {
        /// The missing part of the file.
        what: String,
        /// The expected content.
        expected: &'static str,
    },
    /// A value is not what it should be.
    #[error("{what} is {found}, but must be {expected}")]
    Value {
        /// The value's name.
        what: String,
        /// The value, cut after 60 characters.
        found: String,
        /// The expected value.
        expected: &'static str,
    },
    /// The lens distorts.
    #[error(
        "{camera} with {coefficient} = {value}, and only pictures of pinhole cameras are read; undistort them first, with `colmap image_undistorter`"
    )]
    Distorted {
        /// The camera and its model: "camera 1 is OPENCV".
        camera: String,
        /// The coefficient that is not 0.
        coefficient: String,
        /// Its value.
        value: f64,
    },
    /// The model of the camera is no pinhole, whatever its coefficients.
    #[error(
        "{camera}, which is no pinhole camera; undistort the pictures first, with `colmap image_undistorter`"
    )]
    NoPinhole {
        /// The camera and its model.
        camera: String,
    },
    /// An image's camera is not in the file of cameras.
    #[error("its camera {id} is not in {}", cameras.display())]
    NoCamera {
        /// The camera's number.
        id: u32,
        /// The file of cameras.
        cameras: PathBuf,
    },
    /// Two things have one name.
    #[error("there are two {what}")]
    Twice {
        /// The two things.
        what: String,
    },
    /// The file ends too early.
    #[error("the file ends within {what}")]
    Truncated {
        /// The part that is incomplete.
        what: String,
    },
    /// The file does not end where it should.
    #[error("{bytes} bytes follow the last {what}")]
    Trailing {
        /// The number of bytes.
        bytes: usize,
        /// The last item.
        what: &'static str,
    },
    /// There are no pictures.
    #[error("there are no images")]
    Empty,
    /// The picture cannot be read.
    #[error("{source}")]
    Picture {
        /// The cause.
        source: Box<Error>,
    },
    /// The picture is not that of the camera.
    #[error(
        "its picture {} has {}×{} pixels, but its camera {}×{}, which is another shape; expected the same size or a copy in \
         fewer pixels",
        picture.display(), found.0, found.1, expected.0, expected.1
    )]
    Shape {
        /// The picture.
        picture: PathBuf,
        /// Columns and rows of the picture.
        found: (usize, usize),
        /// Columns and rows according to the camera.
        expected: (f64, f64),
    },
    /// A picture is asked for in another shape, or in more pixels.
    #[error(
        "view `{name}` has {}×{} pixels, and cannot be read with {}×{}; expected fewer, of the same shape",
        found.0, found.1, asked.0, asked.1
    )]
    Resized {
        /// The view.
        name: String,
        /// Columns and rows of the picture.
        found: (usize, usize),
        /// Columns and rows that are asked for.
        asked: (usize, usize),
    },
    /// Focal lengths or the principal point are beyond those of a camera.
    #[error("the focal lengths {focal:?} and the principal point {principal:?} are none of a camera")]
    Calibration {
        /// f_x and f_y, pixels.
        focal: [f64; 2],
        /// c_x and c_y, pixels.
        principal: [f64; 2],
    },
    /// The numbers of sensors and pictures differ.
    #[error("there are {sensors} sensors, but {pictures} pictures; expected one for each, in order")]
    Count {
        /// The number of sensors.
        sensors: usize,
        /// The number of pictures.
        pictures: usize,
    },
}
