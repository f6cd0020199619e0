//! Random cases of three dimensions: generic by what happens in them, and degenerate in a named way.
//!
//! A case is built from its knobs by `build`; `random` draws the knobs from a seed, and
//! [`coverage`](coverage()) and [`irradiance`](irradiance()) draw the kind from it as well. All
//! cases have a derivative. A derivative with respect to θ in which lengths move is per unit of θ:
//! velocities are proportional to the size of the world, so that cases of all sizes have
//! derivatives of order one.

mod coverage;
mod dice;
mod irradiance;
mod moves;
mod solids;

pub use coverage::{CoverageCase, CoverageKind, CoverageKnobs, CoverageMoving};
pub use irradiance::{IrradianceCase, IrradianceKind, IrradianceKnobs, IrradianceMoving};

/// A case of [`crate::space::coverage`], of any kind, with any motion and filter.
#[must_use]
pub fn coverage(seed: u64) -> CoverageCase {
    CoverageKnobs::any(seed).build()
}

/// A case of [`crate::space::irradiance`], of any kind, with any motion.
#[must_use]
pub fn irradiance(seed: u64) -> IrradianceCase {
    IrradianceKnobs::any(seed).build()
}
