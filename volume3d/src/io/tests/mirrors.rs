//! Transforms with reflections, and rotations about axes of other lengths than 1.

use glam::{DMat3, DVec3};

use super::here;
use super::scene::{SENSOR, open, read, with};
use crate::geometry::{Mesh, Normals};
use crate::io::{ReadOptions, load_scene, read_scene_with, write_scene};
use crate::scene::{Description, Environment, Light, Scene};

/// The steps of a transform with a reflection along x.
const MIRROR: &str = "<scale x='-1'/><rotate y='1' angle='90'/>";

/// The directions of the axes x, y and z of such a transform.
fn mirrored() -> [DVec3; 3] {
    [DVec3::Z, DVec3::Y, DVec3::X]
}

fn close(found: [DVec3; 3], expected: [DVec3; 3]) {
    for (a, b) in found.into_iter().zip(expected) {
        assert!((a - b).length() < 1e-15, "{found:?} {expected:?}");
    }
}

fn axes(m: &DMat3) -> [DVec3; 3] {
    [m.x_axis, m.y_axis, m.z_axis]
}

/// Mitsuba's x axis points to the left of the image, also with a reflection.
#[test]
fn mirrored_cameras() {
    for (plugin, more) in [
        ("perspective", ""),
        ("thinlens", "<float name='aperture_radius' value='.1'/>"),
        ("orthographic", ""),
    ] {
        let text = format!(
            "<scene version='3.0.0'><sensor type='{plugin}'>{more}<transform name='to_world'>{MIRROR}</transform></sensor></scene>"
        );
        let d = read(&text).unwrap();
        let [left, up, forward] = mirrored();
        close([-d.camera.right, d.camera.up, d.camera.forward], [left, up, forward]);
        let again = written(d.clone());
        close(
            [again.camera.right, again.camera.up, again.camera.forward],
            [d.camera.right, d.camera.up, d.camera.forward],
        );
    }
}

#[test]
fn mirrored_environments_and_projectors() {
    let to_world = format!("<transform name='to_world'>{MIRROR}</transform>");
    let d = with(&format!(
        "<emitter type='envmap'><string name='filename' value='sky.exr'/>{to_world}</emitter><emitter \
         type='projector'><float name='irradiance' value='1'/>{to_world}</emitter><emitter type='spot'>{to_world}</emitter>"
    ))
    .unwrap();
    for d in [d.clone(), written(d)] {
        let Some(Environment::Map { to_world, .. }) = &d.environment else { panic!("{:?}", d.environment) };
        close(axes(to_world), mirrored());
        for light in &d.lights {
            let (Light::Projector { to_world, .. } | Light::Spot { to_world, .. }) = light else { panic!() };
            close(axes(to_world), mirrored());
        }
    }
}

/// A scene written and read again.
fn written(d: Description) -> Description {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("s.xml");
    write_scene(&path, &Scene::new(d).unwrap()).unwrap();
    load_scene(&path).unwrap()
}

/// A shape rotated by an angle about an axis, with the notes shown in every run.
fn turned(shape: &str, axis: &str, angle: f64) -> (Mesh, Vec<String>) {
    let text = format!(
        "<scene version='3.0.0'>{SENSOR}<shape type='{shape}'><transform name='to_world'><rotate {axis} angle='{angle}'/>\
         </transform></shape></scene>"
    );
    let (d, notes) =
        read_scene_with(text.as_bytes(), here("dir/s.xml"), &ReadOptions::default(), &open).unwrap();
    let notes = notes.into_iter().filter(|note| note.changes_image).map(|note| note.text).collect();
    (d.shapes.into_iter().next().unwrap().mesh, notes)
}

