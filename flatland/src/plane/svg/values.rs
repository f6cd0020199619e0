//! Grammars of attribute values, at least as strict as usvg's parsers.
//!
//! usvg takes what it can of a broken value (the path up to the error, black for an unknown
//! colour) and says nothing; so values are checked before.

use super::MAX_COORDINATE;

/// A place in a list of numbers.
struct Cursor<'a> {
    text: &'a str,
    at: usize,
}

impl<'a> Cursor<'a> {
    fn new(text: &'a str) -> Self {
        let mut this = Self { text, at: 0 };
        this.skip_spaces();
        this
    }

    fn peek(&self) -> Option<u8> {
        self.text.as_bytes().get(self.at).copied()
    }

    fn is_at_end(&self) -> bool {
        self.at == self.text.len()
    }

    fn skip_while(&mut self, f: impl Fn(u8) -> bool) {
        while self.peek().is_some_and(&f) {
            self.at += 1;
        }
    }

    fn skip_spaces(&mut self) {
        self.skip_while(|c| matches!(c, b' ' | b'\t' | b'\n' | b'\r'));
    }

    fn accept(&mut self, c: u8) -> bool {
        let is_there = self.peek() == Some(c);
        self.at += usize::from(is_there);
        is_there
    }

    /// Spaces with at most one comma.
    fn skip_separator(&mut self) {
        self.skip_spaces();
        if self.accept(b',') {
            self.skip_spaces();
        }
    }

    /// A number without what follows it, within ±[`MAX_COORDINATE`].
    fn number(&mut self) -> Option<f64> {
        let start = self.at;
        let _ = self.accept(b'+') || self.accept(b'-');
        self.skip_while(|c| c.is_ascii_digit());
        if self.accept(b'.') {
            self.skip_while(|c| c.is_ascii_digit());
        }
        let is_unit = matches!(self.text.as_bytes().get(self.at + 1), Some(b'm' | b'x'));
        if !is_unit && (self.accept(b'e') || self.accept(b'E')) {
            let _ = self.accept(b'+') || self.accept(b'-');
            self.skip_while(|c| c.is_ascii_digit());
        }
        self.text[start..self.at].parse().ok().filter(|x: &f64| x.abs() <= MAX_COORDINATE)
    }

    fn list_number(&mut self) -> Option<f64> {
        let x = self.number()?;
        self.skip_separator();
        Some(x)
    }

    fn numbers<const N: usize>(&mut self) -> Option<[f64; N]> {
        let mut out = [0.0; N];
        for x in &mut out {
            *x = self.list_number()?;
        }
        Some(out)
    }

    /// An arc's radii, rotation, two flags of one character each, and end.
    fn arc(&mut self) -> Option<()> {
        let [rx, ry, _] = self.numbers()?;
        // Radii are divided by: tiny ones overflow.
        if [rx, ry].iter().any(|r| *r != 0.0 && r.abs() < 1e-9) {
            return None;
        }
        for _ in 0..2 {
            if !(self.accept(b'0') || self.accept(b'1')) {
                return None;
            }
            self.skip_separator();
        }
        self.numbers::<2>().map(drop)
    }
}

/// Path data (SVG 2, section 9.3).
pub(super) fn is_path(text: &str) -> bool {
    let mut cursor = Cursor::new(text);
    let mut command = None;
    while let Some(c) = cursor.peek() {
        if c.is_ascii_alphabetic() {
            if command.is_none() && !c.eq_ignore_ascii_case(&b'm') {
                return false;
            }
            command = Some(c.to_ascii_lowercase());
            cursor.at += 1;
            cursor.skip_spaces();
        } else if matches!(command, None | Some(b'z')) {
            return false;
        }
        let is_good = match command {
            Some(b'z') => Some(()),
            Some(b'h' | b'v') => cursor.numbers::<1>().map(drop),
            Some(b'm' | b'l' | b't') => cursor.numbers::<2>().map(drop),
            Some(b's' | b'q') => cursor.numbers::<4>().map(drop),
            Some(b'c') => cursor.numbers::<6>().map(drop),
            Some(b'a') => cursor.arc(),
            _ => None,
        };
        if is_good.is_none() {
            return false;
        }
    }
    true
}

/// The points of a polygon: an even number of numbers.
pub(super) fn is_points(text: &str) -> bool {
    let mut cursor = Cursor::new(text);
    while !cursor.is_at_end() {
        if cursor.numbers::<2>().is_none() {
            return false;
        }
    }
    true
}

