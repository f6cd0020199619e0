//! Independent runs of one method against a noisy reference: variance, bias and slope.

use glam::DVec3;

use crate::ratio::Ratio;

/// A reference gradient image with residual noise.
#[derive(Clone, Debug)]
pub(crate) struct Reference {
    pub(crate) gradient: Vec<DVec3>,
    /// The mean over pixels and channels of the variance of `gradient`: its contribution to every mean
    /// squared error.
    pub(crate) floor: f64,
    /// The independent runs of which it is the mean, if they are known.
    pub(crate) runs: Vec<Vec<DVec3>>,
}

impl Reference {
    /// The mean of independent runs, with the noise estimated from their differences.
    pub(crate) fn of_runs(runs: Vec<Vec<DVec3>>) -> Self {
        let gradient = mean(&runs);
        let count = runs.len() as f64;
        let square = |residual: Vec<DVec3>| product(&residual, &residual);
        let squares: f64 = runs.iter().map(|run| square(residual(run, &gradient))).sum();
        Self { gradient, floor: squares / (count * (count - 1.0)), runs }
    }

    /// The mean square over pixels and channels, its own noise included: the unit of relative errors.
    pub(crate) fn power(&self) -> f64 {
        product(&self.gradient, &self.gradient)
    }
}

/// Statistics of independent runs of one method, in units of the reference's power.
///
/// With rᵢ the difference of run i and the reference, ⟨rᵢ, rᵢ⟩ has the mean b² + v + f and ⟨rᵢ, rⱼ⟩ the mean
/// b² + f, where b is the bias, v the variance of one run and f the reference's own noise. Everything below
/// follows from these products; errors are those of the jackknife over runs.
#[derive(Clone, Debug)]
pub(crate) struct Compared {
    /// v, the variance of one run.
    pub(crate) variance: Ratio,
    /// b², without noise; negative by chance in some cases.
    pub(crate) bias2: Ratio,
    /// The slope of the mean on the quantity that the reference estimates: 1 without bias. The reference's
    /// own noise, which makes a plain regression fall short by f, is removed.
    pub(crate) slope: Ratio,
    /// That slope for a reference of three or more known runs; its error includes the noise of both sides.
    pub(crate) true_slope: Ratio,
    /// That slope with pixels weighted by how little runs differ there, so that few noisy pixels do not hide
    /// a bias. The weights for a run come from the other runs: they are independent of it, and so the slope
    /// of an unbiased method stays 1.
    pub(crate) quiet_slope: Ratio,
}

impl Compared {
    /// Compares three or more runs with a reference.
    pub(crate) fn new(runs: &[Vec<DVec3>], reference: &Reference) -> Self {
        let power = reference.power();
        let (signal, floor) = (1.0 - reference.floor / power, reference.floor / power);
        let residuals: Vec<_> = runs.iter().map(|run| residual(run, &reference.gradient)).collect();
        let row = |a: &Vec<DVec3>| residuals.iter().map(|b| product(a, b) / power).collect();
        let products: Vec<Vec<f64>> = residuals.iter().map(row).collect();
        // A function of the mean products of runs with themselves and with others.
        let of_products = |statistic: fn(f64, f64, f64) -> f64| {
            jackknife(runs.len(), |kept| {
                let n = kept.len() as f64;
                let diagonal: f64 = kept.iter().map(|&i| products[i][i]).sum();
                let pairs = kept.iter().flat_map(|&i| kept.iter().map(move |&j| (i, j)));
                let all: f64 = pairs.map(|(i, j)| products[i][j]).sum();
                statistic(diagonal / n, (all - diagonal) / (n * (n - 1.0)), floor)
            })
        };
        let slope = |run: &Vec<DVec3>| product(run, &reference.gradient) / power / signal;
        let quiet = |run| quiet_slope(runs, run, &reference.runs);
        Self {
            variance: of_products(|diagonal, others, _| diagonal - others),
            bias2: of_products(|_, others, floor| others - floor),
            slope: Ratio::of_runs(&runs.iter().map(slope).collect::<Vec<_>>()),
            true_slope: true_slope(runs, &reference.runs),
            quiet_slope: Ratio::of_runs(&(0..runs.len()).map(quiet).collect::<Vec<_>>()),
        }
    }
}

