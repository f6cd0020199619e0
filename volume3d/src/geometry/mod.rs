//! Meshes and the tracing of rays.

mod accelerator;
mod edges;
mod mesh;

pub use accelerator::{Accelerator, Hit, Ray};
pub(crate) use edges::{Edges, Jumps};
pub use mesh::{Attribute, Mesh, MeshError, Normals};
