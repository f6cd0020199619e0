//! A number that is found beside what it should be.

use crate::power::Power;
use crate::statistics::Moments;

/// A mean and its standard error.
#[derive(Clone, Copy, Debug, Default)]
pub struct Estimate {
    /// The mean.
    pub mean: f64,
    /// Its standard error.
    pub standard_error: f64,
}

impl Estimate {
    /// Of a number that is known.
    pub fn exact(mean: f64) -> Self {
        Self { mean, standard_error: 0.0 }
    }

    /// From independent runs.
    pub fn of(runs: impl IntoIterator<Item = f64>) -> Self {
        let runs: Moments = runs.into_iter().collect();
        Self { mean: runs.mean(), standard_error: runs.standard_error() }
    }

    /// So many times it.
    pub fn scaled(self, factor: f64) -> Self {
        Self { mean: factor * self.mean, standard_error: factor.abs() * self.standard_error }
    }

    /// The sum with an independent one.
    pub fn plus(self, other: Self) -> Self {
        let standard_error = self.standard_error.hypot(other.standard_error);
        Self { mean: self.mean + other.mean, standard_error }
    }
}

/// Two numbers that should be one.
#[must_use]
#[derive(Clone, Copy, Debug)]
pub struct Comparison {
    /// What is found.
    pub found: Estimate,
    /// What it should be.
    pub reference: Estimate,
    /// How many standard errors of both they may be apart.
    pub limit: f64,
    /// What is allowed beside those.
    pub slack: f64,
}

impl Comparison {
    fn tolerance(&self) -> f64 {
        let error = self.found.standard_error.hypot(self.reference.standard_error);
        self.limit * error + self.slack
    }

    /// Whether they may be one number; NaN is none.
    fn agrees(&self) -> bool {
        (self.found.mean - self.reference.mean).abs() <= self.tolerance()
    }

    fn print(&self, label: &str, scale: f64) {
        let Self { found, reference, .. } = self;
        let error = found.standard_error.hypot(reference.standard_error);
        let z = (found.mean - reference.mean) / error;
        println!("{label}: {found:?} for {reference:?}, z {z:.2}, rejects {:.2e}", self.tolerance() / scale);
    }

    /// Asserts that they agree, and that an estimate with the same error would not that is short by the bias
    /// that must be [noticed](Power::noticed). What could have been noticed is measured by `scale`: the
    /// reference, or what cancels in it.
    pub fn accept(&self, power: &mut Power, label: &str, scale: f64) {
        self.print(label, scale);
        assert!(self.agrees(), "{label}: {self:?}");
        let noticed = power.noticed();
        let bias = (noticed * scale.abs()).copysign(self.reference.mean);
        let less = Self { found: Estimate { mean: self.reference.mean - bias, ..self.found }, ..*self };
        assert!(!less.agrees(), "{label} would pass with a bias of {noticed}: {self:?}");
        power.add(label, self.tolerance(), scale);
    }

    /// Asserts that they do not agree, for all that both are numbers.
    pub fn reject(&self, label: &str) {
        self.print(&format!("control {label}"), self.reference.mean);
        assert!(self.found.mean.is_finite() && self.tolerance().is_finite(), "{label}: {self:?}");
        assert!(!self.agrees(), "the control {label} was not rejected: {self:?}");
    }
}
