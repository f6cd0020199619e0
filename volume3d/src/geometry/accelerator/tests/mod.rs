//! What the accelerator promises.

mod exact;
mod meshes;
mod watertight;
