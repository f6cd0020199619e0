//! The gallery: every picture and study on one page that needs nothing but itself.

use std::{fs, path::Path};

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
    /// Displayed formula.
    pub(crate) formula_mathml: String,
    /// Pictures, embedded.
    pub(crate) pictures: Vec<Picture>,
    /// File names in the gallery's folder, linked.
    pub(crate) data: Vec<String>,
    /// Numbers worth reading on the page.
    pub(crate) table: Table,
}

/// Writes `index.html` into a folder where pictures and data stand already. The title is plain text, the introduction
/// HTML; sections have their numbers, which on a page of a single figure are still that figure's.
pub(crate) fn write(folder: &Path, title: &str, intro: &str, sections: &[(usize, Section)]) -> Result<()> {
    let title = escape(title);
    let mut page = format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <title>{title}</title>\n<style>\n{STYLE}</style>\n</head>\n<body>\n\
         <header><h1>{title}</h1>\n<div class=\"text\">{intro}</div></header>\n\
         <nav aria-label=\"Contents\"><ol>"
    );
    for (number, section) in sections {
        let (id, title) = (escape(&section.id), escape(&section.title));
        page += &format!("<li value=\"{number}\"><a href=\"#{id}\">{title}</a></li>");
    }
    page += "</ol></nav>\n<main>\n";
    for (number, section) in sections {
        let name = || format!("section “{}” of the gallery", section.title);
        page += &section_html(*number, section, folder).with_context(name)?;
    }
    page += "</main>\n</body>\n</html>\n";
    write_bytes(&folder.join("index.html"), page.as_bytes())
}

fn section_html(number: usize, section: &Section, folder: &Path) -> Result<String> {
    let (id, title) = (escape(&section.id), escape(&section.title));
    let pictures: String =
        section.pictures.iter().map(|picture| picture_html(picture, folder)).collect::<Result<_>>()?;
    for file in &section.data {
        ensure!(folder.join(file).is_file(), "no data file {}", folder.join(file).display());
    }
    let links =
        section.data.iter().map(|file| escape(file)).map(|file| format!("<a href=\"{file}\">{file}</a>"));
    Ok(format!(
        "<section id=\"{id}\">\n<h2><a href=\"#{id}\"><span>{number}</span>{title}</a></h2>\n\
         <div class=\"text\">{}</div>\n<div class=\"formula\">{}</div>\n{pictures}{}\
         <p class=\"data\">Data: {}</p>\n</section>\n",
        section.explanation_html,
        section.formula_mathml,
        table_html(&section.table),
        links.collect::<Vec<_>>().join(" · "),
    ))
}

fn picture_html(picture: &Picture, folder: &Path) -> Result<String> {
    let path = folder.join(&picture.file);
    let bytes = fs::read(&path).with_context(|| format!("reading {}", path.display()))?;
    // Width and height stand in a PNG's first chunk, IHDR, at fixed places.
    let side = |at: usize| bytes.get(at..at + 4).and_then(|b| b.try_into().ok()).map(u32::from_be_bytes);
    let sides = side(16).zip(side(20)).filter(|_| bytes.starts_with(b"\x89PNG\r\n\x1a\n"));
    let (width, height) = sides.with_context(|| format!("{} is not a PNG", path.display()))?;
    let caption = match picture.caption.as_str() {
        "" => String::new(),
        caption => format!("<figcaption>{caption}</figcaption>"),
    };
    // Canvases hold two device pixels per logical one.
    Ok(format!(
        "<figure><a class=\"card\" href=\"{}\"><img width=\"{}\" height=\"{}\" alt=\"{}\" \
         src=\"data:image/png;base64,{}\"></a>{caption}</figure>\n",
        escape(&picture.file),
        width / 2,
        height / 2,
        escape(&picture.alt),
        STANDARD.encode(&bytes),
    ))
}

fn table_html(table: &Table) -> String {
    let class = |is_text: bool| if is_text { "" } else { " class=\"number\"" };
    let head = table.header.iter().enumerate().map(|(i, name)| {
        let is_text = matches!(table.rows.first().map(|row| &row[i]), Some(Cell::Text(_)));
        format!("<th{}>{}</th>", class(is_text), escape(name))
    });
    let entry =
        |cell: &Cell| format!("<td{}>{}</td>", class(matches!(cell, Cell::Text(_))), escape(&cell.shown()));
    let rows = table.rows.iter().map(|row| format!("<tr>{}</tr>", row.iter().map(entry).collect::<String>()));
    format!(
        "<div class=\"table\"><table><thead><tr>{}</tr></thead><tbody>{}</tbody></table></div>\n",
        head.collect::<String>(),
        rows.collect::<String>(),
    )
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
    fn the_page_embeds_its_pictures() {
        let folder = tempfile::tempdir().unwrap();
        write_png(&folder.path().join("a.png"), &Canvas::new(20.0, 10.0)).unwrap();
        let picture = Picture { file: "a.png".into(), alt: "<white> & 'b'".into(), caption: String::new() };
        let section = Section { id: "a".into(), pictures: vec![picture], ..Section::default() };
        write(folder.path(), "T & t", "", &[(7, section.clone())]).unwrap();
        let page = fs::read_to_string(folder.path().join("index.html")).unwrap();
        assert!(page.contains("<span>7</span>") && page.contains("<li value=\"7\">"));
        assert!(page.contains("src=\"data:image/png;base64,iVBORw0KGgo"));
        assert!(page.contains("width=\"20\" height=\"10\" alt=\"&lt;white&gt; &amp; &#39;b&#39;\""));
        let missing = Section { data: vec!["none.csv".into()], ..section };
        let error = format!("{:#}", write(folder.path(), "", "", &[(1, missing)]).unwrap_err());
        assert!(error.contains("none.csv"), "{error}");
    }
}
