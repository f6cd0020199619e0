//! The report of a run, as HTML.

use std::fmt::Write as _;
use std::path::PathBuf;

use anyhow::Context as _;
use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use volume3d::io::read_bytes;
use volume3d::optimize::{Fit, Loss, Schedule};

use super::config::Config;
use super::placed_scene::rows;
use super::quality::{Judged, Quality};
use super::result::{LISTED, Pose, poses, unit};
use super::views::view_file;

const STYLE: &str = include_str!("report.css");

/// The largest number of views in the report; the folder has all.
const SHOWN: usize = 16;

/// Content of the report at the end of a run.
pub(super) struct Found<'r> {
    pub(super) fit: &'r Fit,
    /// Start values of the fit.
    pub(super) start: &'r [f64],
    /// The range of the difference image of each view.
    pub(super) ranges: &'r [f64],
    pub(super) views: &'r [Judged],
    /// The table of several starts; empty if there was one.
    pub(super) table: &'r str,
}

/// The page; it refers to no other files.
pub(super) fn page(
    config: &Config,
    found: &Found<'_>,
    file: impl Fn(&str) -> PathBuf,
) -> anyhow::Result<String> {
    let read = |name: &str| {
        let path = file(name);
        read_bytes(&path).with_context(|| format!("cannot read {}", path.display()))
    };
    let picture = |name: &str| -> anyhow::Result<String> {
        Ok(format!("<img alt=\"{name}\" src=\"data:image/png;base64,{}\">", STANDARD.encode(read(name)?)))
    };
    let Found { fit, ranges, views, table, .. } = *found;
    let quality = Quality::of(views);
    let mut page = format!(
        "<!doctype html><html lang=\"en\"><meta charset=\"utf-8\"><meta name=\"viewport\" \
         content=\"width=device-width\"><title>A fit of {scene}</title><style>{STYLE}</style>\n\
         <h1>A fit of {scene}</h1>\n<p class=\"{class}\">{words}</p>\n",
        scene = escape(&config.scene.file_name().unwrap_or_default().to_string_lossy()),
        class = if quality.is_reached() { "good" } else { "bad" },
        words = quality.words(),
    );
    if !quality.is_reached() {
        page.push_str(
            "<p>It may be a wrong optimum, too few steps, or a scene that cannot match its pictures: compare fit and \
             target below, and try a closer start, <code>starts = 8</code> or more <code>steps</code>.</p>\n",
        );
    }
    let _ = writeln!(
        page,
        "<h2>Values</h2>{}{}",
        values(fit, found.start),
        poses(fit).iter().map(matrix).collect::<String>()
    );
    if !table.is_empty() {
        let _ = writeln!(page, "<h2>Starts</h2><pre>{}</pre>", escape(table));
    }
    let _ = writeln!(
        page,
        "<h2>The fit</h2><figure class=\"film\">{}<figcaption>The first view, from the first step to the \
         last.</figcaption></figure>",
        picture("animation.png")?
    );
    let records = &fit.state().records;
    let (first, last) = records.first().zip(records.last()).map_or((0.0, 0.0), |(a, b)| (a.loss, b.loss));
    let _ = writeln!(
        page,
        "<h2>Loss</h2><figure class=\"curve\">{}<figcaption>The loss of each of {} steps, from {first:.3e} to \
         {last:.3e}, and its moving average. The images of steps are noisy, and so are their losses.</figcaption></figure>",
        inherited(&String::from_utf8_lossy(&read("loss.svg")?)),
        records.len()
    );
    let _ = writeln!(
        page,
        "<h2>Views</h2><p>Differences are fit minus target: red where the fit is too bright, blue where it is \
         too dark, each view in its own range.</p>"
    );
    for (v, view) in views.iter().enumerate().take(SHOWN) {
        let _ = writeln!(
            page,
            "<h3>{}</h3><p>residual {:.2e}, noise {:.2e}</p><div class=\"row\">",
            escape(&view.view),
            view.residual,
            view.noise
        );
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
    let more = views.len().saturating_sub(SHOWN);
    if more > 0 {
        let _ = writeln!(page, "<p>{more} more views are in the folder <code>views</code>.</p>");
    }
    if !config.deviations.is_empty() {
        let _ = writeln!(page, "<h2>Parts of the scene that may be read differently than intended</h2><ul>");
        for note in &config.deviations {
            let _ = writeln!(page, "<li>{}</li>", escape(note));
        }
        page.push_str("</ul>\n");
    }
    let text = String::from_utf8_lossy(&read("config.toml")?).into_owned();
    let _ = writeln!(
        page,
        "<h2>Settings</h2>{}<details><summary>Configuration</summary><pre>{}</pre></details></html>",
        settings(config, fit)?,
        escape(&text)
    );
    Ok(page)
}

/// A table with start and end of all parameters with few numbers.
fn values(fit: &Fit, start: &[f64]) -> String {
    let mut table = "<div class=\"wide\"><table><tr><th>parameter<th>unit<th>start<th>end</tr>\n".to_owned();
    let result = fit.result();
    let shown = |numbers: &[f64]| numbers.iter().map(|x| format!("{x:.5}")).collect::<Vec<_>>().join(", ");
    for group in fit.parameters().groups() {
        let range = group.range.clone();
        let [from, to] = if range.len() > LISTED {
            [String::new(), format!("{} numbers, in fit.xml", range.len())]
        } else {
            let from = if start.len() == result.len() { shown(&start[range.clone()]) } else { String::new() };
            [from, shown(&result[range])]
        };
        let _ = writeln!(
            table,
            "<tr><td><code>{}</code><td>{}<td>{from}<td>{to}</tr>",
            escape(&group.name),
            unit(group)
        );
    }
    table + "</table></div>"
}

fn matrix(pose: &Pose<'_>) -> String {
    let (distance, angle, axis) = pose.motion();
    let pivot = pose.placed.pivot;
    let mut text = format!(
        "<h3>Pose of <code>{}</code></h3><p>Moved by {distance:.5} scene units and rotated by {angle:.3}° about \
         ({:.4}, {:.4}, {:.4}) through the pivot ({:.5}, {:.5}, {:.5}), relative to the scene before the fit. The matrix \
         for columns (x, y, z, 1) in scene units; <code>result.toml</code> has all digits:</p><table class=\"matrix\">",
        escape(&pose.name),
        axis.x,
        axis.y,
        axis.z,
        pivot.x,
        pivot.y,
        pivot.z
    );
    for row in rows(&pose.placed.map) {
        let cells: String = row.iter().map(|x| format!("<td>{x:.6}")).collect();
        let _ = writeln!(text, "<tr>{cells}</tr>");
    }
    text + "</table>"
}

fn settings(config: &Config, fit: &Fit) -> anyhow::Result<String> {
    let loss = match fit.objective().loss {
        Loss::Multiscale { levels } => format!("mean squares at {levels} resolutions"),
        Loss::Relative { epsilon } => format!("relative squares, ε = {epsilon}"),
        Loss::L1 => "mean absolute difference".to_owned(),
        _ => "mean square".to_owned(),
    };
    let schedule = match config.schedule {
        Schedule::Constant {} => "constant".to_owned(),
        Schedule::Cosine { end } => format!("cosine, falling to {end} times the first"),
        Schedule::Exponential { end } => format!("exponential, falling to {end} times the first"),
    };
    let rates = fit.parameters().groups().iter().zip(fit.optimizers());
    let rates: Vec<String> =
        rates.map(|(group, o)| format!("<code>{}</code> {}", escape(&group.name), o.adam.rate)).collect();
    let views = fit.objective().views.len();
    let rows = [
        ("steps", config.steps.to_string()),
        ("views", format!("{views}, {} per step", config.views_per_step.unwrap_or(views).min(views))),
        ("loss", loss),
        (
            "samples per pixel",
            format!("{} for gradients, {} for images", config.gradient.spp, fit.objective().image_samples),
        ),
        ("gradient method", config.gradient.method_name().to_owned()),
        ("learning rates", rates.join(", ")),
        ("learning rate schedule", schedule),
        ("starts", config.starts.to_string()),
        ("seed", config.seed.to_string()),
    ];
    let rows: String = rows.iter().map(|(name, value)| format!("<tr><th>{name}<td>{value}</tr>\n")).collect();
    Ok(format!("<div class=\"wide\"><table>{rows}</table></div>"))
}

/// A plot whose lines and letters have the colour of the page.
fn inherited(svg: &str) -> String {
    let svg = svg.replace("#000000", "currentColor").replace("#FFFFFF", "none");
    svg.replacen("<svg width=\"720\" height=\"360\"", "<svg", 1)
}

fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}
