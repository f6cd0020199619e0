//! Reverse mode: numbers recorded on a tape, and the propagation of their adjoints to parameters.

mod mode;
mod scatter;

pub(in crate::gradient) use self::mode::{Inputs, Recorded, Reverse};
