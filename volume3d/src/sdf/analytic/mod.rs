//! Shapes whose distance is a formula.

mod rounded_box;
mod torus;

pub use flatland::sdf::shapes::{Ball, Parametric, ShapeError, SmoothUnion};
pub use rounded_box::RoundedBox;
pub use torus::Torus;

#[cfg(test)]
mod tests;
