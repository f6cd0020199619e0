//! Shapes with a closed-form distance.

mod knot;
mod rounded_box;
mod torus;

pub use flatland::sdf::shapes::{
    Ball, Complement, Parametric, ShapeError, SmoothDifference, SmoothIntersection, SmoothUnion,
    smooth_difference, smooth_intersection,
};
pub use knot::Knot;
pub use rounded_box::RoundedBox;
pub use torus::Torus;

#[cfg(test)]
mod tests;
