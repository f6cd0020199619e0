//! Shared support of the workspace's integration tests: an independent oracle, random scenes, and statistics
//! of unbiasedness.
//!
//! - [`campaign`]: estimates and exact values over many scenes.
//! - [`comparison`]: comparison of an estimate with its reference.
//! - [`effort`]: the effort of the statistical tests.
//! - [`mutations`]: mistakes that the tests must notice, and how they are put into a copy of the code.
//! - [`oracle`]: pixels of a plane scene and their derivatives by a slab decomposition in dual
//!   numbers, sharing no code with [`flatland::plane::exact`].
//! - [`chains`]: random worlds with mirrors, glass, openings and lights without extent.
//! - [`power`]: the smallest bias that a test rejects.
//! - [`quadrature`]: Gauss–Legendre rules.
//! - [`results`]: the tables of `RESULTS.md`, which tests fill.
//! - [`scenes`]: random scenes, generic, degenerate and not differentiable.
//! - [`space`]: the counterpart in three dimensions: coverage, crossings, irradiance, direct light and
//!   constants.
//! - [`statistics`]: z-tests with corrected thresholds, and rates on log–log data.
//! - [`transport`]: the counterpart for flat worlds with scattered light.
//!
//! Functions of this crate panic where a test would fail: on refused scenes, on numbers that are not finite,
//! and on inconsistent arguments.

#![allow(
    clippy::must_use_candidate,
    reason = "nearly all of these functions are pure, and saying so at each says nothing"
)]

pub mod campaign;
pub mod chains;
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
