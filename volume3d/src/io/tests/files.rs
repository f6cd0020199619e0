//! Common properties of readers and writers.

use super::{here, message};
use crate::Image;
use crate::io::MeshProblem;
use crate::io::memory::with_room;
use crate::io::{Array, Error, Precision, load_mesh, load_scene, read_npy, write_npy, write_png};

#[test]
fn missing_files_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("none.ply");
    let found = message(load_mesh(&path));
    assert!(found.starts_with(&format!("cannot read {}: ", path.display())), "{found}");
    assert!(matches!(load_scene(&path), Err(Error::File { action: "read", .. })));
    assert!(matches!(read_npy(&path), Err(Error::File { action: "read", .. })));
}

#[test]
fn the_format_of_a_mesh_is_in_its_name() {
    let found = message(load_mesh(here("mesh.stl")));
    assert_eq!(
        found,
        "mesh.stl: cannot tell the format from the name; supported: .ply, .obj, .ply.gz, .obj.gz"
    );
}

#[test]
fn writing_replaces_a_file_or_leaves_it_alone() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.npy");
    let one = Array { shape: vec![1], values: vec![1.0] };
    write_npy(&path, &one, Precision::Double).unwrap();
    assert!(write_npy(&path, &Array { shape: vec![2], values: vec![] }, Precision::Double).is_err());
    assert_eq!(read_npy(&path).unwrap(), one);
    let two = Array { shape: vec![1], values: vec![2.0] };
    write_npy(&path, &two, Precision::Double).unwrap();
    assert_eq!(read_npy(&path).unwrap(), two);
    let names: Vec<_> = std::fs::read_dir(folder.path()).unwrap().map(|e| e.unwrap().file_name()).collect();
    assert_eq!(names, ["a.npy"], "no temporary file is left");
}

#[test]
fn a_folder_that_does_not_exist_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("none").join("a.png");
    let image = Image { width: 1, height: 1, pixels: vec![glam::DVec3::ONE] };
    let found = message(write_png(&path, &image));
    assert!(found.starts_with(&format!("cannot write {}: ", path.display())), "{found}");
}

/// Written files have the default permissions of the user's files.
#[cfg(unix)]
#[test]
fn written_files_have_ordinary_permissions() {
    use std::os::unix::fs::PermissionsExt;
    let folder = tempfile::tempdir().unwrap();
    let (ours, other) = (folder.path().join("a.npy"), folder.path().join("b"));
    write_npy(&ours, &Array { shape: vec![0], values: vec![] }, Precision::Double).unwrap();
    std::fs::write(&other, "").unwrap();
    let mode = |path| std::fs::metadata(path).unwrap().permissions().mode();
    assert_eq!(mode(&ours), mode(&other));
}

#[test]
fn memory_that_cannot_be_had_is_an_error() {
    let error = with_room::<[f64; 3]>(1 << 57, "the vertices").unwrap_err();
    let expected = "the vertices would take 3458764513820540928 bytes of memory, which cannot be had";
    assert_eq!(error.to_string(), expected);
    assert_eq!(MeshProblem::from(error).to_string(), expected);
    assert!(with_room::<u64>(usize::MAX, "numbers").is_err());
}
