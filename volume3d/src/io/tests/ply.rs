//! Stanford PLY.

use glam::{DVec2, DVec3};

use super::{check_table, gzipped, here, message};
use crate::geometry::{Attribute, Mesh, Normals};
use crate::io::{Error, load_mesh, read_ply, write_ply};

fn read(bytes: impl AsRef<[u8]>) -> Result<Mesh, Error> {
    read_ply(bytes.as_ref(), here("m.ply"))
}

const XYZ: &str = "property float x\nproperty float y\nproperty float z\n";
const FACES: &str = "property list uchar int vertex_indices\n";

#[test]
fn ascii_with_everything() {
    let header = "ply\r\nformat ascii 1.0\nobj_info i\nelement camera 1\nproperty float f\n\
        property list int double d\nelement vertex 4\nproperty double x\nproperty float32 y\nproperty float z\n\
        property uchar red\nproperty float nx\nproperty float ny\nproperty float nz\nproperty float s\n\
        property float t\nelement face 1\nproperty int8 flag\nproperty list uint8 uint32 vertex_index\n\
        element edge 1\nproperty int a\nend_header\n";
    let body = "7 2 1 2\n0 0 0 255 0 0 1 0 0\n1 0 0 255 0 0 1 1 0\n1 1 0 255 0 0 1 1 1\n\
                0 1 0 255 0 0 1 0 1\n-1 4 0 1 2 3\n5\n \n";
    let mesh = read(format!("{header}{body}")).unwrap();
    assert_eq!(mesh.triangles(), [[0, 1, 2], [0, 2, 3]]);
    assert_eq!(mesh.uvs().unwrap().values[2], DVec2::ONE);
    let Normals::Given(normals) = mesh.normals() else { panic!("{:?}", mesh.normals()) };
    assert_eq!(normals.values, [DVec3::Z; 4]);
}

/// All integer types, both byte orders.
#[test]
fn binary_of_both_byte_orders() {
    let order = |little: bool, bytes: &[u8]| {
        let mut bytes = bytes.to_vec();
        if !little {
            bytes.reverse();
        }
        bytes
    };
    for (little, name) in [(true, "little"), (false, "big")] {
        let mut bytes = format!(
            "ply\nformat binary_{name}_endian 1.0\nelement other 1\nproperty short a\nproperty ushort b\n\
             property char c\nproperty uint d\nproperty list ushort int e\nelement vertex 3\n{XYZ}\
             element face 1\nproperty list int short vertex_indices\nend_header\n"
        )
        .into_bytes();
        bytes.extend([0; 9]);
        bytes.extend(order(little, &2_u16.to_le_bytes()));
        bytes.extend([0; 8]);
        for x in [0.0_f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.5, 0.0] {
            bytes.extend(order(little, &x.to_le_bytes()));
        }
        bytes.extend(order(little, &3_i32.to_le_bytes()));
        for i in [0_i16, 1, 2] {
            bytes.extend(order(little, &i.to_le_bytes()));
        }
        let mesh = read(&bytes).unwrap();
        assert_eq!(mesh.positions()[2], 1.5 * DVec3::Y, "{name}");
        assert_eq!(mesh.triangles(), [[0, 1, 2]], "{name}");
        // A line break at the end is accepted, anything else is not.
        bytes.push(b'\n');
        read(&bytes).unwrap();
        bytes.push(7);
        let found = message(read(&bytes));
        assert_eq!(found, "m.ply: 1 bytes follow the last element that the header announces");
    }
}

#[test]
fn duplicated_vertices_are_one_place_and_a_crease() {
    let text = format!(
        "ply\nformat ascii 1.0\nelement vertex 6\n{XYZ}element face 2\n{FACES}end_header\n\
         0 0 0 1 0 0 0 1 0 0 0 0 1 0 0 0 0 1\n3 0 1 2 3 3 4 5\n"
    );
    let mesh = read(text).unwrap();
    assert_eq!(mesh.positions().len(), 4);
    assert_eq!(mesh.triangles(), [[0, 1, 2], [0, 1, 3]]);
    assert_eq!(*mesh.normals(), Normals::AngleWeighted { triangles: vec![[0, 1, 2], [3, 4, 5]], count: 6 });
}

