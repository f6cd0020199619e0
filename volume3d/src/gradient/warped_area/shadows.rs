//! Test whether shadows can be sampled as curves.

use crate::gradient::curve::contacts_are_followed;
use crate::scene::{Scene, Surface};

/// Whether all discontinuities of emitted light, as seen from shading points, are curves that can be sampled.
/// Not if
///
/// - a surface crosses an emitter, or covers part of it in its plane;
/// - an emitter has a texture, which may be discontinuous;
/// - so many shapes emit that edges on them are not detected; or
/// - there are both a field towards lights, that of implicit surfaces, and horizons of faces with
///   interpolated normals, which are sampled as if V were zero.
pub(super) fn are_curves(scene: &Scene) -> bool {
    let textured = scene.description.shapes.iter().any(|shape| shape.radiance_texture.is_some());
    let bent = !scene.description.implicits.is_empty() && !scene.normals.is_empty();
    !textured && !bent && contacts_are_followed(scene) && !are_crossed(scene)
}

fn emits(scene: &Scene, shape: u32) -> bool {
    scene.description.shapes[shape as usize].radiance.is_some()
}

/// Whether any surface crosses an emitter, or covers part of it in its plane.
fn are_crossed(scene: &Scene) -> bool {
    let crossings = scene.crossings();
    let shape = |t: u32| scene.shape_of(Surface::Triangle(t));
    let crossed = |shapes: [u32; 2]| shapes.into_iter().any(|s| emits(scene, s));
    crossings.all().iter().any(|c| crossed(c.shapes(&scene.triangles)))
        || crossings.overlaps().iter().any(|pair| crossed(pair.map(shape)))
}

#[cfg(test)]
mod tests {
    use glam::{DAffine3, DVec3};

    use super::*;
    use crate::geometry::Mesh;
    use crate::gradient::tests::{at, film};
    use crate::scene::{Camera, Description, Filter, Material};

    /// Many lamps, with few other triangles and with many.
    #[test]
    fn edges_on_many_lamps_are_looked_for_among_few() {
        for (lamps, balls, expected) in [(64, 20, true), (65, 1, true), (600, 1, false)] {
            let camera = Camera::look_at(DVec3::new(0.0, -3.0, 1.0), DVec3::ZERO, DVec3::Z, 0.5);
            let mut d = Description::new(camera, film(2, Filter::Tent { radius: 1.0 }));
            let paper = d.add_material(Material::diffuse("paper", DVec3::splat(0.5)));
            for i in 0..lamps {
                let lamp = Mesh::rectangle().transformed(&at(3.0 * f64::from(i), 0.0, 5.0, 1.0));
                d.add_emitter(&format!("lamp {i}"), lamp, DVec3::ONE);
            }
            for i in 0..balls {
                d.add_shape(
                    &format!("ball {i}"),
                    Mesh::sphere().transformed(&at(0.0, 3.0 * f64::from(i), 0.0, 1.0)),
                    paper,
                );
            }
            assert_eq!(are_curves(&Scene::new(d).unwrap()), expected, "{lamps} lamps, {balls} balls");
        }
    }

    /// A lamp with a block above it, on it, through it, and next to it in its plane.
    #[test]
    fn what_covers_an_emitter_is_found() {
        let blocks = [
            (at(0.0, 0.0, 1.0, 0.2), true),
            (at(0.0, 0.0, 0.2, 0.2), false),
            (at(0.1, 0.0, 0.1, 0.2), false),
            (at(0.0, 0.9, 0.2, 0.2), false),
            (at(0.0, 1.3, 0.2, 0.2), true),
            (at(3.0, 0.0, 0.2, 0.2), true),
        ];
        for (map, expected) in blocks {
            let camera = Camera::look_at(DVec3::new(0.0, -3.0, 1.0), DVec3::ZERO, DVec3::Z, 0.5);
            let mut d = Description::new(camera, film(2, Filter::Tent { radius: 1.0 }));
            let paper = d.add_material(Material::diffuse("paper", DVec3::splat(0.5)));
            d.add_emitter("lamp", Mesh::rectangle(), DVec3::ONE);
            let map: DAffine3 = map;
            d.add_shape("block", Mesh::cube().transformed(&map), paper);
            let scene = Scene::new(d).unwrap();
            assert_eq!(are_curves(&scene), expected, "{map}");
        }
    }
}
