//! Random cases in three dimensions: generic by content, and degenerate in a named way.
//!
//! A case is built from its knobs by `build`; `random` draws the knobs of a kind from a seed. All cases have
//! a derivative. Velocities are proportional to the size of the world, so that derivatives with respect to θ
//! are of order one for worlds of all sizes.

mod coverage;
mod crossing;
mod direct;
mod irradiance;
mod lit_crossing;
mod moves;
mod solids;
mod stage;

pub use coverage::{CoverageCase, CoverageKind, CoverageKnobs, CoverageMoving};
pub use crossing::{CrossingKind, CrossingKnobs, CrossingMoving};
pub use direct::{DirectCase, DirectKind, DirectKnobs, DirectMoving};
pub use irradiance::{IrradianceCase, IrradianceKind, IrradianceKnobs, IrradianceMoving};
pub use lit_crossing::{LitCrossing, LitCrossingKind, LitCrossingMoving};
