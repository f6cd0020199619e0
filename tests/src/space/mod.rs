//! The test support of three dimensions: worlds of triangles and polygons whose answers are known.
//!
//! - [`constants`]: furnaces, uniform environments and form factors in closed form.
//! - [`coverage`]: primary visibility of meshes of constant radiance: pixels and their derivatives,
//!   exact, as a scene of the plane.
//! - [`direct`]: pixels of a diffuse ground in such light, by adaptive quadrature.
//! - [`irradiance`]: direct light from polygons past polygons, by Lambert's formula in dual numbers.
//! - [`worlds`]: random cases of both, generic and degenerate.
//!
//! Plain data in, numbers out; nothing here knows a renderer.

pub mod constants;
pub mod coverage;
pub mod direct;
pub mod irradiance;
mod vector;
pub mod worlds;
