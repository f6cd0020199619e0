//! Descents in a file that grows row by row, so that an interrupted run goes on where it was.

use std::path::PathBuf;
use std::time::{Duration, Instant};

use anyhow::Context as _;
use serde::{Deserialize, Serialize};

use super::fit::Distance;
use crate::output::write_bytes;

/// Interval between writes of the file while descents end.
const INTERVAL: Duration = Duration::from_secs(5);

/// Result of one descent. Fields are the columns of the file.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
pub(super) struct Row {
    /// Settings common to all descents of a run: rows of other runs are not mixed in.
    pub(super) run: String,
    pub(super) experiment: String,
    pub(super) scene: String,
    pub(super) method: String,
    /// Samples a pixel of a gradient.
    pub(super) samples: usize,
    pub(super) start: u64,
    /// The translation at the end, in extents.
    pub(super) translation_error: f64,
    /// The rotation at the end, in degrees.
    pub(super) rotation_error: f64,
    /// Processor seconds of one step.
    pub(super) seconds: f64,
    /// The pose at the end: six numbers.
    pub(super) pose: String,
    /// The larger of both errors, in units of the success thresholds, along the way.
    pub(super) errors: String,
}

impl Row {
    /// Settings that determine a descent: with the same it is not repeated.
    fn settings(&self) -> impl Ord + '_ {
        let Self { run, experiment, scene, method, samples, start, .. } = self;
        (run, experiment, scene, method, *samples, *start)
    }

    /// The pose at the end.
    pub(super) fn pose(&self) -> anyhow::Result<Vec<f64>> {
        numbers(&self.pose)
    }

    /// The errors along the way.
    pub(super) fn errors(&self) -> anyhow::Result<Vec<f64>> {
        numbers(&self.errors)
    }

    pub(super) fn distance(&self) -> Distance {
        Distance { shift: self.translation_error, turn: self.rotation_error }
    }
}

/// Numbers between spaces.
pub(super) fn listed(numbers: &[f64]) -> String {
    numbers.iter().map(|x| format!("{x:?}")).collect::<Vec<_>>().join(" ")
}

fn numbers(text: &str) -> anyhow::Result<Vec<f64>> {
    text.split(' ').map(|word| word.parse().with_context(|| format!("`{word}` is no number"))).collect()
}

/// The file and its rows.
pub(super) struct Records {
    path: PathBuf,
    pub(super) rows: Vec<Row>,
    written: Instant,
}

impl Records {
    /// The rows of a run in the file; none if there is no file.
    ///
    /// Rows of other runs are left out, and lost when the file is written.
    pub(super) fn open(path: PathBuf, run: &str) -> anyhow::Result<Self> {
        let mut rows: Vec<Row> = vec![];
        if path.exists() {
            let reader = csv::Reader::from_path(&path).with_context(|| path.display().to_string())?;
            let read: Result<Vec<Row>, _> = reader.into_deserialize().collect();
            rows = read.with_context(|| format!("{}: remove it to begin anew", path.display()))?;
        }
        let all = rows.len();
        rows.retain(|row| row.run == run);
        if all > 0 {
            let kept = rows.len();
            eprintln!(
                "going on with {kept} descents of {}; {} are of another run",
                path.display(),
                all - kept
            );
        }
        Ok(Self { path, rows, written: Instant::now() })
    }

    /// Whether a descent with these settings has been made.
    pub(super) fn holds(&self, like: &Row) -> bool {
        self.rows.iter().any(|row| row.settings() == like.settings())
    }

    /// Adds a row, and writes the whole file atomically if the last write is long ago.
    pub(super) fn add(&mut self, row: Row) -> anyhow::Result<()> {
        self.rows.push(row);
        if self.written.elapsed() > INTERVAL { self.write() } else { Ok(()) }
    }

    /// Writes the whole file atomically, in an order that does not depend on timing.
    pub(super) fn write(&mut self) -> anyhow::Result<()> {
        self.rows.sort_by(|a, b| a.settings().cmp(&b.settings()));
        self.written = Instant::now();
        write_bytes(&self.path, &self.bytes()?)
    }

    /// Removes the file, which is not needed once all is done.
    pub(super) fn remove(&self) -> anyhow::Result<()> {
        std::fs::remove_file(&self.path).with_context(|| format!("removing {}", self.path.display()))
    }

    fn bytes(&self) -> anyhow::Result<Vec<u8>> {
        let mut writer = csv::Writer::from_writer(vec![]);
        self.rows.iter().try_for_each(|row| writer.serialize(row))?;
        Ok(writer.into_inner()?)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(run: &str, start: u64) -> Row {
        Row {
            run: run.to_owned(),
            experiment: "away".to_owned(),
            scene: "bunny".to_owned(),
            method: "rotation".to_owned(),
            samples: 4,
            start,
            translation_error: 0.1 + 0.2,
            rotation_error: 1e-17,
            seconds: 0.5,
            pose: listed(&[1.0, -2e-30]),
            errors: listed(&[7.5]),
        }
    }

    #[test]
    fn an_interrupted_run_goes_on() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("rows.csv");
        let mut records = Records::open(path.clone(), "a").unwrap();
        for row in [row("a", 3), row("b", 1), row("a", 2)] {
            records.add(row).unwrap();
        }
        records.write().unwrap();
        let again = Records::open(path.clone(), "a").unwrap();
        assert_eq!(again.rows, [row("a", 2), row("a", 3)]);
        assert!(again.holds(&row("a", 3)) && !again.holds(&row("a", 1)) && !again.holds(&row("b", 1)));
        assert_eq!(again.rows[0].pose().unwrap(), [1.0, -2e-30]);
        again.remove().unwrap();
        assert!(Records::open(path.clone(), "a").unwrap().rows.is_empty());
        std::fs::write(&path, "a,b\n1,2\n").unwrap();
        let error = format!("{:#}", Records::open(path, "a").map(|_| ()).unwrap_err());
        assert!(error.contains("rows.csv: remove it"), "{error}");
    }
}
