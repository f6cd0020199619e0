//! Measured numbers with standard errors.

/// A number with its standard error.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Ratio {
    pub(crate) value: f64,
    pub(crate) error: f64,
}

impl Ratio {
    /// The mean of independent runs.
    pub(crate) fn of_runs(values: &[f64]) -> Self {
        let count = values.len() as f64;
        let value = values.iter().sum::<f64>() / count;
        let squares: f64 = values.iter().map(|v| (v - value) * (v - value)).sum();
        Self { value, error: (squares / (count * (count - 1.0))).sqrt() }
    }

    /// The quotient of two independent numbers, with the error to first order.
    pub(crate) fn over(self, other: Self) -> Self {
        let value = self.value / other.value;
        Self { value, error: value.abs() * (self.error / self.value).hypot(other.error / other.value) }
    }

    /// The number in another unit, whose factor has no error.
    pub(crate) fn scaled(self, factor: f64) -> Self {
        Self { value: factor * self.value, error: factor * self.error }
    }

    /// One standard error below and above.
    pub(crate) fn ends(self) -> [f64; 2] {
        [self.value - self.error, self.value + self.error]
    }

    /// "3.5 ± 0.6": as many digits as the error allows.
    pub(crate) fn shown(self) -> String {
        let digits = (1.0 - self.error.log10().floor()).clamp(0.0, 4.0) as usize;
        format!("{:.digits$} ± {:.digits$}", self.value, self.error).replace('-', "−")
    }
}
