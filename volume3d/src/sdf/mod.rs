//! Implicit surfaces in space.
//!
//! A surface is where a function φ is 0; φ is positive outside. What a tracer and the warp fields ask of φ is
//! [`flatland::sdf::Sdf`]; balls and their smooth unions are in [`flatland::sdf::shapes`].
//!
//! - [`Grid`]: node values on a regular grid, whose interpolation is φ and which are its parameters.

mod grid;

pub use grid::{Grid, GridError, Interpolation};
