//! Scenes: what they are made of, and what rendering needs of them.

mod adjacency;
mod build;
mod camera;
mod check;
mod crossing;
mod crossing_shapes;
mod description;
mod error;
mod hit;
mod light;
mod material;
mod names;
mod normals;
mod rays;
mod span;
mod surface;
mod texture;
mod triangle;
mod update;

pub(crate) use adjacency::{Beyond, FLAT};
pub use build::Scene;
pub use camera::{Camera, Crop, Film, Filter};
pub use crossing_shapes::{CrossingCount, Overlap};
pub use description::{Description, Integrator, Shape};
pub use error::SceneError;
pub(crate) use hit::{Hit, MaterialPoint, Surface};
pub use light::{Environment, Light};
pub use material::{Bsdf, Material, Microfacets, Reflectance};
pub(crate) use names::Emitter;
pub use names::NameError;
pub(crate) use rays::SHORT;
pub(crate) use span::Span;
pub use texture::{Texture, Wrap};
pub(crate) use triangle::{NONE, Triangle};
