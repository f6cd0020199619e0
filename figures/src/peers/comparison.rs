//! Tables that compare our methods with the best stored measurements of other systems, at equal times.

use super::case::{Group, word};
use super::record::{Row, Stored};
use crate::output::{Cell, Table};
use crate::plot::number;
use crate::ratio::Ratio;
use crate::space::Method;

/// Kinds of stored methods whose best row is listed.
const KINDS: [&str; 2] = ["warped area", "projective"];
/// The keys of our default and of warped area without curve samples.
const OURS: [&str; 2] = ["automatic", "warped-area"];

/// One line of the table. Unknown standard errors are NaN.
#[derive(Clone)]
struct Contender {
    ours: bool,
    /// Our method's key, or the kind of a stored row's method.
    kind: String,
    name: String,
    samples: usize,
    seconds: f64,
    slope: Ratio,
    variance: Ratio,
    bias2: Ratio,
}

impl Contender {
    fn ours(row: &Row) -> Self {
        Self {
            ours: true,
            kind: row.method.clone(),
            name: Method::of_key(&row.method).map_or(row.method.as_str(), |m| m.name).to_owned(),
            samples: row.spp,
            seconds: row.seconds,
            slope: Ratio { value: row.slope, error: row.slope_error },
            variance: Ratio { value: row.rel_variance, error: row.rel_variance_error },
            bias2: Ratio { value: row.rel_bias2, error: row.rel_bias2_error },
        }
    }

    fn stored(row: &Stored) -> Self {
        let unknown = |value| Ratio { value, error: f64::NAN };
        Self {
            ours: false,
            kind: row.method.clone(),
            name: format!("{}: {} {}", row.method, row.system, row.label),
            samples: row.spp,
            seconds: row.seconds,
            slope: unknown(row.slope),
            variance: unknown(row.rel_variance),
            bias2: unknown(row.rel_bias2),
        }
    }

    /// The mean squared error at another time, b² + v · seconds/t. A bias² of ours that is negative through
    /// noise counts as 0.
    fn error_at(&self, time: f64) -> Ratio {
        let noise = self.variance.scaled(self.seconds / time);
        let bias2 = if self.ours { self.bias2.value.max(0.0) } else { self.bias2.value };
        Ratio { value: bias2 + noise.value, error: self.bias2.error.hypot(noise.error) }
    }
}

/// The least error at a time, among all or those of one kind.
fn least<'a>(
    all: impl IntoIterator<Item = &'a Contender>,
    kind: Option<&str>,
    time: f64,
) -> Option<&'a Contender> {
    let able = all.into_iter().filter(|c| kind.is_none_or(|kind| c.kind == kind));
    able.min_by(|a, b| a.error_at(time).value.total_cmp(&b.error_at(time).value))
}

/// Rows compared within one group: ours, then the best stored ones of each kind at each time.
pub(super) struct Comparison {
    group: Group,
    ours: Vec<Contender>,
    stored: Vec<Contender>,
}

impl Comparison {
    pub(super) fn new(group: &Group, rows: &[&Row], stored: &[Stored], times: &[f64]) -> Self {
        let all: Vec<Contender> = stored.iter().filter(|s| s.is_of(group)).map(Contender::stored).collect();
        let mut listed: Vec<&Contender> = vec![];
        for kind in [Some(KINDS[0]), Some(KINDS[1]), None] {
            for best in times.iter().filter_map(|t| least(&all, kind, *t)) {
                if !listed.iter().any(|other| std::ptr::eq(*other, best)) {
                    listed.push(best);
                }
            }
        }
        let ours = rows.iter().map(|row| Contender::ours(row)).collect();
        Self { group: group.clone(), ours, stored: listed.into_iter().cloned().collect() }
    }

    /// Ratio of the best stored row's error to the contender's: above 1 the contender wins.
    fn factor(&self, contender: &Contender, time: f64) -> f64 {
        let stored = least(&self.stored, None, time).map(|stored| stored.error_at(time).value);
        stored.map_or(f64::NAN, |stored| stored / contender.error_at(time).value)
    }

    fn words(&self) -> [Cell; 3] {
        let Group { scene, normals, filter } = &self.group;
        [scene.clone().into(), word(*normals).into(), word(*filter).into()]
    }
}

/// The table of all numbers.
pub(super) fn table(comparisons: &[Comparison], times: &[f64]) -> Table {
    let fixed = "scene normals filter whose method spp seconds slope slope_error rel_variance rel_variance_error \
                 rel_bias2 rel_bias2_error";
    let mut header: Vec<String> = fixed.split(' ').map(str::to_owned).collect();
    for t in times {
        header.extend(["error", "its_error", "best_stored_over_it"].map(|what| format!("{what}_at_{t}_s")));
    }
    let mut table = Table { header, rows: vec![] };
    for comparison in comparisons {
        for c in comparison.ours.iter().chain(&comparison.stored) {
            let mut cells = comparison.words().to_vec();
            let whose = if c.ours { "ours" } else { "stored" };
            cells.extend([whose.into(), c.name.clone().into(), c.samples.into(), c.seconds.into()]);
            let measured = [c.slope, c.variance, c.bias2].into_iter();
            cells.extend(measured.flat_map(|m| [m.value, m.error]).map(Cell::Real));
            for t in times {
                let Ratio { value, error } = c.error_at(*t);
                cells.extend([value, error, comparison.factor(c, *t)].map(Cell::Real));
            }
            table.row(cells);
        }
    }
    table
}

