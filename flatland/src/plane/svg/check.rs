//! What is drawn but not supported, found before usvg drops it.
//!
//! The walk follows what is rendered, through every `use`. Styles that only usvg can resolve
//! (strokes, opacities, gradients) are judged afterwards, on its result.

use std::collections::{BTreeMap, HashSet};

use usvg::roxmltree::NodeId;

use super::document::{Node, Source, attribute, attributes, href, is_svg};
use super::{SvgError, css, values};

/// Elements that draw nothing where they stand.
const UNDRAWN: [&str; 17] = [
    "defs",
    "symbol",
    "style",
    "title",
    "desc",
    "metadata",
    "linearGradient",
    "radialGradient",
    "pattern",
    "mask",
    "clipPath",
    "filter",
    "marker",
    "view",
    "cursor",
    "font",
    "color-profile",
];

/// Elements that are filled.
const SHAPES: [&str; 7] = ["path", "polygon", "polyline", "rect", "circle", "ellipse", "line"];

/// Properties of CSS that move or hide what is drawn, and that usvg does not know.
const UNKNOWN: [&str; 33] = [
    "d",
    "x",
    "y",
    "cx",
    "cy",
    "r",
    "rx",
    "ry",
    "width",
    "height",
    "translate",
    "rotate",
    "scale",
    "transform-box",
    "offset",
    "offset-path",
    "offset-distance",
    "offset-rotate",
    "perspective",
    "animation",
    "animation-name",
    "transition",
    "clip",
    "mask-image",
    "mask-border",
    "mask-border-source",
    "-webkit-mask",
    "-webkit-mask-image",
    "-webkit-clip-path",
    "-webkit-filter",
    "backdrop-filter",
    "zoom",
    "all",
];

/// Refuses what cannot be shown.
pub(super) fn check(source: &Source<'_>) -> Result<(), SvgError> {
    let mut checker =
        Checker { source, paints: HashSet::new(), gradients: HashSet::new(), has_styled_visibility: false };
    for node in source.document().root().children() {
        if node.pi().is_some_and(|pi| pi.target == "xml-stylesheet") {
            return Err(source.unsupported(node, "an external style sheet"));
        }
    }
    for node in source.document().descendants().filter(|n| n.has_tag_name("style")) {
        checker.style_sheet(node)?;
    }
    checker.element(source.root(), true)
}

struct Checker<'s, 'a> {
    source: &'s Source<'a>,
    /// Paints known to be good.
    paints: HashSet<String>,
    /// Gradients known to be good.
    gradients: HashSet<NodeId>,
    /// Whether a style sheet shows or hides elements: then attributes alone do not tell.
    has_styled_visibility: bool,
}

