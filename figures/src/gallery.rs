//! The gallery: every picture and study on one self-contained page with its files beside it.

use std::collections::BTreeMap;
use std::path::Path;

use anyhow::{Context, Result, ensure};
use glam::DVec2;

use crate::output::{Cell, Table, write_bytes};
use crate::plot::Rect;

/// Style sheet of the page.
const STYLE: &str = include_str!("gallery.css");

/// A picture of a section.
#[derive(Clone, Debug)]
pub(crate) struct Picture {
    /// File name in the gallery's folder (PNG, animated or not).
    pub(crate) file: String,
    /// Description of the picture for readers who cannot see it. Plain text.
    pub(crate) alt: String,
    /// Text under the picture; may be empty. HTML on the page.
    pub(crate) caption: String,
}

/// Layout data of a picture's file.
#[derive(Clone, Debug)]
pub(crate) struct Drawing {
    /// Size in logical pixels.
    pub(crate) size: DVec2,
    /// Panels that narrow screens show one below the other.
    pub(crate) parts: Vec<Rect>,
}

/// A numbered part of the page.
#[derive(Clone, Debug, Default)]
pub(crate) struct Section {
    /// Anchor in the page's address.
    pub(crate) id: String,
    /// Heading. Plain text.
    pub(crate) title: String,
    /// One sentence on the content of the pictures. HTML.
    pub(crate) lead_html: String,
    /// Explanation in a paragraph or two. HTML.
    pub(crate) explanation_html: String,
    /// Measurement procedure and all numbers. HTML.
    pub(crate) details_html: String,
    /// Displayed formula.
    pub(crate) formula_mathml: String,
    /// Pictures, which stand beside the page.
    pub(crate) pictures: Vec<Picture>,
    /// File names in the gallery's folder, linked.
    pub(crate) data: Vec<String>,
    /// Main numbers, shown on the page.
    pub(crate) table: Table,
}

/// The file that dark pages show in place of another.
pub(crate) fn dark_file(file: &str) -> String {
    format!("dark_{file}")
}

/// Panel width in logical pixels above which narrow screens scroll instead of shrink.
const WIDE: f64 = 560.0;

/// Maximum magnification of panels on narrow screens.
const LARGER: f64 = 1.25;

/// Writes `index.html` into a folder that already has the pictures and data. The opening comes first; its
/// pictures are shown if they were drawn, and its details, with links to all figures, on a page of more than
/// one.
/// they were drawn, and its details, with links to all figures, on a page of more than one.
pub(crate) fn write(
    folder: &Path,
    opening: &Section,
    sections: &[(usize, Section)],
    drawings: &BTreeMap<String, Drawing>,
) -> Result<()> {
    let page = Page { folder, drawings };
    let title = escape(&opening.title);
    let is_whole = sections.len() > 1;
    let drawn = opening.pictures.iter().filter(|picture| drawings.contains_key(&picture.file));
    let pictures: String = drawn.map(|picture| page.picture(picture)).collect::<Result<_>>()?;
    let story = if is_whole { opening.details_html.as_str() } else { "" };
    let mut html = format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <link rel=\"icon\" href=\"data:,\">\n\
         <title>{title}</title>\n<style>\n{STYLE}</style>\n</head>\n<body>\n\
         <header><h1>{title}</h1>\n<div class=\"lead\">{}</div>\n{pictures}<div class=\"text\">{}{story}</div></header>\n\
         <nav aria-label=\"Contents\"><ol>",
        opening.lead_html, opening.explanation_html,
    );
    for (number, section) in sections {
        let (id, title) = (escape(&section.id), escape(&section.title));
        html += &format!("<li value=\"{number}\"><a href=\"#{id}\">{title}</a></li>");
    }
    html += "</ol></nav>\n<main>\n";
    for (number, section) in sections {
        let name = || format!("section “{}” of the gallery", section.title);
        html += &page.section(*number, section).with_context(name)?;
    }
    html += "</main>\n</body>\n</html>\n";
    write_bytes(&folder.join("index.html"), html.as_bytes())
}

/// The page being written.
struct Page<'a> {
    folder: &'a Path,
    drawings: &'a BTreeMap<String, Drawing>,
}

