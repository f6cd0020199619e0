//! The figures, one file each, in the order of the story.

mod attempts;
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

/// A figure.
pub(crate) struct Figure {
    /// The figure's name on the command line.
    pub(crate) name: &'static str,
    /// A short description.
    pub(crate) about: &'static str,
    /// Measures, writes its files and explains it.
    pub(crate) draw: fn(&Context) -> anyhow::Result<Section>,
}

const fn figure(
    name: &'static str,
    about: &'static str,
    draw: fn(&Context) -> anyhow::Result<Section>,
) -> Figure {
    Figure { name, about, draw }
}

/// All figures in the order of their numbers, from 1 on.
pub(crate) const ALL: [Figure; 18] = [
    figure("fields", "every construction of the warp field on one scene", fields::draw),
    figure("attempts", "the three attempts along a line across a silhouette", attempts::draw),
    figure("forms", "Reynolds, divergence and reparameterised forms of one derivative", forms::draw),
    figure("edges", "edge sampling and warped area as a scene grows", edges::draw),
    figure("trade", "bias, variance and time: the trade", trade::draw),
    figure("drawing", "a real drawing and its gradient image", drawing::draw),
    figure(
        "transport",
        "a flat world, a path with its rays, and the derivative of a shadow",
        transport::draw,
    ),
    figure("specular", "edge sampling and warped area as a glossy lobe narrows", specular::draw),
    figure("implicit", "implicit shapes: fields from the points of sphere tracing", implicit::draw),
    figure("path-bias", "bias and variance along paths, for shadows and two bounces", path_bias::draw),
    figure("mesh", "a mesh in a room, and the gradient image of its motion, term by term", mesh::draw),
    figure(
        "motions",
        "variance and bias of every method on cylinders and foliage that rotate",
        motions::draw,
    ),
    figure("poses", "poses found by descending gradients, from several starts, by every method", poses::draw),
    figure("views", "meshes from their rendered views, by large steps down unbiased gradients", views::draw),
    figure("together", "pose, paint, lamp and floor of one scene from two pictures", together::draw),
    figure("surfaces", "implicit surfaces from their views, and what topology does to it", surfaces::draw),
    figure("masks", "a neural surface from pictures alone, and with masks, good and bad (IDR)", masks::draw),
    figure("levels", "every field of an implicit surface in space, its bias and its price", levels::draw),
];
