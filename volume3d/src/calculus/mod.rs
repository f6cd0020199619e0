//! Derivatives of programs: what a sample computes is written once, over numbers that may carry derivatives.

mod context;
mod number;
mod tape;
mod vector;

pub(crate) use context::{Calculus, CameraMotion, Frame, Kernel, Sees, Warped};
pub(crate) use number::{Dual, Number};
pub(crate) use tape::{Adjoints, Tape, Variable};
pub(crate) use vector::{Rgb, Vec3};
