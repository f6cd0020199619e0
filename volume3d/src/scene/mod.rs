//! Scenes: what they are made of, and what rendering needs of them.

mod build;
mod camera;
mod check;
mod crossing;
mod description;
mod light;
mod material;
mod normals;
mod span;
mod texture;

pub(crate) use build::{NONE, Triangle};
pub use build::{Scene, SceneError};
pub use camera::{Camera, Crop, Film, Filter};
pub use crossing::{CrossingCount, Overlap};
pub use description::{Description, Integrator, Shape};
pub use light::{Environment, Light};
pub use material::{Bsdf, Material, Microfacets, Reflectance};
pub(crate) use span::Span;
pub use texture::{Texture, Wrap};
