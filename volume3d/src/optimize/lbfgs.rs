//! L-BFGS-B, for few parameters and little noise.

use std::cell::RefCell;

use basin::{
    BoxBounds, ConstraintDescription, ConstraintSet, ConstraintSolveError, Constraints, CostFunction,
    Executor, FirstOrderState, Gradient, Termination,
};

/// L-BFGS-B, the limited-memory method of Broyden, Fletcher, Goldfarb and Shanno with bounds (Byrd, Lu,
/// Nocedal and Zhu 1995): options of [`lbfgs`].
#[derive(Clone, Debug, PartialEq)]
pub struct Lbfgs {
    /// The length of the first step, in units of the parameters: about a tenth of the total change expected.
    /// Later steps follow from the gradients. Parameters of different units are best scaled beforehand, so
    /// that one length suits all.
    pub first_step: f64,
    /// Maximum number of evaluations of loss and gradient; 50 are enough for a pose.
    pub evaluations: usize,
    /// Convergence tolerance: the largest component of the gradient relative to the length of the first
    /// gradient. 10⁻³ is the accuracy that images allow, 10⁻⁶ is for closed forms.
    pub tolerance: f64,
    /// Lower and upper bound of each parameter, such as [`Chart::bounds`](super::Chart::bounds); empty for
    /// none.
    pub bounds: Vec<[f64; 2]>,
}

impl Lbfgs {
    /// No bounds, 50 evaluations and a tolerance of 10⁻³.
    #[must_use]
    pub fn new(first_step: f64) -> Self {
        Self { first_step, evaluations: 50, tolerance: 1e-3, bounds: vec![] }
    }

    fn check(&self, start: &[f64]) -> Result<(), &'static str> {
        if !(self.first_step > 0.0 && self.first_step.is_finite()) {
            return Err("the first step is not a positive length");
        }
        if self.evaluations == 0 {
            return Err("no evaluation is allowed");
        }
        if !(self.tolerance >= 0.0 && self.tolerance.is_finite()) {
            return Err("the tolerance is negative or not finite");
        }
        if !(self.bounds.is_empty() || self.bounds.len() == start.len()) {
            return Err("there are not as many bounds as parameters");
        }
        let within = |(x, [low, high]): (&f64, &[f64; 2])| low <= x && x <= high;
        if !start.iter().all(|x| x.is_finite()) || !start.iter().zip(&self.bounds).all(within) {
            return Err("the start is not finite, or out of its bounds");
        }
        Ok(())
    }
}

/// Result of [`lbfgs`].
#[derive(Clone, Debug, PartialEq)]
pub struct Minimum {
    /// The parameters of the lowest loss found.
    pub x: Vec<f64>,
    /// That loss.
    pub loss: f64,
    /// The number of evaluations of loss and gradient.
    pub evaluations: usize,
    /// The reason for termination.
    pub end: End,
}

/// Reason for termination of [`lbfgs`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum End {
    /// The gradient is within the tolerance, or the loss decreases only by rounding.
    Converged,
    /// All evaluations were used.
    Evaluations,
    /// No step along the search direction lowers the loss as its gradient predicts: the noise of the loss or
    /// of the gradient is as large as the remaining decrease. More samples help.
    Noise,
}

/// Errors of L-BFGS-B.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum LbfgsError<E> {
    /// An option is out of its range.
    #[error("L-BFGS cannot begin: {0}")]
    Options(&'static str),
    /// A loss or a gradient is not finite.
    #[error(
        "the {what} is not finite in evaluation {evaluation}, at the parameters {x:?}; shorten the first step, or set bounds"
    )]
    NotFinite {
        /// "loss" or "gradient".
        what: &'static str,
        /// The number of the evaluation, from 1.
        evaluation: usize,
        /// The parameters of the evaluation.
        x: Vec<f64>,
    },
    /// The evaluation has failed.
    #[error(transparent)]
    Evaluation(E),
}