#[test]
fn gzip_is_seen_by_its_first_bytes() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("m.ply.gz");
    let header = format!("ply\nformat ascii 1.0\nelement vertex 3\n{XYZ}element face 1\n{FACES}end_header\n");
    let bytes = gzipped(format!("{header}0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n").as_bytes());
    std::fs::write(&path, &bytes).unwrap();
    assert_eq!(load_mesh(&path).unwrap().triangles(), [[0, 1, 2]]);
    std::fs::write(&path, &bytes[..bytes.len() / 2]).unwrap();
    let found = message(load_mesh(&path));
    assert!(found.starts_with("cannot decompress ") && found.contains("m.ply.gz: "), "{found}");
}

#[test]
fn written_meshes_are_read_again() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("m.ply");
    let third = 1.0 / 3.0;
    let plain = Mesh::new(vec![DVec3::ZERO, DVec3::new(third, -0.1, 1e-300), DVec3::Y], vec![[0, 1, 2]]);
    let plain = plain.unwrap().smooth();
    write_ply(&path, &plain).unwrap();
    assert_eq!(load_mesh(&path).unwrap(), plain);

    let normals = vec![DVec3::X, DVec3::new(third, 0.0, 1.0)];
    let given = Mesh::rectangle()
        .with_normals(Normals::Given(Attribute { values: normals, triangles: vec![[0, 1, 0], [1, 1, 0]] }))
        .unwrap();
    write_ply(&path, &given).unwrap();
    let read = load_mesh(&path).unwrap();
    assert_eq!(read.positions(), given.positions());
    assert_eq!(read.triangles(), given.triangles());
    let corners = |mesh: &Mesh| -> Vec<(DVec3, DVec2)> {
        let (Normals::Given(normals), Some(uvs)) = (mesh.normals(), mesh.uvs()) else { panic!("{mesh:?}") };
        let of = |t: &Vec<[u32; 3]>| t.as_flattened().to_vec();
        let pairs = of(&normals.triangles).into_iter().zip(of(&uvs.triangles));
        pairs.map(|(n, uv)| (normals.values[n as usize], uvs.values[uv as usize])).collect()
    };
    assert_eq!(corners(&read), corners(&given));

    write_ply(&path, &Mesh::new(vec![DVec3::X], vec![]).unwrap()).unwrap();
    assert_eq!(load_mesh(&path).unwrap().positions(), [DVec3::X]);
}

/// The error for a text in which `|` separates lines and words in capitals are abbreviations.
fn refused(text: &str) -> String {
    let texts =
        [("START", "ply|format ascii 1.0"), ("VERTEX", "element vertex 3"), ("CORNERS", "0 0 0|1 0 0|0 1 0")];
    let text = texts.iter().fold(text.to_owned(), |text, (name, meaning)| text.replace(name, meaning));
    message(read(text.replace("XYZ|", XYZ).replace("FACES|", FACES).replace('|', "\n")))
}

#[test]
fn headers_that_are_refused() {
    assert_eq!(message(read("")), "m.ply:1: expected \"ply\", found \"\"");
    check_table(
        r#"
plx|format
    m.ply:1: expected "ply", found "plx"
START
    m.ply:3: the file ends before end_header
ply|format text 1.0
    m.ply:2: expected format ascii, binary_little_endian or binary_big_endian 1.0, found "format text 1.0"
ply|end_header
    m.ply:2: the header has no line "format …"
START|vertices 3
    m.ply:3: expected comment, format, element, property or end_header, found "vertices 3"
START|element vertex -3
    m.ply:3: expected element NAME COUNT, found "element vertex -3"
START|property float x
    m.ply:3: expected an element before its properties, found "property float x"
START|element a 1|property real x
    m.ply:4: expected property TYPE NAME or property list INTEGER_TYPE TYPE NAME, found "property real x"
START|element a 1|property list float int x
    m.ply:4: expected property TYPE NAME or property list INTEGER_TYPE TYPE NAME, found "property list float int x"
START|element a 1|property int x|property int x
    m.ply:5: expected each property once, found "property int x"
START|element a 1|element a 1
    m.ply:4: expected each element once, found "a"
START|element tristrips 1
    m.ply:3: the element "tristrips" is not supported; save the mesh with an element "face"
START|end_header
    m.ply:3: the header has no element vertex
START|VERTEX|XYZ|end_header
    m.ply:7: the header has no element face
START|VERTEX|XYZ|element face 1|end_header
    m.ply:8: the header has no list vertex_index or vertex_indices in its element face
START|element face 1|FACES|VERTEX|XYZ|end_header
    m.ply:9: expected vertices before faces, found "face"
START|element face 1|property list uchar float vertex_index
    m.ply:4: expected indices of an integer type, found "property list uchar float vertex_index"
START|VERTEX|property float x|property float y|element face 1|FACES|end_header
    m.ply: the header has no vertex properties x, y and z
START|VERTEX|XYZ|property float nx|element face 1|FACES|end_header
    m.ply: the header has no vertex properties nx, ny and nz (all or none)
"#,
        |lines| refused(&format!("{lines}|")),
    );
}

