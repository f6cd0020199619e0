//! Detection of content that usvg drops or misreads silently: unknown elements, dangling references, and
//! values and style sheets that its parsers skip. Everything else is checked on usvg's result.

use simplecss::{DeclarationTokenizer, StyleSheet};
use svgtypes::{
    AspectRatio, Color, Length, LengthUnit, NumberListParser, Paint, PathParser, Transform, TransformOrigin,
    ViewBox,
};

use super::SvgError;
use super::document::{Node, Source, attribute, attributes, href, is_svg};

/// Largest nesting depth of elements, with every `use` expanded: usvg recurses.
const MAX_DEPTH: usize = 256;
/// Largest number of elements, with every `use` expanded.
const MAX_ELEMENTS: usize = 1_000_000;

/// Container elements, filled elements, and elements that draw nothing themselves.
const CONTAINERS: &str = "svg g a use symbol";
const SHAPES: &str = "path polygon polyline rect circle ellipse line";
const UNDRAWN: &str =
    "defs style title desc metadata linearGradient radialGradient pattern mask clipPath filter marker";

/// CSS properties that draw, move or hide, and that usvg does not support.
const UNKNOWN: &str = "d x y cx cy r rx ry width height translate rotate scale transform-box offset offset-path \
    offset-distance offset-rotate perspective zoom all background clip mask-image mask-border mask-border-source \
    -webkit-mask -webkit-mask-image -webkit-clip-path -webkit-filter backdrop-filter animation animation-name transition";

fn has_word(list: &str, word: &str) -> bool {
    list.split(' ').any(|other| other == word)
}

/// Refuses content that would be lost.
pub(super) fn check(source: &Source<'_>) -> Result<(), SvgError> {
    for node in source.document().descendants() {
        if node.pi().is_some_and(|pi| pi.target == "xml-stylesheet") {
            return Err(source.unsupported(node, "an external style sheet"));
        }
        if node.has_tag_name("style") {
            style_sheet(source, node)?;
        }
    }
    Walk { source, count: 0 }.element(source.root(), 0, true)
}

struct Walk<'s, 'a> {
    source: &'s Source<'a>,
    /// Number of elements visited.
    count: usize,
}

impl<'a> Walk<'_, 'a> {
    /// An element, its content, and the elements that it uses.
    fn element(&mut self, node: Node<'a>, depth: usize, mut is_drawn: bool) -> Result<(), SvgError> {
        let (source, tag) = (self.source, node.tag_name().name());
        let refuse = |what: &str| Err(source.unsupported(node, what));
        self.count += 1;
        if depth > MAX_DEPTH {
            return refuse("nesting deeper than 256, or a use of itself,");
        }
        if self.count > MAX_ELEMENTS {
            return refuse("a document of more than 10⁶ elements");
        }
        is_drawn = is_drawn && !has_word(UNDRAWN, tag) && !values(source, node)?;
        let is_shape = has_word(SHAPES, tag);
        if is_drawn && !is_shape && !has_word(CONTAINERS, tag) {
            return refuse(tag);
        }
        if tag == "use" {
            match source.target(node) {
                Some(target) => self.element(target, depth + 1, is_drawn)?,
                None if is_drawn => {
                    return refuse(&format!("a reference to nothing ({})", href(node).unwrap_or("no href")));
                }
                None => {}
            }
        }
        for child in node.children().filter(|&child| is_svg(child)) {
            let name = child.tag_name().name();
            if is_drawn && is_shape && !has_word(UNDRAWN, name) {
                return Err(source.unsupported(child, &format!("{name} in {tag}")));
            }
            // A symbol is drawn by its uses.
            self.element(child, depth + 1, is_drawn && name != "symbol")?;
        }
        Ok(())
    }
}

/// Checks the attributes of an element and its own style; returns whether they hide it: `display: none`.
fn values(source: &Source<'_>, node: Node<'_>) -> Result<bool, SvgError> {
    let text = attribute(node, "style").unwrap_or("");
    let style = declarations(text).ok_or_else(|| source.bad_value(node, "style", text))?;
    let mut display = attribute(node, "display");
    for (name, text) in attributes(node) {
        value(source, node, name, text.trim())?;
    }
    for (name, text) in style {
        property(source, node, name, text)?;
        display = if name == "display" { Some(text) } else { display };
    }
    Ok(display == Some("none"))
}

