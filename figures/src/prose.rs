//! Text of a figure: a Markdown file beside its code, in which measured numbers have names.
//!
//! The file's paragraphs are its title (`# …`), one sentence on the content (`> …`), its text, one displayed
//! formula (`$$ … $$`), and the pictures: each a paragraph that begins with `![what is seen](file.png)` and
//! continues with the caption. Text after a paragraph `---` is the section of detailed numbers. `{name}`
//! stands for a measured value; a name known to only one side is an error. `{#name}` stands for the number of
//! the figure of this name, which the page links. Formulas are TeX, and have no names in them.

use std::fmt::Display;

use anyhow::{Context, Result, bail, ensure};
use pulldown_cmark::{Event, Options, Parser, html::push_html};
use pulldown_latex::{RenderConfig, Storage, config::DisplayMode, push_mathml};

use crate::gallery::{Picture, Section};
use crate::output::Table;

/// A figure's file with its numbers filled in.
#[derive(Clone, Debug, Default)]
pub(crate) struct Prose {
    title: String,
    lead: String,
    text: String,
    details: String,
    formula: String,
    pictures: Vec<Picture>,
    values: Vec<(String, String)>,
}

impl Prose {
    /// Fills `{name}`s with the values of these names, which may contain Markdown.
    pub(crate) fn new(source: &str, values: &[(&str, &dyn Display)]) -> Result<Self> {
        let mut unused: Vec<&str> = values.iter().map(|(name, _)| *name).collect();
        let mut prose = Self::parse(source, &mut |name| {
            unused.retain(|other| *other != name);
            let value = values.iter().find(|(other, _)| *other == name);
            value.map(|(_, value)| value.to_string()).with_context(|| format!("{{{name}}} has no value"))
        })?;
        ensure!(unused.is_empty(), "the text does not mention {unused:?}");
        prose.values = values.iter().map(|(name, value)| ((*name).to_owned(), value.to_string())).collect();
        Ok(prose)
    }

    /// Replaces each `{name}` by the value of a function.
    pub(crate) fn of(source: &str, value: impl Fn(&str) -> Result<String>) -> Result<Self> {
        Self::parse(source, &mut |name| value(name))
    }

    fn parse(source: &str, value: &mut dyn FnMut(&str) -> Result<String>) -> Result<Self> {
        let mut prose = Self::default();
        let (mut text, mut details, mut is_detail) = (String::new(), String::new(), false);
        for paragraph in source.split("\n\n").map(str::trim) {
            if let Some(title) = paragraph.strip_prefix("# ") {
                prose.title = title.to_owned();
            } else if let Some(lead) = paragraph.strip_prefix("> ") {
                prose.lead = html(&filled(&lead.replace("\n>", "\n"), value)?)?;
            } else if paragraph == "---" {
                is_detail = true;
            } else if let Some(formula) = paragraph.strip_prefix("$$") {
                prose.formula = mathml(formula.trim_end_matches('$'), DisplayMode::Block)?;
            } else if let Some(picture) = paragraph.strip_prefix("![") {
                let (alt, rest) = picture.split_once("](").context("a picture without a file")?;
                let (file, caption) = rest.split_once(')').context("a picture's file does not end")?;
                let caption = filled(caption, value)?.split_whitespace().collect::<Vec<_>>().join(" ");
                let alt = alt.replace('\n', " ");
                prose.pictures.push(Picture { file: file.to_owned(), alt, caption });
            } else {
                let place = if is_detail { &mut details } else { &mut text };
                *place += &format!("{}\n\n", filled(paragraph, value)?);
            }
        }
        (prose.text, prose.details) = (html(&text)?, html(&details)?);
        Ok(prose)
    }

    /// The part of the gallery with this anchor, with links to files of data.
    pub(crate) fn section(self, id: &str, data: Vec<String>, table: Table) -> Result<Section> {
        let mut pictures = self.pictures;
        for picture in &mut pictures {
            let caption = html(&picture.caption)?;
            picture.caption = caption.trim().trim_start_matches("<p>").trim_end_matches("</p>").to_owned();
        }
        Ok(Section {
            id: id.to_owned(),
            title: self.title,
            lead_html: self.lead,
            explanation_html: self.text,
            details_html: self.details,
            formula_mathml: self.formula,
            pictures,
            data,
            table,
            values: self.values,
            ..Section::default()
        })
    }
}

/// The text with values for its `{name}`s. Indices of drawn text, `_{…}` and `^{…}`, and formulas are
/// unchanged.
fn filled(text: &str, value: &mut dyn FnMut(&str) -> Result<String>) -> Result<String> {
    let mut filled = String::new();
    for (i, piece) in text.split('$').enumerate() {
        let is_formula = i % 2 == 1;
        filled += if i > 0 { "$" } else { "" };
        let mut rest = piece;
        while let Some((before, after)) = rest.split_once('{') {
            filled += before;
            rest = after;
            if is_formula || before.ends_with(['_', '^']) {
                filled.push('{');
                continue;
            }
            let Some((name, after)) = after.split_once('}') else { bail!("“{{{after}” has no end") };
            if name.starts_with('#') {
                filled += &format!("{{{name}}}");
            } else {
                filled += &value(name)?;
            }
            rest = after;
        }
        filled += rest;
    }
    Ok(filled)
}

