//! Recorded results of long studies: their numbers and pictures, kept in `figures/recorded`.
//!
//! The folder of a study holds `record.json`, the pictures for bright pages, and its tables. The text is not
//! part of the record: the numbers are filled into the present one.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::{SystemTime, UNIX_EPOCH};

use anyhow::{Context as _, Result};
use serde::{Deserialize, Serialize};

use crate::gallery::{Drawing, Section, dark_file};
use crate::output::{Cell, Table, write_bytes};
use crate::pictures::dark_png;
use crate::prose::Prose;

/// Largest file of data that is kept, in bytes.
const LARGEST_DATA: u64 = 300 << 10;

/// Who measured a record, when and for how long.
#[derive(Clone, Debug, Deserialize, Serialize)]
pub(crate) struct Origin {
    /// The commit of the code.
    commit: String,
    /// Year, month and day, by Greenwich.
    date: String,
    processor: String,
    threads: usize,
    seed: u64,
    /// Elapsed seconds, and processor seconds.
    seconds: [f64; 2],
    /// Whether it was the full study, and not a shorter one.
    is_full: bool,
}

/// A study's results.
#[derive(Debug, Deserialize, Serialize)]
struct Record {
    origin: Origin,
    /// The numbers in the text, by name.
    values: Vec<(String, String)>,
    table: Table,
    pictures: BTreeMap<String, Drawing>,
    data: Vec<String>,
}

/// The folder of a study's record.
fn folder(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("recorded").join(name)
}

impl Origin {
    /// The origin of a run on this machine, now.
    pub(crate) fn new(seed: u64, seconds: [f64; 2], is_full: bool) -> Self {
        let days = SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |time| time.as_secs() / 86_400);
        let threads = std::thread::available_parallelism().map_or(1, usize::from);
        Self { commit: commit(), date: date(days), processor: processor(), threads, seed, seconds, is_full }
    }

    /// A sentence on the origin, in Markdown.
    fn sentence(&self) -> String {
        let Self { commit, date, processor, threads, seed, seconds: [elapsed, busy], is_full } = self;
        let quality = if *is_full {
            "with `--quality full`"
        } else {
            "with `--quality short`: fewer starts, seeds, pixels and steps than in the full study"
        };
        format!(
            "Measured on {date} {quality}; commit `{commit}`, seed {seed}. It took {} on {threads} threads of {processor}: {} of \
             processor time.",
            duration(*elapsed),
            duration(*busy)
        )
    }
}

/// Seconds in words.
fn duration(seconds: f64) -> String {
    if seconds < 100.0 { format!("{seconds:.0} seconds") } else { format!("{:.0} minutes", seconds / 60.0) }
}

/// The commit that is checked out, marked if files differ from it; unknown without git.
fn commit() -> String {
    let git = |arguments: &[&str]| {
        let output =
            Command::new("git").args(["-C", env!("CARGO_MANIFEST_DIR")]).args(arguments).output().ok()?;
        output.status.success().then(|| String::from_utf8_lossy(&output.stdout).trim().to_owned())
    };
    let Some(commit) = git(&["rev-parse", "--short=10", "HEAD"]) else { return "unknown".to_owned() };
    let is_clean =
        git(&["status", "--porcelain", "--untracked-files=no"]).is_some_and(|changes| changes.is_empty());
    if is_clean { commit } else { format!("{commit} with changes") }
}

/// The processor's name, if the system has it.
fn processor() -> String {
    let all = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let name = all.lines().find_map(|line| line.strip_prefix("model name")?.split_once(':'));
    name.map_or_else(|| std::env::consts::ARCH.to_owned(), |(_, name)| name.trim().to_owned())
}

/// The date, given the days since 1 January 1970, in the proleptic Gregorian calendar (Hinnant 2013).
fn date(days: u64) -> String {
    let days = days + 719_468;
    let (era, day_of_era) = (days / 146_097, days % 146_097);
    let year_of_era = (day_of_era - day_of_era / 1460 + day_of_era / 36_524 - day_of_era / 146_096) / 365;
    let day_of_year = day_of_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
    let shifted = (5 * day_of_year + 2) / 153;
    let day = day_of_year - (153 * shifted + 2) / 5 + 1;
    let month = if shifted < 10 { shifted + 3 } else { shifted - 9 };
    let year = year_of_era + 400 * era + u64::from(month <= 2);
    format!("{year}-{month:02}-{day:02}")
}

