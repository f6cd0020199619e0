//! The path tracer: one program for the primal and, over numbers with derivatives, for gradients.

mod bsdf;
mod calculus;
mod escape;
mod integrator;
mod lights;
mod plain;
mod sequence;
mod surface;

pub(crate) use bsdf::Shading;
pub(crate) use calculus::{Calculus, CameraMotion, Frame, Kernel, VisibilityDomain, Warped};
pub use integrator::Kernels;
pub(crate) use integrator::{Paths, SHORT};
pub(crate) use lights::LightId;
pub(crate) use plain::Plain;
pub(crate) use sequence::Sequence;
pub(crate) use surface::SurfacePoint;
