//! The gallery: every picture and study on one page that needs nothing but itself.

use std::{fmt::Write, fs, path::Path};

use anyhow::{Context, Result, ensure};
use base64::{Engine, engine::general_purpose::STANDARD};

use crate::output::{Cell, Table, write_bytes};

/// A picture of a section.
#[derive(Clone, Debug)]
pub(crate) struct Picture {
    /// File name in the gallery's folder (PNG, animated or not).
    pub(crate) file: String,
    /// What the picture shows, for readers who cannot see it. Plain text.
    pub(crate) alt: String,
    /// Text under the picture. HTML; may be empty.
    pub(crate) caption: String,
}

/// A numbered part of the page.
#[derive(Clone, Debug, Default)]
pub(crate) struct Section {
    /// Anchor in the page's address.
    pub(crate) id: String,
    /// Heading. Plain text.
    pub(crate) title: String,
    /// A few sentences. HTML; inline formulas by [`formula`].
    pub(crate) explanation_html: String,
    /// Displayed formula from [`formula`]; may be empty.
    pub(crate) formula_mathml: String,
    /// Pictures, embedded.
    pub(crate) pictures: Vec<Picture>,
    /// File names in the gallery's folder, linked.
    pub(crate) data: Vec<String>,
    /// Numbers worth reading on the page.
    pub(crate) table: Option<Table>,
}

/// The page.
#[derive(Clone, Debug)]
pub(crate) struct Gallery {
    title: String,
    intro_html: String,
    /// Each with its number.
    sections: Vec<(usize, Section)>,
}

impl Gallery {
    /// A page without sections; the title is plain text, the introduction HTML.
    #[must_use]
    pub(crate) fn new(title: impl Into<String>, intro_html: impl Into<String>) -> Self {
        Self { title: title.into(), intro_html: intro_html.into(), sections: Vec::new() }
    }

    /// The page with one more section at its end, under a number of its own: on a page of a single
    /// figure it is still that figure's.
    #[must_use]
    pub(crate) fn section(mut self, number: usize, section: Section) -> Self {
        self.sections.push((number, section));
        self
    }

    /// Writes `index.html` into `folder`, where pictures and data stand already.
    ///
    /// # Errors
    /// If a picture cannot be read, a data file is missing, or the page cannot be written.
    pub(crate) fn write(&self, folder: &Path) -> Result<()> {
        let mut page = String::new();
        let title = escape(&self.title);
        write!(
            page,
            "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
             <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
             <title>{title}</title>\n<style>{STYLE}</style>\n</head>\n<body>\n\
             <header><h1>{title}</h1>\n<div class=\"text\">{}</div></header>\n\
             <nav aria-label=\"Contents\"><ol>",
            self.intro_html
        )?;
        for (number, section) in &self.sections {
            let (id, title) = (escape(&section.id), escape(&section.title));
            write!(page, "<li value=\"{number}\"><a href=\"#{id}\">{title}</a></li>")?;
        }
        page.push_str("</ol></nav>\n<main>\n");
        for (number, section) in &self.sections {
            write_section(&mut page, *number, section, folder)
                .with_context(|| format!("section “{}” of the gallery", section.title))?;
        }
        page.push_str("</main>\n</body>\n</html>\n");
        write_bytes(&folder.join("index.html"), page.as_bytes())
    }
}

fn write_section(page: &mut String, number: usize, section: &Section, folder: &Path) -> Result<()> {
    let (id, title) = (escape(&section.id), escape(&section.title));
    write!(
        page,
        "<section id=\"{id}\">\n<h2><a href=\"#{id}\"><span>{number}</span>{title}</a></h2>\n\
         <div class=\"text\">{}</div>\n",
        section.explanation_html
    )?;
    if !section.formula_mathml.is_empty() {
        writeln!(page, "<div class=\"formula\">{}</div>", section.formula_mathml)?;
    }
    for picture in &section.pictures {
        write_picture(page, picture, folder)?;
    }
    if let Some(table) = &section.table {
        write_table(page, table)?;
    }
    if !section.data.is_empty() {
        page.push_str("<p class=\"data\">Data: ");
        for (i, file) in section.data.iter().enumerate() {
            ensure!(folder.join(file).is_file(), "no data file {}", folder.join(file).display());
            let file = escape(file);
            write!(page, "{}<a href=\"{file}\">{file}</a>", if i == 0 { "" } else { " · " })?;
        }
        page.push_str("</p>\n");
    }
    page.push_str("</section>\n");
    Ok(())
}

