//! Polygons with dents, holes and self-intersections in OBJ and PLY files.

use glam::DVec3;

use super::{here, message};
use crate::geometry::Mesh;
use crate::io::{load_mesh_with_notes, read_obj, read_ply};

fn obj(points: &[[f64; 3]]) -> Mesh {
    let vertices: String = points.iter().map(|[x, y, z]| format!("v {x} {y} {z}\n")).collect();
    let face: String = (1..=points.len()).map(|i| format!(" {i}")).collect();
    read_obj(format!("{vertices}f{face}\n").as_bytes(), here("m.obj")).unwrap()
}

fn ply(points: &[[f64; 3]]) -> Mesh {
    let vertices: String = points.iter().map(|[x, y, z]| format!("{x} {y} {z}\n")).collect();
    let (n, face) = (points.len(), (0..points.len()).map(|i| format!(" {i}")).collect::<String>());
    let text = format!(
        "ply\nformat ascii 1.0\nelement vertex {n}\nproperty float x\nproperty float y\nproperty float z\n\
         element face 1\nproperty list uchar int vertex_indices\nend_header\n{vertices}{n}{face}\n"
    );
    read_ply(text.as_bytes(), here("m.ply")).unwrap()
}

/// The sum of the areas, and the sum of the area vectors.
fn areas(mesh: &Mesh) -> (f64, DVec3) {
    let vectors = mesh.triangles().iter().map(|t| {
        let [a, b, c] = t.map(|i| mesh.positions()[i as usize]);
        0.5 * (b - a).cross(c - a)
    });
    vectors.fold((0.0, DVec3::ZERO), |(sum, whole), v| (sum + v.length(), whole + v))
}

/// A star with its first corner at a tip or in a dent.
fn star(tips: u32, first: u32) -> Vec<[f64; 2]> {
    let corner = |k: u32| {
        let (angle, r) = (std::f64::consts::PI * f64::from(k) / f64::from(tips), [1.0, 0.3][k as usize % 2]);
        [r * angle.cos(), r * angle.sin()]
    };
    (0..2 * tips).map(|k| corner(k + first)).collect()
}

/// Triangles that are all oriented like the polygon, and whose areas sum to its area, cover it once. The
/// areas of a fan sum to more if a dent is not around the first corner, as `fan` says.
#[test]
fn polygons_with_dents_are_covered_once() {
    let dart = |k: usize| -> Vec<[f64; 2]> {
        let corners = [[-1.5, -1.5], [0.0, -0.2], [1.5, -1.5], [0.0, 1.5]];
        (0..4).map(|i| corners[(i + k) % 4]).collect()
    };
    let square = [[0.0, 0.0], [3.0, 0.0], [3.0, 3.0], [0.0, 3.0]];
    // The hole is joined by an edge in both directions.
    let mut hole = square.to_vec();
    hole.extend([[0.0, 0.0], [1.0, 1.0], [1.0, 2.0], [2.0, 2.0], [2.0, 1.0], [1.0, 1.0]]);
    let comb: Vec<[f64; 2]> = (0..12)
        .map(|i| [f64::from(i), if i % 2 == 0 { 2.0 } else { 0.1 }])
        .chain([[11.0, 0.0], [0.0, 0.0]])
        .collect();
    let comb_area = 0.5
        * (0..comb.len())
            .map(|i| {
                let ([a, b], [c, d]) = (comb[i], comb[(i + 1) % comb.len()]);
                a * d - b * c
            })
            .sum::<f64>()
            .abs();
    let star_area = |n: u32| f64::from(n) * 0.3 * (std::f64::consts::PI / f64::from(n)).sin();
    let cases = [
        ("dart", dart(0), 2.55, true),
        ("dart, from the tip", dart(2), 2.55, true),
        ("dart, from its dent", dart(1), 2.55, false),
        ("square", square.to_vec(), 9.0, false),
        ("hole", hole, 8.0, true),
        ("comb", comb, comb_area, true),
        ("star", star(7, 0), star_area(7), true),
        ("star, from a dent", star(7, 1), star_area(7), true),
    ];
    // In each coordinate plane, seen from both sides, far away, and tilted.
    let places: [fn([f64; 2]) -> [f64; 3]; 6] = [
        |[x, y]| [x, y, 0.0],
        |[x, y]| [y, x, 5.0],
        |[x, y]| [0.0, x, y],
        |[x, y]| [y, -1.0, x],
        |[x, y]| [1e5 + x, y - 1e5, 0.0],
        |[x, y]| [x, y, 0.5 * x - 2.0 * y],
    ];
    for (name, corners, area, fan) in cases {
        for (k, place) in places.iter().enumerate() {
            let points: Vec<[f64; 3]> = corners.iter().map(|p| place(*p)).collect();
            let scale = if k == 5 { (1.0_f64 + 0.25 + 4.0).sqrt() } else { 1.0 };
            for mesh in [obj(&points), ply(&points)] {
                assert_eq!(mesh.triangles().len(), points.len() - 2, "{name} {k}");
                let (sum, whole) = areas(&mesh);
                assert!((sum - scale * area).abs() < 1e-9, "{name} {k}: {sum} for {}", scale * area);
                assert!((whole.length() - sum).abs() < 1e-9, "{name} {k}: turned both ways");
            }
            let triangles = (2..points.len() as u32).map(|i| [0, i - 1, i]).collect();
            let as_fan =
                Mesh::new(points.iter().map(|p| DVec3::from_array(*p)).collect(), triangles).unwrap();
            assert_eq!(areas(&as_fan).0 > scale * area + 1e-3, fan, "{name} {k}: the control");
        }
    }
}