/// A property of a style.
fn property(source: &Source<'_>, node: Node<'_>, name: &str, text: &str) -> Result<(), SvgError> {
    // The size of the page is not a drawing property.
    let is_page = node == source.root() && matches!(name, "width" | "height");
    if has_word(UNKNOWN, name) && !is_page && !matches!(text, "none" | "auto" | "initial" | "transparent") {
        return Err(source.unsupported(node, &format!("{name}=\"{text}\"")));
    }
    value(source, node, name, text)
}

/// An attribute or a property.
fn value(source: &Source<'_>, node: Node<'_>, name: &str, text: &str) -> Result<(), SvgError> {
    let is_effect = has_word("filter mask clip-path marker marker-start marker-mid marker-end", name);
    if text == "inherit" || (is_effect && text == "none") {
        return Ok(());
    }
    if is_effect {
        return Err(source.unsupported(node, &format!("{name}=\"{text}\"")));
    }
    if !is_readable(name, text) {
        return Err(source.bad_value(node, name, text));
    }
    match Paint::from_str(text) {
        Ok(Paint::FuncIRI(id, _)) if matches!(name, "fill" | "stroke") => match source.by_id(id) {
            Some(target) if target.tag_name().name() == "linearGradient" => gradient(source, node, target),
            Some(target) => {
                Err(source.unsupported(node, &format!("{name} by {} #{id}", target.tag_name().name())))
            }
            None => Err(source.unsupported(node, &format!("a reference to nothing ({text})"))),
        },
        _ => Ok(()),
    }
}

/// Whether usvg reads the whole value. Unreadable values it skips, or takes for black.
fn is_readable(name: &str, text: &str) -> bool {
    let length =
        |least: f64| text == "auto" || text.parse().is_ok_and(|length: Length| length.number >= least);
    match name {
        "d" => PathParser::from(text).all(|segment| segment.is_ok()) && !is_beyond_single_precision(text),
        "points" => {
            let numbers: Vec<_> = NumberListParser::from(text).collect();
            numbers.len() % 2 == 0 && numbers.iter().all(Result::is_ok) && !is_beyond_single_precision(text)
        }
        "transform" | "gradientTransform" => text == "none" || text.parse().is_ok_and(keeps_what_it_scales),
        "transform-origin" => text.parse::<TransformOrigin>().is_ok(),
        "viewBox" => text.parse::<ViewBox>().is_ok(),
        "preserveAspectRatio" => text.parse::<AspectRatio>().is_ok(),
        "fill" | "stroke" => Paint::from_str(text).is_ok(),
        "color" | "stop-color" | "background-color" => {
            text == "currentColor" || text.parse::<Color>().is_ok()
        }
        "opacity" | "fill-opacity" | "stroke-opacity" | "stop-opacity" | "offset" => {
            text.parse().is_ok_and(|part: Length| matches!(part.unit, LengthUnit::None | LengthUnit::Percent))
        }
        "x" | "y" | "cx" | "cy" | "x1" | "y1" | "x2" | "y2" | "stroke-width" => length(f64::NEG_INFINITY),
        "width" | "height" | "r" | "rx" | "ry" => length(0.0),
        "fill-rule" => matches!(text, "nonzero" | "evenodd"),
        "gradientUnits" => matches!(text, "userSpaceOnUse" | "objectBoundingBox"),
        "spreadMethod" => matches!(text, "pad" | "reflect" | "repeat"),
        "color-interpolation" => text != "linearRGB",
        _ => true,
    }
}

/// Whether a number has an exponent for which its square or quotient is lost in single precision.
fn is_beyond_single_precision(text: &str) -> bool {
    text.split(['e', 'E']).skip(1).any(|rest| {
        let exponent = rest.trim_start_matches(['+', '-']);
        let end = exponent.find(|c: char| !c.is_ascii_digit()).unwrap_or(exponent.len());
        exponent[..end].parse::<u32>().is_ok_and(|exponent| exponent > 15)
    })
}

