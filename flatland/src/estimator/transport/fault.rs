//! Deliberate mistakes, as negative controls of tests.

/// A mistake that makes the gradient wrong, as a negative control.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
    /// No warp of the directions at this surface of the path and at all after it; 0 is the first.
    NoWarpFrom {
        /// The surface.
        surface: usize,
    },
    /// Nothing of what a softened field leaves to the boundary.
    NoResidual,
    /// No residual on the side of a segment that ends, whether or not its ends are followed there.
    OneSided,
    /// The densities of directions are differentiated along with the integrand.
    AttachedDensity,
}
