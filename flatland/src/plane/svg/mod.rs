//! SVG drawings as scenes.
//!
//! [`read`] turns the filled shapes of a drawing into polygons in painter's order. Content that a scene
//! cannot represent exactly is refused by an [`SvgError`] that names the element and its position in the
//! file; nothing visible is dropped silently.
//!
//! Supported: `svg`, `g`, `a`, `path`, `polygon`, `polyline`, `rect`, `circle`, `ellipse`, `use`, `defs`,
//! `style`, and `linearGradient` with `spreadMethod="pad"`. Refused where they would be drawn: text, images,
//! strokes, markers, any opacity between 0 and 1, radial gradients, patterns, masks, filters, clipping, blend
//! modes, discontinuous gradients, `switch`, animations, scripts, and values that do not parse. Invisible
//! content is omitted: `display: none`, `visibility: hidden`, opacity 0, no fill, regions without area, and
//! unused definitions. (Text and other unsupported elements are omitted only if an attribute or `style` of
//! their own or of an enclosing group says `display: none`.) Elements of foreign namespaces are ignored, as
//! SVG requires. Conditions such as `systemLanguage` are evaluated for English.
//!
//! # Example
//! ```
//! use flatland::plane::svg::{SvgOptions, parse};
//! use flatland::plane::{Film, Filter, Motion};
//! use glam::DVec2;
//!
//! let text = "<svg xmlns='http://www.w3.org/2000/svg' width='40' height='30'>
//!   <rect width='40' height='30' fill='navy'/>
//!   <g id='hand' fill='white'><path d='M20 4L22 15H18z'/><circle cx='20' cy='15' r='3'/></g>
//! </svg>";
//! let drawing = parse(text, &SvgOptions::default())?;
//! let motion = Motion::rotate(drawing.shapes_under("hand"), DVec2::new(20.0, 15.0));
//! let film = Film::new(drawing.size.x as usize, drawing.size.y as usize, Filter::Tent)?;
//! assert_eq!(motion.velocities(&drawing.scene)?.len(), drawing.scene.vertices().len());
//! # let _ = film;
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Coordinates
//! Coordinates are those of the drawing's viewport: pixels of `width` × `height`, y down. [`usvg`] resolves
//! styles and transforms in single precision, so coordinates have relative errors of about 10⁻⁷; beyond
//! ±[`MAX_COORDINATE`] they are refused.
//!
//! # Curves
//! A curve becomes n chords at equal steps of its parameter. A chord over a step 1/n is within max|B″| / (8
//! n²) of the curve (Taylor), hence within `tolerance` for
//!
//! ```text
//! quadratic:  n ≥ √( |p₀ − 2p₁ + p₂| / (4 tolerance) )
//! cubic:      n ≥ √( 3 max(|p₀ − 2p₁ + p₂|, |p₁ − 2p₂ + p₃|) / (4 tolerance) )
//! ```
//!
//! taken after all transforms. Circles, ellipses and arcs arrive as cubics: usvg approximates them within
//! 2.8·10⁻⁴ of their radius, which adds to the tolerance.
//!
//! # Fill rules
//! A path whose rings are a valid [`Polygon`] with the same region as its fill rule is used unchanged. Every
//! other path (crossings, overlaps, nested rings of one orientation under `nonzero`) is resolved by
//! `i_overlay` on a grid of step [`GRID`], to which all its vertices are rounded. One path is one [`Shape`].
//!
//! # Colours
//! sRGB bytes divided by 255, not linearised: the renderer is linear in colours of any kind, and SVG
//! interpolates gradients in sRGB. A linear gradient is [`Shade::ramp`] with t(u) = (M⁻¹u − p₁)·d/|d|², where
//! M maps the gradient's coordinates to the image and d = p₂ − p₁; so the direction of the ramp is L⁻ᵀd/|d|²,
//! with L the linear part of M.

mod check;
mod document;
mod error;
mod flatten;
mod paint;
mod region;

#[cfg(test)]
mod tests;

use std::path::Path;

use glam::{DVec2, DVec3};
use usvg::roxmltree;

pub use self::error::{Element, SvgError};

