//! NumPy arrays.

use glam::DVec3;

use super::{check_table, here, message};
use crate::Image;
use crate::io::{Array, Precision, parse_npy, read_npy, write_npy};

/// What `numpy.save` writes for `array` with this dictionary.
fn file(dictionary: &str, data: &[u8]) -> Vec<u8> {
    let text = format!("{dictionary}\n");
    [b"\x93NUMPY\x01\x00", &(text.len() as u16).to_le_bytes()[..], text.as_bytes(), data].concat()
}

#[test]
fn round_trips() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.npy");
    for shape in [vec![], vec![6], vec![2, 3], vec![1, 2, 3, 1], vec![0, 3]] {
        let count = shape.iter().product();
        let values: Vec<f64> = (0..count).map(|i| (i as f64 - 2.5) / 4.0).collect();
        let array = Array { shape, values };
        for precision in [Precision::Single, Precision::Double] {
            write_npy(&path, &array, precision).unwrap();
            assert_eq!(read_npy(&path).unwrap(), array);
            let bytes = std::fs::read(&path).unwrap();
            let end = bytes.iter().position(|&b| b == b'\n').unwrap() + 1;
            assert_eq!(end % 64, 0, "the data are aligned");
        }
    }
    let special = Array { shape: vec![3], values: vec![f64::NEG_INFINITY, 0.1, f64::MIN_POSITIVE] };
    write_npy(&path, &special, Precision::Double).unwrap();
    assert_eq!(read_npy(&path).unwrap(), special);
}

/// The header is the one NumPy writes.
#[test]
fn the_header_is_that_of_numpy() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.npy");
    let array = Array { shape: vec![2], values: vec![1.0, 2.0] };
    write_npy(&path, &array, Precision::Single).unwrap();
    let mut expected = b"\x93NUMPY\x01\x00\x76\x00".to_vec();
    expected.extend(b"{'descr': '<f4', 'fortran_order': False, 'shape': (2,), }");
    expected.resize(127, b' ');
    expected.extend(b"\n\x00\x00\x80?\x00\x00\x00@");
    assert_eq!(std::fs::read(&path).unwrap(), expected);
}

#[test]
fn big_endian_and_other_versions() {
    let dictionary = "{\"shape\": (1, 2), 'fortran_order':False,'descr': '>f4'}";
    let data = [1.0_f32.to_be_bytes(), (-2.5_f32).to_be_bytes()].concat();
    let expected = Array { shape: vec![1, 2], values: vec![1.0, -2.5] };
    assert_eq!(parse_npy(&file(dictionary, &data), here("a.npy")).unwrap(), expected);
    let mut version2 = b"\x93NUMPY\x02\x00".to_vec();
    version2.extend((dictionary.len() as u32).to_le_bytes());
    version2.extend(dictionary.as_bytes());
    version2.extend(&data);
    assert_eq!(parse_npy(&version2, here("a.npy")).unwrap(), expected);
}

#[test]
fn images_are_arrays() {
    let image = Image { width: 2, height: 1, pixels: vec![DVec3::new(1.0, 2.0, 3.0), DVec3::X] };
    let array = Array::from(&image);
    assert_eq!(array.shape, [1, 2, 3]);
    assert_eq!(array.to_image(), Some(image));
    let grey = Array { shape: vec![1, 2], values: vec![1.0, 2.0] }.to_image().unwrap();
    assert_eq!(grey.pixels, [DVec3::ONE, 2.0 * DVec3::ONE]);
    assert_eq!(Array { shape: vec![2], values: vec![1.0, 2.0] }.to_image(), None);
}

#[test]
fn errors() {
    // The dictionary, and the number of bytes that follow.
    let unread = "cannot understand the header: expected";
    let shown = |text: String| text.replace("a.npy: ", "").replace(unread, "EXPECTED");
    check_table(
        r#"
[] 0
    EXPECTED {…}
{'a'} 0
    EXPECTED 'key': value
{'a': 1} 0
    EXPECTED 'descr', 'fortran_order' and 'shape'
{'descr': '<f4'} 0
    EXPECTED 'descr', 'fortran_order' and 'shape'
{'descr': '<f4', 'fortran_order': No, 'shape': ()} 4
    EXPECTED True or False as 'fortran_order'
{'descr': '<f4', 'fortran_order': False, 'shape': (-1,)} 0
    EXPECTED (n, …) as 'shape'
{'descr': [('r', '<f4')], 'fortran_order': False, 'shape': (1,)} 4
    EXPECTED one type, no structure, as 'descr'
{'descr': '<i8', 'fortran_order': False, 'shape': (1,)} 8
    numbers of type "<i8" are not supported; save as float32 or float64
{'descr': '<f4', 'fortran_order': True, 'shape': (2, 2)} 16
    Fortran order is not supported; save numpy.ascontiguousarray(array)
{'descr': '<f8', 'fortran_order': False, 'shape': (2, 2)} 16
    the shape asks for 32 bytes, but there are 16
{'descr': '<f8', 'fortran_order': False, 'shape': (4294967296, 4294967296)} 16
    the shape asks for more than 2^64 bytes, but there are 16
"#,
        |input| {
            let (dictionary, count) = input.rsplit_once(' ').unwrap();
            shown(message(parse_npy(&file(dictionary, &vec![0; count.parse().unwrap()]), here("a.npy"))))
        },
    );
    for short in [&b""[..], b"\x93NUMPY\x01\x00\xff\xff{"] {
        let found = message(parse_npy(short, here("a.npy")));
        assert_eq!(found, "a.npy: not an NPY file of version 1, 2 or 3");
    }
    let short = Array { shape: vec![2], values: vec![] };
    let found = message(write_npy(here("a.npy"), &short, Precision::Single));
    assert_eq!(found, "a.npy: the shape asks for [2] numbers, but there are 0");
}
