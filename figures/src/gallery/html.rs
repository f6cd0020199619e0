//! Pictures and tables in HTML.

use super::section::Drawing;
use crate::output::{Cell, Table};
use crate::plot::Rect;

/// Panel width in logical pixels above which narrow screens scroll instead of shrink.
const WIDE: f64 = 560.0;

/// Maximum magnification of panels on narrow screens.
const LARGER: f64 = 1.25;

/// The file that dark pages show in place of another.
pub(crate) fn dark_file(file: &str) -> String {
    format!("dark_{file}")
}

/// The whole picture, and folded below it its panels for narrow screens: each the same file, shifted behind a
/// window.
pub(super) fn picture(file: &str, alt: &str, drawing: &Drawing) -> String {
    let parts: String = drawing.parts.iter().map(|part| window(file, alt, drawing, part, true)).collect();
    let parts = match drawing.parts.len() {
        0 => String::new(),
        count => format!(
            "<details class=\"parts\"><summary>{count} panels, one below the other</summary>{parts}</details>"
        ),
    };
    let file_name = escape(file);
    format!("<a class=\"card\" href=\"{file_name}\">{}</a>{parts}", image(file, alt, drawing, ""))
}

/// A part of a picture.
pub(super) fn window(file: &str, alt: &str, drawing: &Drawing, part: &Rect, is_linked: bool) -> String {
    let ([w, h], Rect { x, y, width, height }) = (drawing.size, *part);
    let style = format!(
        "width:{:.2}%;left:{:.2}%;top:{:.2}%",
        100.0 * w / width,
        -100.0 * x / width,
        -100.0 * y / height
    );
    debug_assert!(x + width <= w + 1.0 && y + height <= h + 1.0, "a part of {file} is outside of it");
    let image = image(file, alt, drawing, &style);
    let ratio = format!("aspect-ratio:{width:.1}/{height:.1}");
    if !is_linked {
        return format!("<div class=\"part\" style=\"{ratio};--ratio:{:.4}\">{image}</div>", width / height);
    }
    let least = if width > WIDE { format!(";min-width:{width:.0}px") } else { String::new() };
    let (file, most) = (escape(file), LARGER * width);
    format!(
        "<div class=\"scroll\"><a class=\"part\" href=\"{file}\" style=\"{ratio};max-width:{most:.0}px{least}\">{image}</a></div>"
    )
}

/// A picture in a light and a dark version.
pub(super) fn image(file: &str, alt: &str, drawing: &Drawing, style: &str) -> String {
    let (light, dark, [width, height]) = (escape(file), escape(&dark_file(file)), drawing.size);
    format!(
        "<picture><source media=\"(prefers-color-scheme: dark)\" srcset=\"{dark}\"><img loading=\"lazy\" width=\"{width:.0}\" \
         height=\"{height:.0}\" alt=\"{}\" style=\"{style}\" src=\"{light}\"></picture>",
        escape(alt),
    )
}

/// A table that scrolls within itself.
pub(super) fn table(table: &Table) -> String {
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
pub(super) fn escape(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
        .replace('"', "&quot;")
        .replace('\'', "&#39;")
}
