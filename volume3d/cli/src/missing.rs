//! `--allow-missing`, and what is said of what is left out.

use clap::ValueEnum;
use volume3d::gradient::{Missing, Unsupported};

/// A kind of jump, as `--allow-missing` names it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(super) enum Kind {
    /// What moves in ideal mirrors and smooth coatings.
    Mirror,
    /// What moves behind glass and in its reflection, and behind what is partly transparent.
    Transmission,
    /// Where normals that a bump or normal map tilts turn away.
    Relief,
    /// Shadows of points, spots and projectors, and the borders of their beams.
    PointLight,
    /// Shadows of parallel light.
    ParallelLight,
}

impl From<Kind> for Missing {
    fn from(kind: Kind) -> Self {
        match kind {
            Kind::Mirror => Self::Mirror,
            Kind::Transmission => Self::Transmission,
            Kind::Relief => Self::Relief,
            Kind::PointLight => Self::PointLight,
            Kind::ParallelLight => Self::ParallelLight,
        }
    }
}

/// A line for everything whose jumps stand still.
pub(super) fn left_out(all: &[Unsupported]) -> String {
    let line = |what: &Unsupported| {
        let jumps = match what {
            Unsupported::Mirror { shape, material } => {
                format!(
                    "jumps seen in material `{material}` of shape `{shape}`, which reflects as an ideal mirror"
                )
            }
            Unsupported::Transmission { shape, material } => {
                format!(
                    "jumps seen by light that material `{material}` of shape `{shape}` passes or reflects"
                )
            }
            Unsupported::Relief { shape, material } => {
                format!("where the map of material `{material}` of shape `{shape}` turns normals away")
            }
            Unsupported::Delta { light } => format!("the shadows of point light `{light}`"),
            Unsupported::Beam { light } => format!("the border of the beam of `{light}`"),
            Unsupported::Parallel { light } => format!("the shadows of parallel light `{light}`"),
            other => other.to_string(),
        };
        format!("LEFT OUT (--allow-missing), so that the derivative is not whole: the motion of {jumps}\n")
    };
    all.iter().map(line).collect()
}
