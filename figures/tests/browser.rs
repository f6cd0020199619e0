//! The pages in a real browser, where the machine has one: at the widths of a telephone, a desk and a wide
//! screen, bright and dark. Nothing is missing, nothing is wider than its box, no link is dead, and nothing
//! is written to the console.
//!
//! By default a small gallery is drawn. The variable GALLERY names the folder of one that is drawn already,
//! and CHROMIUM a browser. If the gallery is part of a site of `.ci/site`, the links of its guide are
//! checked, too.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Looks into a page in frames of several widths, and says what is wrong.
const PROBE: &str = r##"<!DOCTYPE html><body><iframe id="page" style="height:900px;border:0"></iframe>
<pre id="found"></pre><script>
const frame = document.getElementById("page"), found = [];
const wait = time => new Promise(done => setTimeout(done, time));
const load = async (width, hash) => {
  frame.style.width = width + "px";
  await new Promise(done => { frame.onload = done; frame.src = "about:blank"; });
  await new Promise(done => { frame.onload = done; frame.src = "PAGE" + hash; });
};
const look = (page, width, when) => {
  const say = words => found.push(width + " pixels" + when + ": " + words);
  const root = page.documentElement;
  if (root.scrollWidth > frame.clientWidth) say("the page is " + root.scrollWidth + " pixels wide");
  for (const element of page.querySelectorAll("body *")) {
    const style = frame.contentWindow.getComputedStyle(element), name = element.outerHTML.slice(0, 70);
    if (style.display == "inline" || !element.clientWidth) continue;
    const spills = element.scrollWidth > element.clientWidth + 1;
    if (spills && style.overflowX == "visible" && element.matches("section, figure, .text, .formula, .table, details, nav, p, li"))
      say("wider than its box: " + name);
    if (spills && width > 1000 && element.matches(".formula")) say("the formula needs " + element.scrollWidth + " of " + element.clientWidth + " pixels: " + element.closest("section").id);
  }
};
(async () => {
  let pictures = 0;
  for (const width of [400, 1400, 1920]) {
    await load(width, "");
    const page = frame.contentDocument;
    for (const image of page.images) image.loading = "eager";
    for (let i = 0; i < 100 && ![...page.images].every(image => image.complete); i++) await wait(100);
    for (const image of page.images)
      if (!image.complete || !image.naturalWidth) found.push("no picture " + image.currentSrc);
    pictures = page.images.length;
    look(page, width, "");
    for (const part of page.querySelectorAll("details")) part.open = true;
    look(page, width, ", all open");
    const slides = page.querySelectorAll("#lecture article").length;
    for (let slide = 1; slide <= slides; slide++) {
      frame.contentWindow.location.hash = "lecture-" + slide;
      await wait(150);
      const shown = [...page.querySelectorAll("#lecture article")].filter(article => !article.hidden), lecture = page.getElementById("lecture");
      if (shown.length != 1 || shown[0].dataset.slide != slide) { found.push("slide " + slide + " is not shown"); continue; }
      const box = shown[0].querySelector(".part").getBoundingClientRect(), text = shown[0].querySelector("p").getBoundingClientRect();
      if (box.width < 100 || box.height < 60) found.push(width + " pixels: slide " + slide + " is " + box.width + " × " + box.height);
      if (lecture.scrollWidth > lecture.clientWidth || text.bottom > 900 || box.top < 0) found.push(width + " pixels: slide " + slide + " does not fit");
    }
  }
  const lines = ["looked at " + pictures + " pictures", ...new Set(found)];
  document.getElementById("found").textContent = lines.join("\n");
})();
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

/// A folder with a gallery: that of the variable GALLERY, or one drawn into `folder`.
fn gallery(folder: &Path) -> PathBuf {
    if let Ok(named) = std::env::var("GALLERY") {
        // Tests run in the folder of their crate.
        return Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(named);
    }
    let drawn = Command::new(env!("CARGO_BIN_EXE_figures"))
        .args(["implicit", "together", "--quality", "draft", "--out"])
        .arg(folder)
        .output()
        .unwrap();
    assert!(drawn.status.success(), "{}", String::from_utf8_lossy(&drawn.stderr));
    folder.to_owned()
}

