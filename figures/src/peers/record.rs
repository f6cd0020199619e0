//! Measurements in a file that grows row by row, so that an interrupted run goes on where it was.

use std::path::{Path, PathBuf};
use std::str::FromStr;

use anyhow::{Context as _, anyhow, ensure};
use clap::ValueEnum as _;

use super::case::{FilterName, Group, Normals, word};
use crate::output::{Table, write_csv};
use crate::space::Measured;

/// What decides a measurement: with the same settings it is not made again.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Settings {
    pub(super) group: Group,
    /// The method's key.
    pub(super) method: String,
    pub(super) samples: usize,
    pub(super) runs: usize,
    pub(super) seed: u32,
    pub(super) threads: usize,
}

/// A measurement of one method on one case.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Row {
    pub(super) settings: Settings,
    /// Of one run: processor time of all threads over their number.
    pub(super) seconds: f64,
    pub(super) measured: Measured,
    /// The reference's own noise, relative to its mean square.
    pub(super) noise: f64,
    /// Mean radiance over that of the reference image: 1 if the scene is read as it was meant.
    pub(super) radiance: f64,
    /// Auxiliary rays of one run.
    pub(super) auxiliary_rays: u64,
    pub(super) non_finite: usize,
}

fn table(rows: &[Row]) -> Table {
    Table::of(
        rows,
        &[
            ("scene", &|row| row.settings.group.scene.as_str().into()),
            ("normals", &|row| word(row.settings.group.normals).into()),
            ("filter", &|row| word(row.settings.group.filter).into()),
            ("method", &|row| row.settings.method.as_str().into()),
            ("spp", &|row| row.settings.samples.into()),
            ("runs", &|row| row.settings.runs.into()),
            ("seed", &|row| row.settings.seed.into()),
            ("threads", &|row| row.settings.threads.into()),
            ("seconds", &|row| row.seconds.into()),
            ("rel_variance", &|row| row.measured.variance.into()),
            ("rel_variance_error", &|row| row.measured.variance_error.into()),
            ("rel_bias2", &|row| row.measured.bias2.into()),
            ("rel_bias2_error", &|row| row.measured.bias2_error.into()),
            ("slope", &|row| row.measured.slope.into()),
            ("slope_error", &|row| row.measured.slope_error.into()),
            ("reference_noise", &|row| row.noise.into()),
            ("radiance_ratio", &|row| row.radiance.into()),
            ("auxiliary_rays", &|row| (row.auxiliary_rays as usize).into()),
            ("non_finite", &|row| row.non_finite.into()),
        ],
    )
}

/// The file and what stands in it.
pub(super) struct Records {
    path: PathBuf,
    pub(super) rows: Vec<Row>,
}

impl Records {
    /// What the file holds; nothing if there is none.
    pub(super) fn open(path: PathBuf) -> anyhow::Result<Self> {
        let rows = match std::fs::read(&path) {
            Ok(text) => parse(&text).with_context(|| path.display().to_string())?,
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => vec![],
            Err(error) => return Err(error).with_context(|| format!("cannot read {}", path.display())),
        };
        Ok(Self { path, rows })
    }

    /// The measurement with these settings.
    pub(super) fn find(&self, settings: &Settings) -> Option<&Row> {
        self.rows.iter().find(|row| row.settings == *settings)
    }

    /// Adds a row in place of one with the same settings, and writes the whole file in one step.
    pub(super) fn add(&mut self, row: Row) -> anyhow::Result<()> {
        self.rows.retain(|other| other.settings != row.settings);
        self.rows.push(row);
        write_csv(&self.path, &table(&self.rows))
    }

    pub(super) fn path(&self) -> &Path {
        &self.path
    }
}

fn parse(text: &[u8]) -> anyhow::Result<Vec<Row>> {
    let mut reader = csv::Reader::from_reader(text);
    ensure!(
        reader.headers()?.iter().eq(&table(&[]).header),
        "its columns are not those that are written here; remove it, or choose another --out"
    );
    let mut rows = vec![];
    for record in reader.records() {
        let record = record?;
        let line = record.position().map_or(0, csv::Position::line);
        rows.push(row(&record).with_context(|| format!("line {line}"))?);
    }
    Ok(rows)
}

