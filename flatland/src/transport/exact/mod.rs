//! Exact images of flat worlds, and their exact derivatives.
//!
//! From every point the half circle of directions is cut where the visible segment changes ([`View`]). Over
//! such an [`Interval`] direct light has a closed form, for diffuse surfaces and for the glossy lobe
//! ([`Surface`]), and its derivative is an interior term plus a sum over the intervals' ends. A pixel is
//! integrated between the places where two vertices are seen in one direction ([`Exact`]).

mod critical;
mod direct;
mod error;
mod lobe;
mod partition;
mod pixels;
mod radiosity;
mod visible;

#[cfg(test)]
mod tests;

pub use direct::{RadianceRate, Surface, SurfaceMotion};
pub use error::ExactError;
pub use pixels::{Exact, Integrated};
pub use radiosity::Radiosity;
pub use visible::{End, Interval, View};
