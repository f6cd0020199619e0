//! Independent runs of one method against a reference that has noise of its own: variance, bias and slope.

use glam::DVec3;

use crate::ratio::Ratio;

/// A gradient image that is nearly right.
#[derive(Clone, Debug)]
pub(crate) struct Reference {
    pub(crate) gradient: Vec<DVec3>,
    /// The mean over pixels and channels of the variance of `gradient`: what it adds to every mean squared error.
    pub(crate) floor: f64,
    /// The independent runs that it is the mean of, if they are known.
    pub(crate) runs: Vec<Vec<DVec3>>,
}

impl Reference {
    /// The mean of independent runs, with the noise that their differences show.
    #[must_use]
    pub(crate) fn of_runs(runs: Vec<Vec<DVec3>>) -> Self {
        let gradient = mean(&runs);
        let count = runs.len() as f64;
        let squares: f64 = runs.iter().map(|run| product(&residual(run, &gradient), None)).sum();
        Self { gradient, floor: squares / (count * (count - 1.0)), runs }
    }

    /// The mean square over pixels and channels, its own noise included: the unit of relative errors.
    #[must_use]
    pub(crate) fn power(&self) -> f64 {
        product(&self.gradient, None)
    }
}

/// The regression of a gradient image on another: ⟨image, on⟩/⟨on, on⟩.
fn slope_on(image: &[DVec3], on: &[DVec3]) -> f64 {
    product(image, Some(on)) / product(on, None)
}

/// What independent runs of one method tell.
///
/// With rᵢ the difference of run i and the reference, ⟨rᵢ, rᵢ⟩ has the mean b² + v + f and ⟨rᵢ, rⱼ⟩ the mean
/// b² + f, where b is the bias, v the variance of one run and f the reference's own noise. Everything below follows from these
/// products.
#[derive(Clone, Debug)]
pub(crate) struct Runs {
    /// ⟨rᵢ, rⱼ⟩ in units of the reference's power.
    products: Vec<Vec<f64>>,
    /// f in the same units.
    floor: f64,
    slopes: Vec<f64>,
    across: Across,
    quiet: Vec<f64>,
    /// The mean of all runs.
    pub(crate) mean: Vec<DVec3>,
}

/// Numbers with standard errors, in units of the reference's power.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Measured {
    /// v, of one run.
    pub(crate) variance: f64,
    pub(crate) variance_error: f64,
    /// b², without noise; by chance it may be negative.
    pub(crate) bias2: f64,
    pub(crate) bias2_error: f64,
    /// The slope of the mean on what the reference is an estimate of: 1 without bias. The reference's own noise, which
    /// makes a plain regression fall short by f, is taken out.
    pub(crate) slope: f64,
    pub(crate) slope_error: f64,
}

impl Measured {
    /// The mean squared error at another time, b² + v · seconds/t, and its standard error. A bias² that noise made
    /// negative counts as none.
    #[must_use]
    pub(crate) fn error_at(&self, seconds: f64, time: f64) -> [f64; 2] {
        let share = seconds / time;
        let error = self.bias2_error.hypot(self.variance_error * share);
        [self.bias2.max(0.0) + self.variance * share, error]
    }
}

impl Runs {
    /// Compares three or more runs with a reference.
    #[must_use]
    pub(crate) fn new(runs: &[Vec<DVec3>], reference: &Reference) -> Self {
        let power = reference.power();
        let signal = 1.0 - reference.floor / power;
        let residuals: Vec<_> = runs.iter().map(|run| residual(run, &reference.gradient)).collect();
        let row = |a: &Vec<DVec3>| residuals.iter().map(|b| product(a, Some(b)) / power).collect();
        Self {
            products: residuals.iter().map(row).collect(),
            floor: reference.floor / power,
            slopes: runs.iter().map(|run| slope_on(run, &reference.gradient) / signal).collect(),
            across: Across::new(runs, &reference.runs),
            quiet: (0..runs.len()).map(|run| quiet_slope(runs, run, &reference.runs)).collect(),
            mean: mean(runs),
        }
    }

    /// Variance, bias² and slope. The errors of the first two are those of the jackknife over runs.
    #[must_use]
    pub(crate) fn measured(&self) -> Measured {
        let slope = Ratio::of_runs(&self.slopes);
        let [variance, variance_error] = self.jackknife(|diagonal, others| diagonal - others);
        let [bias2, bias2_error] = self.jackknife(|_, others| others - self.floor);
        let (slope, slope_error) = (slope.value, slope.error);
        Measured { variance, variance_error, bias2, bias2_error, slope, slope_error }
    }

    /// The slope of the mean on what the reference is an estimate of, for a reference of three or more runs; its error
    /// counts the noise of both sides.
    #[must_use]
    pub(crate) fn true_slope(&self) -> Ratio {
        self.across.slope()
    }

