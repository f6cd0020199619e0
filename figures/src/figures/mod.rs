//! The figures, one file each, in the order of the story.

mod attempts;
pub(crate) mod common;
mod drawing;
mod edges;
mod fields;
mod flat;
mod forms;
mod implicit;
mod mesh;
mod motions;
mod path_bias;
mod specular;
mod trade;
mod transport;

use crate::context::Context;
use crate::gallery::Section;

/// What the gallery opens with, in Markdown.
pub(crate) const INTRODUCTION: &str = include_str!("introduction.md");

/// A figure.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Name {
    Fields,
    Attempts,
    Forms,
    Edges,
    Trade,
    Drawing,
    Transport,
    Specular,
    Implicit,
    PathBias,
    Mesh,
    Motions,
}

impl Name {
    /// All figures in order.
    pub(crate) const ALL: [Self; 12] = [
        Self::Fields,
        Self::Attempts,
        Self::Forms,
        Self::Edges,
        Self::Trade,
        Self::Drawing,
        Self::Transport,
        Self::Specular,
        Self::Implicit,
        Self::PathBias,
        Self::Mesh,
        Self::Motions,
    ];

    /// Its number in the story, from 1 on.
    pub(crate) fn number(self) -> usize {
        self as usize + 1
    }

    /// What the progress bar calls it.
    pub(crate) fn title(self) -> &'static str {
        match self {
            Self::Fields => "1 warp fields",
            Self::Attempts => "2 three attempts",
            Self::Forms => "3 three forms of one derivative",
            Self::Edges => "4 edge sampling",
            Self::Trade => "5 bias, variance and time",
            Self::Drawing => "6 a real drawing",
            Self::Transport => "7 flat transport",
            Self::Specular => "8 a near-specular lobe",
            Self::Implicit => "9 implicit shapes",
            Self::PathBias => "10 bias along paths",
            Self::Mesh => "11 a mesh and its derivative",
            Self::Motions => "12 variance and bias in space",
        }
    }

    /// Draws it, writes its files and explains it.
    pub(crate) fn draw(self, context: &Context) -> anyhow::Result<Section> {
        match self {
            Self::Fields => fields::draw(context),
            Self::Attempts => attempts::draw(context),
            Self::Forms => forms::draw(context),
            Self::Edges => edges::draw(context),
            Self::Trade => trade::draw(context),
            Self::Drawing => drawing::draw(context),
            Self::Transport => transport::draw(context),
            Self::Specular => specular::draw(context),
            Self::Implicit => implicit::draw(context),
            Self::PathBias => path_bias::draw(context),
            Self::Mesh => mesh::draw(context),
            Self::Motions => motions::draw(context),
        }
    }
}