#[test]
fn bodies_that_are_refused() {
    check_table(
        r#"
0 0 0|1 0
    m.ply:12: the file ends before the end of vertex 1
0 0 zero
    m.ply:11: expected a number, found "zero"
0 0 nan 1 0 0 0 1 0 3 0 1 2
    m.ply: position 0 is not finite
CORNERS|3 0 1 3
    m.ply:14: the face refers to vertex 3, but there are 3 so far
CORNERS|3 0 1 -1
    m.ply:14: the face refers to vertex -1, but there are 3 so far
CORNERS|3 0 1 1.5
    m.ply:14: expected a whole number, found "1.5"
CORNERS|2 0 1
    m.ply:14: a face of 2 corners; a face needs at least 3
CORNERS|-3 0 1 2
    m.ply:14: expected the length of a list, found "-3"
CORNERS|4000000000 0 1 2
    m.ply:14: the file ends before the 4000000000 values of the list "vertex_indices"
CORNERS|3 0 1
    m.ply:14: the file ends before the 3 values of the list "vertex_indices"
CORNERS|3 0 1 2|3 0 1 2
    m.ply:15: 7 bytes follow the last element that the header announces
"#,
        |body| refused(&format!("START|comment c|VERTEX|XYZ|element face 1|FACES|end_header|{body}")),
    );
    let header = format!(
        "ply\nformat binary_little_endian 1.0\nelement vertex 3\n{XYZ}element face 4294967295\n{FACES}end_header\n"
    );
    let mut bytes = header.into_bytes();
    assert_eq!(message(read(&bytes)), "m.ply, vertex 0: the file ends before the end of this element");
    bytes.extend([0; 36]);
    bytes.extend([3, 0, 0, 0, 0, 9, 0, 0, 0, 0, 0, 0, 0]);
    assert_eq!(message(read(&bytes)), "m.ply, face 0: the face refers to vertex 9, but there are 3 so far");
}

/// Texture coordinates of vertices under each of their names; u and v precede s and t, which precede the
/// others.
#[test]
fn texture_coordinates_of_vertices() {
    let cases = [
        ("u v", "1 2", "3 4", "5 6", [1.0, 2.0]),
        ("s t", "1 2", "3 4", "5 6", [1.0, 2.0]),
        ("texture_u texture_v", "1 2", "3 4", "5 6", [1.0, 2.0]),
        ("t s", "1 2", "3 4", "5 6", [2.0, 1.0]),
        ("s t u v", "9 9 1 2", "9 9 3 4", "9 9 5 6", [1.0, 2.0]),
        ("texture_u texture_v s t", "9 9 1 2", "9 9 3 4", "9 9 5 6", [1.0, 2.0]),
    ];
    for (names, a, b, c, first) in cases {
        let properties: String = names.split(' ').map(|name| format!("property float {name}\n")).collect();
        let text = format!(
            "ply\nformat ascii 1.0\nelement vertex 3\n{XYZ}{properties}element face 1\n{FACES}end_header\n\
             0 0 0 {a}\n1 0 0 {b}\n0 1 0 {c}\n3 0 1 2\n"
        );
        let mesh = read(text).unwrap();
        let uvs = mesh.uvs().unwrap();
        assert_eq!((uvs.values[0], &uvs.triangles), (DVec2::from_array(first), &vec![[0, 1, 2]]), "{names}");
    }
    // One name of a pair is another property.
    let text = format!(
        "ply\nformat ascii 1.0\nelement vertex 3\n{XYZ}property float t\nelement face 1\n{FACES}end_header\n\
         0 0 0 7\n1 0 0 8\n0 1 0 9\n3 0 1 2\n"
    );
    let soup = crate::io::ply::parse(text.as_bytes(), here("m.ply")).unwrap();
    assert!(
        soup.uvs.is_none() && soup.notes[0].starts_with("the vertex property \"t\" is ignored"),
        "{soup:?}"
    );
}

