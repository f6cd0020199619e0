//! The page that shows a run.

use std::fmt::Write as _;
use std::path::PathBuf;

use anyhow::Context as _;
use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use volume3d::io::read_bytes;
use volume3d::optimize::Fit;

use super::config::Config;
use super::views::view_file;

const STYLE: &str = "body{font:16px/1.5 system-ui,sans-serif;max-width:1000px;margin:2em auto;padding:0 1em;color:#222}\
    img{image-rendering:pixelated;width:100%;display:block}table{border-collapse:collapse}\
    td,th{padding:.2em .8em .2em 0;text-align:left;vertical-align:top}\
    .row{display:grid;grid-template-columns:repeat(4,1fr);gap:12px;margin:.5em 0 1.5em}\
    figure{margin:0}figcaption{color:#555;font-size:14px}pre{background:#f4f4f4;padding:1em;overflow:auto}\
    .film{max-width:480px}";

/// Views that are shown; all of them are in the folder.
const SHOWN: usize = 16;

/// A page that needs no other file.
pub(super) fn page(
    config: &Config,
    fit: &Fit,
    values: &str,
    ranges: &[f64],
    file: impl Fn(&str) -> PathBuf,
) -> anyhow::Result<String> {
    let read = |name: &str| {
        let path = file(name);
        read_bytes(&path).with_context(|| format!("cannot read {}", path.display()))
    };
    let picture = |name: &str| -> anyhow::Result<String> {
        Ok(format!("<img alt=\"{name}\" src=\"data:image/png;base64,{}\">", STANDARD.encode(read(name)?)))
    };
    let records = &fit.state().records;
    let ends = records.first().zip(records.last());
    let (first, last) = ends.map_or((0.0, 0.0), |(a, b)| (a.loss, b.loss));
    let mut page = format!(
        "<!doctype html><html lang=\"en\"><meta charset=\"utf-8\"><meta name=\"viewport\" \
         content=\"width=device-width\"><title>A fit of {scene}</title><style>{STYLE}</style>\n\
         <h1>A fit of {scene}</h1>\n<p>{steps} steps over {views} views: the loss went from {first:.3e} to {last:.3e}. Losses \
         are those of noisy images: where the fit is as good as the noise, they no longer fall.</p>\n",
        scene = escape(&config.scene.file_name().unwrap_or_default().to_string_lossy()),
        steps = records.len(),
        views = fit.objective().views.len(),
    );
    let _ = writeln!(
        page,
        "<h2>The fit</h2><figure class=\"film\">{}<figcaption>The first view, from the first step to the \
         last.</figcaption></figure>",
        picture("animation.png")?
    );
    let _ = writeln!(
        page,
        "<h2>Loss</h2><figure>{}<figcaption>The loss of every step, and its mean over neighbouring \
         steps.</figcaption></figure>",
        String::from_utf8_lossy(&read("loss.svg")?)
    );
    let _ = writeln!(page, "<h2>Values</h2><pre>{}</pre>", escape(values));
    let _ = writeln!(
        page,
        "<h2>Views</h2><p>Differences are fit less target: red where the fit is too bright, blue where it is \
         too dark, each view in its own range.</p>"
    );
    for (v, view) in fit.objective().views.iter().enumerate().take(SHOWN) {
        let _ = writeln!(page, "<h3>{}</h3><div class=\"row\">", escape(&view.name));
        for what in ["target", "start", "fit", "difference"] {
            let name = format!("{}.png", view_file(v, what));
            let range = match (what, ranges.get(v)) {
                ("difference", Some(range)) => format!(", ± {range:.2e}"),
                _ => String::new(),
            };
            let _ =
                writeln!(page, "<figure>{}<figcaption>{what}{range}</figcaption></figure>", picture(&name)?);
        }
        page.push_str("</div>\n");
    }
    let more = fit.objective().views.len().saturating_sub(SHOWN);
    if more > 0 {
        let _ = writeln!(page, "<p>{more} more views are in the folder <code>views</code>.</p>");
    }
    if !config.deviations.is_empty() {
        let _ = writeln!(page, "<h2>Read in another way than it may have been meant</h2><ul>");
        for note in &config.deviations {
            let _ = writeln!(page, "<li>{}</li>", escape(note));
        }
        page.push_str("</ul>\n");
    }
    let text = String::from_utf8_lossy(&read("config.toml")?).into_owned();
    let _ = writeln!(page, "<h2>Configuration</h2><pre>{}</pre></html>", escape(&text));
    Ok(page)
}

fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}