/// usvg drops shapes scaled by less than 2⁻²³; scaled by 0 they have no area.
fn keeps_what_it_scales(t: Transform) -> bool {
    [t.a.hypot(t.c), t.b.hypot(t.d)].iter().all(|&scale| scale == 0.0 || scale > f64::from(f32::EPSILON))
}

/// A gradient that paints `node`, and the gradients from which it inherits stops.
fn gradient(source: &Source<'_>, node: Node<'_>, first: Node<'_>) -> Result<(), SvgError> {
    let mut next = first;
    for _ in 0..MAX_DEPTH {
        values(source, next)?;
        for stop in next.children().filter(|&child| is_svg(child)) {
            values(source, stop)?;
            if !has_word("stop title desc metadata", stop.tag_name().name()) {
                return Err(source.unsupported(stop, &format!("{} in a gradient", stop.tag_name().name())));
            }
        }
        match (href(next), source.target(next)) {
            (None, _) => return Ok(()),
            (_, Some(target)) if target.tag_name().name().ends_with("Gradient") => next = target,
            (Some(link), _) => return Err(source.unsupported(next, &format!("a gradient from {link}"))),
        }
    }
    Err(source.unsupported(node, "a gradient that refers to itself"))
}

/// Refuses style sheets of which usvg would skip a part, and checks every declaration.
fn style_sheet(source: &Source<'_>, node: Node<'_>) -> Result<(), SvgError> {
    let is_plain =
        matches!(attribute(node, "type"), None | Some("text/css")) && attribute(node, "media").is_none();
    if !is_plain || node.children().count() > 1 {
        return Err(source.unsupported(node, "a style sheet that is not plain text/css"));
    }
    let text = without_comments(node.text().unwrap_or(""));
    let mut rest = text.trim();
    while !rest.is_empty() {
        let rule = rest.split_once('}').and_then(|(rule, rest)| Some((rule.split_once('{')?, rest)));
        let Some(((selectors, block), after)) = rule else {
            return Err(source.unsupported(node, "a style sheet with an open block"));
        };
        let list =
            declarations(block).ok_or_else(|| source.bad_value(node, selectors.trim(), block.trim()))?;
        let parsed = StyleSheet::parse(&rest[..rest.len() - after.len()]).rules.len();
        let is_plain = |c: char| c.is_ascii_alphanumeric() || c.is_ascii_whitespace() || ",.#*-_".contains(c);
        if !selectors.chars().all(is_plain) || parsed != selectors.split(',').count() {
            return Err(source.unsupported(node, &format!("the selector \"{}\"", selectors.trim())));
        }
        for (name, text) in list {
            // Otherwise an element hidden by its own style might be shown.
            if name == "display" && text != "none" {
                return Err(source.unsupported(node, &format!("display: {text} in a style sheet")));
            }
            property(source, node, name, text)?;
        }
        rest = after.trim_start();
    }
    Ok(())
}

fn without_comments(text: &str) -> String {
    let mut parts = text.split("/*");
    let first = parts.next().unwrap_or_default().to_owned();
    parts.fold(first, |text, part| text + " " + part.split_once("*/").map_or("", |(_, after)| after))
}

/// The declarations of a style, if usvg's parser reads all of them.
fn declarations(text: &str) -> Option<Vec<(&str, &str)>> {
    let written = text.split(';').filter(|piece| !piece.trim().is_empty());
    let read = DeclarationTokenizer::from(text).map(|declaration| (declaration.name, declaration.value));
    let (written, read): (Vec<_>, Vec<_>) = (written.collect(), read.collect());
    let is_whole = |(piece, (name, value)): (&&str, &(&str, &str))| {
        let rest = piece.split_once(value).map_or(*piece, |(_, rest)| rest);
        let is_done = matches!(rest.replace(char::is_whitespace, "").as_str(), "" | "!important");
        // CSS is case-insensitive, usvg is not; and its parser skips a star.
        let is_lower = !name.contains(|c: char| c.is_ascii_uppercase());
        is_done && is_lower && !piece.trim_start().starts_with('*')
    };
    (written.len() == read.len() && written.iter().zip(&read).all(is_whole)).then_some(read)
}
