//! Shapes whose distance is a formula.

mod rounded_box;
mod torus;

pub use flatland::sdf::shapes::{Ball, Parametric, ShapeError, SmoothUnion};
pub use rounded_box::RoundedBox;
pub use torus::Torus;

/// Refuses what is not finite, or not what `holds` says.
fn check(
    shape: &'static str,
    parameter: &'static str,
    value: f64,
    wanted: &'static str,
    holds: bool,
) -> Result<(), ShapeError> {
    let good = value.is_finite() && holds;
    if good { Ok(()) } else { Err(ShapeError::Parameter { shape, parameter, value, wanted }) }
}

#[cfg(test)]
mod tests;
