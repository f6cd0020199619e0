//! Files to be written: everything that could forbid it is asked before any work.

use std::path::{Path, PathBuf};

use anyhow::bail;
use volume3d::Image;
use volume3d::io::{
    Array, Precision, signed_range, write_exr_with_comments, write_npy, write_png, write_signed_png,
};

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Format {
    Exr,
    Npy,
    Png,
}

/// What the pixels of an image are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Pixels {
    /// Not negative; a PNG shows them in sRGB, clamped to [0, 1].
    Radiance,
    /// Of both signs; a PNG shows the mean of the channels from blue over white to red.
    Signed,
}

/// An image file to be written, in a folder that exists.
#[derive(Clone, Debug)]
pub(super) struct Output {
    path: PathBuf,
    format: Format,
    pixels: Pixels,
}

impl Output {
    pub(super) fn new(path: &Path, pixels: Pixels) -> anyhow::Result<Self> {
        let format = match extension(path).as_str() {
            "exr" => Format::Exr,
            "npy" => Format::Npy,
            "png" => Format::Png,
            _ => bail!("{}: an image is written as .exr, .npy or .png", path.display()),
        };
        check_place(path)?;
        Ok(Self { path: path.to_path_buf(), format, pixels })
    }

    /// A picture, which can only be a PNG.
    pub(super) fn picture(path: &Path, pixels: Pixels) -> anyhow::Result<Self> {
        let output = Self::new(path, pixels)?;
        if output.format != Format::Png {
            bail!("{}: --png writes .png; see -o for the others", path.display());
        }
        Ok(output)
    }

    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    /// Writes the image, atomically, and says what was written.
    pub(super) fn write(&self, image: &Image) -> anyhow::Result<String> {
        self.write_with_comments(image, "")
    }

    /// The same, with a text in the header of an .exr.
    pub(super) fn write_with_comments(&self, image: &Image, comments: &str) -> anyhow::Result<String> {
        let mut note = String::new();
        match (self.format, self.pixels) {
            (Format::Exr, _) => write_exr_with_comments(&self.path, image, comments)?,
            (Format::Npy, _) => write_npy(&self.path, &Array::from(image), Precision::Single)?,
            (Format::Png, Pixels::Radiance) => write_png(&self.path, image)?,
            (Format::Png, Pixels::Signed) => {
                let range = signed_range(image);
                write_signed_png(&self.path, image, range)?;
                note = format!(" (blue {:.3e}, white 0, red {range:.3e})", -range);
            }
        }
        Ok(format!("wrote {}{note}\n", self.path.display()))
    }
}

fn extension(path: &Path) -> String {
    path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase()).unwrap_or_default()
}

/// An array's file, whose name must end in `.npy`.
pub(super) fn check_array(path: &Path) -> anyhow::Result<()> {
    check_file(path, "npy", "the derivative by a parameter")
}

/// A file of something that is written in one format alone, whose name must end so.
pub(super) fn check_file(path: &Path, ending: &str, what: &str) -> anyhow::Result<()> {
    if extension(path) != ending {
        bail!("{}: {what} is written as .{ending}", path.display());
    }
    check_place(path)
}

/// Whether a file can be made at `path`.
pub(super) fn check_place(path: &Path) -> anyhow::Result<()> {
    if path.is_dir() {
        bail!("{} is a folder; name a file in it", path.display());
    }
    let folder = folder(path);
    if !folder.is_dir() {
        bail!("{}: there is no folder {}; make it first", path.display(), folder.display());
    }
    // Hours of work are not to end at a folder that cannot be written to.
    if let Err(error) = tempfile::tempfile_in(folder) {
        bail!("{}: cannot write into the folder {}: {error}", path.display(), folder.display());
    }
    Ok(())
}

fn folder(path: &Path) -> &Path {
    match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    }
}

/// Refuses to write over what was read, and to write twice to one place.
pub(super) fn check_distinct(outputs: &[&Path], inputs: &[PathBuf]) -> anyhow::Result<()> {
    for (i, output) in outputs.iter().enumerate() {
        if outputs[..i].iter().any(|other| same(output, other)) {
            bail!("{} would be written twice; give each output a name of its own", output.display());
        }
        if inputs.iter().any(|input| same(output, input)) {
            bail!("{} is read and will not be overwritten; name another output", output.display());
        }
    }
    Ok(())
}

/// Whether two paths mean one file, be it there yet or not.
fn same(a: &Path, b: &Path) -> bool {
    let real = |path: &Path| {
        path.canonicalize().ok().or_else(|| Some(folder(path).canonicalize().ok()?.join(path.file_name()?)))
    };
    a == b || real(a).is_some_and(|a| Some(a) == real(b))
}
