//! Test support in three dimensions: worlds of triangles and polygons with known answers.
//!
//! - [`campaign`]: estimates and exact values over many scenes.
//! - [`constants`]: furnaces, uniform environments and form factors in closed form.
//! - [`coverage`]: primary visibility of meshes of constant radiance: pixels and their derivatives,
//!   exact, as a scene of the plane.
//! - [`crossing`]: scenes whose triangles pass through one another, with exact derivatives.
//! - [`direct`]: pixels of a diffuse ground in such light, by adaptive quadrature.
//! - [`irradiance`]: direct light from polygons past polygons, by Lambert's formula in dual numbers.
//! - [`scenes`]: the same worlds as scenes of `volume3d`.
//! - [`worlds`]: random cases of both, generic and degenerate.
//!
//! Only [`campaign`] and [`scenes`] depend on a renderer; everything else maps plain data to numbers.

pub mod campaign;
pub mod constants;
pub mod coverage;
pub mod crossing;
pub mod direct;
pub mod irradiance;
pub mod scenes;
pub mod worlds;
