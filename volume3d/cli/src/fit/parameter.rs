//! A fitted parameter and its optimiser.

use anyhow::bail;
use serde::Deserialize;
use volume3d::optimize::Adam;

use super::numbers::numbers;

#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ParameterConfig {
    /// The name; the first of `tie` unless given.
    #[serde(default)]
    pub(super) name: String,
    /// Parameters with the same values.
    #[serde(default)]
    pub(super) tie: Vec<String>,
    pub(super) rate: f64,
    #[serde(default)]
    pub(super) uniform: bool,
    pub(super) large_steps: Option<f64>,
    #[serde(default)]
    pub(super) redistance: bool,
    #[serde(default)]
    pub(super) refine: Vec<u64>,
    pub(super) finish: Option<u64>,
    #[serde(default = "beta1")]
    pub(super) beta1: f64,
    #[serde(default = "beta2")]
    pub(super) beta2: f64,
    pub(super) clamp: Option<f64>,
    #[serde(default, deserialize_with = "numbers")]
    pub(super) bounds: Option<[f64; 2]>,
    #[serde(default, deserialize_with = "numbers")]
    pub(super) pivot: Option<[f64; 3]>,
    pub(super) start: Option<Vec<f64>>,
    /// The largest distance of other starts from this one.
    pub(super) spread: Option<f64>,
}

impl ParameterConfig {
    /// Refuses values out of range and keys that exclude one another, for a fit of `steps` steps.
    pub(super) fn check(&self, steps: u64) -> anyhow::Result<()> {
        let Self { name, rate, large_steps, redistance, refine, finish, bounds, .. } = self;
        if name.is_empty() {
            bail!(
                "a [[parameter]] has no name: name = \"WHAT.PARAMETER\", or tie = [\"WHAT.PARAMETER\", \"WHAT.PARAMETER\"]"
            );
        }
        if !(*rate > 0.0 && rate.is_finite()) {
            bail!(
                "the rate of `{name}` is {rate}, but must be positive: the approximate size of a step in units of the \
                 parameter, such as 0.02"
            );
        }
        if let Some([low, high]) = bounds
            && (low.is_nan() || high.is_nan() || low > high)
        {
            bail!("the bounds of `{name}` are {low} and {high}, but must be in order");
        }
        for (key, beta) in [("beta1", self.beta1), ("beta2", self.beta2)] {
            if !(0.0..1.0).contains(&beta) {
                bail!("{key} of `{name}` is {beta}, but must be from 0 to below 1");
            }
        }
        if let Some(clamp) = self.clamp
            && !(clamp > 0.0 && clamp.is_finite())
        {
            bail!("the clamp of `{name}` is {clamp}, but must be positive");
        }
        if let Some(spread) = self.spread
            && !(spread >= 0.0 && spread.is_finite())
        {
            bail!("the spread of `{name}` is {spread}, but must not be negative");
        }
        if self.pivot.is_some_and(|pivot| pivot.iter().any(|x| !x.is_finite())) {
            bail!("the pivot of `{name}` is not finite");
        }
        let is_grid = name.ends_with(".sdf");
        if *redistance && !is_grid {
            bail!("redistance applies to the sdf of a grid, not to `{name}`");
        }
        if !refine.is_empty() && !is_grid {
            bail!("refine applies to the sdf of a grid or network, not to `{name}`");
        }
        let last = refine.last().is_some_and(|step| *step >= steps);
        if refine.first() == Some(&0) || last || !refine.is_sorted_by(|a, b| a < b) {
            bail!(
                "refine of `{name}` is {refine:?}, but must be step numbers in increasing order, from 1 to {}",
                steps - 1
            );
        }
        if let Some(finish) = finish {
            if !is_grid {
                bail!("finish applies to the sdf of a network, not to `{name}`");
            }
            let least = refine.last().map_or(1, |step| step + 1);
            if !(least..steps).contains(finish) {
                bail!(
                    "finish of `{name}` is {finish}, but must be a step number from {least} to {}",
                    steps - 1
                );
            }
        }
        if large_steps.is_some() && !is_grid && !name.ends_with(".vertex_positions") {
            bail!("large_steps applies to vertex_positions and the sdf of a grid, not to `{name}`");
        }
        if let Some(lambda) = large_steps
            && is_grid
            && !(0.0..=1e6).contains(lambda)
        {
            bail!("large_steps of `{name}` is {lambda}, but must be from 0 to 1e6; 1 is usual");
        }
        Ok(())
    }

    /// The names of all parameters with these values.
    pub(super) fn names(&self) -> Vec<&str> {
        let others = self.tie.iter().filter(|name| **name != self.name);
        std::iter::once(&self.name).chain(others).map(String::as_str).collect()
    }
}

fn beta1() -> f64 {
    Adam::new(1.0).beta1
}

fn beta2() -> f64 {
    Adam::new(1.0).beta2
}
