//! Text as filled outlines of the bundled DejaVu Sans.
//!
//! `_{…}` lowers and `^{…}` raises the text in braces ("∂_{θ}I", "N^{−1/2}"); combining accents sit on the
//! letter before them ("V̂"). A character missing from the font is drawn as the font's empty box.

use std::sync::LazyLock;

use ab_glyph::{Font, FontRef, GlyphId, OutlineCurve};
use glam::DVec2;
use tiny_skia::{FillRule, Path, PathBuilder, Transform};

use super::{
    canvas::{Canvas, Pen},
    color::Color,
};

static REGULAR: LazyLock<FontRef<'static>> =
    LazyLock::new(|| parsed(include_bytes!("../../assets/DejaVuSans-subset.ttf")));
static BOLD: LazyLock<FontRef<'static>> =
    LazyLock::new(|| parsed(include_bytes!("../../assets/DejaVuSans-Bold-subset.ttf")));

/// Heights of capitals and of the letter x in DejaVu Sans, in ems.
const CAPITAL: f64 = 0.729;
const X_HEIGHT: f64 = 0.547;
/// Size and shift of indices, in ems of the surrounding text.
const INDEX_SIZE: f64 = 0.72;
const LOWERED: f64 = 0.18;
const RAISED: f64 = 0.36;
/// Distance between base lines, in ems.
pub(crate) const LINE_SPACING: f64 = 1.4;

fn parsed(bytes: &'static [u8]) -> FontRef<'static> {
    FontRef::try_from_slice(bytes).expect("the bundled font is valid")
}

/// Horizontal alignment: the part of the text at the given x.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Align {
    Left,
    Centre,
    Right,
}

/// Vertical alignment: the height at the given y, of capitals and digits, or the base line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Height {
    Top,
    Middle,
    Baseline,
}

/// Style of text. Alignment refers to the text's own direction.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TextStyle {
    /// Height of an em in logical pixels.
    size: f64,
    color: Color,
    bold: bool,
    align: Align,
    height: Height,
    /// Whether the text runs upwards.
    upwards: bool,
    /// A rim in this colour that separates the text from its background.
    halo: Option<Color>,
}

impl TextStyle {
    /// Plain text, starting at the point given, on its base line.
    pub(crate) fn new(size: f64, color: Color) -> Self {
        Self {
            size,
            color,
            bold: false,
            align: Align::Left,
            height: Height::Baseline,
            upwards: false,
            halo: None,
        }
    }

    /// Makes the letters bold.
    pub(crate) fn bold(self) -> Self {
        Self { bold: true, ..self }
    }

    /// Sets the alignment.
    pub(crate) fn anchored(self, align: Align, height: Height) -> Self {
        Self { align, height, ..self }
    }

    /// Makes the text run upwards.
    pub(crate) fn upwards(self) -> Self {
        Self { upwards: true, ..self }
    }

    /// Adds a rim.
    pub(crate) fn halo(self, color: Color) -> Self {
        Self { halo: Some(color), ..self }
    }

    /// Length of a line of text in logical pixels.
    pub(crate) fn width(&self, text: &str) -> f64 {
        typeset(text, self).1
    }

    /// Breaks text at spaces into lines no longer than `width` (a longer word keeps a line of its own).
    pub(crate) fn wrap(&self, text: &str, width: f64) -> Vec<String> {
        let mut lines: Vec<String> = Vec::new();
        for paragraph in text.split('\n') {
            let mut line = String::new();
            for word in paragraph.split_whitespace() {
                let longer = if line.is_empty() { word.to_owned() } else { format!("{line} {word}") };
                if line.is_empty() || self.width(&longer) <= width {
                    line = longer;
                } else {
                    lines.push(std::mem::replace(&mut line, word.to_owned()));
                }
            }
            lines.push(line);
        }
        lines
    }
}

impl Canvas {
    /// Sets one line of text and returns its length.
    pub(crate) fn text(&mut self, text: &str, at: DVec2, style: &TextStyle) -> f64 {
        let (path, width) = typeset(text, style);
        let Some(path) = path else { return width };
        let start = match style.align {
            Align::Left => 0.0,
            Align::Centre => -0.5 * width,
            Align::Right => -width,
        };
        let base = style.size
            * match style.height {
                Height::Top => CAPITAL,
                Height::Middle => 0.5 * CAPITAL,
                Height::Baseline => 0.0,
            };
        let up = Transform::from_row(0.0, -1.0, 1.0, 0.0, 0.0, 0.0);
        let turn = if style.upwards { up } else { Transform::identity() };
        let place = Transform::from_translate(start as f32, base as f32)
            .post_concat(turn)
            .post_translate(at.x as f32, at.y as f32);
        if let Some(color) = style.halo {
            self.stroke(&path, &Pen::new(color, 0.3 * style.size), place);
        }
        self.fill(&path, style.color, FillRule::Winding, place);
        width
    }

