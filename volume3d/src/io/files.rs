//! Whole files: reading, inflating, and writing so that no half a file is ever seen.

use std::fs::File;
use std::io::{BufWriter, Read, Write};
use std::path::Path;

use super::Error;

/// The most that a compressed file may become, so that a few kilobytes of hostile input cannot fill the
/// memory: 4 GiB, some 80 million triangles in binary PLY.
pub(super) const MAX_INFLATED: u64 = 1 << 32;

pub(super) fn read(path: &Path) -> Result<Vec<u8>, Error> {
    std::fs::read(path).map_err(|source| Error::File { action: "read", path: path.to_path_buf(), source })
}

/// The content of a gzip file.
pub(super) fn inflate(bytes: &[u8], path: &Path) -> Result<Vec<u8>, Error> {
    let error = |source| Error::File { action: "decompress", path: path.to_path_buf(), source };
    let mut content = vec![];
    let mut reader = flate2::read::MultiGzDecoder::new(bytes).take(MAX_INFLATED + 1);
    reader.read_to_end(&mut content).map_err(error)?;
    if content.len() as u64 > MAX_INFLATED {
        return Err(error(std::io::Error::other("it becomes larger than 4 GiB; decompress it before")));
    }
    Ok(content)
}

/// Writes a file under another name in the same directory and then renames it, so that `path` is at every
/// moment either what it was or complete, even if the program is killed.
pub(super) fn write(
    path: &Path,
    fill: impl FnOnce(&mut BufWriter<&mut File>) -> Result<(), Error>,
) -> Result<(), Error> {
    let error = |source| Error::File { action: "write", path: path.to_path_buf(), source };
    let directory = match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    };
    let mut file = builder().tempfile_in(directory).map_err(error)?;
    let mut writer = BufWriter::new(file.as_file_mut());
    fill(&mut writer)?;
    writer.flush().map_err(error)?;
    drop(writer);
    file.persist(path).map_err(|e| error(e.error))?;
    Ok(())
}

/// Writes a whole file so that it is at every moment what it was before, or complete.
///
/// # Errors
/// [`Error::File`].
pub fn write_bytes(path: &Path, bytes: &[u8]) -> Result<(), Error> {
    let error = |source| Error::File { action: "write", path: path.to_path_buf(), source };
    write(path, |file| file.write_all(bytes).map_err(error))
}

/// Temporary files are private by default, but this one is to stay: it gets the permissions of any other.
fn builder() -> tempfile::Builder<'static, 'static> {
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        let mut builder = tempfile::Builder::new();
        builder.permissions(std::fs::Permissions::from_mode(0o666));
        builder
    }
    #[cfg(not(unix))]
    tempfile::Builder::new()
}
