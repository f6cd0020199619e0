//! Tests of the accelerator's guarantees.

mod exact;
mod meshes;
mod refit;
mod sheaf;
mod watertight;
