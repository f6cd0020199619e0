//! The gallery: every picture and study on one page that needs nothing but itself.

use std::{fmt::Write, fs, path::Path};

use anyhow::{Context, Result, ensure};
use base64::{Engine, engine::general_purpose::STANDARD};

use crate::output::{Cell, Table, write_bytes};

/// How the page looks.
const STYLE: &str = include_str!("gallery.css");

/// A picture of a section.
#[derive(Clone, Debug)]
pub(crate) struct Picture {
    /// File name in the gallery's folder (PNG, animated or not).
    pub(crate) file: String,
    /// What the picture shows, for readers who cannot see it. Plain text.
    pub(crate) alt: String,
    /// Text under the picture; may be empty. HTML on the page.
    pub(crate) caption: String,
}

/// A numbered part of the page.
#[derive(Clone, Debug, Default)]
pub(crate) struct Section {
    /// Anchor in the page's address.
    pub(crate) id: String,
    /// Heading. Plain text.
    pub(crate) title: String,
    /// A few paragraphs. HTML.
    pub(crate) explanation_html: String,
    /// Displayed formula; may be empty.
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
             <title>{title}</title>\n<style>\n{STYLE}</style>\n</head>\n<body>\n\
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
fn escape(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
        .replace('"', "&quot;")
        .replace('\'', "&#39;")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{output::write_png, plot::Canvas};

    #[test]
    fn text_is_escaped() {
        assert_eq!(escape("a<b & \"c\" 'd'>"), "a&lt;b &amp; &quot;c&quot; &#39;d&#39;&gt;");
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