    /// The same with pixels weighted by how little runs differ there, so that few noisy pixels do not hide a bias. The
    /// weights for a run come from the other runs: they do not know it, and so the slope of an unbiased method stays 1.
    #[must_use]
    pub(crate) fn quiet_slope(&self) -> Ratio {
        Ratio::of_runs(&self.quiet)
    }

    /// A function of the mean products of runs with themselves and with others, and its standard error.
    fn jackknife(&self, statistic: impl Fn(f64, f64) -> f64) -> [f64; 2] {
        jackknife(self.products.len(), |kept| {
            let n = kept.len() as f64;
            let diagonal: f64 = kept.iter().map(|&i| self.products[i][i]).sum();
            let all: f64 = kept.iter().flat_map(|&i| kept.iter().map(move |&j| self.products[i][j])).sum();
            statistic(diagonal / n, (all - diagonal) / (n * (n - 1.0)))
        })
    }
}

/// Σ w ⟨g, s⟩/Σ w ⟨s, s⟩ over pixels for one run g, with w = 1/(v + median v) from the variance v of the other
/// runs.
fn quiet_slope(runs: &[Vec<DVec3>], run: usize, reference: &[Vec<DVec3>]) -> f64 {
    let others: Vec<&Vec<DVec3>> = (0..runs.len()).filter(|i| *i != run).map(|i| &runs[i]).collect();
    let variances: Vec<f64> = (0..runs[run].len()).map(|pixel| spread(&others, pixel).1).collect();
    let mut sorted: Vec<f64> = variances.iter().copied().filter(|v| *v > 0.0).collect();
    sorted.sort_by(f64::total_cmp);
    let Some(median) = sorted.get(sorted.len() / 2) else { return f64::NAN };
    let reference: Vec<&Vec<DVec3>> = reference.iter().collect();
    let count = reference.len() as f64;
    let (mut with, mut among) = (0.0, 0.0);
    for (pixel, variance) in variances.iter().enumerate() {
        let weight = 1.0 / (variance + median);
        let (mean, noise) = spread(&reference, pixel);
        with += weight * runs[run][pixel].dot(mean);
        among += weight * (mean.length_squared() - noise / count);
    }
    with / among
}

/// The mean of a pixel over runs, and its variance summed over channels.
fn spread(runs: &[&Vec<DVec3>], pixel: usize) -> (DVec3, f64) {
    let count = runs.len() as f64;
    let mean = runs.iter().map(|run| run[pixel]).sum::<DVec3>() / count;
    let squares: f64 = runs.iter().map(|run| (run[pixel] - mean).length_squared()).sum();
    (mean, squares / (count - 1.0))
}

/// Products of runs gᵢ with the runs sⱼ of a reference, and of those with one another: ⟨gᵢ, sⱼ⟩ has the mean
/// ⟨g, s⟩ and, for j ≠ k, ⟨sⱼ, sₖ⟩ the mean ⟨s, s⟩, without noise.
#[derive(Clone, Debug)]
struct Across {
    /// By run, then by run of the reference.
    with: Vec<Vec<f64>>,
    among: Vec<Vec<f64>>,
}

impl Across {
    fn new(runs: &[Vec<DVec3>], reference: &[Vec<DVec3>]) -> Self {
        let row = |a: &Vec<DVec3>| reference.iter().map(|b| product(a, Some(b))).collect();
        Self { with: runs.iter().map(row).collect(), among: reference.iter().map(row).collect() }
    }

    /// ⟨g, s⟩/⟨s, s⟩, with the jackknife over the runs of both.
    fn slope(&self) -> Ratio {
        let [runs, reference] = [self.with.len(), self.among.len()];
        let slope = |kept: &[usize], against: &[usize]| {
            let mean =
                against.iter().map(|&j| kept.iter().map(|&i| self.with[i][j]).sum::<f64>()).sum::<f64>()
                    / (kept.len() * against.len()) as f64;
            let others = against.iter().flat_map(|&j| against.iter().map(move |&k| (j, k)));
            let others: f64 = others.filter(|(j, k)| j != k).map(|(j, k)| self.among[j][k]).sum();
            mean / (others / (against.len() * (against.len() - 1)) as f64)
        };
        let [all, against]: [Vec<usize>; 2] = [runs, reference].map(|count| (0..count).collect());
        let [value, ours] = jackknife(runs, |kept| slope(kept, &against));
        let [_, theirs] = jackknife(reference, |kept| slope(&all, kept));
        Ratio { value, error: ours.hypot(theirs) }
    }
}