#[test]
fn pages_are_whole_at_every_width() {
    let folder = tempfile::tempdir().unwrap();
    let out = gallery(folder.path());
    let site = out.join("..");
    let is_site = site.join("api/volume3d/guide/index.html").exists();
    let mut pages: Vec<PathBuf> = ["index.html", "accuracy.html"]
        .map(|page| out.join(page))
        .into_iter()
        .filter(|page| page.exists())
        .collect();
    assert!(pages[0].ends_with("index.html"), "no page in {}", out.display());
    if is_site {
        pages.push(site.join("index.html"));
    }
    let mut linked = pages.clone();
    if is_site {
        linked.extend(["volume3d/index.html", "flatland/index.html"].map(|page| site.join("api").join(page)));
        let guide = pages_in(&site.join("api/volume3d/guide"));
        assert!(guide.len() > 10, "the guide has {} pages", guide.len());
        linked.extend(guide);
    }
    let dead: Vec<String> = linked.iter().flat_map(|page| dead_links(page)).collect();
    assert!(dead.is_empty(), "dead links:\n{}", dead.join("\n"));
    println!("no dead link in {} pages", linked.len());
    let Some(browser) = browser() else {
        println!("no Chromium here, and none in the variable CHROMIUM: the pages were not looked at");
        return;
    };
    for page in &pages {
        for is_dark in [false, true] {
            let probe = page.with_file_name("probe.html");
            let name = page.file_name().unwrap_or_default().to_string_lossy();
            fs::write(&probe, PROBE.replace("PAGE", &name)).unwrap();
            let (found, log) = look(&browser, &probe, is_dark);
            fs::remove_file(&probe).unwrap();
            let which = format!("{}, dark: {is_dark}", page.display());
            assert!(found.starts_with("looked at "), "{which}: the browser did not finish: {log}");
            let wrong: Vec<&str> = found.lines().skip(1).collect();
            assert!(wrong.is_empty(), "{which}:\n{}", wrong.join("\n"));
            assert!(!log.contains("CONSOLE"), "{which}: {log}");
            println!("{which}: {}", found.lines().next().unwrap_or_default());
        }
    }
}

/// All pages in a folder and its folders.
fn pages_in(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    entries
        .flat_map(|path| if path.is_dir() { pages_in(&path) } else { vec![path] })
        .filter(|path| path.extension().is_some_and(|extension| extension == "html"))
        .collect()
}

/// Links of a page to files that do not exist, or to places that their page does not have.
fn dead_links(page: &Path) -> Vec<String> {
    let html = fs::read_to_string(page).unwrap();
    let is_dead = |target: &&str| {
        if target.contains("://") || target.starts_with("data:") {
            return false;
        }
        let (file, place) = target.split_once('#').unwrap_or((target, ""));
        let path = if file.is_empty() { page.to_owned() } else { page.with_file_name(file) };
        // The places of a source are its lines, which a script finds.
        let has_places = !place.is_empty() && !file.ends_with(".rs.html");
        let has_place = |text: String| text.contains(&format!("id=\"{place}\""));
        !path.exists() || has_places && !fs::read_to_string(&path).is_ok_and(has_place)
    };
    let targets = html.split(" href=\"").skip(1).filter_map(|rest| rest.split('"').next());
    targets.filter(is_dead).map(|target| format!("{}: {target}", page.display())).collect()
}

/// What the probe wrote, and what the browser logged.
fn look(browser: &str, page: &Path, is_dark: bool) -> (String, String) {
    let scheme = format!("--blink-settings=preferredColorScheme={}", u8::from(!is_dark));
    let output = Command::new(browser)
        .args([
            "--headless",
            "--no-sandbox",
            "--disable-gpu",
            "--allow-file-access-from-files",
            "--enable-logging=stderr",
            &scheme,
        ])
        .args(["--virtual-time-budget=120000", "--window-size=2000,1000", "--dump-dom"])
        .arg(format!("file://{}", page.canonicalize().unwrap().display()))
        .output()
        .unwrap();
    let dom = String::from_utf8_lossy(&output.stdout).into_owned();
    let found = dom.split_once("id=\"found\">").and_then(|(_, rest)| rest.split_once("</pre>"));
    (
        found.map_or(String::new(), |(text, _)| text.to_owned()),
        String::from_utf8_lossy(&output.stderr).into_owned(),
    )
}
