//! Mitsuba's `serialized` meshes.

use std::io::Write as _;

use flate2::Compression;
use flate2::write::ZlibEncoder;
use glam::{DVec2, DVec3};

use super::{check_messages, here, message};
use crate::geometry::Normals;
use crate::io::parse_serialized;

const NORMALS: u32 = 1;
const UVS: u32 = 2;
const FACE_NORMALS: u32 = 16;
const SINGLE: u32 = 0x1000;
const DOUBLE: u32 = 0x2000;

/// One triangle with a corner at `x` and the last index `last`.
fn mesh(version: u16, flags: u32, x: f64, last: u32) -> Vec<u8> {
    let mut data = flags.to_le_bytes().to_vec();
    if version == 4 {
        data.extend(b"name\0");
    }
    data.extend(3_u64.to_le_bytes());
    data.extend(1_u64.to_le_bytes());
    let mut numbers = vec![x, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0];
    if flags & NORMALS != 0 {
        numbers.extend([0.0, 0.0, 1.0].repeat(3));
    }
    if flags & UVS != 0 {
        numbers.extend([0.0, 0.25, 1.0, 0.0, 0.0, 1.0]);
    }
    for number in numbers {
        if flags & DOUBLE == 0 {
            data.extend((number as f32).to_le_bytes());
        } else {
            data.extend(number.to_le_bytes());
        }
    }
    [0, 1, last].iter().for_each(|index| data.extend(u32::to_le_bytes(*index)));
    let mut bytes = [0x041C_u16.to_le_bytes(), version.to_le_bytes()].concat();
    let mut encoder = ZlibEncoder::new(vec![], Compression::fast());
    encoder.write_all(&data).unwrap();
    bytes.extend(encoder.finish().unwrap());
    bytes
}

/// A file of two meshes with its list of offsets.
pub(super) fn two(version: u16) -> Vec<u8> {
    let mut bytes = mesh(version, NORMALS | UVS | SINGLE, 0.0, 2);
    let offset = bytes.len();
    bytes.extend(mesh(version, DOUBLE | FACE_NORMALS, 0.5, 2));
    for offset in [0, offset] {
        if version == 4 {
            bytes.extend((offset as u64).to_le_bytes());
        } else {
            bytes.extend((offset as u32).to_le_bytes());
        }
    }
    bytes.extend(2_u32.to_le_bytes());
    bytes
}

#[test]
fn both_meshes_of_both_versions() {
    for version in [3, 4] {
        let first = parse_serialized(&two(version), here("m"), 0).unwrap();
        assert_eq!(first.positions(), [DVec3::ZERO, DVec3::X, DVec3::Y]);
        assert_eq!(first.uvs().unwrap().values[0], DVec2::new(0.0, 0.25));
        let Normals::Given(normals) = first.normals() else { panic!("given") };
        assert_eq!(normals.values, [DVec3::Z; 3]);
        let second = parse_serialized(&two(version), here("m"), 1).unwrap();
        assert_eq!(second.positions()[0], 0.5 * DVec3::X);
        assert_eq!(*second.normals(), Normals::Face);
        assert!(second.uvs().is_none());
    }
}

#[test]
fn hostile_files_are_refused_by_name() {
    let refused = |bytes: &[u8], index| message(parse_serialized(bytes, here("m"), index));
    let good = two(4);
    let mut many = good.clone();
    let end = many.len();
    many[end - 4..].fill(255);
    let mut huge = 0_u32.to_le_bytes().to_vec();
    huge.extend(b"\0");
    huge.extend((1_u64 << 60).to_le_bytes());
    huge.extend(1_u64.to_le_bytes());
    let mut encoder = ZlibEncoder::new(vec![], Compression::fast());
    encoder.write_all(&huge).unwrap();
    let huge = [&good[..4], &encoder.finish().unwrap()].concat();
    check_messages(&[
        (
            refused(b"ply\n", 0),
            "m: expected a serialized mesh (0x041C) of version 3 or 4, found \"0x6c70, version 2681\"",
        ),
        (refused(&good[..3], 0), "m: the file ends before the end of its header"),
        (refused(&good[..20], 0), "m: the file ends before the end of its flags"),
        (
            refused(&good, 2),
            "m: mesh 2 of a file of 2 (from 0) is not supported; give a shape_index that there is",
        ),
        (refused(&many, 1), "m: the file ends before its list of offsets"),
        (refused(&mesh(4, SINGLE, 0.0, 7), 0), "m: the face refers to vertex 7, but there are 3 so far"),
        (refused(&mesh(4, DOUBLE, f64::NAN, 2), 0), "m: position 0 is not finite"),
        (refused(&huge, 0), "m: the file ends before the end of its 1152921504606846976 positions"),
    ]);
}
