//! Grids of signed distances.

use glam::DVec3;

use super::{check_messages, here, message};
use crate::io::{parse_sdf, read_sdf, write_sdf};
use crate::sdf::{Grid, Interpolation};

/// A grid whose numbers are exact in single precision.
fn grid() -> Grid {
    let nodes = (0..24).map(|i| f64::from(i) / 8.0 - 1.0).collect();
    let (low, spacing) = (DVec3::new(-1.0, 0.5, 2.0), DVec3::new(0.5, 0.25, 2.0));
    Grid::new(Interpolation::Cubic, low, spacing, [2, 3, 4], nodes).unwrap()
}

pub(super) fn file() -> Vec<u8> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.vol");
    write_sdf(&path, &grid()).unwrap();
    assert_eq!(read_sdf(&path, Interpolation::Cubic).unwrap(), grid());
    std::fs::read(&path).unwrap()
}

#[test]
fn the_file_is_that_of_mitsuba() {
    let mut expected = b"VOL\x03".to_vec();
    expected.extend([1, 2, 3, 4, 1].iter().flat_map(|n: &i32| n.to_le_bytes()));
    expected.extend([-1.0, 0.5, 2.0, -0.5, 1.0, 8.0].iter().flat_map(|x: &f32| x.to_le_bytes()));
    expected.extend((0..24_u8).flat_map(|i| (f32::from(i) / 8.0 - 1.0).to_le_bytes()));
    assert_eq!(file(), expected);
}

#[test]
fn errors_say_what_is_wrong() {
    let refused = |change: &dyn Fn(&mut Vec<u8>)| {
        let mut bytes = file();
        change(&mut bytes);
        message(parse_sdf(&bytes, here("a.vol"), Interpolation::Cubic))
    };
    let word =
        |at: usize, value: [u8; 4]| refused(&move |b: &mut Vec<u8>| b[at..at + 4].copy_from_slice(&value));
    let huge = i32::MAX.to_le_bytes();
    check_messages(&[
        (refused(&|b| b[0] = b'W'), "a.vol: not a Mitsuba volume: it does not begin with \"VOL\""),
        (refused(&Vec::clear), "a.vol: not a Mitsuba volume: it does not begin with \"VOL\""),
        (refused(&|b| b[3] = 4), "a.vol: version 4 of the volume format is not supported; expected 3"),
        (refused(&|b| b.truncate(47)), "a.vol: the file ends after 47 bytes, within its header of 48"),
        (word(4, [2, 0, 0, 0]), "a.vol: numbers of type 2 are not supported; write float32, type 1"),
        (word(20, [3, 0, 0, 0]), "a.vol: 3 channels; a grid of distances has 1"),
        (word(8, [0xff; 4]), "a.vol: a size of -1 × 3 × 4 nodes"),
        (word(8, huge), "a.vol: 2147483647 × 3 × 4 nodes take 103079215104 bytes, but the file has 144"),
        (refused(&|b| b.truncate(143)), "a.vol: 2 × 3 × 4 nodes take 144 bytes, but the file has 143"),
        (refused(&|b| b.push(0)), "a.vol: 2 × 3 × 4 nodes take 144 bytes, but the file has 145"),
        (word(60, f32::NAN.to_le_bytes()), "a.vol: node (1, 1, 0) is NaN; every node must be finite"),
    ]);
    let place = word(24, f32::INFINITY.to_le_bytes());
    assert!(place.starts_with("a.vol: invalid grid: the low corner "), "{place}");
    let far =
        Grid::new(Interpolation::Cubic, DVec3::splat(1e39), DVec3::ONE, [2, 3, 4], grid().nodes().to_vec());
    let folder = tempfile::tempdir().unwrap();
    let text = message(write_sdf(&folder.path().join("a.vol"), &far.unwrap()));
    assert!(
        text.ends_with("low corner 0 is 1000000000000000000000000000000000000000, which float32 cannot hold"),
        "{text}"
    );
}