/// MeshLab writes texture coordinates of the corners of faces: before or after their indices, for some faces
/// or none, for triangles or polygons. They take precedence over those of vertices.
#[test]
fn texture_coordinates_of_faces() {
    let list = "property list uchar float texcoord\n";
    let text = |order: &str, faces: &str| {
        let properties =
            order.replace("F", FACES).replace("T", list).replace("N", "property int texnumber\n");
        let uv = "property float u\nproperty float v\n";
        format!(
            "ply\nformat ascii 1.0\nelement vertex 5\n{XYZ}{uv}element face 2\n{properties}end_header\n\
             0 0 0 7 7\n2 0 0 7 7\n2 2 0 7 7\n0 2 0 7 7\n.1 1 0 7 7\n{faces}"
        )
    };
    let parse =
        |order: &str, faces: &str| crate::io::ply::parse(text(order, faces).as_bytes(), here("m.ply"));
    // A pentagon with a dent at its last corner is not a fan around its first.
    let dent = "5 0 1 2 3 4";
    let wedges = "10 0 0 1 0 1 1 0 1 .5 .5";
    for (order, faces) in [
        ("FT", format!("{dent} {wedges}\n3 0 1 2 6 .1 .2 .3 .4 .5 .6\n")),
        ("TF", format!("{wedges} {dent}\n6 .1 .2 .3 .4 .5 .6 3 0 1 2\n")),
    ] {
        let soup = parse(order, &faces).unwrap();
        assert!(soup.notes.is_empty(), "{:?}", soup.notes);
        let uvs = soup.uvs.unwrap();
        let corners = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [0.5, 0.5]].map(DVec2::from_array);
        assert_eq!(uvs.values[..5], corners);
        assert_eq!(uvs.values[7], DVec2::new(0.5, 0.6));
        assert_eq!(uvs.triangles.len(), 4);
        for (uv, triangle) in uvs.triangles.iter().zip(&soup.triangles) {
            let expected = if *triangle == [0, 1, 2] && uv[0] == 5 { [5, 6, 7] } else { *triangle };
            assert_eq!(*uv, expected);
        }
        assert_eq!(uvs.triangles[3], [5, 6, 7]);
    }
    let soup = parse("FTN", "3 0 1 2 6 .1 .2 .3 .4 .5 .6 0\n3 0 2 3 0 1\n").unwrap();
    assert!(soup.notes.iter().any(|note| note.starts_with("3 of 6 corners")), "{:?}", soup.notes);
    let uvs = soup.uvs.unwrap();
    assert_eq!((uvs.triangles[1], uvs.values[3]), ([3; 3], DVec2::ZERO));
    let soup = parse("FTN", "3 0 1 2 6 0 0 1 0 0 1 0\n3 0 2 3 6 0 0 1 0 0 1 1\n").unwrap();
    assert!(soup.notes.iter().any(|note| note.contains("several textures by texnumber")), "{:?}", soup.notes);
    // If no face has coordinates, those of vertices count.
    let soup = parse("FT", "3 0 1 2 0\n3 0 2 3 0\n").unwrap();
    assert_eq!(soup.uvs.unwrap().values, [DVec2::splat(7.0); 5]);
    let error = message(parse("FT", "3 0 1 2 4 0 0 1 0\n3 0 2 3 0\n"));
    let expected = "m.ply:18: the list texcoord has 4 numbers for a face of 3 corners; give two for each corner, or none";
    assert_eq!(error, expected);
}

/// A header with four billion elements and no data must not take memory or time.
#[test]
fn counts_without_data_are_harmless() {
    let text = format!(
        "ply\nformat ascii 1.0\nelement nothing 18446744073709551615\nelement vertex 18446744073709551615\n{XYZ}\
         element face 18446744073709551615\n{FACES}end_header\n0 0 0\n"
    );
    assert_eq!(message(read(text)), "m.ply:12: the file ends before the end of vertex 1");
}
