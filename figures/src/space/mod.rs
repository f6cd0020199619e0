//! Shared parts of the figures and the comparison in space: the table of methods, their measurements,
//! pictures.

pub(crate) mod chamfer;
mod clock;
mod methods;
pub(crate) mod picture;
pub(crate) mod reconstruction;
mod runs;
pub(crate) mod studio;
pub(crate) mod target;

pub(crate) use clock::{Clock, ThreadClock};
pub(crate) use methods::{METHODS, Method, Task};
pub(crate) use runs::{Compared, Reference};
