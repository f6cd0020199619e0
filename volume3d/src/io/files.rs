//! Whole files: reading, decompression, and atomic writing.

use std::fs::File;
use std::io::{BufReader, BufWriter, ErrorKind, Read, Write};
use std::path::{Path, PathBuf};

use super::Error;

/// Maximum size of a decompressed file, so that a few kilobytes of hostile input cannot exhaust the memory: 4
/// GiB, some 80 million triangles in binary PLY.
pub(super) const MAX_INFLATED: u64 = 1 << 32;

/// Maximum decompression ratio of a mesh. Text and binary mesh files grow 2 to 10 times, and 40 times where
/// all normals and colours are equal; deflate can reach 1032 times, by repeating one line.
const MOST_INFLATION: u64 = 64;
/// Size up to which a decompressed mesh is accepted at any ratio.
const SMALL: u64 = 1 << 26;

/// Reads a regular file or the target of a link to one. A pipe or a device is an error: reading it may never
/// end or never begin.
///
/// # Errors
/// The errors of [`std::fs::read`], or [`ErrorKind::InvalidInput`] for a file that is not regular.
pub fn read_bytes(path: &Path) -> std::io::Result<Vec<u8>> {
    check_regular(path)?;
    std::fs::read(path)
}

fn check_regular(path: &Path) -> std::io::Result<()> {
    // Opening a pipe blocks until a writer opens it.
    let kind = std::fs::metadata(path)?.file_type();
    if !kind.is_file() && !kind.is_dir() {
        let why = "it is a pipe or a device, and only regular files are read";
        return Err(std::io::Error::new(ErrorKind::InvalidInput, why));
    }
    Ok(())
}

/// Opens a regular file of which only the beginning is needed.
pub(super) fn open(path: &Path) -> Result<BufReader<File>, Error> {
    let opened = check_regular(path).and_then(|()| File::open(path));
    opened.map(BufReader::new).map_err(|source| Error::File {
        action: "read",
        path: path.to_path_buf(),
        source,
    })
}

/// [`read_bytes`] for UTF-8 text.
///
/// # Errors
/// Its errors, or [`ErrorKind::InvalidData`].
pub fn read_text(path: &Path) -> std::io::Result<String> {
    String::from_utf8(read_bytes(path)?).map_err(|e| std::io::Error::new(ErrorKind::InvalidData, e))
}

pub(super) fn read(path: &Path) -> Result<Vec<u8>, Error> {
    read_bytes(path).map_err(|source| Error::File { action: "read", path: path.to_path_buf(), source })
}

/// Decompresses a gzip file.
pub(super) fn inflate(bytes: &[u8], path: &Path) -> Result<Vec<u8>, Error> {
    let error = |source| Error::File { action: "decompress", path: path.to_path_buf(), source };
    let most = (bytes.len() as u64).saturating_mul(MOST_INFLATION).clamp(SMALL, MAX_INFLATED);
    let mut content = vec![];
    let mut reader = flate2::read::MultiGzDecoder::new(bytes).take(most + 1);
    reader.read_to_end(&mut content).map_err(error)?;
    if content.len() as u64 > most {
        let why = format!(
            "it becomes larger than {} MiB, of {} KiB; decompress it before if it is a mesh",
            most >> 20,
            bytes.len() >> 10
        );
        return Err(error(std::io::Error::other(why)));
    }
    Ok(content)
}

/// The destination of a write: the target of a link, whether or not it exists yet, otherwise the path itself.
#[must_use]
pub fn destination(path: &Path) -> PathBuf {
    /// Maximum number of symbolic links that Linux follows.
    const MOST_LINKS: usize = 40;
    let mut path = path.to_path_buf();
    for _ in 0..MOST_LINKS {
        let Ok(target) = std::fs::read_link(&path) else { break };
        path = path.parent().unwrap_or(Path::new("")).join(target);
    }
    path
}

/// Atomic write: writes a temporary file in the same directory and then renames it, so that at every moment
/// `path` is either what it was or complete, even if the program is killed or the machine goes down. A link
/// stays and its target is replaced; a replaced file passes on its permissions. A pipe or a device is not
/// replaced.
pub(super) fn write(
    path: &Path,
    fill: impl FnOnce(&mut BufWriter<&mut File>) -> Result<(), Error>,
) -> Result<(), Error> {
    let error = |source| Error::File { action: "write", path: path.to_path_buf(), source };
    let destination = destination(path);
    let directory = match destination.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    };
    let old = std::fs::metadata(&destination).ok();
    if old.as_ref().is_some_and(|old| !old.is_file() && !old.is_dir()) {
        let why = "it is a pipe or a device, and only regular files are written";
        return Err(error(std::io::Error::new(ErrorKind::InvalidInput, why)));
    }
    let mut file = builder().tempfile_in(directory).map_err(error)?;
    let mut writer = BufWriter::new(file.as_file_mut());
    fill(&mut writer)?;
    writer.flush().map_err(error)?;
    drop(writer);
    if let Some(old) = old.filter(std::fs::Metadata::is_file) {
        file.as_file().set_permissions(old.permissions()).map_err(error)?;
    }
    // Without it the name may reach the disk before the content.
    file.as_file().sync_all().map_err(error)?;
    file.persist(&destination).map_err(|e| error(e.error))?;
    #[cfg(unix)]
    File::open(directory).and_then(|directory| directory.sync_all()).map_err(error)?;
    Ok(())
}

/// Writes a whole file atomically: at every moment it is what it was before, or complete.
///
/// # Errors
/// [`Error::File`].
pub fn write_bytes(path: &Path, bytes: &[u8]) -> Result<(), Error> {
    let error = |source| Error::File { action: "write", path: path.to_path_buf(), source };
    write(path, |file| file.write_all(bytes).map_err(error))
}

/// Temporary files are private by default, but this one becomes permanent: it gets ordinary permissions.
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
