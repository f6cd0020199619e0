//! The XML document: positions of elements, and the elements from which usvg's shapes come.

use std::collections::HashMap;

use usvg::roxmltree::{self, Document};

use super::paint::PaintError;
use super::{Element, SvgError};

pub(super) type Node<'a> = roxmltree::Node<'a, 'a>;

const SVG: &str = "http://www.w3.org/2000/svg";
const XLINK: &str = "http://www.w3.org/1999/xlink";

/// Elements whose ids usvg keeps on its shapes.
const NAMED: [&str; 10] =
    ["g", "a", "use", "path", "polygon", "polyline", "rect", "circle", "ellipse", "line"];

/// A document in which ids are unique and every element has its own position in the text.
pub(super) struct Source<'a> {
    document: &'a Document<'a>,
    by_id: HashMap<&'a str, Node<'a>>,
    /// Prefix, absent from the text, of the ids given to elements without one.
    prefix: String,
}

impl<'a> Source<'a> {
    pub(super) fn new(document: &'a Document<'a>) -> Result<Self, SvgError> {
        let text = document.input_text();
        let mut prefix = "flatland-".to_owned();
        while text.contains(&prefix) {
            prefix.push('-');
        }
        let mut this = Self { document, by_id: HashMap::new(), prefix };
        let mut last = None;
        for node in document.descendants().filter(Node::is_element) {
            // An entity that contains elements places them before others or repeatedly at one position.
            let start = node.range().start;
            if last.is_some_and(|last| last >= start) || !text[start..].starts_with('<') {
                return Err(this.unsupported(node, "an element inside an entity"));
            }
            last = Some(start);
            // usvg looks these up without regard to namespaces.
            let is_misread = |a: roxmltree::Attribute<'_, '_>| {
                a.namespace().is_some() && matches!(a.name(), "id" | "style")
            };
            if is_svg(node) && node.attributes().any(is_misread) {
                return Err(this.unsupported(node, "an id or style of another namespace"));
            }
            let Some(id) = node.attribute("id") else { continue };
            // usvg's nodes without an element have an empty id.
            if id.is_empty() && is_svg(node) {
                return Err(this.unsupported(node, "an empty id"));
            }
            if let Some(other) = this.by_id.insert(id, node) {
                let line = document.text_pos_at(other.range().start).row;
                return Err(this.unsupported(node, &format!("an id given before, in line {line},")));
            }
        }
        let root = document.root_element();
        if !is_svg(root) || root.tag_name().name() != "svg" {
            return Err(this.unsupported(root, "a root other than svg"));
        }
        Ok(this)
    }

    pub(super) fn root(&self) -> Node<'a> {
        self.document.root_element()
    }

    pub(super) fn document(&self) -> &'a Document<'a> {
        self.document
    }

    pub(super) fn by_id(&self, id: &str) -> Option<Node<'a>> {
        self.by_id.get(id).copied().filter(|&node| is_svg(node))
    }

    /// The target of an element's `href` (or `xlink:href`, if there is none).
    pub(super) fn target(&self, node: Node<'a>) -> Option<Node<'a>> {
        self.by_id(href(node)?.trim().strip_prefix('#')?)
    }

    /// The text with an id on every element after which usvg names its shapes.
    pub(super) fn text_with_ids(&self) -> String {
        let text = self.document.input_text();
        let mut out = String::with_capacity(2 * text.len());
        let mut done = 0;
        for node in self.document.descendants() {
            let named = is_svg(node) && NAMED.contains(&node.tag_name().name());
            if !named || attribute(node, "id").is_some() {
                continue;
            }
            let start = node.range().start;
            let ends = |c: char| c.is_ascii_whitespace() || c == '/' || c == '>';
            let at = text[start..].find(ends).map_or(text.len(), |length| start + length);
            out.push_str(&text[done..at]);
            out.push_str(&format!(" id=\"{}{}\"", self.prefix, node.id().get()));
            done = at;
        }
        out.push_str(&text[done..]);
        out
    }

    /// The element that has an id in [`text_with_ids`](Self::text_with_ids).
    pub(super) fn by_given_id(&self, id: &str) -> Option<Node<'a>> {
        match id.strip_prefix(&self.prefix) {
            Some(number) => {
                let number = number.parse().ok()?;
                self.document.get_node(roxmltree::NodeId::new(number))
            }
            None => self.by_id(id),
        }
    }

    /// Ids of an element and its ancestors, innermost first.
    pub(super) fn ids(&self, node: Node<'a>) -> Vec<String> {
        node.ancestors().filter_map(|n| attribute(n, "id")).map(str::to_owned).collect()
    }

    pub(super) fn describe(&self, node: Node<'a>) -> Element {
        let at = self.document.text_pos_at(node.range().start);
        Element {
            tag: node.tag_name().name().to_owned(),
            id: attribute(node, "id").map(str::to_owned),
            line: at.row,
            column: at.col,
        }
    }

    pub(super) fn unsupported(&self, node: Node<'a>, what: &str) -> SvgError {
        SvgError::Unsupported { element: self.describe(node), what: what.to_owned() }
    }

    pub(super) fn bad_value(&self, node: Node<'a>, name: &str, value: &str) -> SvgError {
        let value = match value.char_indices().nth(60) {
            Some((end, _)) => format!("{}…", &value[..end]),
            None => value.to_owned(),
        };
        SvgError::Value { element: self.describe(node), name: name.to_owned(), value }
    }

    pub(super) fn paint_error(&self, node: Node<'a>, error: PaintError) -> SvgError {
        match error {
            PaintError::Unsupported(what) => self.unsupported(node, what),
            PaintError::Shade(source) => SvgError::Shade { element: self.describe(node), source },
        }
    }
}

/// Whether usvg takes a node for an element of SVG.
pub(super) fn is_svg(node: Node<'_>) -> bool {
    node.is_element() && matches!(node.tag_name().namespace(), None | Some(SVG))
}

/// `href`, or else `xlink:href`.
pub(super) fn href<'a>(node: Node<'a>) -> Option<&'a str> {
    attribute(node, "href").or_else(|| node.attribute((XLINK, "href")))
}

/// The attributes of no namespace.
pub(super) fn attributes<'a>(node: Node<'a>) -> impl Iterator<Item = (&'a str, &'a str)> {
    node.attributes().filter(|a| a.namespace().is_none()).map(|a| (a.name(), a.value()))
}

/// The attribute of this name in no namespace; roxmltree's own lookup accepts any namespace.
pub(super) fn attribute<'a>(node: Node<'a>, name: &str) -> Option<&'a str> {
    attributes(node).find(|&(n, _)| n == name).map(|(_, value)| value)
}