/// The axis is not normalised, as in Mitsuba 3.9.1; matrices and bounding boxes are Mitsuba's.
#[test]
fn axes_of_other_lengths_shear() {
    let (mesh, _) = turned("rectangle", "y='1' z='1'", 15.0);
    for p in [DVec3::new(1.0, 1.0, 0.0), DVec3::new(-1.0, 1.0, 0.0)] {
        let [x, y] = [DVec3::new(0.965926, 0.258819, -0.258819), DVec3::new(-0.258819, 1.0, 0.0340742)];
        let expected = p.x * x + p.y * y;
        assert!(mesh.positions().iter().any(|p| (*p - expected).length() < 2e-6), "{mesh:?}");
    }
    // Face normals are transformed by the same matrix, and those of a disk like those of a plane.
    let (rectangle, disk) =
        (turned("rectangle", "y='1' z='1'", 40.0).0, turned("disk", "y='1' z='1'", 40.0).0);
    for mesh in [rectangle, disk] {
        let Normals::Given(normals) = mesh.normals() else { panic!("{mesh:?}") };
        let expected = DVec3::new(0.530539, 0.193101, 0.825373);
        assert!(normals.values.iter().all(|n| (*n - expected).length() < 2e-6), "{normals:?}");
    }
    let (ball, notes) = turned("sphere", "y='1' z='1'", 40.0);
    let radii = ball.positions().iter().map(|p| p.length());
    assert!(radii.fold(0.0, |a: f64, r| a.max((r - 1.18877).abs())) < 2e-3, "{ball:?}");
    assert!(notes.iter().any(|note| note.contains("a ball of 1.1888 times its radius")), "{notes:?}");
}

/// A note names the length of an axis unless it is 1 to three digits.
#[test]
fn axes_of_other_lengths_are_noted() {
    let notes = |axis: &str| turned("cube", axis, 30.0).1;
    assert!(notes("x='1'").is_empty() && notes("value='.577 .577 .577'").is_empty());
    for (axis, length) in
        [("value='1 1 0'", "1.4142"), ("value='.701 .701 0'", "0.9914"), ("y='-2'", "2.0000")]
    {
        let found = notes(axis);
        assert!(found.len() == 1 && found[0].contains(&format!("has length {length}")), "{found:?}");
    }
}

/// A mesh that needs texture coordinates and has none gets those of its triangles in the order of its file,
/// also if flipped normals or a reflection reverse it. Other meshes get none.
#[test]
fn coordinates_of_triangles() {
    let board = "<bsdf type='diffuse'><texture type='checkerboard' name='reflectance'/></bsdf>";
    let brushed = "<bsdf type='roughconductor'><float name='alpha_u' value='.1'/><float name='alpha_v' value='.2'/></bsdf>";
    let lamp = "<emitter type='area'><texture type='checkerboard' name='radiance'/></emitter>";
    let flip = "<boolean name='flip_normals' value='true'/>";
    let mirror = "<transform name='to_world'><scale x='-1'/></transform>";
    let both = format!("{flip}{mirror}");
    for (more, order) in [("", [0, 1, 2]), (flip, [0, 2, 1]), (mirror, [0, 2, 1]), (&both, [0, 1, 2])] {
        for needs in [board, brushed, lamp] {
            let text =
                format!("<shape type='ply'><string name='filename' value='tri.ply'/>{more}{needs}</shape>");
            let mesh = with(&text).unwrap().shapes.remove(0).mesh;
            let uvs = mesh.uvs().unwrap();
            assert_eq!(uvs.triangles, [order], "{text}");
            // The corner of the file at x = ±1 has u = 1, and that at y = 1 has v = 1.
            for (corner, position) in mesh.triangles()[0].into_iter().enumerate() {
                let place = mesh.positions()[position as usize];
                let uv = uvs.values[uvs.triangles[0][corner] as usize];
                assert_eq!(uv, place.abs().truncate(), "{text}");
            }
        }
        let plain = format!("<shape type='ply'><string name='filename' value='tri.ply'/>{more}</shape>");
        assert!(with(&plain).unwrap().shapes[0].mesh.uvs().is_none());
    }
}
