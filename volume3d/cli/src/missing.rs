//! `--allow-missing`, and the lines about what is left out.

use clap::ValueEnum;
use volume3d::gradient::{Missing, Unsupported};

/// A kind of discontinuity that `--allow-missing` leaves out.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(super) enum Kind {
    /// Discontinuities reflected by ideal mirrors and smooth coatings.
    Mirror,
    /// Discontinuities seen through or reflected by glass, or seen through partly transparent surfaces.
    Transmission,
    /// Curves on bump- or normal-mapped surfaces where the shading normal turns away.
    Relief,
    /// Shadows of point lights, spots and projectors, and the borders of their beams.
    PointLight,
    /// Shadows of parallel lights.
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

/// A line for each kind of discontinuity whose motion is left out.
pub(super) fn left_out(all: &[Unsupported]) -> String {
    let line = |what: &Unsupported| {
        let discontinuities = match what {
            Unsupported::Mirror { shape, material } => {
                format!(
                    "discontinuities reflected by material `{material}` of shape `{shape}`, an ideal mirror"
                )
            }
            Unsupported::Transmission { shape, material } => {
                format!(
                    "discontinuities seen by light that material `{material}` of shape `{shape}` transmits or reflects"
                )
            }
            Unsupported::Relief { shape, material } => {
                format!("curves where the map of material `{material}` of shape `{shape}` turns normals away")
            }
            Unsupported::Delta { light } => format!("the shadows of point light `{light}`"),
            Unsupported::Beam { light } => format!("the border of the beam of `{light}`"),
            Unsupported::Parallel { light } => format!("the shadows of parallel light `{light}`"),
            other => other.to_string(),
        };
        format!(
            "LEFT OUT (--allow-missing), so that the derivative is incomplete: the motion of {discontinuities}\n"
        )
    };
    all.iter().map(line).collect()
}
