//! Output files. Their paths are checked before any work.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use anyhow::bail;
use glam::DVec3;
use volume3d::Image;
use volume3d::io::{
    Array, Precision, destination, signed_range, write_exr_with_comments, write_npy, write_png_with_comments,
    write_signed_png_with_comments,
};

use super::report::{Outcome, Report};

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Format {
    Exr,
    Npy,
    Png,
}

/// The meaning of an image's pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Pixels {
    /// Not negative; a PNG has them in sRGB, clamped to [0, 1].
    Radiance,
    /// Of both signs; a PNG shows the mean of the channels, from blue over white to red.
    Signed,
}

/// Messages about written files, and whether all numbers in them are finite.
#[derive(Clone, Debug)]
pub(super) struct Written {
    pub(super) text: String,
    pub(super) outcome: Outcome,
    /// Notes about every image, for the headers of formats that have room for them.
    comments: String,
}

impl Written {
    /// No files yet; `text` is printed before the messages.
    pub(super) fn after(text: String) -> Self {
        Self { text, outcome: Outcome::Good, comments: String::new() }
    }

    /// Adds notes about how the scene deviates from its file to the headers of all images.
    pub(super) fn noting(mut self, deviations: &[String]) -> Self {
        self.comments = deviations.iter().map(|note| format!("note: {note}\n")).collect();
        self
    }

    /// Adds a message about numbers that are not finite, and sets the exit status.
    pub(super) fn not_finite(&mut self, what: &str) {
        let _ = writeln!(self.text, "NOT FINITE: {what}");
        self.outcome = Outcome::Bad;
    }

    pub(super) fn report(self) -> Report {
        Report { text: self.text, outcome: self.outcome }
    }
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

    /// A picture, which must be a PNG.
    pub(super) fn picture(path: &Path, pixels: Pixels) -> anyhow::Result<Self> {
        let output = Self::new(path, pixels)?;
        if output.format != Format::Png {
            bail!("{}: --png writes .png; use -o for other formats", path.display());
        }
        Ok(output)
    }

    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    /// Writes the image atomically, and adds a message.
    pub(super) fn write(&self, image: &Image, to: &mut Written) -> anyhow::Result<()> {
        self.write_with_comments(image, "", to)
    }

    /// Like [`write`](Self::write), with a text in the header after the notes; .npy has no room for it.
    pub(super) fn write_with_comments(
        &self,
        image: &Image,
        comments: &str,
        to: &mut Written,
    ) -> anyhow::Result<()> {
        let mut note = String::new();
        let comments = format!("{}{comments}", to.comments);
        match (self.format, self.pixels) {
            (Format::Exr, _) => write_exr_with_comments(&self.path, image, &comments)?,
            (Format::Npy, _) => write_npy(&self.path, &Array::from(image), Precision::Single)?,
            (Format::Png, Pixels::Radiance) => write_png_with_comments(&self.path, image, &comments)?,
            (Format::Png, Pixels::Signed) => {
                let range = signed_range(image);
                write_signed_png_with_comments(&self.path, image, range, &comments)?;
                note = format!(" (blue {:.3e}, white 0, red {range:.3e})", -range);
            }
        }
        // A PNG clamps finite values.
        let is_finite = |p: &DVec3| match self.format {
            Format::Exr | Format::Npy => p.as_vec3().is_finite(),
            Format::Png => p.is_finite(),
        };
        if let Some(first) = image.pixels.iter().position(|p| !is_finite(p)) {
            let count = image.pixels.iter().filter(|p| !is_finite(p)).count();
            let (column, row, path) = (first % image.width, first / image.width, self.path.display());
            to.not_finite(&format!(
                "{count} of {} pixels of {path}, such as column {column}, row {row}, which is {}; single precision ends \
                 at 3.4e38",
                image.pixels.len(),
                colour(image.pixels[first])
            ));
        }
        let _ = writeln!(to.text, "wrote {}{note}", self.path.display());
        Ok(())
    }
}

/// A colour as text; its values may be very large.
pub(super) fn colour(pixel: DVec3) -> String {
    let DVec3 { x, y, z } = pixel;
    format!("({x:.3e}, {y:.3e}, {z:.3e})")
}

fn extension(path: &Path) -> String {
    path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase()).unwrap_or_default()
}

/// Checks the file of an array, whose name must end in `.npy`.
pub(super) fn check_array(path: &Path) -> anyhow::Result<()> {
    check_file(path, "npy", "a derivative with respect to a parameter")
}

/// Checks a file that is written in one format only: its name must have this extension. `what` is for the
/// message.
pub(super) fn check_file(path: &Path, ending: &str, what: &str) -> anyhow::Result<()> {
    if extension(path) != ending {
        bail!("{}: {what} is written as .{ending}", path.display());
    }
    check_place(path)
}

/// Checks that a file can be created at `path`.
pub(super) fn check_place(path: &Path) -> anyhow::Result<()> {
    if path.is_dir() {
        bail!("{} is a folder; name a file in it", path.display());
    }
    let destination = destination(path);
    if destination.metadata().is_ok_and(|found| !found.is_file() && !found.is_dir()) {
        bail!("{} is a pipe or a device; outputs must be regular files", path.display());
    }
    let folder = folder(&destination);
    if !folder.is_dir() {
        bail!("{}: there is no folder {}; create it first", path.display(), folder.display());
    }
    // Finds now, not after hours of work, that the folder cannot be written to.
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

/// Refuses outputs that are inputs, and outputs that are the same file.
pub(super) fn check_distinct(outputs: &[&Path], inputs: &[PathBuf]) -> anyhow::Result<()> {
    for (i, output) in outputs.iter().enumerate() {
        if outputs[..i].iter().any(|other| same(output, other)) {
            bail!("{} would be written twice; give each output its own name", output.display());
        }
        if inputs.iter().any(|input| same(output, input)) {
            bail!("{} is an input and will not be overwritten; name another output", output.display());
        }
    }
    Ok(())
}

/// Whether two paths are the same file, which need not exist.
fn same(a: &Path, b: &Path) -> bool {
    let real = |path: &Path| {
        let path = destination(path);
        path.canonicalize().ok().or_else(|| Some(folder(&path).canonicalize().ok()?.join(path.file_name()?)))
    };
    a == b || real(a).is_some_and(|a| Some(a) == real(b))
}