/// Finds a minimum of a loss of few parameters, from its values and gradients.
///
/// `evaluate` returns loss and gradient at parameters x. Where Adam takes a hundred steps of a stated size,
/// this method estimates the curvature from successive gradients, and takes about as many steps as Newton's
/// method would. For many parameters, such as vertices, use [`Adam`](super::Adam) with
/// [`LargeSteps`](super::LargeSteps).
///
/// # Noise
/// A line search compares losses. If they are noisy, differences of the noise are taken for differences of
/// the loss, and where these are smaller than the noise the search ends, [`End::Noise`], or is misled.
/// Therefore draw **the same samples in every evaluation**: one seed for all images and one for all gradients
/// (common random numbers), not a seed for each step. The loss is then a deterministic function, though not
/// exactly the true one: its minimum is off by its noise, and its derivative is not quite the gradient, which
/// must still come from samples that are independent of the image's (as those of
/// [`render`](crate::gradient::render) and of a method at the same seed are). With fixed samples the loss is
/// also discontinuous where edges pass them; take many samples, and a loss without the image's own variance,
/// which falls as one over their number.
///
/// # Rotations
/// Rotations are not vectors, and [`Parameters::retract`](super::Parameters::retract) composes them: the
/// difference of two gradients is meaningless where each is by a turn of another rotation. Pass this function
/// the coordinates y of a [`Chart`](super::Chart), which is made for that.
///
/// ```
/// use volume3d::optimize::{End, Lbfgs, lbfgs};
///
/// // A long valley, from −1 to 3 along x and narrow in y.
/// let valley = |x: &[f64]| {
///     let (a, b) = (x[0] - 3.0, 100.0 * (x[1] - x[0]));
///     Ok::<_, std::convert::Infallible>((a * a + b * b, vec![2.0 * a - 200.0 * b, 200.0 * b]))
/// };
/// let options = Lbfgs { tolerance: 1e-9, ..Lbfgs::new(0.1) };
/// let minimum = lbfgs(&[-1.0, 0.0], &options, valley)?;
/// assert_eq!(minimum.end, End::Converged);
/// assert!((minimum.x[0] - 3.0).abs() < 1e-6 && minimum.evaluations < 20);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// [`LbfgsError::Evaluation`] returns the error of `evaluate`, [`LbfgsError::NotFinite`] reports a loss or
/// gradient that is not finite, and [`LbfgsError::Options`] options out of their range.
///
/// # Panics
/// If a gradient has another length than the start.
pub fn lbfgs<E>(
    start: &[f64],
    options: &Lbfgs,
    evaluate: impl FnMut(&[f64]) -> Result<(f64, Vec<f64>), E>,
) -> Result<Minimum, LbfgsError<E>> {
    options.check(start).map_err(LbfgsError::Options)?;
    let mut search = Search {
        evaluate,
        limit: options.evaluations,
        evaluations: 0,
        best: (f64::INFINITY, start.to_vec()),
        last: None,
    };
    let end = match search.descend(start, options) {
        Ok(end) => end,
        Err(Stop::Evaluations) => End::Evaluations,
        Err(Stop::Error(error)) => return Err(error),
    };
    let (loss, x) = search.best;
    Ok(Minimum { x, loss, evaluations: search.evaluations, end })
}

/// Early termination from within an evaluation.
enum Stop<E> {
    Evaluations,
    Error(LbfgsError<E>),
}

/// The caller's function and the state of the search.
struct Search<F> {
    evaluate: F,
    limit: usize,
    evaluations: usize,
    best: (f64, Vec<f64>),
    /// The last evaluation, which a solver may ask for again.
    last: Option<Evaluated>,
}

/// Loss and gradient at a point.
struct Evaluated {
    x: Vec<f64>,
    loss: f64,
    gradient: Vec<f64>,
}

