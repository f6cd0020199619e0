//! Whether shadows can be sampled as curves.

use glam::DVec3;

use crate::scene::{Scene, Surface};

/// Above as many triangles of emitters it is not asked of each whether something touches it.
const MANY: usize = 64;

/// Whether all jumps of the light of a scene's emitters, as shading points see them, are curves that are sampled: not where
/// something passes through an emitter or lies on it, as shadows begin there and the edge in common is seen from no point before the
/// emitter; not where an emitter has a texture, which may jump; and not where there is a field towards lights, that of implicit surfaces, and
/// horizons of faces with interpolated normals, which are sampled as if there were none.
pub(in crate::gradient) fn are_curves(scene: &Scene) -> bool {
    let textured = scene.description.shapes.iter().any(|shape| shape.radiance_texture.is_some());
    let bent = !scene.description.implicits.is_empty() && !scene.normals.is_empty();
    !textured && !bent && !are_crossed(scene) && !are_touched(scene)
}

fn emits(scene: &Scene, shape: u32) -> bool {
    scene.description.shapes[shape as usize].radiance.is_some()
}

/// Whether any surface passes through one that emits, or covers it in one plane.
fn are_crossed(scene: &Scene) -> bool {
    let crossings = scene.crossings();
    let shape = |t: u32| scene.shape_of(Surface::Triangle(t));
    let crossed = |shapes: [u32; 2]| shapes.into_iter().any(|s| emits(scene, s));
    crossings.all().iter().any(|c| crossed(c.shapes(&scene.triangles)))
        || crossings.overlaps().iter().any(|pair| crossed(pair.map(shape)))
}

/// Whether an edge of another shape lies in the plane of a triangle that emits, within the box around it. Of emitters with many
/// triangles it is asked only whether another shape comes into the box around them.
fn are_touched(scene: &Scene) -> bool {
    let all = 0..scene.triangles.len() as u32;
    let shape = |t: u32| scene.triangles[t as usize].shape;
    let emitters: Vec<u32> = all.clone().filter(|&t| emits(scene, shape(t))).take(MANY + 1).collect();
    if emitters.len() > MANY {
        return are_approached(scene);
    }
    let slack = 1e4 * scene.rounding();
    emitters.iter().any(|&emitter| {
        let corners = scene.corners(emitter);
        let normal = scene.face_normal(emitter);
        let (low, high) = bounds(&corners);
        all.clone().filter(|&t| shape(t) != shape(emitter)).any(|t| {
            let p = scene.corners(t);
            let within = p.map(|p| normal.dot(p - corners[0]).abs() <= slack);
            (0..3).any(|k| {
                let ends = [p[k], p[(k + 1) % 3]];
                let (a, b) = bounds(&ends);
                within[k]
                    && within[(k + 1) % 3]
                    && (a - slack).cmple(high).all()
                    && (b + slack).cmpge(low).all()
            })
        })
    })
}

/// Whether a triangle comes into the box around an emitter of another shape.
fn are_approached(scene: &Scene) -> bool {
    let slack = 1e4 * scene.rounding();
    let shapes = (0..scene.description.shapes.len()).filter(|&s| emits(scene, s as u32));
    shapes.into_iter().any(|emitter| {
        let (low, high) = bounds(&scene.positions[scene.position_range(emitter)]);
        let others = (0..scene.triangles.len() as u32)
            .filter(|&t| scene.triangles[t as usize].shape != emitter as u32);
        others.into_iter().any(|t| {
            let (a, b) = bounds(&scene.corners(t));
            (a - slack).cmple(high).all() && (b + slack).cmpge(low).all()
        })
    })
}

/// The least and the largest coordinates of some points.
fn bounds(points: &[DVec3]) -> (DVec3, DVec3) {
    let fold = |f: fn(DVec3, DVec3) -> DVec3| points.iter().copied().reduce(f).unwrap_or_default();
    (fold(DVec3::min), fold(DVec3::max))
}

#[cfg(test)]
mod tests {
    use glam::DAffine3;

    use super::*;
    use crate::geometry::Mesh;
    use crate::gradient::tests::{at, film};
    use crate::scene::{Camera, Description, Filter, Material};

    /// A ball that emits, of thousands of triangles, beside a block and with it in the corner of its box.
    #[test]
    fn many_triangles_that_emit_are_kept_apart_by_their_box() {
        for (x, expected) in [(3.0, true), (1.1, false)] {
            let camera = Camera::look_at(DVec3::new(0.0, -3.0, 1.0), DVec3::ZERO, DVec3::Z, 0.5);
            let mut d = Description::new(camera, film(2, Filter::Tent { radius: 1.0 }));
            let paper = d.add_material(Material::diffuse("paper", DVec3::splat(0.5)));
            d.add_emitter("ball", Mesh::sphere(), DVec3::ONE);
            d.add_shape("block", Mesh::cube().transformed(&at(x, x, x, 0.2)), paper);
            assert_eq!(are_curves(&Scene::new(d).unwrap()), expected, "{x}");
        }
    }

    /// A lamp with a block above it, on it and through it, and beside it in its plane.
    #[test]
    fn what_touches_an_emitter_is_found() {
        let blocks = [
            (at(0.0, 0.0, 1.0, 0.2), true),
            (at(0.0, 0.0, 0.2, 0.2), false),
            (at(0.1, 0.0, 0.1, 0.2), false),
            (at(0.0, 0.9, 0.2, 0.2), false),
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