#[test]
fn what_is_said_of_polygons_and_materials() {
    let folder = tempfile::tempdir().unwrap();
    let notes = |text: &str| {
        let path = folder.path().join("m.obj");
        std::fs::write(&path, text).unwrap();
        load_mesh_with_notes(&path).unwrap().1.join("; ")
    };
    let square = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";
    assert_eq!(notes(&format!("{square}f 1 2 3 4\n")), "");
    assert_eq!(notes(&format!("{square}usemtl a\nf 1 2 3\nusemtl a\nf 1 3 4\nusemtl unused\n")), "");
    let two = notes(&format!("{square}usemtl a\nf 1 2 3\nusemtl b c\nf 1 3 4\n"));
    assert!(two.contains("several materials by usemtl (\"a\", \"b c\"), which are ignored"), "{two}");
    // Deviations in the sixth digit count as flat, a tenth does not.
    let bent = |z: &str| notes(&format!("v 0 0 0\nv 1 0 0\nv 1 1 {z}\nv 0 1 0\nf 1 2 3 4\n"));
    assert_eq!(bent("0.000002"), "");
    assert!(
        bent("0.1").starts_with("1 of 1 faces of more than three corners are not flat, by up to 3."),
        "{}",
        bent("0.1")
    );
    let eight = notes(&format!("{square}v 0.5 -1 0\nf 1 3 2 4\n"));
    assert_eq!(eight, "");
    let crossing = notes("v 0 0 0\nv 4 0 0\nv 4 4 0\nv 1 -1 0\nv 0 4 0\nf 1 2 3 4 5\n");
    assert!(crossing.starts_with("1 of 1 faces of more than three corners cross themselves"), "{crossing}");
}

#[test]
fn points_alone_are_refused() {
    let points = message(read_obj(b"v 0 0 0\nv 1 0 0\nv 1 1 0\np 1\n", here("m.obj")));
    assert_eq!(points, "m.obj: there are no faces, only 3 vertices: nothing would be seen");
    let header = "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\n\
                  element face 0\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n";
    // A mesh whose header says 0 elements is empty, with a note.
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("m.ply");
    std::fs::write(&path, header).unwrap();
    let (mesh, notes) = load_mesh_with_notes(&path).unwrap();
    assert!(mesh.triangles().is_empty());
    assert_eq!(notes, ["there are no faces, only 1 vertices: nothing would be seen"]);
}
