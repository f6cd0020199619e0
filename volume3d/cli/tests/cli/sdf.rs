//! `volume3d sdf`: a mesh becomes a grid of its distances.

use glam::DVec3;
use volume3d::io::{load_mesh, read_sdf, write_sdf};
use volume3d::sdf::{Grid, Interpolation};

use super::Place;

/// The cube [−1, 1]³, closed, turned outwards; without its last triangles if fewer are kept.
fn cube(triangles: usize) -> String {
    let mut text = String::new();
    for i in 0..8 {
        let corner = [0, 1, 2].map(|axis| if i >> axis & 1 == 1 { 1 } else { -1 });
        text += &format!("v {} {} {}\n", corner[0], corner[1], corner[2]);
    }
    let faces = [
        [1, 3, 4],
        [1, 4, 2],
        [5, 6, 8],
        [5, 8, 7],
        [1, 2, 6],
        [1, 6, 5],
        [3, 7, 8],
        [3, 8, 4],
        [1, 5, 7],
        [1, 7, 3],
        [2, 4, 8],
        [2, 8, 6],
    ];
    for [a, b, c] in &faces[..triangles] {
        text += &format!("f {a} {b} {c}\n");
    }
    text
}

#[test]
fn a_cube_becomes_its_distances() {
    let place = Place::new();
    std::fs::write(place.path("cube.obj"), cube(12)).unwrap();
    let text = place.succeed("sdf cube.obj -o cube.vol --resolution 10 --margin 0.25");
    assert!(text.contains("11 × 11 × 11 nodes, 0.300000 apart") && text.contains("wrote cube.vol"), "{text}");
    assert!(!text.contains("WARNING"), "{text}");
    let grid = read_sdf(&place.path("cube.vol"), Interpolation::Trilinear).unwrap();
    for (index, &value) in grid.nodes().iter().enumerate() {
        let q = grid.position(index).abs() - 1.0;
        let expected = q.max(DVec3::ZERO).length() + q.max_element().min(0.0);
        // Of single precision.
        assert!((value - expected).abs() < 1e-6, "{index}: {value} for {expected}");
    }
    // The same bits on one thread.
    place.succeed("sdf cube.obj -o one.vol --resolution 10 --margin 0.25 --threads 1");
    assert_eq!(place.bytes("one.vol"), place.bytes("cube.vol"));
    // And back: a closed mesh through the corners of cells.
    let text = place.succeed("sdf cube.vol -o back.ply");
    assert!(text.contains("triangles\nwrote back.ply"), "{text}");
    let back = load_mesh(&place.path("back.ply")).unwrap();
    let volume: f64 = back
        .triangles()
        .iter()
        .map(|t| {
            let [a, b, c] = t.map(|i| back.positions()[i as usize]);
            a.dot(b.cross(c)) / 6.0
        })
        .sum();
    // Edges of the cube are cut off, by no more than a cell.
    assert!(volume < 8.0 && volume > 8.0 - 12.0 * 2.0 * 0.3 * 0.3, "{volume}");
    // Without a side.
    std::fs::write(place.path("open.obj"), cube(10)).unwrap();
    let text = place.succeed("sdf open.obj -o open.vol --resolution 10");
    assert!(text.contains("WARNING: ") && text.contains("an ambiguous sign"), "{text}");
}

#[test]
fn what_has_no_distances_is_refused() {
    let place = Place::new();
    std::fs::write(place.path("cube.obj"), cube(12)).unwrap();
    std::fs::write(place.path("sheet.obj"), cube(2)).unwrap();
    std::fs::write(place.path("point.obj"), "v 0 0 0\nv 0 0 0\nv 0 0 0\nf 1 2 3\n").unwrap();
    place.succeed("sdf cube.obj -o cube.vol --resolution 6");
    let corners = (DVec3::splat(-2.0), DVec3::splat(2.0));
    let wide = Grid::sampled(Interpolation::Trilinear, corners, 8, |x| x.length() - 2.2).unwrap();
    write_sdf(&place.path("tight.vol"), &wide).unwrap();
    std::fs::write(place.path("damaged.vol"), &place.bytes("cube.vol")[..100]).unwrap();
    let cases = [
        ("sdf none.obj -o a.vol", 1, "cannot read none.obj"),
        ("sdf cube.obj -o a.exr", 1, "written as .vol"),
        ("sdf cube.obj -o none/a.vol", 1, "there is no folder none"),
        ("sdf cube.obj -o a.vol --resolution 0", 1, "0 cells"),
        ("sdf cube.obj -o a.vol --resolution 100000", 1, "100000 cells"),
        ("sdf cube.obj -o a.vol --margin -1", 1, "margin -1"),
        ("sdf cube.obj -o a.vol --margin NaN", 1, "margin NaN"),
        ("sdf sheet.obj -o a.vol", 1, "encloses no node"),
        ("sdf point.obj -o a.vol", 1, "no triangle with an area"),
        ("sdf scene.xml -o a.vol", 1, "scene.xml"),
        ("sdf cube.obj", 2, "--output"),
        ("sdf cube.obj -o a.obj", 1, "written as .vol"),
        ("sdf cube.vol -o a.vol", 1, "both grids"),
        ("sdf cube.vol -o a.stl", 1, ".obj or .ply"),
        ("sdf cube.vol -o a.obj --margin 0.1", 1, "--margin applies to grids"),
        ("sdf cube.vol -o a.obj --resolution 5000", 1, "5000 cells"),
        ("sdf tight.vol -o a.obj", 1, "leaves the box"),
        ("sdf damaged.vol -o a.obj", 1, "damaged.vol"),
    ];
    for (line, code, words) in cases {
        place.fail(line, code, &[words]);
        assert!(!place.path("a.vol").exists() && !place.path("a.obj").exists(), "{line}");
    }
}