impl Page<'_> {
    fn section(&self, number: usize, section: &Section) -> Result<String> {
        let (id, title) = (escape(&section.id), escape(&section.title));
        let pictures: String =
            section.pictures.iter().map(|picture| self.picture(picture)).collect::<Result<_>>()?;
        for file in &section.data {
            ensure!(self.folder.join(file).is_file(), "no data file {}", self.folder.join(file).display());
        }
        let links =
            section.data.iter().map(|file| escape(file)).map(|file| format!("<a href=\"{file}\">{file}</a>"));
        Ok(format!(
            "<section id=\"{id}\">\n<h2><a href=\"#{id}\"><span>{number}</span>{title}</a></h2>\n\
             <div class=\"lead\">{}</div>\n<div class=\"shown\">\n<div class=\"pictures\">{pictures}</div>\n\
             <div class=\"text\">{}<div class=\"formula\">{}</div>\n\
             <details><summary>Numbers, and how they were measured</summary>\n{}{}\
             <p class=\"data\">Data: {}</p></details></div>\n</div>\n</section>\n",
            section.lead_html,
            section.explanation_html,
            section.formula_mathml,
            section.details_html,
            table_html(&section.table),
            links.collect::<Vec<_>>().join(" · "),
        ))
    }

    /// The whole picture, and its panels for narrow screens: each the same file, shifted behind a window.
    fn picture(&self, picture: &Picture) -> Result<String> {
        let drawing =
            self.drawings.get(&picture.file).with_context(|| format!("{} was not drawn", picture.file))?;
        let size = drawing.size;
        let image = |style: &str| image_html(&picture.file, &picture.alt, size, style);
        let caption = match picture.caption.as_str() {
            "" => String::new(),
            caption => format!("<figcaption>{caption}</figcaption>"),
        };
        let file = escape(&picture.file);
        let class = if drawing.parts.is_empty() { "card" } else { "card whole" };
        let whole = format!("<a class=\"{class}\" href=\"{file}\">{}</a>", image(""));
        let part = |part: &Rect| {
            let Rect { x, y, width, height } = *part;
            let style = format!(
                "width:{:.2}%;left:{:.2}%;top:{:.2}%",
                100.0 * size.x / width,
                -100.0 * x / width,
                -100.0 * y / height
            );
            let least = if width > WIDE { format!(";min-width:{width:.0}px") } else { String::new() };
            let most = LARGER * width;
            format!(
                "<div class=\"scroll\"><a class=\"part\" href=\"{file}\" style=\"aspect-ratio:{width:.1}/{height:.1};max-width:{most:.0}px{least}\">{}</a></div>",
                image(&style)
            )
        };
        let parts: String = drawing.parts.iter().map(part).collect();
        let parts = if parts.is_empty() { parts } else { format!("<div class=\"parts\">{parts}</div>") };
        Ok(format!("<figure>{whole}{parts}{caption}</figure>\n"))
    }
}

/// A picture in a light and a dark version.
fn image_html(file: &str, alt: &str, size: DVec2, style: &str) -> String {
    let (light, dark) = (escape(file), escape(&dark_file(file)));
    format!(
        "<picture><source media=\"(prefers-color-scheme: dark)\" srcset=\"{dark}\"><img loading=\"lazy\" width=\"{:.0}\" \
         height=\"{:.0}\" alt=\"{}\" style=\"{style}\" src=\"{light}\"></picture>",
        size.x,
        size.y,
        escape(alt),
    )
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

/// Text with the special characters of HTML escaped, for attributes too.
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

    #[test]
    fn the_page_shows_pictures_whole_and_in_parts() {
        let folder = tempfile::tempdir().unwrap();
        let drawing =
            Drawing { size: DVec2::new(200.0, 100.0), parts: vec![Rect::new(50.0, 20.0, 100.0, 80.0)] };
        let drawings = BTreeMap::from([("a.png".to_owned(), drawing)]);
        let picture = Picture { file: "a.png".into(), alt: "<white> & 'b'".into(), caption: String::new() };
        let section = Section { id: "a".into(), pictures: vec![picture], ..Section::default() };
        let opening = Section { title: "T & t".into(), ..section.clone() };
        let sections = [(7, section.clone())];
        write(folder.path(), &opening, &sections, &drawings).unwrap();
        let page = std::fs::read_to_string(folder.path().join("index.html")).unwrap();
        assert!(page.contains("<span>7</span>") && page.contains("<li value=\"7\">"));
        assert!(page.contains("width=\"200\" height=\"100\" alt=\"&lt;white&gt; &amp; &#39;b&#39;\""));
        assert!(page.contains("src=\"a.png\"") && page.contains("srcset=\"dark_a.png\""));
        assert!(
            page.contains("aspect-ratio:100.0/80.0;max-width:125px")
                && page.contains("width:200.00%;left:-50.00%;top:-25.00%")
        );
        let missing = Section { data: vec!["none.csv".into()], ..section.clone() };
        let error = |sections: &[(usize, Section)]| {
            format!("{:#}", write(folder.path(), &Section::default(), sections, &drawings).unwrap_err())
        };
        assert!(error(&[(1, missing)]).contains("none.csv"));
        let undrawn = Picture { file: "b.png".into(), alt: String::new(), caption: String::new() };
        assert!(error(&[(1, Section { pictures: vec![undrawn], ..section })]).contains("b.png"));
    }
}
