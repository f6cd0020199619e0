//! Power of a statistical test: the smallest bias that it rejects.
//!
//! A comparison has a tolerance, a number of standard errors plus a fixed allowance. The tolerance relative
//! to the reference is the smallest bias that the comparison rejects, its power. A comparison counts only if
//! that is at most [`NOTICED`], or less where a test [asks](Power::noticing) for it; a test with a weaker
//! comparison fails.
//!
//! A comparison may pool scenes: the slope over many has the power of all together against a bias that they
//! share. The power of one scene alone is [reported separately](Power::by_scene), as a bias may affect one
//! scene only.
//!
//! Every statistical test prints one line, `power | test | comparisons | smallest bias | where`, which are
//! the rows of the table of power of `RESULTS.md`: `UPDATE_RESULTS=1 cargo test --release --workspace --
//! --nocapture | cargo run --release -p tests --example power` fills it. A quick test that the table does
//! not name fails unless `UPDATE_RESULTS` is set.

use crate::effort::thorough;
use crate::results;

/// The largest relative bias that a valid comparison may leave unnoticed.
pub const NOTICED: f64 = 0.15;

/// The name of the table.
pub const TABLE: &str = "power table";

/// Power of the comparisons of one test. On drop it prints the row of the table; it panics if nothing was
/// compared, if some comparison could not have noticed a bias of [`NOTICED`], or if the table lacks the test.
#[derive(Debug)]
pub struct Power {
    test: &'static str,
    noticed: f64,
    rows: Vec<(String, f64)>,
    /// The smallest biases that single scenes reject, where scenes are pooled.
    scenes: Vec<f64>,
}

impl Power {
    /// A record without comparisons; `test` is its file and name.
    pub fn of(test: &'static str) -> Self {
        Self { test, noticed: NOTICED, rows: vec![], scenes: vec![] }
    }

    /// This record with another bias that must be noticed.
    #[must_use]
    pub fn noticing(mut self, noticed: f64) -> Self {
        self.noticed = noticed;
        self
    }

    /// The largest relative bias that a comparison may leave unnoticed.
    pub fn noticed(&self) -> f64 {
        self.noticed
    }

    /// Adds the smallest biases that single scenes reject, for a comparison that pools them.
    pub fn by_scene(&mut self, biases: impl IntoIterator<Item = f64>) {
        self.scenes.extend(biases);
    }

    /// Adds a comparison that rejects deviations above `tolerance` from `reference`; for a reference of 0,
    /// pass a natural scale of the terms that cancel.
    pub fn add(&mut self, label: impl Into<String>, tolerance: f64, reference: f64) {
        self.rows.push((label.into(), tolerance / reference.abs()));
    }
}

impl Drop for Power {
    fn drop(&mut self) {
        // The test has failed already.
        if std::thread::panicking() {
            return;
        }
        let (label, bias) = worst(&self.rows).unwrap_or_else(|| panic!("{} compares nothing", self.test));
        let weak: Vec<_> =
            self.rows.iter().filter(|(_, bias)| bias.is_nan() || *bias > self.noticed).collect();
        assert!(weak.is_empty(), "{} would not notice a bias of {}: {weak:?}", self.test, self.noticed);
        let label = label.replace('|', "/");
        let scenes = alone(&mut self.scenes);
        println!("power | {} | {} | {:.1} %{scenes} | {label} |", self.test, self.rows.len(), 100.0 * bias);
        // The table lists the quick tests; some tests run only when thorough.
        if !thorough() {
            results::names(TABLE, self.test);
        }
    }
}

/// Smallest bias that single scenes reject: the median and the worst.
fn alone(scenes: &mut [f64]) -> String {
    scenes.sort_by(f64::total_cmp);
    match scenes {
        [] => String::new(),
        [.., worst] => {
            let worst = 100.0 * *worst;
            format!("; one scene alone {:.0} %, at worst {worst:.0} %", 100.0 * scenes[scenes.len() / 2])
        }
    }
}

/// The comparison with the least power, NaN being the worst of all.
fn worst(rows: &[(String, f64)]) -> Option<(&str, f64)> {
    let size = |bias: f64| if bias.is_nan() { f64::INFINITY } else { bias };
    let worst = rows.iter().max_by(|a, b| size(a.1).total_cmp(&size(b.1)));
    worst.map(|(label, bias)| (label.as_str(), size(*bias)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_worst_comparison_is_told() {
        let row = |label: &str, bias| (label.to_owned(), bias);
        assert_eq!(worst(&[]), None);
        assert_eq!(worst(&[row("fair", 0.05), row("poor", 0.1)]), Some(("poor", 0.1)));
        assert_eq!(worst(&[row("nothing", f64::NAN), row("poor", 0.1)]), Some(("nothing", f64::INFINITY)));
    }

    #[test]
    fn what_scenes_show_alone_is_said() {
        assert_eq!(alone(&mut []), "");
        assert_eq!(alone(&mut [3.0, 0.2, 0.4]), "; one scene alone 40 %, at worst 300 %");
    }

    #[test]
    #[should_panic(expected = "would not notice")]
    fn a_test_may_ask_for_more() {
        let mut power = Power::of("power::tests").noticing(0.05);
        power.add("fair elsewhere", 0.1, 1.0);
    }

    #[test]
    #[should_panic(expected = "would not notice")]
    fn a_weak_comparison_is_a_failure() {
        let mut power = Power::of("power::tests");
        power.add("fair, of the other sign", 0.1, -1.0);
        power.add("weak", 0.16, 1.0);
    }

    #[test]
    #[should_panic(expected = "compares nothing")]
    fn a_test_without_comparisons_is_a_failure() {
        drop(Power::of("power::tests"));
    }
}
