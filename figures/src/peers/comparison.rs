//! The table: our methods beside the best of what other systems were measured to do, at equal times.

use std::fmt::Write as _;

use super::case::{Group, word};
use super::record::Row;
use super::stored::{Stored, best};
use crate::output::{Cell, Table};
use crate::plot::number;
use crate::space::Method;

/// Kinds of stored methods of which the best row is listed.
const KINDS: [&str; 2] = ["warped area", "projective"];

/// The key of our warped area.
const OURS: &str = "warped-area";

/// One line of the table.
struct Contender {
    name: String,
    /// Our method's key, or what kind of method a stored row is of.
    kind: String,
    ours: bool,
    samples: usize,
    seconds: f64,
    /// With their standard errors, as far as they are known.
    slope: [f64; 2],
    variance: [f64; 2],
    bias2: [f64; 2],
    /// The relative mean squared error at every time, with its standard error.
    errors: Vec<[f64; 2]>,
}

impl Contender {
    fn error(&self, i: usize) -> f64 {
        self.errors[i][0]
    }
}

/// What is compared within one group.
pub(super) struct Comparison {
    group: Group,
    contenders: Vec<Contender>,
    /// The least error among stored rows at every time.
    stored: Vec<Option<f64>>,
}

impl Comparison {
    /// Our rows of a group, then the best stored ones of each kind at each time.
    pub(super) fn new(group: &Group, rows: &[&Row], stored: &[Stored], times: &[f64]) -> Self {
        let mut contenders: Vec<Contender> = rows.iter().map(|row| Contender::ours(row, times)).collect();
        let mut listed: Vec<&Stored> = vec![];
        for kind in KINDS {
            listed.extend(times.iter().filter_map(|t| best(stored, group, Some(kind), *t)));
        }
        listed.extend(times.iter().filter_map(|t| best(stored, group, None, *t)));
        let mut seen: Vec<&Stored> = vec![];
        for row in listed {
            if !seen.contains(&row) {
                seen.push(row);
                contenders.push(Contender::stored(row, times));
            }
        }
        let least = times.iter().map(|t| best(stored, group, None, *t).map(|row| row.error_at(*t)));
        Self { group: group.clone(), contenders, stored: least.collect() }
    }

    /// The contender with the least error at the i-th time.
    fn winner(&self, i: usize) -> Option<&Contender> {
        self.contenders.iter().min_by(|a, b| a.error(i).total_cmp(&b.error(i)))
    }

    /// The least error at the i-th time among ours or stored rows, perhaps of one kind only.
    fn least(&self, i: usize, ours: bool, kind: Option<&str>) -> Option<&Contender> {
        let fits = |c: &&Contender| c.ours == ours && kind.is_none_or(|kind| c.kind == kind);
        self.contenders.iter().filter(fits).min_by(|a, b| a.error(i).total_cmp(&b.error(i)))
    }

    /// How many times a contender's error at the i-th time goes into that of the best stored row: above 1 it wins.
    fn factor(&self, contender: &Contender, i: usize) -> Option<f64> {
        self.stored[i].map(|stored| stored / contender.error(i))
    }
}

impl Contender {
    fn ours(row: &Row, times: &[f64]) -> Self {
        let m = &row.measured;
        let method = &row.settings.method;
        Self {
            name: Method::of_key(method).map_or(method.as_str(), |m| m.name).to_owned(),
            kind: method.clone(),
            ours: true,
            samples: row.settings.samples,
            seconds: row.seconds,
            slope: [m.slope, m.slope_error],
            variance: [m.variance, m.variance_error],
            bias2: [m.bias2, m.bias2_error],
            errors: times.iter().map(|t| m.error_at(row.seconds, *t)).collect(),
        }
    }

    fn stored(row: &Stored, times: &[f64]) -> Self {
        Self {
            name: row.name(),
            kind: row.method.clone(),
            ours: false,
            samples: row.samples,
            seconds: row.seconds,
            slope: [row.slope, f64::NAN],
            variance: [row.variance, f64::NAN],
            bias2: [row.bias2, f64::NAN],
            errors: times.iter().map(|t| [row.error_at(*t), f64::NAN]).collect(),
        }
    }
}

