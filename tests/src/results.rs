//! Tables in `RESULTS.md` and other files that tests fill.

use std::ops::Range;
use std::path::{Path, PathBuf};

fn path() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("RESULTS.md")
}

/// A file's text and the range of a table in it: between `<!-- {name}: filled by … -->` and
/// `<!-- end of {name} -->`.
fn place(file: &Path, name: &str) -> (String, Range<usize>) {
    let text = std::fs::read_to_string(file).unwrap_or_else(|e| panic!("{}: {e}", file.display()));
    let start = text.find(&format!("<!-- {name}: filled by ")).expect("the table's beginning");
    let start = start + text[start..].find('\n').expect("a line") + 1;
    let end = start + text[start..].find(&format!("<!-- end of {name} -->")).expect("the table's end");
    (text, start..end)
}

/// The table as `RESULTS.md` shows it.
pub fn shown(name: &str) -> String {
    shown_in(&path(), name)
}

/// The table as a given file shows it.
pub fn shown_in(file: &Path, name: &str) -> String {
    let (text, place) = place(file, name);
    text[place].to_owned()
}

/// Writes a table into `RESULTS.md`.
pub fn fill(name: &str, table: &str) {
    fill_in(&path(), name, table);
}

/// Writes a table into a given file.
pub fn fill_in(file: &Path, name: &str, table: &str) {
    let (text, place) = place(file, name);
    let filled = format!("{}{table}{}", &text[..place.start], &text[place.end..]);
    std::fs::write(file, filled).unwrap_or_else(|e| panic!("{}: {e}", file.display()));
}

/// Whether the environment variable `UPDATE_RESULTS` asks for new tables.
fn updates() -> bool {
    std::env::var_os("UPDATE_RESULTS").is_some()
}

/// Writes a table if `UPDATE_RESULTS` is set, and otherwise checks that the file shows a table with the same
/// first column: the last digits of the other columns differ between machines.
pub fn table<const N: usize>(name: &str, header: [&str; N], rows: Vec<[String; N]>) {
    let mut table = format!("| {} |\n|{}\n", header.join(" | "), "---|".repeat(N));
    rows.iter().for_each(|row| table += &format!("| {} |\n", row.join(" | ")));
    println!("{table}");
    if updates() {
        fill(name, &table);
    } else {
        let rows = |t: &str| t.lines().map(|l| l.split('|').nth(1).map(str::to_owned)).collect::<Vec<_>>();
        assert_eq!(
            rows(&shown(name)),
            rows(&table),
            "run with UPDATE_RESULTS=1 to show the new rows in tests/RESULTS.md"
        );
    }
}

/// The power of ten at or above an error, which must be small, formatted for a table.
pub fn power_of_ten(error: f64) -> String {
    assert!(error.is_finite() && error <= 1e-2, "{error}");
    if error == 0.0 { "0".into() } else { format!("≤ 1e{}", error.log10().ceil()) }
}

/// Checks that a table's first column has a row of this name, unless `UPDATE_RESULTS` is set.
pub fn names(table: &str, row: &str) {
    let named =
        shown(table).lines().any(|line| line.split('|').nth(1).is_some_and(|cell| cell.trim() == row));
    assert!(named || updates(), "tests/RESULTS.md: the {table} has no row {row:?}");
}
