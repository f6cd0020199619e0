//! What other systems were measured to do.

use std::path::Path;

use anyhow::{Context as _, ensure};
use clap::ValueEnum as _;

use super::case::{FilterName, Group, Normals};

/// One row of the file of results. All errors are relative to the mean square of the reference.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Stored {
    pub(super) group: Group,
    /// "warped area" or "projective".
    pub(super) method: String,
    /// The program and its version.
    pub(super) system: String,
    pub(super) label: String,
    pub(super) samples: usize,
    /// Processor time of all cores over their number.
    pub(super) seconds: f64,
    pub(super) variance: f64,
    pub(super) bias2: f64,
    pub(super) slope: f64,
}

impl Stored {
    /// bias² + variance · seconds/t.
    pub(super) fn error_at(&self, time: f64) -> f64 {
        self.bias2 + self.variance * self.seconds / time
    }

    /// Its full name.
    pub(super) fn name(&self) -> String {
        format!("{}: {} {}", self.method, self.system, self.label)
    }
}

/// Reads the file of results.
pub(super) fn read(path: &Path) -> anyhow::Result<Vec<Stored>> {
    let text = std::fs::read(path).with_context(|| format!("cannot read {}", path.display()))?;
    parse(&text).with_context(|| path.display().to_string())
}

fn parse(text: &[u8]) -> anyhow::Result<Vec<Stored>> {
    let mut reader = csv::Reader::from_reader(text);
    let header = reader.headers()?.clone();
    let column = |name: &str| {
        let place = header.iter().position(|h| h == name);
        place.with_context(|| format!("there is no column “{name}”"))
    };
    let names = ["scene", "normals", "filter", "method", "system", "label", "spp", "seconds"];
    let words = names.map(column);
    let numbers = ["rel_variance", "rel_bias2", "slope"].map(column);
    let columns = words.into_iter().chain(numbers).collect::<anyhow::Result<Vec<usize>>>()?;
    let mut rows = vec![];
    for record in reader.records() {
        let record = record?;
        let line = record.position().map_or(0, csv::Position::line);
        rows.push(row(&record, &columns).with_context(|| format!("line {line}"))?);
    }
    Ok(rows)
}

fn row(record: &csv::StringRecord, columns: &[usize]) -> anyhow::Result<Stored> {
    let text = |i: usize| record.get(columns[i]).unwrap_or_default().trim();
    let number = |i: usize| -> anyhow::Result<f64> {
        let value: f64 = text(i).parse().with_context(|| format!("“{}” is no number", text(i)))?;
        ensure!(value.is_finite(), "“{}” is not finite", text(i));
        Ok(value)
    };
    let normals = Normals::from_str(text(1), false).ok();
    let filter = FilterName::from_str(text(2), false).ok();
    Ok(Stored {
        group: Group {
            scene: text(0).to_owned(),
            normals: normals.with_context(|| format!("normals “{}”", text(1)))?,
            filter: filter.with_context(|| format!("filter “{}”", text(2)))?,
        },
        method: text(3).to_owned(),
        system: text(4).to_owned(),
        label: text(5).to_owned(),
        samples: text(6).parse().with_context(|| format!("“{}” samples", text(6)))?,
        seconds: number(7)?,
        variance: number(8)?,
        bias2: number(9)?,
        slope: number(10)?,
    })
}

/// The row of a group with the least error at a time, among all or those of one method.
pub(super) fn best<'a>(
    rows: &'a [Stored],
    group: &Group,
    method: Option<&str>,
    time: f64,
) -> Option<&'a Stored> {
    rows.iter()
        .filter(|row| row.group == *group && method.is_none_or(|method| row.method == method))
        .min_by(|a, b| a.error_at(time).total_cmp(&b.error_at(time)))
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "scene,normals,filter,method,system,label,spp,seeds,seconds,reverse_seconds,relmse,rel_variance,rel_bias2,slope\n\
        s,face,tent,warped area,m 3.4.1,r16,16,8,0.5,1.0,0.5,0.4,0.1,0.7\n\
        s,face,tent,projective,m 3.9.1,none,64,8,4,,0.05,0.02,0.03,0.9\n\
        s,vertex,tent,projective,m 3.9.1,none,64,8,4,,0.05,0.0,0.0,1\n";

    #[test]
    fn the_best_row_depends_on_the_time() {
        let rows = parse(TEXT.as_bytes()).unwrap();
        assert_eq!(rows.len(), 3);
        let group = rows[0].group.clone();
        // At 2 s: 0.1 + 0.4·0.5/2 = 0.2 and 0.03 + 0.02·4/2 = 0.07.
        assert!((rows[0].error_at(2.0) - 0.2).abs() < 1e-12);
        assert!((rows[1].error_at(2.0) - 0.07).abs() < 1e-12);
        assert_eq!(best(&rows, &group, None, 2.0), Some(&rows[1]));
        assert_eq!(best(&rows, &group, Some("warped area"), 2.0), Some(&rows[0]));
        // At 0.1 s: 2.1 and 0.83; at 0.001 s the cheaper variance · seconds wins still: 0.08 against 0.2.
        assert_eq!(best(&rows, &group, None, 0.001), Some(&rows[1]));
        assert_eq!(best(&rows, &Group { scene: "t".to_owned(), ..group }, None, 2.0), None);
    }

    #[test]
    fn faults_are_located() {
        for (from, to, words) in [
            ("0.4,0.1", "much,0.1", "line 2: “much”"),
            ("face,tent,proj", "edge,tent,proj", "line 3: normals “edge”"),
            ("rel_bias2", "bias", "“rel_bias2”"),
            ("0.02,0.03", "inf,0.03", "line 3: “inf” is not finite"),
        ] {
            let error = format!("{:#}", parse(TEXT.replace(from, to).as_bytes()).unwrap_err());
            assert!(error.contains(words), "{error}");
        }
    }
}