/// HTML of Markdown with `$…$` and the indices of drawn text.
pub(crate) fn html(markdown: &str) -> Result<String> {
    let markdown = with_indices(markdown);
    let events =
        Parser::new_ext(&markdown, Options::ENABLE_MATH | Options::ENABLE_TABLES).map(|event| match event {
            Event::InlineMath(tex) => Ok(Event::InlineHtml(mathml(&tex, DisplayMode::Inline)?.into())),
            other => Ok(other),
        });
    let mut html = String::new();
    push_html(&mut html, events.collect::<Result<Vec<_>>>()?.into_iter());
    // An exponent stays with its base.
    Ok(html.replace("<sup>", "\u{2060}<sup>").replace("<sub>", "\u{2060}<sub>"))
}

/// `_{…}` and `^{…}` outside formulas as HTML.
fn with_indices(text: &str) -> String {
    let mut out = String::new();
    for (i, piece) in text.split('$').enumerate() {
        let is_formula = i % 2 == 1;
        out += if i > 0 { "$" } else { "" };
        let mut rest = piece;
        while let Some(at) = rest.find("_{").into_iter().chain(rest.find("^{")).min().filter(|_| !is_formula)
        {
            let Some(end) = rest[at..].find('}') else { break };
            let tag = if rest[at..].starts_with('_') { "sub" } else { "sup" };
            out += &format!("{}<{tag}>{}</{tag}>", &rest[..at], &rest[at + 2..at + end]);
            rest = &rest[at + end + 1..];
        }
        out += rest;
    }
    out
}

fn mathml(tex: &str, display_mode: DisplayMode) -> Result<String> {
    let storage = Storage::new();
    let events: Vec<_> = pulldown_latex::Parser::new(tex, &storage).collect();
    if let Some(Err(error)) = events.iter().find(|event| event.is_err()) {
        bail!("the formula {tex}: {error}");
    }
    let mut mathml = String::new();
    push_mathml(&mut mathml, events.into_iter(), RenderConfig { display_mode, ..Default::default() })?;
    Ok(mathml)
}

#[cfg(test)]
mod tests {
    use std::{collections::BTreeSet, fs, path::Path};

    use super::*;

    #[test]
    fn pages_have_parts() {
        let source = "# A title\n\n> In\n> short.\n\nIt is *so*: $x_i$ is\n{n} < {m}.\n\n---\n\nMore.\n\n$$\n\\frac{1}{2}\n$$\n\n![seen](a.png) By θ_{0} = {n}.\n";
        let values: &[(&str, &dyn Display)] = &[("n", &3), ("m", &"**4**")];
        let section = Prose::new(source, values).unwrap().section("id", vec![], Table::default()).unwrap();
        assert_eq!(section.title, "A title");
        assert_eq!([&section.lead_html, &section.details_html], ["<p>In\nshort.</p>\n", "<p>More.</p>\n"]);
        let text = "<p>It is <em>so</em>: <math display=\"inline\"><msub><mi>x</mi><mi>i</mi></msub></math> is\n3 &lt; <strong>4</strong>.</p>\n";
        assert_eq!(section.explanation_html, text);
        assert!(section.formula_mathml.contains("display=\"block\"><mfrac>"));
        assert_eq!(
            (section.pictures[0].alt.as_str(), section.pictures[0].caption.as_str()),
            ("seen", "By θ\u{2060}<sub>0</sub> = 3.")
        );
    }

    #[test]
    fn names_must_agree() {
        let error = |source: &str| Prose::new(source, &[("n", &3)]).unwrap_err().to_string();
        assert_eq!(error("{n} {m}"), "{m} has no value");
        assert_eq!(error("nothing"), "the text does not mention [\"n\"]");
        assert!(error("{n").contains("no end") && error("{n} $\\nothing$").contains("\\nothing"));
    }

    /// The Markdown and the code in every figure's folder use the same names, and all formulas are TeX.
    #[test]
    fn every_figure_fills_its_text() {
        let figures = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/figures");
        let (mut count, mut pictures) = (0, BTreeSet::new());
        let lecture = Prose::new(include_str!("figures/lecture.md"), &[]).unwrap();
        for folder in
            fs::read_dir(figures).unwrap().map(|entry| entry.unwrap().path()).filter(|path| path.is_dir())
        {
            let (mut asked, mut given) = (BTreeSet::new(), BTreeSet::new());
            for path in fs::read_dir(&folder).unwrap().map(|entry| entry.unwrap().path()) {
                let text = fs::read_to_string(&path).unwrap();
                if path.extension().is_some_and(|extension| extension == "md") {
                    let is_live = path.file_name().is_some_and(|name| name == "live.md");
                    let prose = Prose::parse(&text, &mut |name| {
                        asked.insert(name.to_owned());
                        Ok(String::new())
                    });
                    let section = prose.unwrap().section("", vec![], Table::default()).unwrap();
                    // TeX's \min_t is translated to an element with three children, which browsers do not
                    // draw.
                    assert!(!section.formula_mathml.contains("<munder><mspace"), "{}", path.display());
                    pictures.extend(section.pictures.iter().map(|picture| picture.file.clone()));
                    assert!(
                        !(section.title.is_empty()
                            || section.lead_html.is_empty()
                            || (section.formula_mathml.is_empty() && !is_live)),
                        "{}",
                        path.display()
                    );
                    count += usize::from(!is_live);
                }
                let calls = text.split("Prose::new(").skip(1).filter_map(|rest| rest.split("],\n").next());
                let values = calls.flat_map(|call| call.split("(\"").skip(1));
                given.extend(values.filter_map(|rest| Some(rest.split_once("\", &")?.0.to_owned())));
            }
            assert_eq!(asked, given, "names in {}", folder.display());
        }
        assert_eq!(count, 20);
        assert_eq!(lecture.pictures.len(), 10);
        for slide in &lecture.pictures {
            let file = slide.file.split('#').next().unwrap();
            assert!(pictures.contains(file), "no figure has the slide {file}");
        }
    }
}
