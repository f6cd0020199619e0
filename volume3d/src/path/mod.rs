//! Path tracer: one implementation for the primal image and, over numbers with derivatives, for gradients.

mod bsdf;
mod calculus;
mod chain;
mod emission;
mod emitter;
mod environment;
mod free_flight;
mod integrator;
mod kernels;
mod lights;
mod map;
mod media;
mod next_event;
mod normal_map;
mod plain;
mod restart;
mod scattered;
mod sequence;
mod spot;
mod still;
mod surface;
mod texture;
mod wave;

pub(crate) use bsdf::{Bounce, Branch, Shading};
pub(crate) use calculus::{BorderSample, Calculus, CameraMotion, Frame, Kernel, VisibilityDomain, Warped};
pub(crate) use chain::Parts;
pub(crate) use emission::radiance_at;
pub(crate) use integrator::Paths;
pub use kernels::Kernels;
pub(crate) use lights::LightId;
pub(crate) use plain::Plain;
pub(crate) use sequence::{Draws, PreparedSequence, Sequence};
pub(crate) use surface::SurfacePoint;
pub(crate) use wave::{Wave, WaveTables};
