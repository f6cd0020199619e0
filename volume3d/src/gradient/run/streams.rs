//! Random streams by purpose.
//!
//! Paths of an image, of a gradient and of finite differences are independent at
//! the same seed: the derivative of a loss is a product of image and gradient, whose mean is the product of
//! their means only if they share no sample.

pub(in crate::gradient) const PATH: u64 = 0;
pub(in crate::gradient) const GRADIENT_PATH: u64 = 5;
pub(in crate::gradient) const DIFFERENCE_PATH: u64 = 6;
pub(in crate::gradient) const AUXILIARY: u64 = 1;
pub(in crate::gradient) const EDGE: u64 = 2;
pub(in crate::gradient) const EDGE_AUXILIARY: u64 = 3;
pub(in crate::gradient) const SPLIT: u64 = 4;
/// Mixed into the seed of the control-variate image, which must not depend on the samples.
pub(in crate::gradient) const CONTROL_VARIATE: u64 = 0x9E37_79B9_7F4A_7C15;
