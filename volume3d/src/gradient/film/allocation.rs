//! Adaptive allocation of the area term's samples over the film.

use crate::gradient::film::FilmPlane;
use crate::gradient::run::groups::GROUPS;

/// Number of samples of each square of pixels, larger where the variance is larger.
///
/// With σ² the variance of one sample and c its cost, the sum of squared errors at fixed total cost is least
/// for n ∝ σ/√c (Neyman 1934). The estimate stays unbiased if the allocation does not depend on the samples
/// themselves: a [`Pilot`](crate::gradient::Pilot) draws independent samples to choose it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Allocation {
    /// Side of a square, in pixels.
    side: usize,
    columns: usize,
    /// Samples by square, row by row: multiples of the number of groups from which standard errors are
    /// estimated.
    samples: Vec<u32>,
}

/// Side of a square, in pixels.
///
/// Compared with 16 and 8, 4 had the least or nearly the least variance on four test scenes. In a closed box
/// with four bounces smaller squares increased it (relative variance .044, .048, .062): indirect light
/// dominates there, its noise is common to cells that share [random numbers](crate::gradient::run::groups),
/// and it cancels in their differences only if they have equally many samples. The pilot keeps the allocation
/// uniform in such scenes.
pub(in crate::gradient) const SIDE: usize = 4;

/// Fraction of the samples that is spread uniformly, because a pilot of few samples may miss variance.
const EVEN: f64 = 0.25;

/// Bisection steps for the scale of the allocation: relative precision about 10⁻³.
const HALVINGS: usize = 12;

/// Variances smoothed over squares: half a square's own value, half the mean of its neighbours, because
/// estimates from few samples are noisy.
fn smoothed(sums: &[f64], columns: usize) -> Vec<f64> {
    let rows = sums.len() / columns;
    let around = |t: usize| {
        let (i, j) = (t % columns, t / columns);
        let near = |k: usize, n: usize| k.saturating_sub(1)..(k + 2).min(n);
        let all =
            near(j, rows).flat_map(|y| near(i, columns).map(move |x| y * columns + x)).filter(|&s| s != t);
        let (sum, count) = all.fold((0.0, 0), |(sum, count), s| (sum + sums[s], count + 1));
        if count > 0 { sum / f64::from(count) } else { sums[t] }
    };
    (0..sums.len()).map(|t| 0.5 * (sums[t] + around(t))).collect()
}

impl Allocation {
    /// The allocation over squares of `side` × `side` pixels whose cost is that of `samples` samples in every
    /// pixel, with at least 8 in each. Variances are given per pixel and costs per sample and cell, row by
    /// row.
    pub(in crate::gradient) fn new(
        film: &FilmPlane,
        side: usize,
        samples: usize,
        variances: &[f64],
        costs: &[f64],
    ) -> Self {
        let (width, height) = film.cells();
        let (columns, rows) = (width.div_ceil(side), height.div_ceil(side));
        let mut sums = vec![0.0; columns * rows];
        for (pixel, variance) in variances.iter().enumerate().filter(|(_, v)| v.is_finite()) {
            let (i, j) = (pixel % film.columns + film.reach, pixel / film.columns + film.reach);
            sums[j / side * columns + i / side] += variance;
        }
        let mut times = vec![0.0; columns * rows];
        for (cell, cost) in costs.iter().enumerate() {
            times[cell / width / side * columns + cell % width / side] += cost;
        }
        // n ∝ σ/√c.
        let smooth = smoothed(&sums, columns);
        let rates: Vec<f64> = smooth.iter().zip(&times).map(|(v, c)| (v / c).sqrt()).collect();
        let spent = |n: &[f64]| n.iter().zip(&times).map(|(n, c)| n * c).sum::<f64>();
        let (time, used) = (samples as f64 * times.iter().sum::<f64>(), spent(&rates));
        let even = if used > 0.0 { EVEN * samples as f64 } else { samples as f64 };
        let whole = |scale: f64| -> Vec<f64> {
            let groups = |rate: &f64| ((even + scale * rate) / GROUPS as f64).round().max(1.0);
            rates.iter().map(|rate| (groups(rate) * GROUPS as f64).min(f64::from(u32::MAX))).collect()
        };
        // Squares at the minimum take more than their share; the scale of the others is reduced accordingly,
        // by bisection.
        let (mut least, mut most) = (0.0, if used > 0.0 { time / used } else { 0.0 });
        for _ in 0..HALVINGS {
            let scale = 0.5 * (least + most);
            *(if spent(&whole(scale)) > time { &mut most } else { &mut least }) = scale;
        }
        let samples = whole(least).into_iter().map(|n| n as u32).collect();
        Self { side, columns, samples }
    }

    /// Mean number of samples over the cells of a film.
    pub(in crate::gradient) fn mean(&self, film: &FilmPlane) -> f64 {
        let (width, height) = film.cells();
        let sum: usize = (0..width * height).map(|cell| self.at((cell % width, cell / width))).sum();
        sum as f64 / (width * height) as f64
    }

    /// Number of samples of a cell.
    pub(in crate::gradient) fn at(&self, (i, j): (usize, usize)) -> usize {
        self.samples[j / self.side * self.columns + i / self.side] as usize
    }

