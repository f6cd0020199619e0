//! Fills the table of power of `tests/RESULTS.md` from the output of statistical tests: `UPDATE_RESULTS=1
//! cargo test --release --workspace -- --nocapture | cargo run --release -p tests --example power`.
//!
//! Rows of files that are not in the input are kept, so that one file can be measured again.

use std::collections::{BTreeMap, BTreeSet};
use std::io::{BufRead, stdin};

use tests::power::TABLE;
use tests::results;

fn main() {
    let mut rows = BTreeMap::new();
    for line in stdin().lock().lines() {
        let line = line.expect("text");
        // The harness may have begun the line.
        let Some((_, row)) = line.split_once("power | ") else { continue };
        let name = row.split(" |").next().expect("a name").to_owned();
        rows.insert(name, format!("| {row}"));
    }
    let file = |name: &str| name.split("::").next().map(str::to_owned);
    let measured: BTreeSet<_> = rows.keys().filter_map(|name| file(name)).collect();
    for row in results::shown(TABLE).lines().skip(2) {
        let name = row.trim_start_matches("| ").split(" |").next().expect("a name").to_owned();
        if file(&name).is_some_and(|file| !measured.contains(&file)) {
            rows.insert(name, row.to_owned());
        }
    }
    let rows: String = rows.into_values().map(|row| row + "\n").collect();
    let head = "| test | comparisons | smallest bias it rejects | of which |\n|---|---|---|---|\n";
    results::fill(TABLE, &format!("{head}{rows}"));
    println!("{rows}");
}