/// The comparison for readers, in Markdown: the winners, then every row.
pub(super) fn markdown(comparisons: &[Comparison], times: &[f64], threads: usize) -> String {
    let mut text = format!(
        "# Gradient images at equal time\n\n\
         The relative mean squared error of the gradient image at time t is bias² + variance · seconds/t, all relative to the \
         mean square of the reference. Seconds are processor time over {threads} threads. Bias² is corrected for \
         the noise of the runs and of the reference; where that makes it negative it counts as 0. The slope is that \
         of the mean on the reference (1 is right), with the reference’s noise taken out of ours; ± is one standard error \
         over runs, of variances and bias² by the jackknife. “Best stored over it” is the error of the best stored row of \
         the same scene, normals and filter over that of the row: above 1 the row wins over everything stored. “At least” \
         is the factor with our error two standard errors worse. Stored rows are the best of each kind at each time. Our \
         default is what a pilot chooses, its own time counted.\n"
    );
    for t in times {
        text += &format!("\n## Who wins at {t} s\n\n{}", winners(comparisons, *t).markdown());
    }
    text + "\n## All rows\n\n" + &table(comparisons, times).markdown()
}

/// "0.12 ± 0.03", or the value alone where its error is unknown.
fn with_error(Ratio { value, error }: Ratio) -> String {
    if error.is_finite() { format!("{} ± {}", number(value), number(error)) } else { number(value) }
}

/// One line per group: our default, warped area against warped area, and the best of ours against the best
/// stored row.
fn winners(comparisons: &[Comparison], time: f64) -> Table {
    let none = || "–".to_owned();
    let error = |all: &[Contender], kind: &str| -> Cell {
        least(all, Some(kind), time).map_or_else(none, |c| with_error(c.error_at(time))).into()
    };
    let best = |c: &Contender| format!("{}: {}", c.name, with_error(c.error_at(time)));
    let ours = |c: &Comparison| least(&c.ours, None, time).cloned();
    let stored = |c: &Comparison| least(&c.stored, None, time).cloned();
    Table::of(
        comparisons,
        &[
            ("scene", &|c| c.words()[0].clone()),
            ("normals", &|c| c.words()[1].clone()),
            ("filter", &|c| c.words()[2].clone()),
            ("our default", &|c| error(&c.ours, OURS[0])),
            ("our warped area", &|c| error(&c.ours, OURS[1])),
            ("stored warped area", &|c| error(&c.stored, KINDS[0])),
            ("stored projective", &|c| error(&c.stored, KINDS[1])),
            ("best of ours", &|c| ours(c).map_or_else(none, |c| best(&c)).into()),
            ("the best of ours against the best stored row", &|c| {
                ours(c).zip(stored(c)).map_or_else(none, |(a, b)| verdict(&a, &b, time)).into()
            }),
        ],
    )
}

/// The better one, the factor, and the factor if our error is two standard errors worse or better.
fn verdict(ours: &Contender, stored: &Contender, time: f64) -> String {
    let (Ratio { value, error }, other) = (ours.error_at(time), stored.error_at(time).value);
    let (name, factor, least) = if value <= other {
        ("ours", other / value, other / (value + 2.0 * error))
    } else {
        ("stored", value / other, (value - 2.0 * error) / other)
    };
    let sure = if least > 1.0 { format!("at least {} ×", number(least)) } else { "not sure".to_owned() };
    format!("{name}, {} × ({sure})", number(factor))
}

#[cfg(test)]
mod tests {
    use super::super::record::tests::some_row;
    use super::*;

    fn some_stored(method: &str, rel_variance: f64, rel_bias2: f64) -> Stored {
        let Row { scene, normals, filter, spp, .. } = some_row("", 0.0, 0.0);
        let [method, system, label] = [method, "m 3", "r16"].map(str::to_owned);
        let (seconds, slope) = (1.0, 0.7);
        Stored { scene, normals, filter, method, system, label, spp, seconds, rel_variance, rel_bias2, slope }
    }

    #[test]
    fn factors_and_winners() {
        // At 2 s and 20 s: 0.11 and 0.02; 0.01 and 0.001 (negative bias² counts as none).
        let rows = [some_row("automatic", 0.4, 0.01), some_row("rotation", 0.04, -0.5)];
        // 0.3 and 0.12, 1 and 0.1; the third is the best of its kind at no time.
        let stored = [
            some_stored("warped area", 0.4, 0.1),
            some_stored("projective", 2.0, 0.0),
            some_stored("warped area", 9.0, 0.5),
        ];
        let times = [2.0, 20.0];
        let rows: Vec<&Row> = rows.iter().collect();
        let group = Group { scene: "s".to_owned(), normals: rows[0].normals, filter: rows[0].filter };
        let comparison = Comparison::new(&group, &rows, &stored, &times);
        assert_eq!((comparison.ours.len(), comparison.stored.len()), (2, 2));
        for (time, expected) in [(2.0, 0.3 / 0.11), (20.0, 0.1 / 0.02)] {
            assert!((comparison.factor(&comparison.ours[0], time) - expected).abs() < 1e-12);
        }
        let table = table(std::slice::from_ref(&comparison), &times);
        assert!(table.rows.len() == 4 && table.rows.iter().all(|r| r.len() == table.header.len()));
        let text = markdown(&[comparison], &times, 2);
        assert!(text.contains("| ours, 30 × (") && text.contains("| 0.11 ± "), "{text}");
        let alone = Comparison::new(&group, &rows, &[], &times);
        assert!(alone.factor(&alone.ours[0], 2.0).is_nan());
        assert!(markdown(&[alone], &times, 2).contains(" | – | – | – | rotation: 0.01 ± "));
    }
}