/// A list of transforms. One that scales by less than usvg keeps (2⁻²³), but not by 0, counts as
/// unreadable.
pub(super) fn is_transform(text: &str) -> bool {
    if text.trim() == "none" {
        return true;
    }
    matrix(text).is_some_and(|[a, b, c, d]| {
        [a.hypot(c), b.hypot(d)].iter().all(|&scale| scale == 0.0 || scale > f64::from(f32::EPSILON))
    })
}

/// The linear part of a list of transforms, by columns.
fn matrix(text: &str) -> Option<[f64; 4]> {
    let mut cursor = Cursor::new(text);
    let mut product = [1.0, 0.0, 0.0, 1.0];
    while !cursor.is_at_end() {
        let start = cursor.at;
        cursor.skip_while(|c| c.is_ascii_alphabetic());
        let name = &text[start..cursor.at];
        cursor.skip_spaces();
        if !cursor.accept(b'(') {
            return None;
        }
        cursor.skip_spaces();
        let mut arguments = vec![];
        while !cursor.accept(b')') {
            arguments.push(cursor.list_number()?);
        }
        cursor.skip_separator();
        let [a, b, c, d] = match (name, &arguments[..]) {
            ("matrix", &[a, b, c, d, _, _]) => [a, b, c, d],
            ("translate", [_] | [_, _]) => [1.0, 0.0, 0.0, 1.0],
            ("scale", &[x]) => [x, 0.0, 0.0, x],
            ("scale", &[x, y]) => [x, 0.0, 0.0, y],
            ("rotate", &[angle] | &[angle, _, _]) => {
                let (sin, cos) = angle.to_radians().sin_cos();
                [cos, sin, -sin, cos]
            }
            ("skewX", &[angle]) => [1.0, 0.0, angle.to_radians().tan(), 1.0],
            ("skewY", &[angle]) => [1.0, angle.to_radians().tan(), 0.0, 1.0],
            _ => return None,
        };
        let [p, q, r, s] = product;
        product = [p * a + r * b, q * a + s * b, p * c + r * d, q * c + s * d];
    }
    Some(product)
}

/// A length with or without a unit, or `auto`; `None` if it is neither.
pub(super) fn length(text: &str) -> Option<f64> {
    if text.trim() == "auto" {
        return Some(0.0);
    }
    let mut cursor = Cursor::new(text);
    let number = cursor.number()?;
    let unit = text[cursor.at..].trim_end();
    let units = ["", "px", "em", "ex", "in", "cm", "mm", "pt", "pc", "%"];
    units.contains(&unit).then_some(number)
}

/// A number or a percentage, as a fraction.
pub(super) fn fraction(text: &str) -> Option<f64> {
    let mut cursor = Cursor::new(text);
    let number = cursor.number()?;
    match text[cursor.at..].trim_end() {
        "" => Some(number),
        "%" => Some(number / 100.0),
        _ => None,
    }
}

/// Corner and size of a view box; the size must be positive.
pub(super) fn is_view_box(text: &str) -> bool {
    let mut cursor = Cursor::new(text);
    let numbers = cursor.numbers::<4>();
    cursor.is_at_end() && numbers.is_some_and(|[_, _, width, height]| width > 0.0 && height > 0.0)
}

/// A word of `preserveAspectRatio`.
pub(super) fn is_aspect_word(word: &str) -> bool {
    let is_part = |part| matches!(part, "Min" | "Mid" | "Max");
    let align = word.strip_prefix('x').and_then(|rest| rest.split_once('Y'));
    matches!(word, "defer" | "none" | "meet" | "slice")
        || align.is_some_and(|(x, y)| is_part(x) && is_part(y))
}

/// A colour, `none`, `inherit`, `currentColor`, or a reference with or without a fallback: what
/// usvg takes for one. It paints a broken fill black, but a broken stroke not at all.
pub(super) fn is_paint(text: &str) -> bool {
    let text = text.trim();
    if matches!(text, "none" | "inherit") {
        return true;
    }
    let escaped = text.replace('&', "&amp;").replace('<', "&lt;").replace('"', "&quot;");
    let probe = format!(
        "<svg xmlns='http://www.w3.org/2000/svg' width='1' height='1'>\
         <linearGradient id='g'><stop/><stop offset='1'/></linearGradient>\
         <rect width='1' height='1' stroke=\"{escaped}\"/></svg>"
    );
    let tree = usvg::Tree::from_str(&probe, &usvg::Options::default());
    tree.is_ok_and(|tree| match tree.root().children() {
        [usvg::Node::Path(path)] => path.stroke().is_some(),
        _ => false,
    })
}

/// The id in `url(#id)`, before any fallback.
pub(super) fn reference(text: &str) -> Option<&str> {
    let inside = text.trim().strip_prefix("url(")?.split(')').next()?.trim();
    inside.trim_matches(['"', '\'']).trim().strip_prefix('#')
}
