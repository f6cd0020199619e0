//! Deliberate mistakes, as negative controls of tests.

/// A mistake that makes the gradient wrong, as a negative control.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
    /// No warp of the directions at this surface of the path and at all after it; 0 is the first.
    NoWarpFrom {
        /// The surface.
        surface: usize,
    },
    /// The densities of directions are differentiated along with the integrand.
    AttachedDensity,
}
