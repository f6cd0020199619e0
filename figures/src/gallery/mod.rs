//! The gallery: every picture and study on self-contained pages with their files beside them.

mod html;
mod lecture;
mod section;

use std::collections::BTreeMap;
use std::path::Path;

use anyhow::{Context, Result, ensure};

use self::html::escape;
use crate::output::write_bytes;

pub(crate) use self::html::dark_file;
pub(crate) use self::section::{Drawing, Picture, Section};

const STYLE: &str = include_str!("style.css");
const SCRIPT: &str = include_str!("script.js");

/// Elements shared by all pages of a gallery.
pub(crate) struct Gallery<'a> {
    /// The folder, which already has the pictures and data.
    pub(crate) folder: &'a Path,
    pub(crate) drawings: &'a BTreeMap<String, Drawing>,
    /// The names of all figures, in the order of their numbers.
    pub(crate) names: &'a [&'a str],
    /// All figures of this run, by number.
    pub(crate) sections: &'a [(usize, Section)],
    /// Path from the gallery to the pages of `cargo doc`, for links.
    pub(crate) documentation: Option<&'a str>,
}

impl Gallery<'_> {
    /// Writes `index.html`. The opening comes first; its pictures are shown if they were drawn. Its details,
    /// with links to all figures, and the lecture, a picture a slide, are only on a page of all figures.
    pub(crate) fn write(&self, opening: &Section, slides: &Section) -> Result<()> {
        let recorded = self.sections.iter().filter(|(_, section)| !section.origin_html.is_empty());
        let recorded = recorded
            .flat_map(|(_, section)| &section.pictures)
            .map(|picture| picture.file.as_str())
            .collect();
        let is_whole = self.sections.len() == self.names.len();
        let drawn = opening.pictures.iter().filter(|picture| self.drawings.contains_key(&picture.file));
        let pictures: String = drawn.map(|picture| self.picture(picture)).collect::<Result<_>>()?;
        let (story, button, lecture) = if is_whole {
            (
                opening.details_html.as_str(),
                "<p><a class=\"button\" href=\"#lecture\">The lecture: ten figures, one a screen</a> \
                 <a class=\"button\" href=\"accuracy.html\">Speed against accuracy</a></p>",
                lecture::lecture(slides, self.drawings, &recorded)?,
            )
        } else {
            ("", "", String::new())
        };
        let guide = self.guide();
        let mut body = format!(
            "<header><h1>{}</h1>\n<div class=\"opening\"><div class=\"text\"><div class=\"lead\">{}</div>\n{}{button}{guide}</div>\n\
             <div class=\"pictures\">{pictures}</div></div>\n{story}</header>\n<main>\n",
            escape(&opening.title),
            opening.lead_html,
            opening.explanation_html,
        );
        for (number, section) in self.sections {
            let name = || format!("section “{}” of the gallery", section.title);
            body += &self.section(*number, section).with_context(name)?;
        }
        body += "</main>\n";
        body += &lecture;
        self.page("index.html", &opening.title, &body)
    }

    /// Writes a page of its own on what several figures say together.
    pub(crate) fn write_summary(&self, file: &str, opening: &Section, parts: &[Section]) -> Result<()> {
        let mut body = format!(
            "<header><p><a href=\"index.html\">All figures</a></p><h1>{}</h1>\n<div class=\"lead\">{}</div>\n\
             <div class=\"text\">{}{}</div></header>\n<main>\n",
            escape(&opening.title),
            opening.lead_html,
            opening.explanation_html,
            self.guide(),
        );
        for (i, part) in parts.iter().enumerate() {
            body += &self.section(i + 1, part)?;
        }
        body += "</main>\n";
        self.page(file, &opening.title, &self.linked(&body, "index.html"))
    }

    /// Links to the guide and the documentation of both libraries, or the command that shows them.
    fn guide(&self) -> String {
        let Some(folder) = self.documentation.map(escape) else {
            return "<p>The guide, from a mesh to a fitted pose: <code>cargo doc --open -p volume3d</code></p>".to_owned();
        };
        let folder = folder.trim_end_matches('/');
        format!(
            "<p><a class=\"button\" href=\"{folder}/volume3d/guide/index.html\">Guide: from a mesh to a fitted pose</a> \
             <a class=\"button\" href=\"{folder}/volume3d/index.html\">API in space</a> \
             <a class=\"button\" href=\"{folder}/flatland/index.html\">API in the plane</a></p>"
        )
    }

    fn page(&self, file: &str, title: &str, body: &str) -> Result<()> {
        let html = format!(
            "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
             <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
             <link rel=\"icon\" href=\"data:,\">\n\
             <title>{}</title>\n<style>\n{STYLE}</style>\n</head>\n<body>\n{}<script>\n{SCRIPT}</script>\n</body>\n</html>\n",
            escape(title),
            self.linked(body, ""),
        );
        write_bytes(&self.folder.join(file), html.as_bytes())
    }

    /// The numbers of figures for their names, `{#name}`, as links to those that are on `page`.
    fn linked(&self, html: &str, page: &str) -> String {
        let mut html = html.to_owned();
        for (i, name) in self.names.iter().enumerate() {
            let number = i + 1;
            let is_here = self.sections.iter().any(|(other, _)| *other == number);
            let link =
                if is_here { format!("<a href=\"{page}#{name}\">{number}</a>") } else { number.to_string() };
            html = html.replace(&format!("{{#{name}}}"), &link);
        }
        html
    }

    fn section(&self, number: usize, section: &Section) -> Result<String> {
        let (id, title) = (escape(&section.id), escape(&section.title));
        for file in &section.data {
            ensure!(self.folder.join(file).is_file(), "no data file {}", self.folder.join(file).display());
        }
        let mut pictures = section.pictures.iter().map(|picture| self.picture(picture));
        let first = pictures.next().transpose()?.unwrap_or_default();
        let count = pictures.len();
        let more: String = pictures.collect::<Result<_>>()?;
        let more = match count {
            0 => String::new(),
            1 => format!(
                "<details class=\"wide\" open><summary>One more picture</summary>\n{more}</details>\n"
            ),
            _ => format!(
                "<details class=\"wide\" open><summary>{count} more pictures</summary>\n{more}</details>\n"
            ),
        };
        let origin = match section.origin_html.as_str() {
            "" => String::new(),
            origin => format!("<div class=\"origin\"><span class=\"mark\">recorded</span>{origin}</div>\n"),
        };
        let formula = match section.formula_mathml.as_str() {
            "" => String::new(),
            formula => format!("<div class=\"formula\">{formula}</div>\n"),
        };
        let text = match section.explanation_html.as_str() {
            "" => String::new(),
            text => {
                format!("<details class=\"wide text\" open><summary>What is seen</summary>\n{text}</details>")
            }
        };
        let links =
            section.data.iter().map(|file| escape(file)).map(|file| format!("<a href=\"{file}\">{file}</a>"));
        let links = links.collect::<Vec<_>>().join(" · ");
        let details = if section.details_html.is_empty() && section.table.rows.is_empty() {
            String::new()
        } else {
            format!(
                "<details class=\"numbers\"><summary>Numbers, and how they were measured</summary>\n<div class=\"text\">{}</div>{}\
                 <p class=\"data\">Data: {links}</p></details>\n",
                section.details_html,
                html::table(&section.table),
            )
        };
        let live = section.live.as_ref().map(|live| self.live(live)).transpose()?.unwrap_or_default();
        Ok(format!(
            "<section id=\"{id}\">\n<h2 id=\"number-{number}\"><a href=\"#{id}\"><span>{number}</span>{title}</a></h2>\n\
             <div class=\"lead\">{}</div>\n{origin}<div class=\"shown\">\n<div class=\"pictures\">{first}</div>\n\
             {text}</div>\n{formula}{more}{details}{live}</section>\n",
            section.lead_html,
        ))
    }

    /// A small scene next to recorded results.
    fn live(&self, live: &Section) -> Result<String> {
        let pictures: String =
            live.pictures.iter().map(|picture| self.picture(picture)).collect::<Result<_>>()?;
        Ok(format!(
            "<div class=\"live\"><h3><span class=\"mark\">live</span>{}</h3>\n<div class=\"shown\">\n\
             <div class=\"pictures\">{pictures}</div>\n<div class=\"text\">{}{}</div></div></div>\n",
            escape(&live.title),
            live.lead_html,
            live.explanation_html,
        ))
    }

    fn picture(&self, picture: &Picture) -> Result<String> {
        let drawing =
            self.drawings.get(&picture.file).with_context(|| format!("{} was not drawn", picture.file))?;
        let caption = match picture.caption.as_str() {
            "" => String::new(),
            caption => format!("<figcaption>{caption}</figcaption>"),
        };
        Ok(format!("<figure>{}{caption}</figure>\n", html::picture(&picture.file, &picture.alt, drawing)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plot::{Kept, Rect};

    #[test]
    fn the_page_shows_pictures_whole_and_in_parts() {
        let folder = tempfile::tempdir().unwrap();
        let parts = vec![Rect::new(50.0, 20.0, 100.0, 80.0)];
        let drawing = Drawing { size: [200.0, 100.0], parts, kept: Kept::default() };
        let drawings = BTreeMap::from([("a.png".to_owned(), drawing)]);
        let picture =
            Picture { file: "a.png".into(), alt: "<white> & 'b'".into(), caption: "see {#b}".into() };
        let section = Section { id: "a".into(), pictures: vec![picture], ..Section::default() };
        let opening = Section { title: "T & t".into(), ..section.clone() };
        let sections = [(1, section.clone())];
        let write = |opening: &Section, sections: &[(usize, Section)], documentation| {
            let names = &["a", "b"];
            let gallery =
                Gallery { folder: folder.path(), drawings: &drawings, names, sections, documentation };
            gallery.write(opening, &Section::default())
        };
        write(&opening, &sections, None).unwrap();
        let page = std::fs::read_to_string(folder.path().join("index.html")).unwrap();
        assert!(page.contains("<span>1</span>") && page.contains("<figcaption>see 2</figcaption>"));
        assert!(page.contains("width=\"200\" height=\"100\" alt=\"&lt;white&gt; &amp; &#39;b&#39;\""));
        assert!(page.contains("src=\"a.png\"") && page.contains("srcset=\"dark_a.png\""));
        assert!(
            page.contains("aspect-ratio:100.0/80.0;max-width:125px")
                && page.contains("width:200.00%;left:-50.00%;top:-25.00%")
        );
        assert!(page.contains("cargo doc --open") && page.contains("<h2 id=\"number-1\">"));
        let both = [(1, section.clone()), (2, section.clone())];
        write(&Section::default(), &both, Some("../api")).unwrap();
        let page = std::fs::read_to_string(folder.path().join("index.html")).unwrap();
        assert!(page.contains("see <a href=\"#b\">2</a>"));
        assert!(page.contains("href=\"../api/volume3d/guide/index.html\"") && !page.contains("cargo doc"));
        let missing = Section { data: vec!["none.csv".into()], ..section.clone() };
        let error = |sections: &[(usize, Section)]| {
            format!("{:#}", write(&Section::default(), sections, None).unwrap_err())
        };
        assert!(error(&[(1, missing)]).contains("none.csv"));
        let undrawn = Picture { file: "b.png".into(), alt: String::new(), caption: String::new() };
        assert!(error(&[(1, Section { pictures: vec![undrawn], ..section })]).contains("b.png"));
    }
}
