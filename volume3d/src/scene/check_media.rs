//! Validation of media and of references to them.

use super::check::{not_negative, range, unique};
use super::{Description, Medium, SceneError};

pub(super) fn check(description: &Description) -> Result<(), SceneError> {
    let Description { media, camera_medium, shapes, .. } = description;
    unique("medium", media.iter().map(|m| &m.id))?;
    media.iter().try_for_each(medium)?;
    let exists = |id: &str, index: Option<usize>| match index {
        Some(index) if index >= media.len() => {
            Err(SceneError::Missing { id: id.to_owned(), what: "medium", index, count: media.len() })
        }
        _ => Ok(()),
    };
    exists("camera", *camera_medium)?;
    for shape in shapes {
        let boundary = shape.boundary.unwrap_or_default();
        exists(&shape.id, boundary.interior)?;
        exists(&shape.id, boundary.exterior)?;
    }
    Ok(())
}

fn medium(Medium { id, extinction, albedo, asymmetry }: &Medium) -> Result<(), SceneError> {
    not_negative(id, "the extinction", *extinction)?;
    not_negative(id, "the albedo", *albedo)?;
    let most = albedo.max_element();
    range(most <= 1.0, id, "the albedo", most, "in [0, 1]")?;
    range(asymmetry.abs() < 1.0, id, "the asymmetry", *asymmetry, "in (-1, 1)")
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use crate::geometry::Mesh;
    use crate::scene::{Boundary, Camera, Description, Film, Filter, Material, Medium, Scene, SceneError};

    fn message(change: impl Fn(&mut Description)) -> String {
        let camera = Camera::look_at(DVec3::ZERO, DVec3::NEG_Z, DVec3::Y, 0.7);
        let mut d = Description::new(
            camera,
            Film { width: 2, height: 2, crop: None, sample_border: true, filter: Filter::Box },
        );
        let white = d.add_material(Material::diffuse("white", DVec3::ONE));
        d.add_shape("ball", Mesh::cube(), white);
        let fog = Medium { id: "fog".to_owned(), extinction: DVec3::ONE, albedo: DVec3::ONE, asymmetry: 0.5 };
        d.media.push(fog);
        assert!(Scene::new(d.clone()).is_ok());
        change(&mut d);
        let error: SceneError = Scene::new(d).map(|_| ()).unwrap_err();
        error.to_string()
    }

    #[test]
    fn what_makes_no_medium_is_refused() {
        let infinite = f64::INFINITY;
        for (found, expected) in [
            (message(|d| d.media[0].extinction.y = -1.0), "the extinction of `fog` is -1, but must be"),
            (message(|d| d.media[0].extinction.y = infinite), "the extinction of `fog` is inf, but must be"),
            (message(|d| d.media[0].albedo.z = 1.5), "the albedo of `fog` is 1.5, but must be in [0, 1]"),
            (
                message(|d| d.media[0].asymmetry = -1.0),
                "the asymmetry of `fog` is -1, but must be in (-1, 1)",
            ),
            (message(|d| d.media[0].asymmetry = f64::NAN), "the asymmetry of `fog` is NaN"),
            (message(|d| d.media.push(d.media[0].clone())), "two mediums are called `fog`"),
            (message(|d| d.camera_medium = Some(1)), "`camera` refers to medium 1, but there are only 1"),
            (
                message(|d| {
                    d.shapes[0].boundary = Some(Boundary { interior: None, exterior: Some(7) });
                }),
                "`ball` refers to medium 7, but there are only 1",
            ),
        ] {
            assert!(found.starts_with(expected), "{found}");
        }
    }
}
