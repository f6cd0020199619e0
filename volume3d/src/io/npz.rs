//! Archives of NumPy arrays (NPZ); only single matrices are read.

use std::collections::BTreeMap;
use std::io::Read;

use flate2::read::DeflateDecoder;
use glam::DMat4;
use rawzip::{CompressionMethod, ZipArchive, ZipArchiveEntryWayfinder, ZipSliceArchive};

use super::error::excerpt;
use super::npy::parse_matrix;
use super::{Array, DtuProblem};

/// Maximum decompressed size of a matrix with its header, in bytes; NumPy writes 256.
const LARGEST: u64 = 1 << 16;

/// The extension of a member's name, which is not part of the array's.
const ENDING: &[u8] = b".npy";

/// NPZ archive with the index of its members.
pub(super) struct Npz<'a> {
    archive: ZipSliceArchive<&'a [u8]>,
    members: BTreeMap<Vec<u8>, (CompressionMethod, ZipArchiveEntryWayfinder)>,
}

impl<'a> Npz<'a> {
    /// Reads the list of arrays.
    pub(super) fn new(bytes: &'a [u8]) -> Result<Self, DtuProblem> {
        let archive = ZipArchive::from_slice(bytes)?;
        let mut members = BTreeMap::new();
        for entry in archive.entries() {
            let entry = entry?;
            let path = entry.file_path();
            let Some(name) = path.as_bytes().strip_suffix(ENDING) else { continue };
            if members.insert(name.to_vec(), (entry.compression_method(), entry.wayfinder())).is_some() {
                let array = excerpt(&String::from_utf8_lossy(name));
                return Err(DtuProblem::Twice { array });
            }
        }
        Ok(Self { archive, members })
    }

    /// Whether the archive has an array of this name.
    pub(super) fn has(&self, name: &str) -> bool {
        self.members.contains_key(name.as_bytes())
    }

    /// Reads a 4 × 4 matrix with finite entries.
    pub(super) fn matrix(&self, name: &str) -> Result<DMat4, DtuProblem> {
        let array = || name.to_owned();
        let Some(&(method, place)) = self.members.get(name.as_bytes()) else {
            return Err(DtuProblem::Missing { array: array() });
        };
        let bytes = self.inflate(method, place, name)?;
        let numbers = parse_matrix(&bytes);
        let Array { shape, values } =
            numbers.map_err(|problem| DtuProblem::Array { array: array(), problem })?;
        if shape != [4, 4] {
            return Err(DtuProblem::Shape { array: array(), found: shape });
        }
        if let Some(index) = values.iter().position(|x| !x.is_finite()) {
            let (array, row, column) = (array(), index / 4, index % 4);
            return Err(DtuProblem::NotFinite { array, row, column, value: values[index] });
        }
        let mut matrix = DMat4::ZERO;
        for (index, value) in values.into_iter().enumerate() {
            matrix.col_mut(index % 4)[index / 4] = value;
        }
        Ok(matrix)
    }

    fn inflate(
        &self,
        method: CompressionMethod,
        place: ZipArchiveEntryWayfinder,
        name: &str,
    ) -> Result<Vec<u8>, DtuProblem> {
        let array = || name.to_owned();
        let entry = self.archive.get_entry(place)?;
        let mut bytes = vec![];
        let error = |source| DtuProblem::Damaged { array: array(), source };
        let size = match method {
            CompressionMethod::STORE => {
                entry.verifying_reader(entry.data()).take(LARGEST).read_to_end(&mut bytes)
            }
            CompressionMethod::DEFLATE => entry
                .verifying_reader(DeflateDecoder::new(entry.data()))
                .take(LARGEST)
                .read_to_end(&mut bytes),
            _ => return Err(DtuProblem::Compression { array: array() }),
        };
        if size.map_err(error)? as u64 == LARGEST {
            return Err(DtuProblem::TooLarge { array: array(), limit: LARGEST });
        }
        Ok(bytes)
    }
}