impl<F, E> Search<F>
where
    F: FnMut(&[f64]) -> Result<(f64, Vec<f64>), E>,
{
    fn at(&mut self, x: &[f64]) -> Result<(f64, Vec<f64>), Stop<E>> {
        if let Some(known) = self.last.as_ref().filter(|last| last.x == x) {
            return Ok((known.loss, known.gradient.clone()));
        }
        if self.evaluations == self.limit {
            return Err(Stop::Evaluations);
        }
        self.evaluations += 1;
        let (loss, gradient) = (self.evaluate)(x).map_err(|e| Stop::Error(LbfgsError::Evaluation(e)))?;
        assert_eq!(gradient.len(), x.len(), "a gradient by all parameters");
        let finite = [("loss", loss.is_finite()), ("gradient", gradient.iter().all(|g| g.is_finite()))];
        if let Some((what, _)) = finite.into_iter().find(|(_, finite)| !finite) {
            let evaluation = self.evaluations;
            return Err(Stop::Error(LbfgsError::NotFinite { what, evaluation, x: x.to_vec() }));
        }
        if loss < self.best.0 {
            self.best = (loss, x.to_vec());
        }
        self.last = Some(Evaluated { x: x.to_vec(), loss, gradient: gradient.clone() });
        Ok((loss, gradient))
    }

    fn descend(&mut self, start: &[f64], options: &Lbfgs) -> Result<End, Stop<E>> {
        let (loss, gradient) = self.at(start)?;
        // Scaled by the largest component, so that squares of very large and very small numbers do not
        // overflow or vanish.
        let greatest = gradient.iter().fold(0.0, |a: f64, g| a.max(g.abs()));
        let unit = if greatest > 0.0 { greatest } else { 1.0 };
        let length = unit * gradient.iter().map(|g| (g / unit).powi(2)).sum::<f64>().sqrt();
        if length == 0.0 {
            return Ok(End::Converged);
        }
        let step = options.first_step;
        let bound = |side: usize, none: f64| -> Vec<f64> {
            let given = options.bounds.iter().zip(start).map(|(b, x)| (b[side] - x) / step);
            if options.bounds.is_empty() { vec![none; start.len()] } else { given.collect() }
        };
        let bounds = (bound(0, f64::NEG_INFINITY), bound(1, f64::INFINITY));
        // In these units the solver's first step has the length 1 along a gradient of length 1.
        let problem = Scaled {
            search: RefCell::new(&mut *self),
            start,
            step,
            loss: step * length,
            at: loss,
            bounds,
            limits: &options.bounds,
        };
        let method = basin::Lbfgs::new().with_absolute_projected_gradient_tolerance(options.tolerance);
        let state = FirstOrderState::new(vec![0.0; start.len()]);
        match Executor::new(problem, method, state).run() {
            Ok(result) => Ok(match result.report.termination {
                Termination::Converged(_) => End::Converged,
                _ => End::Noise,
            }),
            Err(ConstraintSolveError::Evaluation(stop)) => Err(stop),
            // Bounds have been checked.
            Err(_) => Err(Stop::Error(LbfgsError::Options("the bounds are not in order"))),
        }
    }
}

/// The loss in units in which the first gradient and the first step have the length 1.
struct Scaled<'s, S> {
    search: RefCell<&'s mut S>,
    start: &'s [f64],
    /// The unit of parameters.
    step: f64,
    /// The unit of the loss.
    loss: f64,
    /// The loss that is subtracted, so that it counts as 0.
    at: f64,
    bounds: (Vec<f64>, Vec<f64>),
    /// The bounds, in units of the parameters.
    limits: &'s [[f64; 2]],
}

impl<F, E> CostFunction for Scaled<'_, Search<F>>
where
    F: FnMut(&[f64]) -> Result<(f64, Vec<f64>), E>,
{
    type Param = Vec<f64>;
    type Output = f64;
    type Error = Stop<E>;

    fn cost(&self, z: &Vec<f64>) -> Result<f64, Stop<E>> {
        Ok(self.cost_and_gradient(z)?.0)
    }
}

impl<F, E> Gradient for Scaled<'_, Search<F>>
where
    F: FnMut(&[f64]) -> Result<(f64, Vec<f64>), E>,
{
    type Gradient = Vec<f64>;

    fn gradient(&self, z: &Vec<f64>) -> Result<Vec<f64>, Stop<E>> {
        Ok(self.cost_and_gradient(z)?.1)
    }

    fn cost_and_gradient(&self, z: &Vec<f64>) -> Result<(f64, Vec<f64>), Stop<E>> {
        let mut x: Vec<f64> = self.start.iter().zip(z).map(|(x, z)| x + self.step * z).collect();
        // Rounding may exceed a bound by an ulp.
        x.iter_mut().zip(self.limits).for_each(|(x, [low, high])| *x = x.clamp(*low, *high));
        let (loss, gradient) = self.search.borrow_mut().at(&x)?;
        let gradient = gradient.iter().map(|g| g * self.step / self.loss).collect();
        Ok(((loss - self.at) / self.loss, gradient))
    }
}

impl<S> Constraints for Scaled<'_, S> {
    type Set = ConstraintSet<BoxBounds<Vec<f64>>>;

    fn constraints(&self) -> <Self::Set as ConstraintDescription>::Borrowed<'_> {
        ConstraintSet::new().with_bounds(BoxBounds::new(Some(&self.bounds.0), Some(&self.bounds.1)))
    }
}

#[cfg(test)]
mod tests;
