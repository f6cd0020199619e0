//! Meshes and the tracing of rays.

mod accelerator;
mod edges;
mod meeting;
mod mesh;

pub use accelerator::{Accelerator, Hit, Ray};
pub use edges::{Edges, HalfEdge};
pub(crate) use meeting::{End, Meeting, meeting};
pub use mesh::{Attribute, Mesh, MeshError, Normals};