use self::document::{Node, Source};
use super::{Attachment, Scene, Shape};

#[cfg(doc)]
use super::{Polygon, Shade};

/// Largest coordinate, in the file and in the image. Single precision, which usvg uses, has errors of 0.06
/// there.
pub const MAX_COORDINATE: f64 = 1e6;

/// Step of the grid to which a path is rounded if its fill rule must be resolved: 2⁻²⁰.
pub const GRID: f64 = 1.0 / 1_048_576.0;

/// Smallest tolerance: the rounding error of a coordinate of 16.
pub const MIN_TOLERANCE: f64 = 1e-6;

/// Options for reading a drawing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SvgOptions {
    /// Largest distance of a chord from its curve, in pixels of the drawing. 0.1 is invisible; halving it
    /// multiplies the edges of curves by √2.
    pub tolerance: f64,
    /// Attachment of gradients when their shape moves.
    pub attachment: Attachment,
    /// Background colour.
    pub background: DVec3,
}

impl Default for SvgOptions {
    /// A tolerance of 0.1, gradients fixed to the image, a white background.
    fn default() -> Self {
        Self { tolerance: 0.1, attachment: Attachment::Image, background: DVec3::ONE }
    }
}

/// A drawing as a scene, with the names of its parts.
#[derive(Clone, Debug)]
pub struct Drawing {
    /// The shapes in painter's order.
    pub scene: Scene,
    /// Width and height of the viewport. Content outside it is part of the scene.
    pub size: DVec2,
    /// For each shape, the ids of its element and of its enclosing groups, innermost first. A shape drawn by
    /// a `use` belongs to the `use`.
    pub ids: Vec<Vec<String>>,
}

impl Drawing {
    /// Id of a shape's element, or of the innermost enclosing group that has one.
    #[must_use]
    pub fn name(&self, shape: usize) -> Option<&str> {
        self.ids.get(shape)?.first().map(String::as_str)
    }

    /// All shapes drawn by an element, or by a group and its nested groups; empty if no visible element has
    /// this id.
    #[must_use]
    pub fn shapes_under(&self, id: &str) -> Vec<usize> {
        (0..self.ids.len()).filter(|&shape| self.ids[shape].iter().any(|name| name == id)).collect()
    }
}

/// Reads a drawing from a file.
///
/// # Errors
/// Any [`SvgError`].
pub fn read(path: &Path, options: &SvgOptions) -> Result<Drawing, SvgError> {
    let text = text(path).map_err(|source| SvgError::Io { path: path.to_path_buf(), source })?;
    parse(&text, options)
}

/// Reads a regular file. Pipes and devices are refused: they may never begin or end.
fn text(path: &Path) -> std::io::Result<String> {
    let kind = std::fs::metadata(path)?.file_type();
    if !kind.is_file() && !kind.is_dir() {
        let why = "it is a pipe or a device, and only regular files are read";
        return Err(std::io::Error::new(std::io::ErrorKind::InvalidInput, why));
    }
    std::fs::read_to_string(path)
}

/// Reads a drawing from its text.
///
/// # Errors
/// Any [`SvgError`] except [`SvgError::Io`].
pub fn parse(text: &str, options: &SvgOptions) -> Result<Drawing, SvgError> {
    let tolerance = options.tolerance;
    if !(tolerance.is_finite() && tolerance >= MIN_TOLERANCE) {
        return Err(SvgError::Tolerance { tolerance });
    }
    let xml_options = roxmltree::ParsingOptions { allow_dtd: true, ..Default::default() };
    let document = roxmltree::Document::parse_with_options(text, xml_options).map_err(|error| {
        let (at, message) = (error.pos(), error.to_string());
        SvgError::Xml { line: at.row, column: at.col, message }
    })?;
    let source = Source::new(&document)?;
    check::check(&source)?;
    let tree = usvg::Tree::from_str(&source.text_with_ids(), &usvg_options())
        .map_err(|error| SvgError::Document { message: error.to_string() })?;
    let mut reader = Reader { source: &source, options, shapes: vec![], ids: vec![] };
    reader.group(tree.root(), document.root_element())?;
    if reader.shapes.is_empty() {
        return Err(SvgError::Empty);
    }
    let scene = Scene::new(options.background, reader.shapes)?;
    let size = DVec2::new(f64::from(tree.size().width()), f64::from(tree.size().height()));
    Ok(Drawing { scene, size, ids: reader.ids })
}

