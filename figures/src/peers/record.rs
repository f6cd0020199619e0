//! Measurements in a file that grows row by row, so that an interrupted run goes on where it was.

use std::path::{Path, PathBuf};

use anyhow::{Context as _, ensure};
use serde::{Deserialize, Serialize};

use super::case::{FilterName, Group, Normals};
use crate::output::write_bytes;

/// A measurement of one method on one case. Fields are the columns of the file.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, Serialize)]
pub(super) struct Row {
    pub(super) scene: String,
    pub(super) normals: Normals,
    pub(super) filter: FilterName,
    /// The method's key.
    pub(super) method: String,
    pub(super) spp: usize,
    pub(super) runs: usize,
    pub(super) seed: u32,
    pub(super) threads: usize,
    /// Seconds of one run: processor time of all threads over their number.
    pub(super) seconds: f64,
    pub(super) rel_variance: f64,
    pub(super) rel_variance_error: f64,
    pub(super) rel_bias2: f64,
    pub(super) rel_bias2_error: f64,
    pub(super) slope: f64,
    pub(super) slope_error: f64,
    /// The reference's own noise, relative to its mean square.
    pub(super) reference_noise: f64,
    /// Mean radiance over that of the reference image: 1 if the scene is interpreted as intended.
    pub(super) radiance_ratio: f64,
    /// Auxiliary rays of one run.
    pub(super) auxiliary_rays: u64,
    pub(super) non_finite: usize,
}

impl Row {
    /// Settings that determine a measurement: with the same it is not repeated.
    pub(super) fn settings(&self) -> impl PartialEq + '_ {
        let case = (&self.scene, self.normals, self.filter);
        (case, &self.method, self.spp, self.runs, self.seed, self.threads)
    }
}

/// The file and its rows.
pub(super) struct Records {
    pub(super) path: PathBuf,
    pub(super) rows: Vec<Row>,
}

impl Records {
    /// The rows of the file; none if there is no file.
    pub(super) fn open(path: PathBuf) -> anyhow::Result<Self> {
        let rows = if path.exists() { read(&path)? } else { vec![] };
        Ok(Self { path, rows })
    }

    /// The measurement with the settings of another.
    pub(super) fn find(&self, like: &Row) -> Option<&Row> {
        self.rows.iter().find(|row| row.settings() == like.settings())
    }

    /// Adds a row, replacing one with the same settings, and writes the whole file atomically.
    pub(super) fn add(&mut self, row: Row) -> anyhow::Result<()> {
        self.rows.retain(|other| other.settings() != row.settings());
        self.rows.push(row);
        let mut writer = csv::Writer::from_writer(vec![]);
        self.rows.iter().try_for_each(|row| writer.serialize(row))?;
        write_bytes(&self.path, &writer.into_inner()?)
    }
}

/// Stored measurement of another system; only the columns used here. All errors are relative to the mean
/// square of the reference.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub(super) struct Stored {
    pub(super) scene: String,
    pub(super) normals: Normals,
    pub(super) filter: FilterName,
    /// "warped area" or "projective".
    pub(super) method: String,
    /// The program and its version.
    pub(super) system: String,
    pub(super) label: String,
    pub(super) spp: usize,
    /// Processor time of all cores over their number.
    pub(super) seconds: f64,
    pub(super) rel_variance: f64,
    pub(super) rel_bias2: f64,
    pub(super) slope: f64,
}

impl Stored {
    pub(super) fn read(path: &Path) -> anyhow::Result<Vec<Self>> {
        let rows: Vec<Self> = read(path)?;
        for row in &rows {
            let numbers = [row.seconds, row.rel_variance, row.rel_bias2, row.slope];
            ensure!(numbers.iter().all(|x| x.is_finite()), "{}: not finite: {row:?}", path.display());
        }
        Ok(rows)
    }

    pub(super) fn is_of(&self, group: &Group) -> bool {
        (&self.scene, self.normals, self.filter) == (&group.scene, group.normals, group.filter)
    }
}

fn read<T: for<'a> Deserialize<'a>>(path: &Path) -> anyhow::Result<Vec<T>> {
    let reader = csv::ReaderBuilder::new().trim(csv::Trim::All).from_path(path);
    let reader = reader.with_context(|| format!("cannot read {}", path.display()))?;
    reader.into_deserialize().collect::<Result<_, _>>().with_context(|| path.display().to_string())
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// A measurement with given variance · seconds and bias².
    pub(in super::super) fn some_row(method: &str, rel_variance: f64, rel_bias2: f64) -> Row {
        Row {
            scene: "s".to_owned(),
            normals: Normals::Face,
            filter: FilterName::Tent,
            method: method.to_owned(),
            spp: 16,
            runs: 4,
            seed: 1,
            threads: 2,
            seconds: 0.5,
            rel_variance,
            rel_variance_error: 0.1 + 0.2,
            rel_bias2,
            rel_bias2_error: 1e-17,
            slope: 0.99,
            slope_error: 0.01,
            reference_noise: 0.001,
            radiance_ratio: 1.0001,
            auxiliary_rays: 12,
            non_finite: 0,
        }
    }

    #[test]
    fn what_is_written_is_found_again() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("deeper/runs.csv");
        let mut records = Records::open(path.clone()).unwrap();
        let rows = [some_row("a", 0.1, -1e-3), some_row("b", 2.0, 0.5)];
        rows.iter().for_each(|row| records.add(row.clone()).unwrap());
        let mut again = Records::open(path.clone()).unwrap();
        assert_eq!(again.rows, rows);
        assert_eq!(again.find(&rows[1]), Some(&rows[1]));
        assert_eq!(again.find(&Row { spp: 17, ..rows[1].clone() }), None);
        // A second measurement with the same settings replaces the first.
        again.add(Row { seconds: 7.0, ..rows[0].clone() }).unwrap();
        assert_eq!(again.rows.len(), 2);
        assert_eq!(Records::open(path).unwrap().find(&rows[0]).unwrap().seconds, 7.0);
    }

    #[test]
    fn faults_are_located() {
        const TEXT: &str = "scene,normals,filter,method,system,label,spp,seeds,seconds,rel_variance,rel_bias2,slope\n\
            s,face,tent,warped area,m 3.4.1,r16,16,8,0.5,0.4,0.1,0.7\n\
            s,face,tent,projective, m 3.9.1,none,64,8,4,0.02,0.03,0.9\n";
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("results.csv");
        let read = |text: &str| {
            std::fs::write(&path, text).unwrap();
            Stored::read(&path)
        };
        let rows = read(TEXT).unwrap();
        assert_eq!((rows.len(), rows[1].system.as_str(), rows[1].rel_bias2), (2, "m 3.9.1", 0.03));
        for (from, to, words) in [
            ("0.4,0.1", "much,0.1", "line: 2"),
            ("face,tent,proj", "edge,tent,proj", "line: 3"),
            ("rel_bias2", "bias", "`rel_bias2`"),
            ("0.02,0.03", "inf,0.03", "not finite"),
        ] {
            let error = format!("{:#}", read(&TEXT.replace(from, to)).unwrap_err());
            assert!(error.contains("results.csv") && error.contains(words), "{error}");
        }
        assert!(Records::open(path).is_err(), "columns of another file");
    }
}