fn row(record: &csv::StringRecord) -> anyhow::Result<Row> {
    fn field<T: FromStr>(record: &csv::StringRecord, i: usize) -> anyhow::Result<T> {
        let text = record.get(i).unwrap_or_default();
        text.parse().map_err(|_| anyhow!("“{text}” as {}", table(&[]).header[i]))
    }
    let choice = |i: usize| record.get(i).unwrap_or_default();
    let real = |i: usize| field::<f64>(record, i);
    let group = Group {
        scene: field(record, 0)?,
        normals: Normals::from_str(choice(1), false).map_err(|e| anyhow!(e))?,
        filter: FilterName::from_str(choice(2), false).map_err(|e| anyhow!(e))?,
    };
    Ok(Row {
        settings: Settings {
            group,
            method: field(record, 3)?,
            samples: field(record, 4)?,
            runs: field(record, 5)?,
            seed: field(record, 6)?,
            threads: field(record, 7)?,
        },
        seconds: real(8)?,
        measured: Measured {
            variance: real(9)?,
            variance_error: real(10)?,
            bias2: real(11)?,
            bias2_error: real(12)?,
            slope: real(13)?,
            slope_error: real(14)?,
        },
        noise: real(15)?,
        radiance: real(16)?,
        auxiliary_rays: field(record, 17)?,
        non_finite: field(record, 18)?,
    })
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// A measurement with given variance · seconds and bias².
    pub(in super::super) fn some_row(method: &str, variance: f64, bias2: f64) -> Row {
        let group = Group { scene: "s".to_owned(), normals: Normals::Face, filter: FilterName::Tent };
        let measured = Measured {
            variance,
            variance_error: 0.1 + 0.2,
            bias2,
            bias2_error: 1e-17,
            slope: 0.99,
            slope_error: 0.01,
        };
        Row {
            settings: Settings {
                group,
                method: method.to_owned(),
                samples: 16,
                runs: 4,
                seed: 1,
                threads: 2,
            },
            seconds: 0.5,
            measured,
            noise: 0.001,
            radiance: 1.0001,
            auxiliary_rays: 12,
            non_finite: 0,
        }
    }

    #[test]
    fn what_is_written_is_found_again() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("deeper/runs.csv");
        let mut records = Records::open(path.clone()).unwrap();
        assert!(records.rows.is_empty());
        let rows = [some_row("a", 0.1, -1e-3), some_row("b", 2.0, 0.5)];
        for row in &rows {
            records.add(row.clone()).unwrap();
        }
        let mut again = Records::open(path.clone()).unwrap();
        assert_eq!(again.rows, rows);
        assert_eq!(again.find(&rows[1].settings), Some(&rows[1]));
        let other = Settings { samples: 17, ..rows[1].settings.clone() };
        assert_eq!(again.find(&other), None);
        // A second measurement with the same settings takes the place of the first.
        again.add(Row { seconds: 7.0, ..rows[0].clone() }).unwrap();
        assert_eq!(again.rows.len(), 2);
        assert_eq!(Records::open(path).unwrap().find(&rows[0].settings).unwrap().seconds, 7.0);
    }

    #[test]
    fn what_is_not_ours_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("runs.csv");
        std::fs::write(&path, "a,b\n1,2\n").unwrap();
        let error = format!("{:#}", Records::open(path.clone()).err().unwrap());
        assert!(error.contains("runs.csv") && error.contains("--out"), "{error}");
        let mut records = Records { path: path.clone(), rows: vec![] };
        records.add(some_row("a", 0.1, 0.1)).unwrap();
        let text = std::fs::read_to_string(&path).unwrap().replace("0.99", "ok");
        std::fs::write(&path, text).unwrap();
        let error = format!("{:#}", Records::open(path).err().unwrap());
        assert!(error.contains("line 2: “ok” as slope"), "{error}");
    }
}