/// Replaces the record of a study by a section whose files are in `out`.
pub(crate) fn write(
    name: &str,
    section: &Section,
    out: &Path,
    drawings: &BTreeMap<String, Drawing>,
    origin: Origin,
) -> Result<()> {
    let folder = folder(name);
    if folder.exists() {
        std::fs::remove_dir_all(&folder).with_context(|| format!("removing {}", folder.display()))?;
    }
    let copy = |file: &str| -> Result<()> {
        let path = out.join(file);
        let bytes = std::fs::read(&path).with_context(|| format!("reading {}", path.display()))?;
        write_bytes(&folder.join(file), &bytes)
    };
    let mut pictures = BTreeMap::new();
    for picture in &section.pictures {
        let file = &picture.file;
        let drawing = drawings.get(file).with_context(|| format!("{file} was not drawn"))?;
        copy(file)?;
        pictures.insert(file.clone(), drawing.clone());
    }
    let mut data = vec![];
    for file in section.data.iter().filter(|file| file.ends_with(".csv")) {
        if out.join(file).metadata().is_ok_and(|metadata| metadata.len() <= LARGEST_DATA) {
            copy(file)?;
            data.push(file.clone());
        }
    }
    // JSON has no NaN.
    let cell = |cell: &Cell| match cell {
        Cell::Real(value) if !value.is_finite() => Cell::Text(cell.shown()),
        other => other.clone(),
    };
    let rows = section.table.rows.iter().map(|row| row.iter().map(cell).collect()).collect();
    let table = Table { header: section.table.header.clone(), rows };
    let record = Record { origin, values: section.values.clone(), table, pictures, data };
    let mut json = serde_json::to_vec_pretty(&record)?;
    json.push(b'\n');
    write_bytes(&folder.join("record.json"), &json)
}

/// The recorded section of a study with this text, and its drawings; its files are copied to `out`. `None` if
/// there is no record.
pub(crate) fn read(
    name: &str,
    text: &str,
    out: &Path,
) -> Result<Option<(Section, BTreeMap<String, Drawing>)>> {
    let folder = folder(name);
    let path = folder.join("record.json");
    if !path.exists() {
        return Ok(None);
    }
    let open = |path: &Path| std::fs::read(path).with_context(|| format!("reading {}", path.display()));
    let named = || path.display().to_string();
    let record: Record = serde_json::from_slice(&open(&path)?).with_context(named)?;
    let values: Vec<(&str, &dyn std::fmt::Display)> =
        record.values.iter().map(|(name, value)| (name.as_str(), value as &dyn std::fmt::Display)).collect();
    let prose = Prose::new(text, &values).with_context(named)?;
    let mut section = prose.section(name, record.data.clone(), record.table)?;
    section.origin_html = crate::prose::html(&record.origin.sentence())?;
    for (file, drawing) in &record.pictures {
        let bytes = open(&folder.join(file))?;
        write_bytes(&out.join(dark_file(file)), &dark_png(&bytes, &drawing.kept).with_context(named)?)?;
        write_bytes(&out.join(file), &bytes)?;
    }
    for file in &record.data {
        write_bytes(&out.join(file), &open(&folder.join(file))?)?;
    }
    Ok(Some((section, record.pictures)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn durations_have_units() {
        assert_eq!([59.6, 1239.0].map(duration), ["60 seconds", "21 minutes"]);
    }

    #[test]
    fn days_become_dates() {
        // 2000-02-29, and the day after 1999-12-31.
        for (days, expected) in
            [(0, "1970-01-01"), (11_016, "2000-02-29"), (10_957, "2000-01-01"), (20_785, "2026-11-28")]
        {
            assert_eq!(date(days), expected);
        }
    }
}
