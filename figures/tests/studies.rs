//! Studies whose results are recorded run from end to end, with the least of everything.

use std::process::Command;

#[test]
fn studies_run() {
    let folder = tempfile::tempdir().unwrap();
    let names = ["poses", "views", "together", "surfaces", "masks"];
    let drawn = Command::new(env!("CARGO_BIN_EXE_figures"))
        .args(names)
        .args(["--quality", "sketch", "--out"])
        .arg(folder.path())
        .output()
        .unwrap();
    assert!(drawn.status.success(), "{}", String::from_utf8_lossy(&drawn.stderr));
    let page = std::fs::read_to_string(folder.path().join("index.html")).unwrap();
    for name in names {
        assert!(page.contains(&format!("<section id=\"{name}\">")), "{name}");
        assert!(folder.path().join(format!("{name}.png")).exists(), "{name}");
    }
    assert!(!page.contains("NaN"));
}
