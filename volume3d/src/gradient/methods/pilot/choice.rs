//! What is asked of a pilot, and its choice.

use super::method::Method;
use super::reason::Reason;

/// Chooses between unbiased methods, and splits their samples.
///
/// ```no_run
/// # use volume3d::{gradient::{Pilot, Progress, Tangent}, scene::Scene};
/// # fn f(scene: &Scene, change: &Tangent) -> Result<(), Box<dyn std::error::Error>> {
/// let choice = Pilot { samples: 64, seed: 1 }.for_change(scene, change, &Progress::none())?;
/// let image = choice.method.forward(scene, change, &Progress::none())?;
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Copy, Debug)]
pub struct Pilot {
    /// Budget: samples per pixel of [`WarpedArea::default`](crate::gradient::WarpedArea) that take about as
    /// long as the chosen method. The pilot itself takes the time of about 8 to 32 more, or of an eighth of
    /// the budget if that is more.
    pub samples: usize,
    /// Seed of the chosen method, from which the pilot's own is derived.
    pub seed: u64,
}

/// A pilot's choice, and the reasons.
#[derive(Clone, Debug)]
pub struct Choice {
    /// The chosen method: the softened field, unless another one's expected error is lower by more than the
    /// pilot's uncertainty.
    pub method: Method,
    /// All candidates, the chosen one first. Empty if there was no choice; without edge sampling if a surface
    /// is not diffuse.
    pub candidates: Vec<Candidate>,
    /// Whether listing all edges would have taken more than a quarter of the time of the method: then there
    /// were no trials, and the exact mean is used.
    pub in_haste: bool,
    /// Whether the expected error of the method is as large as everything that any trial found: the choice is
    /// then a guess, and so is the result.
    pub is_lost: bool,
}

/// A method with its best split.
#[derive(Clone, Debug)]
pub struct Candidate {
    /// The method.
    pub method: Method,
    /// Expected squared error: the sum over pixels and channels, weighted by the squared adjoint.
    pub expected_squared_error: f64,
    /// Its shares: area, curves on the film, curves before lights seen from shading points, and curves before
    /// everything else.
    pub shares: [f64; 4],
    /// Why it was not chosen, if its expected error is lower than that of a preferred method.
    pub reason: Option<Reason>,
}

/// Least number of area samples of a pilot: a variance takes two.
pub(super) const FEWEST: usize = 2;