/// ⟨g, s⟩/⟨s, s⟩ of runs gᵢ on the runs sⱼ of a reference: ⟨gᵢ, sⱼ⟩ has the mean ⟨g, s⟩ and, for j ≠ k, ⟨sⱼ,
/// sₖ⟩ the mean ⟨s, s⟩, without noise. The jackknife goes over the runs of both.
fn true_slope(runs: &[Vec<DVec3>], reference: &[Vec<DVec3>]) -> Ratio {
    let row = |a: &Vec<DVec3>| reference.iter().map(|b| product(a, b)).collect();
    let [with, among]: [Vec<Vec<f64>>; 2] = [runs, reference].map(|images| images.iter().map(row).collect());
    let slope = |kept: &[usize], against: &[usize]| {
        let mean = against.iter().map(|&j| kept.iter().map(|&i| with[i][j]).sum::<f64>()).sum::<f64>()
            / (kept.len() * against.len()) as f64;
        let pairs = against.iter().flat_map(|&j| against.iter().map(move |&k| (j, k)));
        let others: f64 = pairs.filter(|(j, k)| j != k).map(|(j, k)| among[j][k]).sum();
        mean / (others / (against.len() * (against.len() - 1)) as f64)
    };
    let [all, against]: [Vec<usize>; 2] = [with.len(), among.len()].map(|count| (0..count).collect());
    let ours = jackknife(with.len(), |kept| slope(kept, &against));
    let theirs = jackknife(among.len(), |kept| slope(&all, kept));
    Ratio { error: ours.error.hypot(theirs.error), ..ours }
}

/// Σ w ⟨g, s⟩/Σ w ⟨s, s⟩ over pixels for one run g, with w = 1/(v + median v) from the variance v of the
/// other runs.
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

/// A statistic of all of `count` runs, and its standard error by leaving out one at a time.
fn jackknife(count: usize, statistic: impl Fn(&[usize]) -> f64) -> Ratio {
    let of = |left_out: Option<usize>| {
        let kept: Vec<usize> = (0..count).filter(|i| Some(*i) != left_out).collect();
        statistic(&kept)
    };
    let parts: Vec<f64> = (0..count).map(|i| of(Some(i))).collect();
    // Ratio::of_runs divides by n(n − 1), the jackknife multiplies by (n − 1)/n.
    Ratio { value: of(None), error: Ratio::of_runs(&parts).error * (count as f64 - 1.0) }
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

/// The mean over pixels and channels of a product.
fn product(a: &[DVec3], b: &[DVec3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a.dot(*b)).sum::<f64>() / (3 * a.len()) as f64
}

#[cfg(test)]
mod tests {
    use flatland::random::{Stream, open01, stream};

    use super::*;

    /// A normal deviate by the Box–Muller transform.
    fn normal(rng: &mut Stream) -> f64 {
        (-2.0 * open01(rng).ln()).sqrt() * (std::f64::consts::TAU * open01(rng)).cos()
    }

    /// Statistics of runs that are 0.8 of the truth plus noise, against a noisy reference, recover these
    /// values.
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
        let found = Compared::new(&runs, &reference);
        let power = 1.0 + noise * noise;
        for (measured, expected) in [
            (found.variance, spread * spread / power),
            (found.bias2, 0.04 / power),
            (found.slope, 0.8),
            (found.true_slope, 0.8),
            (found.quiet_slope, 0.8),
        ] {
            assert!((measured.value - expected).abs() < 0.01, "{measured:?} for {expected}");
            assert!(measured.error < 0.01, "{measured:?}");
        }
    }

    /// The products agree with the definitions: Σ|gᵢ − ḡ|²/(n − 1), and mse − v − f.
    #[test]
    fn products_agree_with_the_definitions() {
        let mut rng = stream(8, &[]);
        let mut three = || DVec3::from_array(std::array::from_fn(|_| normal(&mut rng)));
        let runs: Vec<Vec<DVec3>> = (0..4).map(|_| (0..50).map(|_| three()).collect()).collect();
        let gradient = (0..50).map(|_| three()).collect();
        let reference = Reference { gradient, floor: 0.2, runs: vec![] };
        let found = Compared::new(&runs, &reference);
        let power = reference.power();
        let square = |run: &Vec<DVec3>, from: &[DVec3]| {
            let difference = residual(run, from);
            product(&difference, &difference) / power
        };
        let variance = runs.iter().map(|run| square(run, &mean(&runs))).sum::<f64>() / 3.0;
        let mse = runs.iter().map(|run| square(run, &reference.gradient)).sum::<f64>() / 4.0;
        assert!((found.variance.value - variance).abs() < 1e-12);
        assert!((found.bias2.value - (mse - variance - 0.2 / power)).abs() < 1e-12);
        assert!((Reference::of_runs(runs).floor - variance * power / 4.0).abs() < 1e-12);
    }
}
