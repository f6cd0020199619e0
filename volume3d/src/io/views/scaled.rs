//! Copies of pictures in other pixels.

use std::path::Path;

use glam::DVec2;

use crate::io::ViewsProblem;
use crate::scene::Camera;

/// The camera for a copy of its picture in other pixels. A copy in fewer pixels may be rounded to whole ones.
pub(super) fn scaled(
    camera: Camera,
    declared: (f64, f64),
    found: (usize, usize),
    picture: &Path,
) -> Result<Camera, ViewsProblem> {
    let (size, declared) = (DVec2::new(found.0 as f64, found.1 as f64), DVec2::new(declared.0, declared.1));
    let difference = (size.x * declared.y - size.y * declared.x).abs();
    let allowed = if size.cmplt(declared).all() { declared.max_element() } else { 0.0 };
    if difference > allowed {
        let expected = (declared.x, declared.y);
        return Err(ViewsProblem::Shape { picture: picture.to_path_buf(), found, expected });
    }
    let scale = size / declared;
    // Angles and the relative principal point stay.
    Ok(Camera { pixel_aspect: camera.pixel_aspect * (scale.y / scale.x), ..camera })
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;

    #[test]
    fn copies_have_the_same_shape() {
        let camera = Camera::look_at(DVec3::Z, DVec3::ZERO, DVec3::Y, 0.7);
        let of = |found| scaled(camera.clone(), (801.0, 600.0), found, Path::new("a.png"));
        assert_eq!(of((801, 600)).unwrap(), camera);
        // 400.5 columns are written as 400 or 401.
        let copy = of((400, 300)).unwrap();
        assert!((copy.pixel_aspect - 0.5 / (400.0 / 801.0)).abs() < 1e-15);
        assert!(of((401, 300)).is_ok() && of((1602, 1200)).is_ok());
        assert!(of((398, 300)).is_err() && of((600, 801)).is_err() && of((800, 600)).is_err());
    }
}
