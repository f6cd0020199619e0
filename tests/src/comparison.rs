//! Comparison of an estimate with its reference.

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
    /// An exact number, with standard error 0.
    pub fn exact(mean: f64) -> Self {
        Self { mean, standard_error: 0.0 }
    }

    /// Mean and standard error of independent runs.
    pub fn of(runs: impl IntoIterator<Item = f64>) -> Self {
        let runs: Moments = runs.into_iter().collect();
        Self { mean: runs.mean(), standard_error: runs.standard_error() }
    }

    /// The estimate times a factor.
    pub fn scaled(self, factor: f64) -> Self {
        Self { mean: factor * self.mean, standard_error: factor.abs() * self.standard_error }
    }

    /// The sum with an independent estimate.
    pub fn plus(self, other: Self) -> Self {
        let standard_error = self.standard_error.hypot(other.standard_error);
        Self { mean: self.mean + other.mean, standard_error }
    }
}

/// Two numbers that should be equal.
#[must_use]
#[derive(Clone, Copy, Debug)]
pub struct Comparison {
    /// The estimate under test.
    pub found: Estimate,
    /// The reference.
    pub reference: Estimate,
    /// Allowed difference, in combined standard errors.
    pub limit: f64,
    /// Allowance in addition to those.
    pub slack: f64,
}

impl Comparison {
    fn tolerance(&self) -> f64 {
        let error = self.found.standard_error.hypot(self.reference.standard_error);
        self.limit * error + self.slack
    }

    /// Whether the two are consistent; NaN is not.
    fn agrees(&self) -> bool {
        (self.found.mean - self.reference.mean).abs() <= self.tolerance()
    }

    fn print(&self, label: &str, scale: f64) {
        let Self { found, reference, .. } = self;
        let error = found.standard_error.hypot(reference.standard_error);
        let z = (found.mean - reference.mean) / error;
        println!("{label}: {found:?} for {reference:?}, z {z:.2}, rejects {:.2e}", self.tolerance() / scale);
    }

    /// Asserts that the two agree, and, as a control, that an estimate with the same error would not agree if
    /// it were short by the bias that must be [noticed](Power::noticed). Power is relative to `scale`: the
    /// reference, or the magnitude of the terms that cancel in it.
    pub fn accept(&self, power: &mut Power, label: &str, scale: f64) {
        self.print(label, scale);
        assert!(self.agrees(), "{label}: {self:?}");
        let noticed = power.noticed();
        let bias = (noticed * scale.abs()).copysign(self.reference.mean);
        let less = Self { found: Estimate { mean: self.reference.mean - bias, ..self.found }, ..*self };
        assert!(!less.agrees(), "{label} would pass with a bias of {noticed}: {self:?}");
        power.add(label, self.tolerance(), scale);
    }

    /// Asserts that the two do not agree although both are finite.
    pub fn reject(&self, label: &str) {
        self.print(&format!("control {label}"), self.reference.mean);
        assert!(self.found.mean.is_finite() && self.tolerance().is_finite(), "{label}: {self:?}");
        assert!(!self.agrees(), "the control {label} was not rejected: {self:?}");
    }
}