    /// Sets text in lines of at most `width`, the first anchored at `at`; returns the height taken.
    pub(crate) fn paragraph(&mut self, text: &str, at: DVec2, width: f64, style: &TextStyle) -> f64 {
        let lines = style.wrap(text, width);
        for (i, line) in lines.iter().enumerate() {
            self.text(line, at + DVec2::new(0.0, i as f64 * LINE_SPACING * style.size), style);
        }
        lines.len() as f64 * LINE_SPACING * style.size
    }
}

/// The outline of a line of text from the origin along its base line, and its length.
fn typeset(text: &str, style: &TextStyle) -> (Option<Path>, f64) {
    let font = if style.bold { &*BOLD } else { &*REGULAR };
    let em = f64::from(font.units_per_em().unwrap_or(2048.0));
    let mut builder = PathBuilder::new();
    let (mut pen, mut last_start, mut tall) = (0.0, 0.0, false);
    let (mut size, mut rise) = (style.size, 0.0);
    let mut characters = text.chars().peekable();
    while let Some(character) = characters.next() {
        if matches!(character, '_' | '^') && characters.next_if_eq(&'{').is_some() {
            size = INDEX_SIZE * style.size;
            rise = style.size * if character == '_' { LOWERED } else { -RAISED };
            continue;
        }
        if character == '}' && rise != 0.0 {
            (size, rise) = (style.size, 0.0);
            continue;
        }
        let glyph = font.glyph_id(character);
        let unit = size / em;
        if matches!(character, '\u{300}'..='\u{36f}') {
            // An accent has no advance of its own: its ink is centred on the letter before.
            if let Some(outline) = font.outline(glyph) {
                let ink = 0.5 * f64::from(outline.bounds.min.x + outline.bounds.max.x) * unit;
                let lift = if tall { (CAPITAL - X_HEIGHT) * size } else { 0.0 };
                append(&mut builder, font, glyph, unit, 0.5 * (last_start + pen) - ink, rise - lift);
            }
            continue;
        }
        append(&mut builder, font, glyph, unit, pen, rise);
        last_start = pen;
        tall = character.is_uppercase() || matches!(character, 'b' | 'd' | 'f' | 'h' | 'k' | 'l' | 'θ' | 'β');
        pen += f64::from(font.h_advance_unscaled(glyph)) * unit;
    }
    (builder.finish(), pen)
}

fn append(builder: &mut PathBuilder, font: &FontRef<'_>, glyph: GlyphId, unit: f64, x: f64, y: f64) {
    let Some(outline) = font.outline(glyph) else { return };
    // Font units point up, the page down.
    let place = |p: ab_glyph::Point| ((x + f64::from(p.x) * unit) as f32, (y - f64::from(p.y) * unit) as f32);
    let mut end = None;
    for curve in &outline.curves {
        let start = match curve {
            OutlineCurve::Line(a, _) | OutlineCurve::Quad(a, ..) | OutlineCurve::Cubic(a, ..) => *a,
        };
        if end != Some(start) {
            if end.is_some() {
                builder.close();
            }
            let (x, y) = place(start);
            builder.move_to(x, y);
        }
        end = Some(match curve {
            OutlineCurve::Line(_, b) => {
                let (x, y) = place(*b);
                builder.line_to(x, y);
                *b
            }
            OutlineCurve::Quad(_, b, c) => {
                let ((x1, y1), (x, y)) = (place(*b), place(*c));
                builder.quad_to(x1, y1, x, y);
                *c
            }
            OutlineCurve::Cubic(_, b, c, d) => {
                let ((x1, y1), (x2, y2), (x, y)) = (place(*b), place(*c), place(*d));
                builder.cubic_to(x1, y1, x2, y2, x, y);
                *d
            }
        });
    }
    if end.is_some() {
        builder.close();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mathematics_is_in_the_fonts() {
        let needed = "∇∂∫∮∑ΔΘΩθκγνμσλπφψωε·×′₀₁₂ᵢₓ⁰¹²³⁻√≈≤≥≠±∓∞–—−∥⊥‖∈∝→←↔ℓ°…■●▲";
        for font in [&*REGULAR, &*BOLD] {
            let missing: String = needed.chars().filter(|c| font.glyph_id(*c) == GlyphId(0)).collect();
            assert_eq!(missing, "");
        }
    }

    #[test]
    fn indices_are_small_and_plain_underscores_stay() {
        let style = TextStyle::new(12.0, Color::INK);
        assert!(style.width("V_{θ}") < style.width("Vθ"));
        assert!(style.width("a_b") > style.width("ab"));
        assert_eq!(style.width("V\u{302}"), style.width("V"));
        assert_eq!(style.width("unfinished^{"), style.width("unfinished"));
    }
}
