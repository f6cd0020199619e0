//! Wavefront OBJ.

use glam::{DVec2, DVec3};

use super::{check_table, here, message};
use crate::geometry::{Mesh, Normals};
use crate::io::{Error, read_obj};

fn read(text: &str) -> Result<Mesh, Error> {
    read_obj(text.as_bytes(), here("m.obj"))
}

const CORNERS: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

#[test]
fn polygons_become_fans() {
    let mesh = read(&format!("{CORNERS}f 1 2 3 4\n")).unwrap();
    assert_eq!(mesh.triangles(), [[0, 1, 2], [0, 2, 3]]);
    assert_eq!(mesh.positions()[2], DVec3::new(1.0, 1.0, 0.0));
    let same = Normals::AngleWeighted { triangles: mesh.triangles().to_vec(), count: 4 };
    assert_eq!(*mesh.normals(), same);
}

#[test]
fn negative_indices_count_from_the_end_so_far() {
    let mesh = read("v 9 9 9\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf -3 -2 -1\nv 8 8 8\n").unwrap();
    assert_eq!(mesh.triangles(), [[1, 2, 3]]);
}

#[test]
fn normals_and_texture_coordinates_keep_their_indices() {
    let text = "vt 0 0\nvt .5 1e0\nvn 0 0 1\nvn 0 0 2\nf 1/1/2 2/2/2 3/1/1\n";
    let mesh = read(&format!("{CORNERS}{text}")).unwrap();
    let uvs = mesh.uvs().unwrap();
    assert_eq!(uvs.values, [DVec2::ZERO, DVec2::new(0.5, 1.0)]);
    assert_eq!(uvs.triangles, [[0, 1, 0]]);
    let Normals::Given(normals) = mesh.normals() else { panic!("{:?}", mesh.normals()) };
    assert_eq!(normals.values, [DVec3::Z, 2.0 * DVec3::Z]);
    assert_eq!(normals.triangles, [[1, 1, 0]]);
}

#[test]
fn normals_without_texture_coordinates() {
    let mesh = read(&format!("{CORNERS}vn 0 0 1\nf 1//1 2//1 3//1\n")).unwrap();
    assert!(mesh.uvs().is_none() && matches!(mesh.normals(), Normals::Given(_)));
}

#[test]
fn a_seam_of_texture_coordinates_is_no_crease() {
    let text = "vt 0 0\nvt 1 1\nf 1/1 2/1 3/1\nf 1/2 3/2 4/2\n";
    let mesh = read(&format!("{CORNERS}{text}")).unwrap();
    let same = Normals::AngleWeighted { triangles: mesh.triangles().to_vec(), count: 4 };
    assert_eq!(*mesh.normals(), same);
}

#[test]
fn what_has_no_surface_is_skipped() {
    let text = "# comment\r\nmtllib a.mtl\no a\ng b\ns off\nusemtl c\nv 0 0 0 1\nv 1 0 0 .1 .2 .3 # red\n\
                v 0 1 0\np 1\nl 1 2\n\n\tf  1 \\\n 2 3\r\n";
    assert_eq!(read(text).unwrap().triangles(), [[0, 1, 2]]);
}

/// Corners without texture coordinates are at (0, 0), unaffected by flips, and corners without normals have
/// those of their triangle: for whole faces and for some corners of a face. A note says so.
#[test]
fn faces_without_texture_coordinates_or_normals() {
    let parsed = |text: &str| {
        let text = format!("{CORNERS}vt .5 .25\nvt 1 .75\nvn 1 0 0\nvn 0 1 0\n{text}");
        crate::io::obj::parse(text.as_bytes(), here("m.obj")).unwrap()
    };
    let texture = "texture coordinates: theirs are (0, 0)";
    let cases = [
        ("f 1/1 2/2 3/1\nf 1 3 4\n", [[0, 1, 0], [2, 2, 2]]),
        ("f 1//1 2//2 3//1\nf 1/1 3/2 4/1\n", [[2, 2, 2], [0, 1, 0]]),
        ("f 1/1 2/2 3\nf 1/ 3/2/ 4//\n", [[0, 1, 2], [2, 1, 2]]),
    ];
    for (faces, expected) in cases {
        let mut soup = parsed(faces);
        assert!(soup.notes.iter().any(|note| note.contains(texture)), "{faces}: {:?}", soup.notes);
        soup.flip_texture_coordinates();
        let mesh = soup.into_mesh(false).unwrap();
        let uvs = mesh.uvs().unwrap();
        assert_eq!(uvs.triangles, expected, "{faces}");
        assert_eq!(uvs.values, [DVec2::new(0.5, 0.75), DVec2::new(1.0, 0.25), DVec2::ZERO]);
    }
    let soup = parsed("f 1//1 2//2 3\nf 1 3 4\n");
    assert!(soup.uvs.is_none() && soup.notes[0].starts_with("4 of 6 corners of triangles have no normals"));
    let mesh = soup.into_mesh(false).unwrap();
    let Normals::Given(normals) = mesh.normals() else { panic!("{:?}", mesh.normals()) };
    assert_eq!(normals.triangles, [[0, 1, 2], [3, 3, 3]]);
    assert_eq!(normals.values, [DVec3::X, DVec3::Y, DVec3::Z, DVec3::Z]);
    let plain = parsed("f 1 2 3\nf 1/ 3// 4\n");
    assert!(plain.uvs.is_none() && plain.normals.is_none() && plain.notes.is_empty());
}

#[test]
fn errors_name_the_line() {
    check_table(
        r#"
v 1 2
    m.obj:5: expected v x y z, found "v 1 2"
v 1 2 x
    m.obj:5: expected v x y z, found "v 1 2 x"
v 1 nan 3
    m.obj:5: expected v x y z, found "v 1 nan 3"
v 1 2 3 4 5
    m.obj:5: expected v x y z, found "v 1 2 3 4 5"
v 1 2 3 2
    m.obj:5: a vertex of weight other than 1 is not supported; divide x, y and z by it
vn 1 2
    m.obj:5: expected vn x y z, found "vn 1 2"
vt
    m.obj:5: expected vt u v, found "vt"


f 1 2
    m.obj:7: a face of 2 corners; a face needs at least 3
f 1 2 5
    m.obj:5: the face refers to vertex 5, but there are 4 so far
f 1 2 0
    m.obj:5: the face refers to vertex 0, but there are 4 so far
f 1 2 -5
    m.obj:5: the face refers to vertex -5, but there are 4 so far
f 1/1 2/1 3/1
    m.obj:5: the face refers to texture coordinate 1, but there are 0 so far
f 1//1 2//1 3//1
    m.obj:5: the face refers to normal 1, but there are 0 so far
f 1/2/3/4 2 3
    m.obj:5: expected a corner v, v/vt, v//vn or v/vt/vn of whole numbers, found "1/2/3/4"
f /1 2 3
    m.obj:5: expected a corner v, v/vt, v//vn or v/vt/vn of whole numbers, found "/1"
vp 0 0
    m.obj:5: the keyword "vp" is not supported; supported: v, vt, vn, f, and without effect g, o, s, usemtl, mtllib, p, l
"#,
        |text| message(read(&format!("{CORNERS}{text}"))),
    );
    let latin = message(read_obj(b"v 1 2 3\nv \xff 2 3\n", here("m.obj")));
    assert_eq!(latin, "m.obj:2: expected UTF-8 text, found \"v \u{fffd} 2 3\"");
}