/// Every number, for programs.
pub(super) fn table(comparisons: &[Comparison], times: &[f64]) -> Table {
    let mut header: Vec<String> = [
        "scene",
        "normals",
        "filter",
        "whose",
        "method",
        "spp",
        "seconds",
        "slope",
        "slope_error",
        "rel_variance",
        "rel_variance_error",
        "rel_bias2",
        "rel_bias2_error",
    ]
    .map(str::to_owned)
    .to_vec();
    for t in times {
        header.extend([
            format!("error_at_{t}_s"),
            format!("its_error_at_{t}_s"),
            format!("best_stored_over_it_at_{t}_s"),
        ]);
    }
    let mut table = Table { header, rows: vec![] };
    for comparison in comparisons {
        let Comparison { group, contenders, .. } = comparison;
        for c in contenders {
            let mut cells: Vec<Cell> = vec![
                group.scene.clone().into(),
                word(group.normals).into(),
                word(group.filter).into(),
                if c.ours { "ours" } else { "stored" }.into(),
                c.name.clone().into(),
                c.samples.into(),
                c.seconds.into(),
            ];
            cells.extend([c.slope, c.variance, c.bias2].into_iter().flatten().map(Cell::Real));
            for (i, [error, its_error]) in c.errors.iter().enumerate() {
                let factor = comparison.factor(c, i).unwrap_or(f64::NAN);
                cells.extend([*error, *its_error, factor].map(Cell::Real));
            }
            table.row(cells);
        }
    }
    table
}

/// The same for readers, in Markdown: who wins, then every row.
pub(super) fn markdown(comparisons: &[Comparison], times: &[f64], threads: usize) -> String {
    let mut text = format!(
        "# Gradient images at equal time\n\n\
         The relative mean squared error of the gradient image at time t is bias² + variance · seconds/t, all relative to the \
         mean square of the reference. Seconds are processor time over {threads} threads. Bias² is corrected for \
         the noise of the runs and of the reference; where that makes it negative it counts as 0. The slope is that \
         of the mean on the reference (1 is right), with the reference’s noise taken out of ours; ± is one standard error over runs, of variances and bias² by the jackknife. The factor is the error of \
         the best stored row of the same scene, normals and filter over that of the row: above 1 the row wins \
         over everything stored. \
         “At least” is the factor with our error two standard errors worse. Stored rows are the best of each kind at each time.\n"
    );
    winners(&mut text, comparisons, times);
    text.push_str("\n## All rows\n\n| scene | normals | filter | method | spp | s | slope | rel. variance | rel. bias² |");
    for t in times {
        let _ = write!(text, " error at {t} s | factor |");
    }
    text.push_str("\n|---|---|---|---|--:|--:|--:|--:|--:|");
    text.push_str(&"--:|--:|".repeat(times.len()));
    text.push('\n');
    for comparison in comparisons {
        for contender in &comparison.contenders {
            text.push_str(&line(comparison, contender));
        }
    }
    text
}

fn line(comparison: &Comparison, c: &Contender) -> String {
    let Group { scene, normals, filter } = &comparison.group;
    let name = if c.ours { c.name.clone() } else { format!("*stored* {}", c.name) };
    let mut text = format!(
        "| {scene} | {} | {} | {name} | {} | {} | {} | {} | {} |",
        word(*normals),
        word(*filter),
        c.samples,
        number(c.seconds),
        with_error(c.slope),
        with_error(c.variance),
        with_error(c.bias2),
    );
    for (i, error) in c.errors.iter().enumerate() {
        let wins = comparison.winner(i).is_some_and(|w| std::ptr::eq(w, c));
        let star = if wins { "**" } else { "" };
        let factor = comparison.factor(c, i).map_or_else(|| "–".to_owned(), number);
        let _ = write!(text, " {star}{}{star} | {factor} |", with_error(*error));
    }
    text + "\n"
}

/// "0.12 ± 0.03", or the value alone where its error is not known.
fn with_error([value, error]: [f64; 2]) -> String {
    if error.is_finite() { format!("{} ± {}", number(value), number(error)) } else { number(value) }
}

