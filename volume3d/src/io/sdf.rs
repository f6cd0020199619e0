//! SDF grids in Mitsuba's binary volume format, version 3.
//!
//! "VOL", the version as a byte, the type of numbers (1 for float32), nodes along x, y and z, channels, as
//! 32-bit integers, the bounding box as six float32 numbers, then the nodes, x fastest; all little-endian.

use std::io::Write;
use std::path::Path;

use glam::DVec3;

use super::memory::with_room;
use super::{Error, GridProblem, files};
use crate::sdf::{Grid, Interpolation};

const HEADER: usize = 48;

/// Maximum displacement of nodes by rounding, in cells: no more than the resolution of distances in single
/// precision.
const MOVED: f64 = 1e-3;

/// Reads a grid; the file does not specify the interpolation.
///
/// The outermost nodes lie on the faces of the bounding box. (Mitsuba's `sdfgrid` puts them on those of [0,
/// 1]³ instead, and leaves the box to `to_world`.)
///
/// # Errors
/// [`Error::File`] or [`Error::Grid`].
pub fn read_sdf(path: &Path, interpolation: Interpolation) -> Result<Grid, Error> {
    parse_sdf(&files::read(path)?, path, interpolation)
}

/// [`read_sdf`] from memory. `path` is for messages.
///
/// # Errors
/// [`Error::Grid`].
pub fn parse_sdf(bytes: &[u8], path: &Path, interpolation: Interpolation) -> Result<Grid, Error> {
    let error = |problem| Error::Grid { path: path.to_path_buf(), problem };
    let Stored { size, low, high, nodes } = parse(bytes).map_err(error)?;
    grid(interpolation, (low, high), size, nodes).map_err(error)
}

/// [`parse_sdf`] with the outermost nodes on the faces of [0, 1]³, as in Mitsuba, or of the box of the file.
/// The bytes are freed before the grid is made.
pub(super) fn into_sdf(
    bytes: Vec<u8>,
    path: &Path,
    interpolation: Interpolation,
    keeps_box: bool,
) -> Result<Grid, Error> {
    let error = |problem| Error::Grid { path: path.to_path_buf(), problem };
    let Stored { size, low, high, nodes } = parse(&bytes).map_err(error)?;
    drop(bytes);
    let corners = if keeps_box { (low, high) } else { (DVec3::ZERO, DVec3::ONE) };
    grid(interpolation, corners, size, nodes).map_err(error)
}

fn grid(
    interpolation: Interpolation,
    (low, high): (DVec3, DVec3),
    size: [usize; 3],
    nodes: Vec<f64>,
) -> Result<Grid, GridProblem> {
    let cells = DVec3::from_array(size.map(|n| n as f64 - 1.0));
    Ok(Grid::new(interpolation, low, (high - low) / cells, size, nodes)?)
}

/// Content of a file.
struct Stored {
    size: [usize; 3],
    low: DVec3,
    high: DVec3,
    nodes: Vec<f64>,
}

/// Writes a grid in single precision, atomically.
///
/// # Errors
/// [`Error::File`], or [`Error::Grid`] if single precision cannot hold a number, or moves a corner of the
/// box by more than a thousandth of a cell.
pub fn write_sdf(path: &Path, grid: &Grid) -> Result<(), Error> {
    let problem = |problem| Error::Grid { path: path.to_path_buf(), problem };
    let single = |what: &'static str, index: usize, value: f64| {
        let rounded = value as f32;
        if rounded.is_finite() { Ok(rounded) } else { Err(GridProblem::Single { what, index, value }) }
    };
    let mut bytes = with_room(HEADER + 4 * grid.nodes().len(), "the grid").map_err(|e| problem(e.into()))?;
    bytes.extend(*b"VOL\x03");
    let size = grid.size().map(i32::try_from);
    let [Ok(nx), Ok(ny), Ok(nz)] = size else {
        let size = grid.size();
        let found = grid.nodes().len();
        return Err(problem(crate::sdf::GridError::Count { size, found }.into()));
    };
    bytes.extend([1, nx, ny, nz, 1].iter().flat_map(|n: &i32| n.to_le_bytes()));
    let corners = [("low corner", grid.low()), ("high corner", grid.high())];
    let corners = corners.iter().flat_map(|(what, p)| (0..3).map(|axis| (*what, axis, p[axis])));
    let nodes = grid.nodes().iter().enumerate().map(|(index, &value)| ("node", index, value));
    for (what, index, value) in corners.chain(nodes) {
        bytes.extend(single(what, index, value).map_err(problem)?.to_le_bytes());
    }
    // In single precision a corner may move by half a unit in its last place, and all nodes with it.
    let rounding = (grid.low() - grid.low().as_vec3().as_dvec3()).abs();
    let rounding = rounding.max((grid.high() - grid.high().as_vec3().as_dvec3()).abs()) / grid.spacing();
    if rounding.max_element() > MOVED {
        return Err(problem(GridProblem::Far { cells: rounding.max_element() }));
    }
    let error = |source| Error::File { action: "write", path: path.to_path_buf(), source };
    files::write(path, |file| file.write_all(&bytes).map_err(error))
}

fn parse(bytes: &[u8]) -> Result<Stored, GridProblem> {
    let rest = bytes.strip_prefix(b"VOL").ok_or(GridProblem::Magic)?;
    let found = bytes.len();
    let (&version, _) = rest.split_first().ok_or(GridProblem::Header { found })?;
    if version != 3 {
        return Err(GridProblem::Version { found: version });
    }
    let (header, data) = bytes.split_at_checked(HEADER).ok_or(GridProblem::Header { found })?;
    let word = |i: usize| [0, 1, 2, 3].map(|k| header[4 + 4 * i + k]);
    let integer = |i: usize| i32::from_le_bytes(word(i));
    let number = |i: usize| f64::from(f32::from_le_bytes(word(i)));
    if integer(0) != 1 {
        return Err(GridProblem::Type { found: integer(0) });
    }
    if integer(4) != 1 {
        return Err(GridProblem::Channels { found: integer(4) });
    }
    let announced = [1, 2, 3].map(integer);
    let [Ok(nx), Ok(ny), Ok(nz)] = announced.map(usize::try_from) else {
        return Err(GridProblem::Size { size: announced });
    };
    let size = [nx, ny, nz];
    // Less than 2³¹ along each axis: 128 bits hold four times their product.
    let expected = HEADER as u128 + 4 * size.iter().map(|&n| n as u128).product::<u128>();
    if expected != found as u128 {
        return Err(GridProblem::Length { size, expected, found });
    }
    let mut nodes = with_room(data.len() / 4, "the nodes")?;
    nodes.extend(data.as_chunks::<4>().0.iter().map(|&word| f64::from(f32::from_le_bytes(word))));
    let [low, high] = [5, 8].map(|i| DVec3::new(number(i), number(i + 1), number(i + 2)));
    Ok(Stored { size, low, high, nodes })
}
