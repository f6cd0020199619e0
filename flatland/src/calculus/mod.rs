//! Differentiable numbers: an integrand is written once, over numbers that may carry derivatives.
//!
//! - `f64` is the primal;
//! - [`Dual`] is a number with its derivatives along a few directions: forward mode;
//! - [`Variable`] records its operations on a [`Tape`], which is swept backwards for the derivative by every
//!   input at once: reverse mode.
//!
//! Their values are computed by the same operations in the same order, and have the same bits. This module is
//! independent of scenes, dimensions and pixels.
//!
//! # Example
//!
//! d(x²y) at (3, 2), along x and y forward, and by both in reverse.
//!
//! ```
//! use flatland::calculus::{Dual, Number, Tape};
//!
//! fn volume<T: Number>(x: T, y: T) -> T {
//!     x.squared() * y
//! }
//!
//! let forward = volume(Dual::new(3.0, [1.0, 0.0]), Dual::new(2.0, [0.0, 1.0]));
//! assert_eq!((forward.value, forward.tangent), (18.0, [12.0, 9.0]));
//!
//! let tape = Tape::new();
//! let [x, y] = tape.inputs("x and y", [3.0, 2.0]);
//! let mut found = vec![];
//! tape.sweep(&[(volume(x, y), 1.0)], &mut vec![], |_, adjoints, _| found = adjoints.to_vec());
//! assert_eq!(found, [12.0, 9.0]);
//! ```

mod number;
mod tape;
mod vector;

pub use number::{Dual, Number};
pub use tape::{Adjoint, Adjoints, Tape, Variable};
pub use vector::{Rgb, Vec2, Vec3};