/// One line a group: warped area against warped area, and the best of ours against the best stored row.
fn winners(text: &mut String, comparisons: &[Comparison], times: &[f64]) {
    for (i, t) in times.iter().enumerate() {
        let _ = write!(
            text,
            "\n## Who wins at {t} s\n\n| scene | normals | filter | our warped area | stored warped area | stored projective \
             | best of ours | the best of ours against the best stored row |\n|---|---|---|--:|--:|--:|---|---|\n"
        );
        for comparison in comparisons {
            let Group { scene, normals, filter } = &comparison.group;
            let _ = write!(text, "| {scene} | {} | {} |", word(*normals), word(*filter));
            let sides = [(true, OURS), (false, KINDS[0]), (false, KINDS[1])];
            for side in sides.map(|(ours, kind)| comparison.least(i, ours, Some(kind))) {
                let error = side.map_or_else(|| "–".to_owned(), |c| with_error(c.errors[i]));
                let _ = write!(text, " {error} |");
            }
            let (ours, stored) = (comparison.least(i, true, None), comparison.least(i, false, None));
            let best =
                ours.map_or_else(|| "–".to_owned(), |c| format!("{}: {}", c.name, with_error(c.errors[i])));
            let winner = ours.zip(stored).map_or_else(|| "–".to_owned(), |(a, b)| verdict(a, b, i));
            let _ = writeln!(text, " {best} | {winner} |");
        }
    }
}

/// Who is better, by what factor, and by what factor still if our error is two standard errors worse or better.
fn verdict(ours: &Contender, stored: &Contender, i: usize) -> String {
    let ([error, spread], other) = (ours.errors[i], stored.error(i));
    let (name, factor, least) = if error <= other {
        ("ours", other / error, other / (error + 2.0 * spread))
    } else {
        ("stored", error / other, (error - 2.0 * spread) / other)
    };
    let sure = if least > 1.0 { format!("at least {} ×", number(least)) } else { "not sure".to_owned() };
    format!("{name}, {} × ({sure})", number(factor))
}

#[cfg(test)]
mod tests {
    use super::super::record::tests::some_row;
    use super::*;

    fn some_stored(method: &str, variance: f64, bias2: f64) -> Stored {
        Stored {
            group: some_row("", 0.0, 0.0).settings.group,
            method: method.to_owned(),
            system: "m 3".to_owned(),
            label: "r16".to_owned(),
            samples: 16,
            seconds: 1.0,
            variance,
            bias2,
            slope: 0.7,
        }
    }

    #[test]
    fn factors_and_winners() {
        // At 2 s and 20 s: 0.11 and 0.02; 0.01 and 0.01 (negative bias² counts as none).
        let rows = [some_row("edge-sampling", 0.4, 0.01), some_row("rotation", 0.04, -0.5)];
        let stored = [
            some_stored("warped area", 0.4, 0.1),
            some_stored("projective", 2.0, 0.0),
            some_stored("warped area", 9.0, 0.5),
        ];
        let times = [2.0, 20.0];
        let rows: Vec<&Row> = rows.iter().collect();
        let group = rows[0].settings.group.clone();
        let comparison = Comparison::new(&group, &rows, &stored, &times);
        // Ours, and each of the two useful stored rows once.
        assert_eq!(comparison.contenders.len(), 4);
        let near = |a: Option<f64>, b: f64| a.is_some_and(|a| (a - b).abs() < 1e-12);
        // Stored: warped area 0.3 and 0.12, projective 1 and 0.1.
        assert!(near(comparison.stored[0], 0.3) && near(comparison.stored[1], 0.1));
        let edges = &comparison.contenders[0];
        assert!(near(comparison.factor(edges, 0), 0.3 / 0.11));
        assert!(near(comparison.factor(edges, 1), 0.1 / 0.02));
        assert_eq!(comparison.winner(1).map(|c| c.name.as_str()), Some("rotation"));
        let text = markdown(&[comparison], &times, 2);
        assert!(text.contains("| ours, 30 × ("), "{text}");
        let alone = Comparison::new(&group, &rows, &[], &times);
        assert!(alone.factor(&alone.contenders[0], 0).is_none());
        assert!(markdown(&[alone], &times, 2).contains("| – | – | – | rotation: 0.01 ± "));
    }

    #[test]
    fn tables_are_rectangular() {
        let row = some_row("edge-sampling", 0.4, 0.01);
        let group = row.settings.group.clone();
        let comparison = Comparison::new(&group, &[&row], &[some_stored("projective", 1.0, 1.0)], &[2.0]);
        let table = table(&[comparison], &[2.0]);
        assert!(table.rows.len() == 2 && table.rows.iter().all(|r| r.len() == table.header.len()));
    }
}