/// A statistic of all of `count` runs, and its standard error by leaving out one at a time.
fn jackknife(count: usize, statistic: impl Fn(&[usize]) -> f64) -> [f64; 2] {
    let of = |left_out: Option<usize>| {
        let kept: Vec<usize> = (0..count).filter(|i| Some(*i) != left_out).collect();
        statistic(&kept)
    };
    let parts: Vec<f64> = (0..count).map(|i| of(Some(i))).collect();
    // Ratio::of_runs divides by n(n − 1), the jackknife multiplies by (n − 1)/n.
    [of(None), Ratio::of_runs(&parts).error * (count as f64 - 1.0)]
}

fn residual(run: &[DVec3], from: &[DVec3]) -> Vec<DVec3> {
    run.iter().zip(from).map(|(g, r)| *g - *r).collect()
}

fn mean(runs: &[Vec<DVec3>]) -> Vec<DVec3> {
    let mut mean = vec![DVec3::ZERO; runs.first().map_or(0, Vec::len)];
    for run in runs {
        mean.iter_mut().zip(run).for_each(|(m, g)| *m += *g / runs.len() as f64);
    }
    mean
}

/// The mean over pixels and channels of a product, or of a square.
fn product(a: &[DVec3], b: Option<&[DVec3]>) -> f64 {
    let b = b.unwrap_or(a);
    a.iter().zip(b).map(|(a, b)| a.dot(*b)).sum::<f64>() / (3 * a.len()) as f64
}

#[cfg(test)]
mod tests {
    use flatland::random::{Stream, open01, stream};

    use super::*;

    /// A normal number by Box and Muller.
    fn normal(rng: &mut Stream) -> f64 {
        (-2.0 * open01(rng).ln()).sqrt() * (std::f64::consts::TAU * open01(rng)).cos()
    }

    /// Runs that are 0.8 of the truth plus noise, against a noisy reference, come out as what they are.
    #[test]
    fn bias_and_variance_are_told_apart() {
        let (pixels, spread, noise) = (20_000, 0.5, 0.3);
        let mut rng = stream(7, &[]);
        let mut three = |scale: f64| DVec3::from_array(std::array::from_fn(|_| scale * normal(&mut rng)));
        let truth: Vec<DVec3> = (0..pixels).map(|_| three(1.0)).collect();
        let halves = (0..4).map(|_| truth.iter().map(|t| *t + three(2.0 * noise)).collect()).collect();
        let reference = Reference::of_runs(halves);
        assert!((reference.floor - noise * noise).abs() < 0.01);
        let runs: Vec<Vec<DVec3>> =
            (0..6).map(|_| truth.iter().map(|t| 0.8 * *t + three(spread)).collect()).collect();
        let runs = Runs::new(&runs, &reference);
        let m = runs.measured();
        let power = 1.0 + noise * noise;
        let expected = [spread * spread / power, 0.04 / power, 0.8];
        for (value, expected) in [m.variance, m.bias2, m.slope].into_iter().zip(expected) {
            assert!((value - expected).abs() < 0.01, "{value} for {expected}");
        }
        assert!(m.variance_error < 0.01 && m.bias2_error < 0.01 && m.slope_error < 0.01, "{m:?}");
        let slope = runs.true_slope();
        assert!((slope.value - 0.8).abs() < 0.01 && slope.error < 0.01, "{slope:?}");
        assert!((runs.quiet_slope().value - 0.8).abs() < 0.01, "{:?}", runs.quiet_slope());
        assert!((m.error_at(3.0, 2.0)[0] - (m.bias2 + 1.5 * m.variance)).abs() < 1e-12);
        assert_eq!(Measured { bias2: -0.1, ..m }.error_at(2.0, 2.0)[0], m.variance);
    }

    /// The products give the same as the definitions: Σ|gᵢ − ḡ|²/(n − 1), and mse − v − f.
    #[test]
    fn products_agree_with_the_definitions() {
        let mut rng = stream(8, &[]);
        let mut three = || DVec3::from_array(std::array::from_fn(|_| normal(&mut rng)));
        let runs: Vec<Vec<DVec3>> = (0..4).map(|_| (0..50).map(|_| three()).collect()).collect();
        let gradient = (0..50).map(|_| three()).collect();
        let reference = Reference { gradient, floor: 0.2, runs: vec![] };
        let m = Runs::new(&runs, &reference).measured();
        let power = reference.power();
        let middle = mean(&runs);
        let variance = runs.iter().map(|r| product(&residual(r, &middle), None)).sum::<f64>() / 3.0 / power;
        let mse =
            runs.iter().map(|r| product(&residual(r, &reference.gradient), None)).sum::<f64>() / 4.0 / power;
        assert!((m.variance - variance).abs() < 1e-12);
        assert!((m.bias2 - (mse - variance - 0.2 / power)).abs() < 1e-12);
        assert!((Reference::of_runs(runs).floor - variance * power / 4.0).abs() < 1e-12);
    }
}
