//! Film points moved by a warp.

/// A film point u + ε V(u), with the Jacobian 1 + ε ∇·V(u) of the change of variables.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FilmPoint<T> {
    pub(crate) at: [T; 2],
    pub(crate) jacobian: T,
}
