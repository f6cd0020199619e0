//! The lecture: pictures one a screen, each with a sentence.

use std::collections::{BTreeMap, BTreeSet};

use anyhow::{Context, Result, ensure};

use super::html::{escape, image, window};
use super::section::{Drawing, Section};
use crate::plot::Rect;

/// The slides: those pictures of the section that are drawn, with their captions. A file name may end in
/// `#b-d`, which shows these panels alone. Captions of `recorded` files are marked.
pub(super) fn lecture(
    slides: &Section,
    drawings: &BTreeMap<String, Drawing>,
    recorded: &BTreeSet<&str>,
) -> Result<String> {
    let mut html =
        format!("<div id=\"lecture\" role=\"dialog\" aria-label=\"{}\" hidden>\n", escape(&slides.title));
    let drawn = slides.pictures.iter().filter_map(|slide| {
        let (file, panels) = slide.file.split_once('#').unwrap_or((&slide.file, ""));
        Some((slide, file, panels, drawings.get(file)?))
    });
    let drawn: Vec<_> = drawn.collect();
    let count = drawn.len();
    for (i, (slide, file, panels, drawing)) in drawn.into_iter().enumerate() {
        let shown = if panels.is_empty() {
            let ratio = drawing.size[0] / drawing.size[1];
            format!(
                "<div class=\"part\" style=\"--ratio:{ratio:.4}\">{}</div>",
                image(file, &slide.alt, drawing, "")
            )
        } else {
            let part = around(drawing, panels).with_context(|| format!("slide {}: {}", i + 1, slide.file))?;
            window(file, &slide.alt, drawing, &part, false)
        };
        let mark = if recorded.contains(file) { "<span class=\"mark\">recorded</span>" } else { "" };
        html += &format!(
            "<article data-slide=\"{0}\" hidden>{shown}<p>{mark}{1}</p></article>\n",
            i + 1,
            slide.caption
        );
    }
    html += &format!(
        "<footer><a href=\"#lecture\" data-go=\"-1\" aria-label=\"back\">←</a> <span data-count=\"{count}\"></span> \
         <a href=\"#lecture\" data-go=\"1\" aria-label=\"on\">→</a> <a href=\"#\" data-go=\"0\">close</a></footer>\n</div>\n"
    );
    Ok(html)
}

/// The rectangle around panels from one letter to another.
fn around(drawing: &Drawing, letters: &str) -> Result<Rect> {
    let (first, last) = letters.split_once('-').unwrap_or((letters, letters));
    let index = |letter: &str| -> Result<usize> {
        let letter = letter.bytes().next().filter(u8::is_ascii_lowercase).context("no panel's letter")?;
        Ok(usize::from(letter - b'a'))
    };
    let (first, last) = (index(first)?, index(last)?);
    ensure!(first <= last && last < drawing.parts.len(), "there are {} panels", drawing.parts.len());
    let mut parts = drawing.parts[first..=last].iter();
    let start = *parts.next().context("no panel")?;
    Ok(parts.fold(start, |all, part| {
        let (x, y) = (all.x.min(part.x), all.y.min(part.y));
        Rect::new(x, y, all.right().max(part.right()) - x, all.bottom().max(part.bottom()) - y)
    }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gallery::Picture;
    use crate::plot::Kept;

    #[test]
    fn slides_show_panels() {
        let parts = [0.0, 50.0, 110.0].map(|x| Rect::new(x, 10.0, 40.0, 30.0)).to_vec();
        let drawing = Drawing { size: [200.0, 100.0], parts, kept: Kept::default() };
        assert_eq!(around(&drawing, "b-c").unwrap(), Rect::new(50.0, 10.0, 100.0, 30.0));
        assert_eq!(around(&drawing, "a").unwrap(), Rect::new(0.0, 10.0, 40.0, 30.0));
        assert!(around(&drawing, "d").is_err() && around(&drawing, "b-a").is_err());
        let drawings = BTreeMap::from([("a.png".to_owned(), drawing)]);
        let slide = |file: &str| Section {
            pictures: vec![Picture { file: file.into(), alt: String::new(), caption: "so".into() }],
            ..Section::default()
        };
        let html = lecture(&slide("a.png#b-c"), &drawings, &BTreeSet::new()).unwrap();
        assert!(html.contains("aspect-ratio:100.0/30.0") && html.contains("<p>so</p>"), "{html}");
        let html = lecture(&slide("a.png#a"), &drawings, &BTreeSet::from(["a.png"])).unwrap();
        assert!(html.contains("<p><span class=\"mark\">recorded</span>so</p>"), "{html}");
        let error = format!("{:#}", lecture(&slide("a.png#e"), &drawings, &BTreeSet::new()).unwrap_err());
        assert!(error.contains("slide 1: a.png#e: there are 3 panels"), "{error}");
    }
}
