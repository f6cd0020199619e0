//! The gallery in a real browser, where the machine has one: nothing missing, nothing wider than the window,
//! no errors.

use std::fs;
use std::path::Path;
use std::process::Command;

/// Widths of windows: a telephone's, and a desk's.
const WIDTHS: [u32; 2] = [400, 1400];

/// Looks into the page in a frame of the given width, and says what is wrong.
const PROBE: &str = r##"<!DOCTYPE html><body><iframe id="page" style="width:WIDTHpx;height:900px;border:0"></iframe>
<pre id="found"></pre><script>
const frame = document.getElementById("page"), found = [];
frame.onload = () => {
  for (const image of frame.contentDocument.images) image.loading = "eager";
  wait(100);
};
const wait = tries => {
  const done = [...frame.contentDocument.images].every(image => image.complete);
  if (done || tries == 0) look(); else setTimeout(() => wait(tries - 1), 100);
};
const look = () => {
  const page = frame.contentDocument, root = page.documentElement;
  for (const image of page.images)
    if (!image.complete || !image.naturalWidth) found.push("no picture " + image.currentSrc);
  if (root.scrollWidth > frame.clientWidth) {
    for (const element of page.querySelectorAll("body *")) {
      const box = element.getBoundingClientRect(), around = element.closest(".scroll, .table, .formula, .card, .part");
      if (box.right > frame.clientWidth + 1 && !around) found.push("too wide: " + element.outerHTML.slice(0, 80));
    }
    found.push("the page is " + root.scrollWidth + " pixels wide");
  }
  for (const link of page.querySelectorAll("a[href^='#']"))
    if (!page.getElementById(link.getAttribute("href").slice(1))) found.push("no place " + link.getAttribute("href"));
  document.getElementById("found").textContent = "looked at " + page.images.length + " pictures\n" + found.join("\n");
};
frame.src = "index.html";
</script>"##;

/// The first of the names under which Chromium is installed that runs, or what the variable CHROMIUM names.
fn browser() -> Option<String> {
    let names = std::env::var("CHROMIUM")
        .into_iter()
        .chain(["chromium", "chromium-browser", "google-chrome"].map(String::from));
    let runs =
        |name: &String| Command::new(name).arg("--version").output().is_ok_and(|out| out.status.success());
    names.into_iter().find(runs)
}

#[test]
fn the_page_is_whole_at_every_width() {
    let Some(browser) = browser() else {
        println!("no Chromium here, and none in the variable CHROMIUM: the page was not looked at");
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path();
    let drawn = Command::new(env!("CARGO_BIN_EXE_figures"))
        .args(["implicit", "--quality", "draft", "--out"])
        .arg(out)
        .output()
        .unwrap();
    assert!(drawn.status.success(), "{}", String::from_utf8_lossy(&drawn.stderr));
    for width in WIDTHS {
        fs::write(out.join("probe.html"), PROBE.replace("WIDTH", &width.to_string())).unwrap();
        let (found, log) = look(&browser, &out.join("probe.html"));
        assert!(found.starts_with("looked at "), "{width} pixels: the browser did not finish: {log}");
        assert_eq!(found.lines().skip(1).collect::<Vec<_>>(), Vec::<&str>::new(), "{width} pixels");
        assert!(!log.contains("CONSOLE"), "{width} pixels: {log}");
        println!("{width} pixels: {found}");
    }
}

/// What the probe wrote, and what the browser logged.
fn look(browser: &str, page: &Path) -> (String, String) {
    let output = Command::new(browser)
        .args([
            "--headless",
            "--no-sandbox",
            "--disable-gpu",
            "--allow-file-access-from-files",
            "--enable-logging=stderr",
        ])
        .args(["--virtual-time-budget=20000", "--window-size=1600,1000", "--dump-dom"])
        .arg(format!("file://{}", page.display()))
        .output()
        .unwrap();
    let dom = String::from_utf8_lossy(&output.stdout).into_owned();
    let found = dom.split_once("id=\"found\">").and_then(|(_, rest)| rest.split_once("</pre>"));
    (
        found.map_or(String::new(), |(text, _)| text.to_owned()),
        String::from_utf8_lossy(&output.stderr).into_owned(),
    )
}