fn write_picture(page: &mut String, picture: &Picture, folder: &Path) -> Result<()> {
    let path = folder.join(&picture.file);
    let bytes = fs::read(&path).with_context(|| format!("reading {}", path.display()))?;
    // Width and height stand in a PNG's first chunk, IHDR, at fixed places.
    let side = |at: usize| bytes.get(at..at + 4).and_then(|b| b.try_into().ok()).map(u32::from_be_bytes);
    ensure!(bytes.starts_with(b"\x89PNG\r\n\x1a\n"), "{} is not a PNG", path.display());
    let (Some(width), Some(height)) = (side(16), side(20)) else {
        anyhow::bail!("{} ends in its header", path.display());
    };
    // Canvases hold two device pixels per logical one.
    write!(
        page,
        "<figure><a class=\"card\" href=\"{}\"><img width=\"{}\" height=\"{}\" alt=\"{}\" \
         src=\"data:image/png;base64,",
        escape(&picture.file),
        width / 2,
        height / 2,
        escape(&picture.alt),
    )?;
    STANDARD.encode_string(&bytes, page);
    page.push_str("\"></a>");
    if !picture.caption.is_empty() {
        write!(page, "<figcaption>{}</figcaption>", picture.caption)?;
    }
    page.push_str("</figure>\n");
    Ok(())
}

fn write_table(page: &mut String, table: &Table) -> Result<()> {
    page.push_str("<div class=\"table\"><table><thead><tr>");
    for (i, name) in table.header.iter().enumerate() {
        let words = table.rows.first().and_then(|row| row.get(i));
        let class = if matches!(words, Some(Cell::Text(_))) { "" } else { " class=\"number\"" };
        write!(page, "<th{class}>{}</th>", escape(name))?;
    }
    page.push_str("</tr></thead><tbody>");
    for row in &table.rows {
        page.push_str("<tr>");
        for cell in row {
            let class = if matches!(cell, Cell::Text(_)) { "" } else { " class=\"number\"" };
            write!(page, "<td{class}>{}</td>", escape(&cell.shown()))?;
        }
        page.push_str("</tr>");
    }
    page.push_str("</tbody></table></div>\n");
    Ok(())
}

/// Text with the characters that mean something in HTML made harmless, in attributes too.
#[must_use]
pub(crate) fn escape(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
        .replace('"', "&quot;")
        .replace('\'', "&#39;")
}

/// How a formula stands on the page.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Placement {
    /// On a line of its own.
    Display,
    /// Within a sentence.
    Inline,
}

/// MathML for a formula in a small subset of TeX with Unicode symbols, such as
/// `∂_θ I = ∫_D ∇·(f V_θ) \d x`.
///
/// Known are `_` and `^`, groups `{…}`, `\frac{…}{…}`, `\sqrt{…}`, accents `\hat`, `\tilde`, `\bar`,
/// `\bold{…}`, words in `\text{…}`, thin and wide spaces `\,` and `\quad`, and the differential `\d`;
/// any other `\word` is an upright function name. Faulty input gives a faulty formula, never a panic.
#[must_use]
pub(crate) fn formula(source: &str, placement: Placement) -> String {
    let display = if placement == Placement::Display { " display=\"block\"" } else { "" };
    let mut parser = Parser { rest: source };
    let mut body = parser.row(false);
    while !parser.rest.is_empty() {
        // A closing brace too many.
        parser.rest = &parser.rest[1..];
        body.push_str(&parser.row(false));
    }
    format!("<math{display}><mrow>{body}</mrow></math>")
}

struct Parser<'a> {
    rest: &'a str,
}

/// A piece of MathML and whether its indices go above and below it (sums, limits) in display.
struct Atom {
    code: String,
    limits: bool,
}

