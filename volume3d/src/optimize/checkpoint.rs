//! Checkpoints: the state of a fit in a file.

use std::path::{Path, PathBuf};

use super::fit::State;
use crate::io::Error;

/// The first bytes of the file, with the format version.
const HEADER: &[u8] = b"volume3d fit, state 3\n";

/// Why a checkpoint cannot be read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CheckpointError {
    /// The file cannot be read.
    #[error(transparent)]
    File(#[from] Error),
    /// The file is not a checkpoint, or is damaged.
    #[error("{} is not the state of a fit, or is damaged; remove it to start from the beginning", path.display())]
    Format {
        /// The file.
        path: PathBuf,
    },
    /// The checkpoint belongs to other input.
    #[error("{} is the state of another fit: its configuration, scene or pictures were not these", path.display())]
    Other {
        /// The file.
        path: PathBuf,
    },
}

/// Writes a state atomically: at every moment the file is what it was before, or complete. `fingerprint`
/// identifies the input of the fit.
///
/// # Errors
/// [`Error::File`].
pub fn write_checkpoint(path: &Path, state: &State, fingerprint: u32) -> Result<(), Error> {
    let error = |source| Error::File { action: "write", path: path.to_path_buf(), source };
    let bytes = encode_state(state, fingerprint).map_err(|e| error(std::io::Error::other(e)))?;
    crate::io::write_bytes(path, &bytes)
}

/// A state as bytes, those of the file of [`write_checkpoint`].
///
/// # Errors
/// [`postcard::Error`] if memory does not suffice.
pub fn encode_state(state: &State, fingerprint: u32) -> Result<Vec<u8>, postcard::Error> {
    let content = postcard::to_stdvec(state)?;
    let mut bytes = HEADER.to_vec();
    bytes.extend(fingerprint.to_le_bytes());
    bytes.extend(crc32fast::hash(&content).to_le_bytes());
    bytes.extend(content);
    Ok(bytes)
}

/// Why bytes are not a state.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum StateError {
    /// The bytes are not a state, or are damaged.
    #[error("this is not the state of a fit, or it is damaged")]
    Format,
    /// The state belongs to other input.
    #[error("this is the state of another fit: its configuration, scene or pictures were not these")]
    Other,
}

/// A state from the bytes of [`encode_state`], bit for bit.
///
/// # Errors
/// A [`StateError`].
pub fn decode_state(bytes: &[u8], fingerprint: u32) -> Result<State, StateError> {
    let rest = bytes.strip_prefix(HEADER).ok_or(StateError::Format)?;
    let (of, rest) = rest.split_first_chunk::<4>().ok_or(StateError::Format)?;
    let (sum, content) = rest.split_first_chunk::<4>().ok_or(StateError::Format)?;
    if crc32fast::hash(content) != u32::from_le_bytes(*sum) {
        return Err(StateError::Format);
    }
    if u32::from_le_bytes(*of) != fingerprint {
        return Err(StateError::Other);
    }
    postcard::from_bytes(content).map_err(|_| StateError::Format)
}

/// Reads a state written by [`write_checkpoint`], bit for bit; `None` if the file does not exist.
///
/// # Errors
/// A [`CheckpointError`].
pub fn read_checkpoint(path: &Path, fingerprint: u32) -> Result<Option<State>, CheckpointError> {
    let bytes = match crate::io::read_bytes(path) {
        Ok(bytes) => bytes,
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(None),
        Err(source) => {
            return Err(Error::File { action: "read", path: path.to_path_buf(), source }.into());
        }
    };
    decode_state(&bytes, fingerprint).map(Some).map_err(|error| match error {
        StateError::Format => CheckpointError::Format { path: path.to_path_buf() },
        StateError::Other => CheckpointError::Other { path: path.to_path_buf() },
    })
}
