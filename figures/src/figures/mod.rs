//! The figures, one file each, in the order of the story.

mod attempts;
mod chains;
pub(crate) mod common;
mod drawing;
mod edges;
mod fields;
mod flat;
mod forms;
mod implicit;
mod levels;
mod masks;
mod mesh;
mod motions;
mod path_bias;
mod poses;
mod specular;
mod surfaces;
mod together;
mod trade;
mod transport;
mod views;

use crate::context::Context;
use crate::gallery::Section;

/// Introduction of the gallery, in Markdown.
pub(crate) const INTRODUCTION: &str = include_str!("introduction.md");

/// Slides of the lecture: pictures with a sentence each.
pub(crate) const LECTURE: &str = include_str!("lecture.md");

/// A figure.
pub(crate) struct Figure {
    /// The figure's name on the command line.
    pub(crate) name: &'static str,
    /// A short description.
    pub(crate) about: &'static str,
    /// Usual duration in draft quality, in seconds on two cores.
    pub(crate) seconds: f64,
    /// Measures, writes its files and explains it.
    pub(crate) draw: fn(&Context) -> anyhow::Result<Section>,
    /// Scene that a draft computes instead of a long study.
    pub(crate) study: Option<Study>,
}

/// A study whose results are recorded.
pub(crate) struct Study {
    /// The text that the recorded numbers are filled into.
    pub(crate) text: &'static str,
    /// Computes one small scene of it.
    pub(crate) live: fn(&Context) -> anyhow::Result<Section>,
}

type Draw = fn(&Context) -> anyhow::Result<Section>;

const fn figure(name: &'static str, about: &'static str, seconds: f64, draw: Draw) -> Figure {
    Figure { name, about, seconds, draw, study: None }
}

const fn study(
    name: &'static str,
    about: &'static str,
    seconds: f64,
    draw: Draw,
    (text, live): (&'static str, Draw),
) -> Figure {
    Figure { name, about, seconds, draw, study: Some(Study { text, live }) }
}

/// All figures in the order of their numbers, from 1 on: that of the lecture.
pub(crate) const ALL: [Figure; 20] = [
    figure("forms", "the boundary term: Reynolds and divergence, exactly", 3.0, forms::draw),
    figure("fields", "every construction of the warp field on one scene", 9.0, fields::draw),
    figure("attempts", "the three attempts along a line across a silhouette", 5.0, attempts::draw),
    figure("trade", "bias, variance and time: the trade", 21.0, trade::draw),
    figure("motion", "samples that move with the field, and the same derivative", 5.0, forms::draw_motion),
    figure("edges", "edge sampling and warped area as a scene grows", 15.0, edges::draw),
    figure("drawing", "a real drawing and its gradient image", 7.0, drawing::draw),
    figure(
        "transport",
        "a flat world, a path with its rays, and the derivative of a shadow",
        8.0,
        transport::draw,
    ),
    figure("specular", "edge sampling and warped area as a glossy lobe narrows", 5.0, specular::draw),
    figure("chains", "an emitter in a curved mirror, which no list of edges finds", 3.0, chains::draw),
    figure("path-bias", "bias and variance along paths, for shadows and two bounces", 8.0, path_bias::draw),
    figure("mesh", "a mesh in a room, and the gradient image of its motion, term by term", 8.0, mesh::draw),
    figure(
        "motions",
        "variance and bias of every method on cylinders and foliage that rotate",
        20.0,
        motions::draw,
    ),
    study(
        "poses",
        "poses found by descending gradients, from several starts, by every method",
        10.0,
        poses::draw,
        (poses::TEXT, poses::live),
    ),
    study(
        "views",
        "meshes from their rendered views, by large steps down unbiased gradients",
        10.0,
        views::draw,
        (views::TEXT, views::live),
    ),
    study(
        "together",
        "pose, paint, lamp and floor of one scene from two pictures",
        5.0,
        together::draw,
        (together::TEXT, together::live),
    ),
    figure("implicit", "implicit shapes: fields from the points of sphere tracing", 3.0, implicit::draw),
    figure(
        "levels",
        "every field of an implicit surface in space, its bias and its price",
        10.0,
        levels::draw,
    ),
    study(
        "surfaces",
        "implicit surfaces from their views, and what topology does to it",
        10.0,
        surfaces::draw,
        (surfaces::TEXT, surfaces::live),
    ),
    study(
        "masks",
        "a neural surface from pictures alone, and with masks, good and bad (IDR)",
        10.0,
        masks::draw,
        (masks::TEXT, masks::live),
    ),
];
