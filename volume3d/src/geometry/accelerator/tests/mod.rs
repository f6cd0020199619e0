//! What the accelerator promises.

mod exact;
mod meshes;
mod refit;
mod sheaf;
mod watertight;
