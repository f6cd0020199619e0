//! Space at the extremes: a table of `RESULTS.md` that this test fills.
//!
//! `UPDATE_RESULTS=1 WARPED_AREA_TESTS=thorough cargo test --release -p tests --test space_stability` writes
//! it. Otherwise few runs check the cells that are known to be right, and that the table has the same rows.
//! `ONLY=words` restricts the test to rows whose names contain these words, and prints them.

mod film;
mod light;
mod row;
mod surfaces;

use tests::effort::thorough;
use tests::results;

use row::{Held, Row};

const TABLE: &str = "space stability table";

/// Environment variable: only rows whose names contain it are measured.
fn only() -> String {
    std::env::var("ONLY").unwrap_or_default()
}

fn rows() -> Vec<Row> {
    [film::rows(), light::rows(), surfaces::rows()].into_iter().flatten().collect()
}

#[test]
fn the_table_shows_what_is_measured_at_the_extremes_of_space() {
    let only = only();
    let (mut table, mut held) = (vec![], Held::default());
    for row in rows().into_iter().filter(|row| row.name.contains(&only)) {
        let start = std::time::Instant::now();
        let [image, auto, warped, edges, auto_reverse, warped_reverse, edges_reverse] = row.cells(&mut held);
        let cells = [row.name, image, auto, warped, edges, auto_reverse, warped_reverse, edges_reverse];
        println!("{:.1} s | {}", start.elapsed().as_secs_f64(), cells.join(" | "));
        table.push(cells);
    }
    let header = [
        "extreme",
        "image",
        "auto",
        "warped area",
        "edge sampling",
        "auto in reverse",
        "warped area, reverse − forward",
        "edge sampling, reverse − forward",
    ];
    println!("{}", held.wrong.join("\n"));
    held.noticed.sort_by(f64::total_cmp);
    if let [.., worst] = held.noticed[..] {
        let [count, half] = [held.noticed.len(), held.noticed.len() / 2];
        println!("{count} cells notice a bias of {:.3}, of {worst:.2} at worst", held.noticed[half]);
    }
    if thorough() && only.is_empty() {
        results::table(TABLE, header, table);
    } else {
        table.iter().for_each(|[name, ..]| results::names(TABLE, name));
    }
    assert!(held.wrong.is_empty(), "{} cells are wrong", held.wrong.len());
}

/// The control: without the terms of moving discontinuities even the simplest rows are wrong.
#[test]
fn the_interior_term_alone_is_rejected() {
    for row in rows().into_iter().filter(|row| row.name.contains("nothing extreme")) {
        assert!(row.notices_the_interior_alone(), "{}", row.name);
    }
}

/// Measured references are measured again, with other random numbers.
#[test]
fn references_by_differences_hold() {
    if !thorough() {
        return;
    }
    let only = only();
    let mut wrong = vec![];
    for row in rows().into_iter().filter(|row| row.name.contains(&only)) {
        let Some(found) = row.remeasure(512, 32) else {
            continue;
        };
        println!("{}: ({:.4}, {:.1e})", row.name, found.mean, found.standard_error);
        let error = found.standard_error.hypot(row.derivative.standard_error);
        if (found.mean - row.derivative.mean).abs() > 6.0 * error {
            wrong.push(row.name);
        }
    }
    assert!(wrong.is_empty(), "{wrong:?}");
}