impl Parser<'_> {
    fn take(&mut self) -> Option<char> {
        let first = self.rest.chars().next()?;
        self.rest = &self.rest[first.len_utf8()..];
        Some(first)
    }

    /// Everything up to the end or an unmatched `}`, which is consumed if `braced`.
    fn row(&mut self, braced: bool) -> String {
        let mut row = String::new();
        loop {
            self.rest = self.rest.trim_start();
            if self.rest.starts_with('}') {
                if braced {
                    self.take();
                }
                return row;
            }
            let Some(base) = self.atom() else { return row };
            row.push_str(&self.with_indices(base));
        }
    }

    fn with_indices(&mut self, base: Atom) -> String {
        let (mut lower, mut upper) = (None, None);
        loop {
            self.rest = self.rest.trim_start();
            let slot = match self.rest.chars().next() {
                Some('_') if lower.is_none() => &mut lower,
                Some('^') if upper.is_none() => &mut upper,
                _ => break,
            };
            self.take();
            *slot = Some(self.argument());
        }
        let tags = if base.limits { ["munder", "mover", "munderover"] } else { ["msub", "msup", "msubsup"] };
        let code = base.code;
        match (lower, upper) {
            (None, None) => code,
            (Some(lower), None) => format!("<{0}>{code}{lower}</{0}>", tags[0]),
            (None, Some(upper)) => format!("<{0}>{code}{upper}</{0}>", tags[1]),
            (Some(lower), Some(upper)) => format!("<{0}>{code}{lower}{upper}</{0}>", tags[2]),
        }
    }

    /// A group or a single symbol, as one element.
    fn argument(&mut self) -> String {
        self.rest = self.rest.trim_start();
        if self.rest.starts_with('}') {
            return "<mrow></mrow>".to_owned();
        }
        self.atom().map_or_else(|| "<mrow></mrow>".to_owned(), |atom| atom.code)
    }

    fn atom(&mut self) -> Option<Atom> {
        let plain = |code: String| Some(Atom { code, limits: false });
        let start = self.rest;
        match self.take()? {
            '{' => plain(format!("<mrow>{}</mrow>", self.row(true))),
            '\\' => Some(self.command()),
            digit if digit.is_ascii_digit() => {
                let end = start.find(|c: char| !c.is_ascii_digit() && c != '.').unwrap_or(start.len());
                self.rest = &start[end..];
                plain(format!("<mn>{}</mn>", &start[..end]))
            }
            sum @ ('∑' | '∏') => Some(Atom { code: format!("<mo>{sum}</mo>"), limits: true }),
            '|' => plain("<mo stretchy=\"false\">|</mo>".to_owned()),
            '-' => plain("<mo>−</mo>".to_owned()),
            '\'' => plain("<mo>′</mo>".to_owned()),
            letter if letter.is_alphabetic() || letter == '∞' => plain(format!("<mi>{letter}</mi>")),
            symbol => plain(format!("<mo>{}</mo>", escape(symbol.encode_utf8(&mut [0; 4])))),
        }
    }

    fn command(&mut self) -> Atom {
        let end = self.rest.find(|c: char| !c.is_ascii_alphabetic()).unwrap_or(self.rest.len());
        let (name, rest) = self.rest.split_at(end);
        self.rest = rest;
        let code = match name {
            "" => match self.take() {
                Some(brace @ ('{' | '}')) => format!("<mo>{brace}</mo>"),
                _ => "<mspace width=\"0.17em\"></mspace>".to_owned(),
            },
            "quad" => "<mspace width=\"1em\"></mspace>".to_owned(),
            "d" => "<mspace width=\"0.17em\"></mspace><mi mathvariant=\"normal\">d</mi>".to_owned(),
            "frac" => format!("<mfrac>{}{}</mfrac>", self.argument(), self.argument()),
            "sqrt" => format!("<msqrt>{}</msqrt>", self.argument()),
            "hat" => {
                format!("<mover accent=\"true\">{}<mo stretchy=\"false\">^</mo></mover>", self.argument())
            }
            "tilde" => {
                format!("<mover accent=\"true\">{}<mo stretchy=\"false\">~</mo></mover>", self.argument())
            }
            "bar" => {
                format!("<mover accent=\"true\">{}<mo stretchy=\"false\">¯</mo></mover>", self.argument())
            }
            "bold" => format!("<mrow style=\"font-weight:bold\">{}</mrow>", self.argument()),
            "text" => format!("<mtext>{}</mtext>", self.words()),
            "lim" | "min" | "max" | "argmin" => {
                return Atom {
                    code: format!("<mo form=\"prefix\" movablelimits=\"true\">{name}</mo>"),
                    limits: true,
                };
            }
            name => format!("<mi>{name}</mi><mspace width=\"0.17em\"></mspace>"),
        };
        Atom { code, limits: false }
    }

    /// The raw text of a group.
    fn words(&mut self) -> String {
        let Some(open) = self.rest.strip_prefix('{') else { return String::new() };
        let end = open.find('}').unwrap_or(open.len());
        self.rest = open.get(end + 1..).unwrap_or("");
        escape(&open[..end])
    }
}

