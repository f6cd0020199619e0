//! The content of a figure on the page.

use serde::{Deserialize, Serialize};

use crate::output::Table;
use crate::plot::{Kept, Rect};

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
#[derive(Clone, Debug, Deserialize, Serialize)]
pub(crate) struct Drawing {
    /// Width and height in logical pixels.
    pub(crate) size: [f64; 2],
    /// Panels that narrow screens show one below the other.
    pub(crate) parts: Vec<Rect>,
    /// Colours unchanged on dark pages.
    pub(crate) kept: Kept,
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
    /// Picture files, in the folder of the page.
    pub(crate) pictures: Vec<Picture>,
    /// File names in the gallery's folder, linked.
    pub(crate) data: Vec<String>,
    /// Main numbers, shown on the page.
    pub(crate) table: Table,
    /// The numbers in the text, by name.
    pub(crate) values: Vec<(String, String)>,
    /// Source of recorded results, as HTML; empty if this run measured them.
    pub(crate) origin_html: String,
    /// A small scene computed by this run, next to recorded results.
    pub(crate) live: Option<Box<Section>>,
}
