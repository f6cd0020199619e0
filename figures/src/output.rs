//! Result files. Each is encoded in memory, written beside its place under a temporary name and renamed, so
//! that any file found is complete, whenever the program was interrupted.

use std::{
    fs,
    io::{Cursor, Write},
    path::Path,
};

use anyhow::{Context, Result};
use image::{DynamicImage, ImageBuffer, ImageFormat, Rgb};

use serde::{Deserialize, Serialize};

use crate::plot::number;

/// One entry of a table.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(untagged)]
pub(crate) enum Cell {
    /// A count.
    Whole(i64),
    /// A real number, written with all its digits.
    Real(f64),
    /// Words.
    Text(String),
}

impl Cell {
    /// The entry for readers: three significant digits.
    pub(crate) fn shown(&self) -> String {
        match self {
            Self::Text(text) => text.clone(),
            Self::Real(value) => number(*value),
            Self::Whole(value) => value.to_string(),
        }
    }

    /// The entry for programs: the shortest digits that read back as the same number.
    fn exact(&self) -> String {
        match self {
            Self::Text(text) => text.clone(),
            Self::Real(value) => format!("{value:?}"),
            Self::Whole(value) => value.to_string(),
        }
    }
}

impl From<f64> for Cell {
    fn from(value: f64) -> Self {
        Self::Real(value)
    }
}

impl From<u32> for Cell {
    fn from(value: u32) -> Self {
        Self::Whole(value.into())
    }
}

impl From<usize> for Cell {
    fn from(value: usize) -> Self {
        i64::try_from(value).map_or(Self::Real(value as f64), Self::Whole)
    }
}

impl From<&str> for Cell {
    fn from(text: &str) -> Self {
        Self::Text(text.to_owned())
    }
}

impl From<String> for Cell {
    fn from(text: String) -> Self {
        Self::Text(text)
    }
}

/// A column's name, and its entry for an item.
type Column<'a, T> = (&'a str, &'a dyn Fn(&T) -> Cell);

/// Named columns and the rows under them.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, Serialize)]
pub(crate) struct Table {
    pub(crate) header: Vec<String>,
    /// Entries, one per column in each row.
    pub(crate) rows: Vec<Vec<Cell>>,
}

impl Table {
    /// One row per item; each column has a name and a function for its entry.
    pub(crate) fn of<T>(items: impl IntoIterator<Item = T>, columns: &[Column<'_, T>]) -> Self {
        let header = columns.iter().map(|(name, _)| (*name).to_owned()).collect();
        let row = |item: T| columns.iter().map(|(_, cell)| cell(&item)).collect();
        Self { header, rows: items.into_iter().map(row).collect() }
    }

    /// The table in Markdown, with numbers formatted for readers.
    pub(crate) fn markdown(&self) -> String {
        let line = |cells: Vec<String>| format!("| {} |\n", cells.join(" | "));
        let rule = self.header.iter().map(|_| "---".to_owned()).collect();
        let rows = self.rows.iter().map(|row| line(row.iter().map(Cell::shown).collect()));
        [line(self.header.clone()), line(rule)].into_iter().chain(rows).collect()
    }

    /// Appends a row, such as `[method.into(), variance.into()]`.
    pub(crate) fn row(&mut self, cells: impl IntoIterator<Item = Cell>) {
        self.rows.push(cells.into_iter().collect());
    }
}

/// Writes `bytes` to `path` atomically, creating its folder if needed.
pub(crate) fn write_bytes(path: &Path, bytes: &[u8]) -> Result<()> {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    fs::create_dir_all(folder).with_context(|| format!("making the folder {}", folder.display()))?;
    let mut builder = tempfile::Builder::new();
    builder.prefix(".unfinished-");
    #[cfg(unix)]
    {
        // Temporary files are private by default; results are not.
        use std::os::unix::fs::PermissionsExt;
        builder.permissions(fs::Permissions::from_mode(0o666));
    }
    let write = || -> std::io::Result<()> {
        let mut file = builder.tempfile_in(folder)?;
        file.write_all(bytes)?;
        file.as_file().sync_all()?;
        file.persist(path).map_err(|error| error.error)?;
        Ok(())
    };
    write().with_context(|| format!("writing {}", path.display()))
}

/// Writes a table as CSV; reals keep every digit.
pub(crate) fn write_csv(path: &Path, table: &Table) -> Result<()> {
    let encode = || -> Result<Vec<u8>> {
        let mut writer = csv::Writer::from_writer(Vec::new());
        writer.write_record(&table.header)?;
        for row in &table.rows {
            writer.write_record(row.iter().map(Cell::exact))?;
        }
        Ok(writer.into_inner().map_err(csv::IntoInnerError::into_error)?)
    };
    write_bytes(path, &encode().with_context(|| format!("encoding {}", path.display()))?)
}

/// Writes linear RGB values in rows of `width`, including signed ones, as OpenEXR in single precision.
pub(crate) fn write_exr(path: &Path, width: usize, pixels: &[[f32; 3]]) -> Result<()> {
    let (columns, rows) = (u32::try_from(width)?, u32::try_from(pixels.len() / width)?);
    let buffer = ImageBuffer::<Rgb<f32>, _>::from_raw(columns, rows, pixels.as_flattened().to_vec());
    let buffer = buffer.with_context(|| format!("{}: a picture of {columns}×{rows}", path.display()))?;
    let mut bytes = Cursor::new(Vec::new());
    let encoded = DynamicImage::ImageRgb32F(buffer).write_to(&mut bytes, ImageFormat::OpenExr);
    encoded.with_context(|| format!("encoding {}", path.display()))?;
    write_bytes(path, bytes.get_ref())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn writing_leaves_nothing_but_the_file() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("deeper/a.csv");
        for text in ["first", "second"] {
            write_bytes(&path, text.as_bytes()).unwrap();
            assert_eq!(fs::read_to_string(&path).unwrap(), text);
        }
        assert_eq!(fs::read_dir(path.parent().unwrap()).unwrap().count(), 1);
        // A folder occupies the file's path: the error names the file, and no temporary file remains.
        let error = format!("{:#}", write_bytes(path.parent().unwrap(), b"x").unwrap_err());
        assert!(error.contains("deeper"), "{error}");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[test]
    fn csv_reads_back_exactly() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.csv");
        let mut table = Table::of(
            [("a, \"b\"", 0.1 + 0.2, 16_usize), ("c", 1e-300, 4)],
            &[
                ("method", &|(method, ..)| (*method).into()),
                ("variance", &|(_, variance, _)| (*variance).into()),
                ("spp", &|(.., spp)| (*spp).into()),
            ],
        );
        write_csv(&path, &table).unwrap();
        let text = fs::read_to_string(&path).unwrap();
        assert_eq!(text, "method,variance,spp\n\"a, \"\"b\"\"\",0.30000000000000004,16\nc,1e-300,4\n");
        table.row(["too short".into()]);
        let error = format!("{:#}", write_csv(&path, &table).unwrap_err());
        assert!(error.contains("a.csv"), "{error}");
    }

    #[test]
    fn exr_keeps_signs() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.exr");
        write_exr(&path, 2, &[[-1.5; 3], [3e4; 3]]).unwrap();
        let read = image::open(&path).unwrap().to_rgb32f();
        assert_eq!(read.into_raw(), [-1.5, -1.5, -1.5, 3e4, 3e4, 3e4]);
    }
}