const STYLE: &str = "
:root { color-scheme: light dark; --text: #1c2026; --muted: #5a626d; --line: #dfe3e8; --page: #fff;
  --link: #0060a0; --card: #fff; --soft: #f6f7f9; }
@media (prefers-color-scheme: dark) { :root { --text: #e4e7eb; --muted: #a2aab4; --line: #363c44;
  --page: #14171b; --link: #7fbdf0; --soft: #1c2025; } }
* { box-sizing: border-box; }
html { scroll-behavior: smooth; -webkit-text-size-adjust: 100%; }
body { margin: 0 auto; padding: 2.5rem 1.25rem 5rem; max-width: 62rem; color: var(--text);
  background: var(--page);
  font: 1.0625rem/1.6 system-ui, -apple-system, 'Segoe UI', Roboto, 'Helvetica Neue', sans-serif; }
h1 { font-size: clamp(1.7rem, 5vw, 2.4rem); line-height: 1.2; letter-spacing: -0.015em; margin: 0 0 1rem; }
h2 { font-size: 1.4rem; line-height: 1.3; margin: 0 0 .8rem; }
h2 a { color: inherit; text-decoration: none; }
h2 span { color: var(--muted); font-weight: 400; margin-right: .7em; }
a { color: var(--link); }
.text { max-width: 42rem; }
.text p { margin: 0 0 .9rem; }
nav { margin: 2rem 0; padding: 1rem 1.25rem; background: var(--soft); border-radius: .5rem; }
nav ol { margin: 0; padding-left: 1.6em; columns: 18rem; column-gap: 2.5rem; }
nav li { break-inside: avoid; padding: .15rem 0; }
nav a { text-decoration: none; }
nav a:hover, h2 a:hover { text-decoration: underline; }
section { padding: 2.5rem 0 0; margin: 2.5rem 0 0; border-top: 1px solid var(--line); }
.formula { margin: 1.2rem 0; padding: .3rem 0; overflow-x: auto; font-size: 1.15rem; }
math { font-family: 'Latin Modern Math', 'STIX Two Math', 'Cambria Math', math; }
math[display=block] { text-align: left; padding-left: 1.5rem; }
figure { margin: 1.5rem 0; }
.card { display: block; width: fit-content; max-width: 100%; background: var(--card);
  border: 1px solid var(--line); border-radius: .5rem; overflow: hidden; }
img { display: block; max-width: 100%; height: auto; }
figcaption { margin: .6rem 0 0; max-width: 42rem; color: var(--muted); font-size: .93rem; line-height: 1.5; }
.table { overflow-x: auto; margin: 1.5rem 0; }
table { border-collapse: collapse; font-size: .95rem; font-variant-numeric: tabular-nums; }
th, td { padding: .35rem 1.4rem .35rem 0; text-align: left; white-space: nowrap; }
th { border-bottom: 1.5px solid var(--text); font-weight: 600; }
td { border-bottom: 1px solid var(--line); }
.number { text-align: right; }
.data { font-size: .93rem; color: var(--muted); margin: 1rem 0 0; }
code { font-size: .92em; }
";

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{output::write_png, plot::Canvas};

    #[test]
    fn text_is_escaped() {
        assert_eq!(escape("a<b & \"c\" 'd'>"), "a&lt;b &amp; &quot;c&quot; &#39;d&#39;&gt;");
        assert!(formula("a < b & c", Placement::Inline).contains("<mo>&lt;</mo>"));
    }

    #[test]
    fn formulas_become_mathml() {
        assert_eq!(
            formula("I_θ^{2}", Placement::Inline),
            "<math><mrow><msubsup><mi>I</mi><mi>θ</mi><mrow><mn>2</mn></mrow></msubsup></mrow></math>"
        );
        assert!(formula("\\frac{1}{N} ∑_i x", Placement::Display).contains("<munder><mo>∑</mo><mi>i</mi>"));
        for faulty in
            ["{", "}", "}}a{", "_", "x_", "x_}", "\\", "\\frac", "\\frac{a", "\\text{a", "x^^_", "∂_"]
        {
            assert!(formula(faulty, Placement::Inline).ends_with("</math>"));
        }
    }

    #[test]
    fn the_page_embeds_its_pictures() {
        let folder = tempfile::tempdir().unwrap();
        write_png(&folder.path().join("a.png"), &Canvas::new(20.0, 10.0)).unwrap();
        let picture = Picture { file: "a.png".into(), alt: "<white>".into(), caption: String::new() };
        let section = Section { id: "a".into(), pictures: vec![picture], ..Section::default() };
        Gallery::new("T & t", "").section(7, section.clone()).write(folder.path()).unwrap();
        let page = fs::read_to_string(folder.path().join("index.html")).unwrap();
        assert!(page.contains("<span>7</span>") && page.contains("<li value=\"7\">"));
        assert!(page.contains("src=\"data:image/png;base64,iVBORw0KGgo"));
        assert!(page.contains("width=\"20\" height=\"10\" alt=\"&lt;white&gt;\""));
        let missing = Section { data: vec!["none.csv".into()], ..section };
        let error =
            format!("{:#}", Gallery::new("", "").section(1, missing).write(folder.path()).unwrap_err());
        assert!(error.contains("none.csv"), "{error}");
    }
}