impl<'a> Checker<'_, 'a> {
    /// A rendered element. `is_visible` is the inherited `visibility`.
    fn element(&mut self, node: Node<'a>, is_visible: bool) -> Result<(), SvgError> {
        let tag = node.tag_name().name();
        if !is_svg(node) || UNDRAWN.contains(&tag) {
            return Ok(());
        }
        self.rendered(node, is_visible)
    }

    fn rendered(&mut self, node: Node<'a>, is_visible: bool) -> Result<(), SvgError> {
        let tag = node.tag_name().name();
        let style = self.style(node)?;
        let property = |name: &str| {
            let styled = style.get(name).map(String::as_str);
            styled.or_else(|| attribute(node, name)).map(str::trim)
        };
        let mut is_visible = is_visible;
        if !self.has_styled_visibility {
            let is_transparent = property("opacity").and_then(values::fraction) == Some(0.0);
            if property("display") == Some("none") || is_transparent {
                return Ok(());
            }
            is_visible = match property("visibility") {
                Some("visible") => true,
                Some("hidden" | "collapse") => false,
                _ => is_visible,
            };
        }
        let is_leaf = tag != "use" && !node.children().any(is_svg);
        if !is_visible && is_leaf {
            return Ok(());
        }
        let is_container = matches!(tag, "svg" | "g" | "a" | "symbol");
        if !is_container && tag != "use" && !SHAPES.contains(&tag) {
            return Err(self.source.unsupported(node, tag));
        }
        for (name, value) in attributes(node) {
            // The one property that SVG takes from styles only.
            if name != "mix-blend-mode" {
                self.value(node, name, value, false)?;
            }
        }
        for (name, value) in &style {
            self.value(node, name, value, true)?;
        }
        if tag == "use" {
            let Some(target) = self.source.target(node) else {
                let what = format!("a reference to nothing ({})", href(node).unwrap_or("no href"));
                return Err(self.source.unsupported(node, &what));
            };
            match target.tag_name().name() {
                "symbol" => self.rendered(target, is_visible)?,
                _ => self.element(target, is_visible)?,
            }
        }
        for child in node.children().filter(|&child| is_svg(child)) {
            let name = child.tag_name().name();
            if is_container {
                self.element(child, is_visible)?;
            } else if !matches!(name, "title" | "desc" | "metadata") {
                return Err(self.source.unsupported(child, &format!("{name} in {tag}")));
            }
        }
        Ok(())
    }

    /// An attribute (or a property of a style) of something rendered.
    fn value(&mut self, node: Node<'a>, name: &str, value: &str, is_style: bool) -> Result<(), SvgError> {
        let source = self.source;
        let unsupported = || Err(source.unsupported(node, &format!("{name}=\"{value}\"")));
        let readable = |ok: bool| if ok { Ok(()) } else { Err(source.bad_value(node, name, value)) };
        let text = value.trim();
        match name {
            _ if is_style && UNKNOWN.contains(&name) => {
                // The size of the page is the page's business.
                let is_page = node == source.root() && matches!(name, "width" | "height");
                if is_page || matches!(text, "none" | "auto" | "initial") { Ok(()) } else { unsupported() }
            }
            _ if text == "inherit" => Ok(()),
            "filter" | "mask" | "clip-path" | "marker" | "marker-start" | "marker-mid" | "marker-end" => {
                if text == "none" {
                    Ok(())
                } else {
                    unsupported()
                }
            }
            "mix-blend-mode" => {
                if text == "normal" {
                    Ok(())
                } else {
                    unsupported()
                }
            }
            "color-interpolation" if text == "linearRGB" => unsupported(),
            "background" if !matches!(text, "none" | "transparent") => unsupported(),
            "fill" | "stroke" => self.paint(node, name, value),
            "color" | "stop-color" | "background-color" => self.colour(node, name, value),
            "fill-rule" => readable(matches!(text, "nonzero" | "evenodd")),
            "opacity" | "fill-opacity" | "stroke-opacity" | "stop-opacity" | "offset" => {
                readable(values::fraction(text).is_some())
            }
            "transform" | "gradientTransform" => readable(values::is_transform(text)),
            "d" => readable(values::is_path(text)),
            "points" => readable(values::is_points(text)),
            "viewBox" => readable(values::is_view_box(text)),
            "preserveAspectRatio" => readable(text.split_whitespace().all(values::is_aspect_word)),
            "transform-origin" => {
                let is_side = |w| matches!(w, "left" | "right" | "center" | "top" | "bottom");
                readable(text.split_whitespace().all(|w| is_side(w) || values::length(w).is_some()))
            }
            "gradientUnits" => readable(matches!(text, "userSpaceOnUse" | "objectBoundingBox")),
            "spreadMethod" => readable(matches!(text, "pad" | "reflect" | "repeat")),
            "x" | "y" | "cx" | "cy" | "x1" | "y1" | "x2" | "y2" | "stroke-width" => {
                readable(values::length(text).is_some())
            }
            "width" | "height" | "r" | "rx" | "ry" => {
                readable(values::length(text).is_some_and(|x| x >= 0.0))
            }
            _ => Ok(()),
        }
    }

    fn colour(&mut self, node: Node<'a>, name: &str, value: &str) -> Result<(), SvgError> {
        if !self.paints.contains(value) {
            if !values::is_paint(value) {
                return Err(self.source.bad_value(node, name, value));
            }
            self.paints.insert(value.to_owned());
        }
        Ok(())
    }

    fn paint(&mut self, node: Node<'a>, name: &str, value: &str) -> Result<(), SvgError> {
        if !value.trim_start().starts_with("url(") {
            return self.colour(node, name, value);
        }
        let Some(id) = values::reference(value) else {
            return Err(self.source.bad_value(node, name, value));
        };
        // The fallback, if any, is a colour.
        let colour = value.split_once(')').map_or("", |(_, rest)| rest.trim());
        if !colour.is_empty() {
            self.colour(node, name, colour)?;
        }
        match self.source.by_id(id).map(|target| (target, target.tag_name().name())) {
            Some((target, "linearGradient")) if is_svg(target) => self.gradient(target),
            Some((target, tag)) => Err(self
                .source
                .unsupported(node, &format!("{name} by {tag} #{}", attribute(target, "id").unwrap_or("")))),
            None => Err(self.source.unsupported(node, &format!("a reference to nothing ({value})"))),
        }
    }

    /// A gradient and those it takes its stops or attributes from.
    fn gradient(&mut self, first: Node<'a>) -> Result<(), SvgError> {
        let mut chain = HashSet::new();
        let mut next = Some(first);
        while let Some(node) = next {
            if !chain.insert(node.id()) {
                return Err(self.source.unsupported(first, "a gradient that refers to itself"));
            }
            if self.gradients.contains(&node.id()) {
                break;
            }
            for (name, value) in attributes(node) {
                self.value(node, name, value, false)?;
            }
            for (name, value) in self.style(node)? {
                self.value(node, &name, &value, true)?;
            }
            for stop in node.children().filter(|&child| is_svg(child)) {
                match stop.tag_name().name() {
                    "stop" => {}
                    "title" | "desc" | "metadata" => continue,
                    other => return Err(self.source.unsupported(stop, &format!("{other} in a gradient"))),
                }
                if let Some(child) = stop.children().find(|&child| is_svg(child)) {
                    return Err(self.source.unsupported(child, "anything in a stop"));
                }
                for (name, value) in attributes(stop) {
                    self.value(stop, name, value, false)?;
                }
                for (name, value) in self.style(stop)? {
                    self.value(stop, &name, &value, true)?;
                }
            }
            next = match (href(node), self.source.target(node)) {
                (None, _) => None,
                (Some(_), Some(target)) if target.tag_name().name().ends_with("Gradient") => Some(target),
                (Some(link), _) => {
                    return Err(self.source.unsupported(node, &format!("a gradient from {link}")));
                }
            };
        }
        self.gradients.extend(chain);
        Ok(())
    }

    /// The properties of a `style` attribute; the last of each name counts.
    fn style(&self, node: Node<'a>) -> Result<BTreeMap<String, String>, SvgError> {
        let text = attribute(node, "style").unwrap_or("");
        css::declarations(text)
            .ok_or_else(|| self.source.bad_value(node, "style", text))
            .map(|list| list.into_iter().collect())
    }

    /// Refuses all that usvg's CSS parser would skip, and checks every declaration.
    fn style_sheet(&mut self, node: Node<'a>) -> Result<(), SvgError> {
        if !matches!(attribute(node, "type"), None | Some("text/css")) || attribute(node, "media").is_some() {
            return Err(self.source.unsupported(node, "a style sheet that is not plain text/css"));
        }
        if node.children().count() > 1 {
            return Err(self.source.unsupported(node, "a style sheet in pieces"));
        }
        let text = node.text().unwrap_or("");
        let Some(text) = css::without_comments(text) else {
            return Err(self.source.unsupported(node, "an open comment in a style sheet"));
        };
        let mut rest = text.trim();
        while !rest.is_empty() {
            let parts = rest.split_once('{').and_then(|(selectors, rest)| {
                rest.split_once('}').map(|(block, rest)| (selectors.trim(), block, rest))
            });
            let Some((selectors, block, after)) = parts else {
                return Err(self.source.unsupported(node, "a style sheet with an open block"));
            };
            if !selectors.split(',').all(css::is_selector) {
                return Err(self.source.unsupported(node, &format!("the selector \"{selectors}\"")));
            }
            let Some(list) = css::declarations(block) else {
                return Err(self.source.bad_value(node, selectors, block.trim()));
            };
            for (name, value) in &list {
                self.value(node, name, value, true)?;
                let decides = ["display", "visibility", "opacity"].contains(&name.as_str());
                self.has_styled_visibility |= decides;
            }
            rest = after.trim_start();
        }
        Ok(())
    }
}
