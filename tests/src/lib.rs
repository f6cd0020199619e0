//! What the integration tests of the workspace share: an independent oracle, random scenes, and the
//! statistics of unbiasedness.
//!
//! - [`campaign`]: estimates and exact values over many scenes.
//! - [`comparison`]: a number that is found beside what it should be.
//! - [`effort`]: how much the statistical tests spend.
//! - [`mutations`]: mistakes that the tests must notice, and how they are put into a copy of the code.
//! - [`oracle`]: pixels of a plane scene and their derivatives by a slab decomposition in dual
//!   numbers, sharing no code with [`flatland::plane::exact`].
//! - [`power`]: the smallest bias that a test rejects.
//! - [`quadrature`]: Gauss–Legendre rules.
//! - [`results`]: the tables of `RESULTS.md`, which tests fill.
//! - [`scenes`]: random scenes, generic, degenerate and not differentiable.
//! - [`space`]: the same in three dimensions: coverage, crossings, irradiance, direct light and constants.
//! - [`statistics`]: z-tests with corrected thresholds, and rates on log–log data.
//! - [`transport`]: the same for flat worlds in which light is scattered.
//!
//! Where a test would fail, functions of this crate panic: at scenes that are refused, at numbers that are not finite,
//! and at arguments that do not belong together.

#![allow(
    clippy::must_use_candidate,
    reason = "nearly all of these functions are pure, and saying so at each says nothing"
)]

pub mod campaign;
mod choices;
pub mod comparison;
mod dice;
mod double_double;
mod dual;
pub mod effort;
pub mod mutations;
pub mod oracle;
pub mod power;
pub mod quadrature;
pub mod results;
pub mod scenes;
pub mod space;
pub mod statistics;
pub mod transport;
#[cfg(test)]
mod worst;

/// The README's examples compile and run.
#[cfg(doctest)]
#[doc = include_str!("../../README.md")]
struct Readme;