    /// Whether the allocation is for a film of this size.
    pub(in crate::gradient) fn fits(&self, film: &FilmPlane) -> bool {
        let (width, height) = film.cells();
        self.columns == width.div_ceil(self.side)
            && self.samples.len() == self.columns * height.div_ceil(self.side)
    }

    /// Variance of the mean under this allocation, given `variances`, those at `samples` samples everywhere.
    pub(in crate::gradient) fn variance(&self, film: &FilmPlane, samples: usize, variances: &[f64]) -> f64 {
        let of = |(pixel, variance): (usize, &f64)| {
            let cell = (pixel % film.columns + film.reach, pixel / film.columns + film.reach);
            variance * samples as f64 / self.at(cell) as f64
        };
        variances.iter().enumerate().filter(|(_, v)| v.is_finite()).map(of).sum()
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use glam::DVec3;

    use super::*;
    use crate::Image;
    use crate::geometry::Mesh;
    use crate::gradient::tests::{Comparisons, at, film, total};
    use crate::gradient::{ActiveParameters, Field, Progress, Tangent, WarpedArea};
    use crate::scene::{Camera, Description, Filter, Scene};

    /// A square that emits, with most samples in one corner of the film.
    fn scene(side: usize, samples: usize) -> (Scene, Tangent, Arc<Allocation>) {
        let camera = Camera::look_at(DVec3::new(0.0, 0.0, 3.0), DVec3::ZERO, DVec3::Y, 0.8);
        let mut d = Description::new(camera, film(40, Filter::Tent { radius: 1.0 }));
        d.integrator.max_depth = Some(1);
        d.add_emitter("square", Mesh::rectangle().transformed(&at(0.1, 0.2, 0.0, 0.6)), DVec3::ONE);
        let scene = Scene::new(d).unwrap();
        let mut change = Tangent::still(&scene);
        change.translate(&scene, 0, DVec3::new(0.4, -0.7, 0.3));
        let film = FilmPlane::new(&scene);
        let variances: Vec<f64> =
            (0..40 * 40).map(|i| if i % 40 < 14 && i < 40 * 14 { 9.0 } else { 0.01 }).collect();
        let (width, height) = film.cells();
        let allocation = Allocation::new(&film, side, samples, &variances, &vec![1.0; width * height]);
        (scene, change, Arc::new(allocation))
    }

    #[test]
    fn samples_follow_deviations() {
        let (scene, _, allocation) = scene(16, 16);
        let film = FilmPlane::new(&scene);
        assert!(allocation.samples[0] >= 3 * allocation.samples[8], "{allocation:?}");
        assert!(allocation.samples.iter().all(|n| n % 8 == 0 && *n >= 8), "{allocation:?}");
        assert!((allocation.mean(&film) / 16.0 - 1.0).abs() < 0.2, "{allocation:?}");
        let even = Allocation::new(&film, 16, 32, &[0.0; 40 * 40], &[1.0; 42 * 42]);
        assert_eq!(even.samples, [32; 9]);
        let other = Scene::new(Description::new(
            scene.description().camera.clone(),
            crate::gradient::tests::film(64, Filter::Tent { radius: 1.0 }),
        ));
        assert!(!allocation.fits(&FilmPlane::new(&other.unwrap())));
    }

    /// A uniform and an uneven allocation estimate the same derivative, and reverse mode is the transpose of
    /// each.
    #[test]
    fn spread_samples_are_unbiased() {
        let (scene, change, allocation) = scene(4, 32);
        let none = Progress::none();
        let weighted = |image: Image| -> Vec<DVec3> {
            image.pixels.iter().enumerate().map(|(i, g)| *g * (1.0 + (i % 40) as f64)).collect()
        };
        let run = |allocation: Option<Arc<Allocation>>, warps: bool| {
            total(|seed| {
                let allocation = allocation.clone();
                let method = WarpedArea { samples: 16, allocation, seed, warps, ..WarpedArea::default() };
                weighted(method.forward(&scene, &change, &none).unwrap().gradient)
            })
        };
        let (even, spread) = (run(None, true), run(Some(allocation.clone()), true));
        let mut comparisons = Comparisons::of("spread_samples_are_unbiased");
        comparisons.add("spread".into(), spread, even, 0.0, even.0);
        comparisons.reject("interior only", run(Some(allocation.clone()), false), even);
        comparisons.finish();
        let method =
            WarpedArea { allocation: Some(allocation), field: Field::softened(8), ..WarpedArea::default() };
        let forward = method.forward(&scene, &change, &none).unwrap().gradient;
        let adjoint = Image::constant(40, 40, DVec3::new(1.0, 0.5, 0.25));
        let mut active = ActiveParameters::nothing(&scene);
        active.shapes[0] = true;
        let gradient = method.reverse(&scene, &adjoint, &active, &none).unwrap().by_parameter;
        let along: f64 = gradient.positions.iter().zip(&change.positions).map(|(g, v)| g.dot(*v)).sum();
        let across: f64 = forward.pixels.iter().map(|g| g.dot(DVec3::new(1.0, 0.5, 0.25))).sum();
        assert!((along - across).abs() < 1e-9 * across.abs(), "{along} {across}");
    }
}
