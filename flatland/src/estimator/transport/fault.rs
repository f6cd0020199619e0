//! Deliberate mistakes, as negative controls of tests.

/// A mistake that makes the gradient wrong, as a negative control.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
    /// No warp of the directions at this surface of the path and all later ones; 0 is the first.
    NoWarpFrom {
        /// Index of the surface.
        surface: usize,
    },
    /// No residual of a softened field.
    NoResidual,
    /// Residual omitted on the side of the ending segment, whether or not its ends are followed there.
    OneSided,
    /// Densities of directions are differentiated along with the integrand.
    AttachedDensity,
}
