//! Meshes, ray tracing, and distances.

mod accelerator;
mod curved;
mod edge_contact;
mod edges;
mod facing;
mod flat;
mod meeting;
mod mesh;
mod proximity;

pub use accelerator::{Accelerator, Goal, Hit, Ray, Shadows, Sheaf};
pub use curved::TOLERANCE;
pub(crate) use edge_contact::{Stretch, common_stretches, upon_face};
pub use edges::{Edges, HalfEdge};
pub(crate) use meeting::{End, Meeting, ROUNDING, in_contact, meeting, parts, within};
pub use mesh::{Attribute, Mesh, MeshError, Normals};
pub use proximity::Proximity;
pub(crate) use proximity::{closest_point, solid_angle};