/// usvg's options: no other file than the drawing is ever opened.
fn usvg_options() -> usvg::Options<'static> {
    let image_href_resolver = usvg::ImageHrefResolver {
        resolve_data: Box::new(|_, _, _| None),
        resolve_string: Box::new(|_, _| None),
    };
    usvg::Options { image_href_resolver, ..Default::default() }
}

/// Collects the shapes of usvg's tree, in painter's order.
struct Reader<'s, 'a> {
    source: &'s Source<'a>,
    options: &'s SvgOptions,
    shapes: Vec<Shape>,
    ids: Vec<Vec<String>>,
}

impl<'a> Reader<'_, 'a> {
    /// `owner` is the element that draws shapes without an id: the innermost `use`, or the root.
    fn group(&mut self, group: &usvg::Group, owner: Node<'a>) -> Result<(), SvgError> {
        let owner = self.source.by_given_id(group.id()).unwrap_or(owner);
        let opacity = group.opacity().get();
        if opacity == 0.0 {
            return Ok(());
        }
        let what = if opacity < 1.0 {
            Some("opacity between 0 and 1")
        } else if group.clip_path().is_some() {
            Some("clipping")
        } else if group.mask().is_some() {
            Some("mask")
        } else if !group.filters().is_empty() {
            Some("filter")
        } else if group.blend_mode() != usvg::BlendMode::Normal {
            Some("mix-blend-mode")
        } else {
            None
        };
        if let Some(what) = what {
            return Err(self.source.unsupported(self.owner(group, owner), what));
        }
        for child in group.children() {
            match child {
                usvg::Node::Group(child) => self.group(child, owner)?,
                usvg::Node::Path(path) => self.path(path, owner)?,
                usvg::Node::Image(_) => return Err(self.source.unsupported(owner, "image")),
                usvg::Node::Text(_) => return Err(self.source.unsupported(owner, "text")),
            }
        }
        Ok(())
    }

    /// Element of a group: its own or, if it was made for a single shape, the shape's element.
    fn owner(&self, group: &usvg::Group, outer: Node<'a>) -> Node<'a> {
        match (self.source.by_given_id(group.id()), group.children().first()) {
            (Some(node), _) => node,
            (None, Some(usvg::Node::Group(inner))) => self.owner(inner, outer),
            (None, Some(usvg::Node::Path(path))) => self.source.by_given_id(path.id()).unwrap_or(outer),
            _ => outer,
        }
    }

    fn path(&mut self, path: &usvg::Path, owner: Node<'a>) -> Result<(), SvgError> {
        if !path.is_visible() {
            return Ok(());
        }
        let node = self.source.by_given_id(path.id()).unwrap_or(owner);
        if path.stroke().is_some_and(|stroke| stroke.opacity().get() > 0.0) {
            return Err(self.source.unsupported(node, "stroke"));
        }
        let Some(fill) = path.fill().filter(|fill| fill.opacity().get() > 0.0) else {
            return Ok(());
        };
        if fill.opacity().get() < 1.0 {
            return Err(self.source.unsupported(node, "fill opacity between 0 and 1"));
        }
        let rings = flatten::rings(path, self.options.tolerance)
            .ok_or_else(|| self.source.unsupported(node, "a coordinate beyond ±10⁶"))?;
        let polygon = region::polygon(rings, fill.rule())
            .map_err(|source| SvgError::Polygon { element: self.source.describe(node), source })?;
        let Some(polygon) = polygon else { return Ok(()) };
        let shade = paint::shade(fill.paint(), path.abs_transform(), self.options.attachment)
            .map_err(|error| self.source.paint_error(node, error))?;
        self.shapes.push(Shape::new(polygon, shade));
        self.ids.push(self.source.ids(node));
        Ok(())
    }
}
