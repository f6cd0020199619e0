//! Tables of the README that tests fill.

use std::path::Path;

/// Puts a table in its place in the README if the environment variable `UPDATE_README` is set, and
/// otherwise checks that the README shows a table with the same first column: the last digits of
/// the others differ between machines.
///
/// The place is between `<!-- {name}: filled by … -->` and `<!-- end of {name} -->`.
///
/// # Panics
/// If the README has no such place, or shows other rows.
pub fn table(name: &str, table: &str) {
    println!("{table}");
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../README.md");
    let readme = std::fs::read_to_string(&path).expect("README.md");
    let start = readme.find(&format!("<!-- {name}: filled by ")).expect("the table's beginning");
    let start = start + readme[start..].find('\n').expect("a line") + 1;
    let end = start + readme[start..].find(&format!("<!-- end of {name} -->")).expect("the table's end");
    let shown = &readme[start..end];
    if std::env::var_os("UPDATE_README").is_some() {
        std::fs::write(&path, format!("{}{table}{}", &readme[..start], &readme[end..])).expect("README.md");
    } else {
        let rows = |t: &str| t.lines().map(|l| l.split('|').nth(1).map(str::to_owned)).collect::<Vec<_>>();
        assert_eq!(rows(shown), rows(table), "run with UPDATE_README=1 to show the new rows");
    }
}
