//! Implicit surfaces in space.
//!
//! A surface is where a function φ is 0; φ is positive outside. What a tracer and the warp fields ask of φ is
//! [`flatland::sdf::Sdf`]; balls and their smooth unions are in [`flatland::sdf::shapes`].
//!
//! - [`Grid`]: node values on a regular grid, whose interpolation is φ and which are its parameters.
//! - [`from_mesh()`]: the grid of signed distances to a triangle mesh.

mod from_mesh;
mod grid;

pub use from_mesh::{MeshDistanceError, MeshDistances, from_mesh};
pub use grid::{Grid, GridError, Interpolation};
