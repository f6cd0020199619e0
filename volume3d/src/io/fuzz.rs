//! Entry points for fuzzing: each takes arbitrary bytes and must return. An accepted value must satisfy the
//! guarantees of its type.

use std::io::{Error as IoError, ErrorKind};
use std::path::Path;

use flatland::sdf::shapes::Parametric;

use super::dtu::parse_cameras;
use super::mitsuba::parse_sensors;
use super::views::{Frame, parse_colmap_binary, parse_colmap_text, parse_transforms, posed};
use super::{MeshFormat, parse_network, parse_npy, parse_sdf, parse_serialized, read_image, read_scene};
use crate::geometry::{Mesh, Normals};
use crate::scene::Camera;
use crate::sdf::Interpolation;

/// OBJ, or its gzip.
pub fn obj(bytes: &[u8]) {
    mesh(MeshFormat::Obj, bytes);
}

/// PLY, or its gzip.
pub fn ply(bytes: &[u8]) {
    mesh(MeshFormat::Ply, bytes);
}

/// The first and the second mesh of a `serialized` file.
pub fn serialized(bytes: &[u8]) {
    for index in [0, 1] {
        if let Ok(mesh) = parse_serialized(bytes, Path::new("fuzz.serialized"), index) {
            check_mesh(&mesh);
        }
    }
}

/// A scene. Files it references are replaced by tiny ones, so that nothing outside is read; including itself
/// is possible.
pub fn scene(bytes: &[u8]) {
    const TRIANGLE: &[u8] = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    let open = |path: &Path| match path.extension().and_then(|e| e.to_str()) {
        Some("obj") => Ok(TRIANGLE.to_vec()),
        Some("xml") => Ok(bytes.to_vec()),
        _ => Err(IoError::from(ErrorKind::NotFound)),
    };
    if let Ok(scene) = read_scene(bytes, Path::new("fuzz.xml"), &[], &open) {
        assert!(scene.camera.field_of_view > 0.0 && scene.camera.origin.is_finite());
        assert!(scene.shapes.iter().all(|s| s.material < scene.materials.len()));
        scene.shapes.iter().for_each(|s| check_mesh(&s.mesh));
    }
}

/// An image of any format.
pub fn image(bytes: &[u8]) {
    if let Ok(image) = read_image(bytes, Path::new("fuzz.image"), false) {
        assert_eq!(image.pixels.len(), image.width * image.height);
        assert!(image.pixels.iter().all(|p| p.is_finite()));
    }
}

/// A NumPy array.
pub fn npy(bytes: &[u8]) {
    if let Ok(array) = parse_npy(bytes, Path::new("fuzz.npy")) {
        assert_eq!(array.shape.iter().product::<usize>(), array.values.len());
    }
}

/// An SDF grid.
pub fn sdf(bytes: &[u8]) {
    if let Ok(grid) = parse_sdf(bytes, Path::new("fuzz.vol"), Interpolation::Cubic) {
        assert_eq!(grid.size().iter().product::<usize>(), grid.nodes().len());
        assert!(grid.nodes().iter().all(|value| value.is_finite()));
    }
}

/// A network.
pub fn network(bytes: &[u8]) {
    if let Ok(network) = parse_network(bytes, Path::new("fuzz.safetensors")) {
        assert_eq!(network.parameters().len(), network.architecture().parameter_count());
        assert!(network.parameters().iter().all(|p| p.is_finite()));
    }
}

/// Cameras of three images.
pub fn cameras(bytes: &[u8]) {
    if let Ok(cameras) = parse_cameras(bytes, 3) {
        assert_eq!(cameras.len(), 3);
        assert!(cameras.iter().all(|camera| camera.center.is_finite() && camera.intrinsics.is_finite()));
    }
}

/// `transforms.json`.
pub fn transforms(bytes: &[u8]) {
    if let Ok(frames) = parse_transforms(bytes, Path::new("fuzz.json")) {
        check_frames(frames);
    }
}

/// A COLMAP model as text or binary: the bytes are both of its files.
pub fn colmap(bytes: &[u8]) {
    let paths = [Path::new("cameras"), Path::new("images")];
    // The first byte says where the second file begins.
    let (at, rest) = bytes.split_first().map_or((0, bytes), |(at, rest)| (usize::from(*at), rest));
    let (cameras, images) = rest.split_at(at.min(rest.len()));
    for parse in [parse_colmap_text, parse_colmap_binary] {
        if let Ok(frames) = parse([cameras, images], paths) {
            check_frames(frames);
        }
    }
}

/// The sensors of a scene. There are no other files.
pub fn sensors(bytes: &[u8]) {
    let open = |_: &Path| Err(IoError::from(ErrorKind::NotFound));
    if let Ok(sensors) = parse_sensors(bytes, Path::new("fuzz.xml"), &[], &open) {
        for sensor in sensors {
            assert!(sensor.camera.origin.is_finite() && sensor.width * sensor.height > 0);
        }
    }
}

/// Accepted frames are those of cameras, or are refused once their pictures are known.
fn check_frames(frames: Vec<Frame>) {
    for frame in frames {
        if let Ok(view) = posed(frame, "fuzz.png".into(), None, (8, 6)) {
            let Camera { origin, right, up, forward, field_of_view, .. } = view.camera;
            assert!(origin.is_finite() && field_of_view > 0.0);
            assert!((right.cross(forward) - up).length() < 1e-9, "{right} {up} {forward}");
        }
    }
}

fn mesh(format: MeshFormat, bytes: &[u8]) {
    let Ok(soup) = format.parse(bytes, Path::new("fuzz.mesh")) else { return };
    if let Ok(mesh) = soup.into_mesh(false) {
        check_mesh(&mesh);
    }
}

fn check_mesh(mesh: &Mesh) {
    let within = |triangles: &[[u32; 3]], count: usize| {
        assert_eq!(triangles.len(), mesh.triangles().len());
        assert!(triangles.as_flattened().iter().all(|&i| (i as usize) < count));
    };
    assert!(mesh.positions().iter().all(|p| p.is_finite()));
    within(mesh.triangles(), mesh.positions().len());
    match mesh.normals() {
        Normals::Face => {}
        Normals::AngleWeighted { triangles, count } => within(triangles, *count),
        Normals::Given(normals) => within(&normals.triangles, normals.values.len()),
    }
    if let Some(uvs) = mesh.uvs() {
        within(&uvs.triangles, uvs.values.len());
    }
}
