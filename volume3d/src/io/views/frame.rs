//! One picture of a file of cameras, before the picture's size is known.

use std::path::{Path, PathBuf};

use glam::{DMat3, DVec2, DVec3};

use super::posed_picture::PosedPicture;
use super::scaled::scaled;
use crate::io::{At, ViewsProblem};
use crate::scene::{Calibration, Camera};

/// Tolerance of orthogonality and equal lengths of a rotation's columns: of files with five digits.
const TOLERANCE: f64 = 1e-3;

/// A picture as its file of cameras describes it.
#[derive(Clone, Debug)]
pub(in crate::io) struct Frame {
    /// File, and line or key, that describe the frame.
    pub(super) at: At,
    /// The picture, as it is named there.
    pub(super) picture: String,
    /// The picture of weights, if any.
    pub(super) weights: Option<String>,
    /// R of [`Calibration`].
    pub(super) rotation: DMat3,
    /// c of [`Calibration`].
    pub(super) center: DVec3,
    pub(super) lens: Lens,
}

/// Intrinsics of a pinhole camera.
#[derive(Clone, Copy, Debug)]
pub(super) struct Lens {
    /// Columns and rows to which pixels refer; those of the picture if `None`.
    pub(super) size: Option<(f64, f64)>,
    /// Along x, and along y; square pixels if the latter is `None`.
    pub(super) focal: (Focal, Option<Focal>),
    /// The principal point along each axis, pixels from the top left corner; the middle if `None`.
    pub(super) principal: [Option<f64>; 2],
}

/// Focal length along an axis.
#[derive(Clone, Copy, Debug)]
pub(super) enum Focal {
    /// In pixels.
    Pixels(f64),
    /// As the field of view of the whole film, radians.
    Angle(f64),
}

impl Focal {
    fn pixels(self, side: f64) -> f64 {
        match self {
            Self::Pixels(length) => length,
            Self::Angle(angle) => 0.5 * side / (0.5 * angle).tan(),
        }
    }
}

/// The view of a frame whose picture has these columns and rows.
pub(in crate::io) fn posed(
    frame: Frame,
    picture: PathBuf,
    weights: Option<PathBuf>,
    (width, height): (usize, usize),
) -> Result<PosedPicture, ViewsProblem> {
    let Frame { rotation, center, lens, picture: written, .. } = frame;
    let declared = lens.size.unwrap_or((width as f64, height as f64));
    let size = DVec2::new(declared.0, declared.1);
    let x = lens.focal.0.pixels(size.x);
    let focal = DVec2::new(x, lens.focal.1.map_or(x, |focal| focal.pixels(size.y)));
    let middle = 0.5 * size;
    let principal = DVec2::new(lens.principal[0].unwrap_or(middle.x), lens.principal[1].unwrap_or(middle.y));
    let camera = Camera::from(Calibration { rotation, center, focal, principal, size });
    let angle = camera.field_of_view;
    let is_camera = angle > 0.0
        && angle < std::f64::consts::PI
        && camera.pixel_aspect > 0.0
        && camera.pixel_aspect.is_finite()
        && camera.principal_point.is_finite();
    if !is_camera {
        let (focal, principal) = (focal.to_array(), principal.to_array());
        return Err(ViewsProblem::Calibration { focal, principal });
    }
    let camera = scaled(camera, declared, (width, height), &picture)?;
    let name = named(&written);
    Ok(PosedPicture { name, camera, picture, mask: None, weights, width, height })
}

/// A picture's name without its extension, and without a leading "./".
fn named(picture: &str) -> String {
    let plain = picture.strip_prefix("./").unwrap_or(picture);
    let extension = Path::new(plain).extension().and_then(|e| e.to_str());
    let is_image = |e: &str| IMAGES.iter().any(|image| e.eq_ignore_ascii_case(image));
    match extension {
        Some(extension) if is_image(extension) => plain[..plain.len() - extension.len() - 1].to_owned(),
        _ => plain.to_owned(),
    }
}

pub(super) fn stem(path: &Path) -> String {
    path.file_stem().unwrap_or_default().to_string_lossy().into_owned()
}

/// Extensions of images that are read.
pub(super) const IMAGES: [&str; 6] = ["png", "jpg", "jpeg", "exr", "hdr", "bmp"];

/// The rotation that a matrix is, up to a scale and rounding; `None` if its columns are not orthogonal, of
/// one length and right-handed.
pub(super) fn rotation(m: DMat3) -> Option<DMat3> {
    let lengths = [m.x_axis, m.y_axis, m.z_axis].map(DVec3::length);
    let [x, y, z] = [m.x_axis / lengths[0], m.y_axis / lengths[1], m.z_axis / lengths[2]];
    let is_frame = [x.dot(y), y.dot(z), z.dot(x)].iter().all(|cosine| cosine.abs() < TOLERANCE)
        && lengths.iter().all(|length| (length / lengths[2] - 1.0).abs() < TOLERANCE)
        && x.cross(y).dot(z) > 0.0;
    let right = y.cross(z).normalize();
    let frame = DMat3::from_cols(right, z.cross(right), z);
    (is_frame && frame.is_finite()).then_some(frame)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_those_of_pictures() {
        let found = ["./train/r_0", "a/b.JPG", "r_0.5", ".png"].map(named);
        assert_eq!(found, ["train/r_0", "a/b", "r_0.5", ".png"]);
    }

    #[test]
    fn a_rotation_is_right_handed_and_of_one_length() {
        let turn = DMat3::from_axis_angle(DVec3::new(1.0, 2.0, 2.0) / 3.0, 0.7);
        assert!(rotation(turn * 3.0).unwrap().abs_diff_eq(turn, 1e-15));
        assert!(rotation(turn * DMat3::from_diagonal(DVec3::new(1.0, 1.0, -1.0))).is_none());
        assert!(rotation(turn * DMat3::from_diagonal(DVec3::new(1.0, 1.1, 1.0))).is_none());
        assert!(rotation(DMat3::ZERO).is_none() && rotation(turn * f64::NAN).is_none());
    }
}
