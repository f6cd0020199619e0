//! Implicit surfaces in space: shapes φ(x; θ) = 0, φ > 0 outside.
//!
//! [`flatland::sdf`] is independent of the dimension: its [`Sdf`](flatland::sdf::Sdf), [sphere
//! tracing](flatland::sdf::View) and [fields](flatland::sdf::fields) are used in space with
//! [`DVec3`](glam::DVec3) for points and [`Sphere`](crate::Sphere) for directions, as are its [balls, smooth
//! unions, intersections and differences](flatland::sdf::shapes). This module adds:
//!
//! - [`analytic`]: rounded boxes, rings and knots.
//! - [`Grid`]: node values on a regular grid, whose interpolation is φ and which are its parameters.
//! - [`from_mesh()`]: the grid of signed distances to a triangle mesh.
//! - [`redistance()`]: restores distances of a grid, with its surface preserved.
//! - [`isosurface()`]: the triangle mesh of any of them.
//! - [`network`]: φ as a neural network, whose weights are the parameters.
//! - [`Baked`]: a network baked to a grid, which is faster to trace, with the gradient by its weights.
//! - [`Guided`]: a network traced directly, accelerated by that grid.
//!
//! A scene accepts any of them, [`Description::add_implicit`](crate::scene::Description::add_implicit).

pub mod analytic;
mod bake;
mod from_mesh;
mod grid;
mod guided;
mod isosurface;
pub mod network;
mod redistance;

pub use bake::{BakeError, Baked};
pub use from_mesh::{MeshDistanceError, MeshDistances, from_mesh};
pub use grid::{Grid, GridError, Interpolation};
pub use guided::Guided;
pub use isosurface::{IsosurfaceError, isosurface};
pub use redistance::{RedistanceError, Slopes, redistance};
