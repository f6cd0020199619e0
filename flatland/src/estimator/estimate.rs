//! Result type of all estimators.

/// A mean over samples with its standard error: of every pixel in forward mode, of every parameter in reverse
/// mode.
#[derive(Clone, Debug, PartialEq)]
pub struct Estimate<M, E = M> {
    /// The mean.
    pub mean: M,
    /// Standard error of the mean; 0 if the mean is exact, NaN for a single sample. In reverse mode it is
    /// estimated from at most 16 independent batches of samples.
    pub standard_error: E,
    /// Number of rays traced; in the plane, of visibility queries.
    pub rays: u64,
    /// Number of rays that ran out of steps of a sphere tracer. They count as misses, which biases the mean.
    pub out_of_steps: u64,
    /// Non-finite samples, as (pixel, sample). They count as 0, which biases the mean.
    pub non_finite: Vec<(usize, usize)>,
}

impl<M, E> Estimate<M, E> {
    /// A result without samples.
    pub(super) fn exact(mean: M, standard_error: E) -> Self {
        Self { mean, standard_error, rays: 0, out_of_steps: 0, non_finite: vec![] }
    }

    /// The same samples, with mean and standard error in another form.
    pub(super) fn map<N, F>(self, form: impl FnOnce(M, E) -> (N, F)) -> Estimate<N, F> {
        let Self { mean, standard_error, rays, out_of_steps, non_finite } = self;
        let (mean, standard_error) = form(mean, standard_error);
        Estimate { mean, standard_error, rays, out_of_steps, non_finite }
    }
}
