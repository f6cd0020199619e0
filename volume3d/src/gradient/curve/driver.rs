//! Monte Carlo driver of one kind of curve: splats onto the film or, transposed, gradients of parameters.

use flatland::calculus::{Number as _, Tape};
use flatland::moments::Moments;
use glam::{DVec2, DVec3};

use super::address::{Address, WARPS};
use super::budget::{Budget, Kind};
use super::field::WarpField as _;
use super::integral::{Curve, Difference};
use crate::gradient::auxiliary::{Auxiliary, work};
use crate::gradient::film::FilmPlane;
use crate::gradient::modes::accumulator::{Accumulator, Sums};
use crate::gradient::modes::differential::Differential;
use crate::gradient::modes::forward::Forward;
use crate::gradient::modes::reverse::{Inputs, Recorded, Reverse};
use crate::gradient::results::contribution::{Contribution, Source};
use crate::gradient::results::regions::{RegionSums, Regions};
use crate::gradient::run::groups::GROUPS;
use crate::gradient::run::parts::in_order;
use crate::gradient::warp::motion::{Motion, MovingBounds};
use crate::gradient::{ActiveParameters, NonFinite, Progress, Stopped};
use crate::path::Frame;
use crate::scene::Scene;

/// Δ(f − L₀) (v − V)·ν at one point of a curve, as seen on the film.
#[derive(Clone, Copy, Debug)]
struct CurveSample<T> {
    at: DVec2,
    difference: Difference,
    /// A number whose derivative is (v − V)·ν.
    speed: T,
}

/// Calls back with every point of a curve that one sample finds and that moves across V.
fn sample<C: Differential, K: Curve>(
    curve: &K,
    calculus: &mut C,
    frame: &Frame<C::Number>,
    address: Address,
    found: &mut impl FnMut(&mut C, CurveSample<C::Number>),
) {
    curve.draw(address, &mut |path, point| {
        if let Some(rng) = calculus.rng() {
            *rng = address.stream(WARPS);
        }
        let speed = curve.speed(calculus, frame, path, point);
        if !speed.is_still() {
            let difference = curve.difference(path, point);
            found(calculus, CurveSample { at: path.at, difference, speed });
        }
    });
}

/// Mean over samples by pixel, and variance of that mean.
#[derive(Clone, Debug)]
pub(super) struct Estimate {
    pub(super) mean: Vec<DVec3>,
    pub(super) variance: Vec<DVec3>,
    pub(super) regions: Regions,
    /// Number of auxiliary rays.
    pub(super) rays: u64,
    /// Cost of one sample, in rays.
    pub(super) work: f64,
    pub(super) non_finite: Vec<NonFinite>,
    /// The sample with the largest contribution.
    pub(super) largest: Option<Contribution>,
}

/// Contributions of a chunk of samples to the film: amounts by pixel.
#[derive(Clone, Debug, Default)]
struct Splats {
    amounts: Vec<(u32, DVec3)>,
    rays: u64,
    work: f64,
    non_finite: Vec<NonFinite>,
    /// The sample with the largest contribution.
    largest: Option<Contribution>,
}

/// Samples computed sequentially as one task.
const CHUNK: usize = 2048;

/// Settings of the summation over one kind of curve.
#[derive(Clone, Copy, Debug)]
pub(super) struct Driver<'s> {
    pub(super) scene: &'s Scene,
    pub(super) film: FilmPlane,
    pub(super) seed: u64,
    /// Control variate of every pixel; empty if it is 0.
    control_variate: &'s [DVec3],
    /// Samples per group.
    count: usize,
}

impl<'s> Driver<'s> {
    /// A driver with at least `samples` samples in total.
    pub(super) fn new(scene: &'s Scene, seed: u64, samples: usize) -> Self {
        let count = samples.div_ceil(GROUPS).max(1);
        Self { scene, film: FilmPlane::new(scene), seed, control_variate: &[], count }
    }

    /// A driver with the samples of a budget for one kind of curve.
    pub(super) fn of(scene: &'s Scene, budget: &Budget<'s>, kind: Kind) -> Self {
        let (width, height) = scene.size();
        let samples = budget.of(kind).saturating_mul(width * height);
        Self { control_variate: budget.control_variate, ..Self::new(scene, budget.seed, samples) }
    }

    fn chunks(&self) -> usize {
        self.count.div_ceil(CHUNK)
    }

    /// Samples of a chunk; each group has [`chunks`](Self::chunks) of them.
    fn addresses(self, number: usize) -> impl Iterator<Item = Address> {
        let (group, chunk) = (number / self.chunks(), number % self.chunks());
        let last = (CHUNK * (chunk + 1)).min(self.count);
        (CHUNK * chunk..last).map(move |index| Address { seed: self.seed, group, index, count: self.count })
    }

    /// Derivative of every pixel along a tangent: mean over samples, with the variance estimated from the
    /// groups' means.
    pub(super) fn forward(
        &self,
        curve: &impl Curve,
        motion: &Motion<'_>,
        progress: &Progress,
    ) -> Result<Estimate, Stopped> {
        let pixels = self.film.columns * self.film.rows;
        let mut moments = vec![Moments::<DVec3>::default(); pixels];
        let (mut rays, mut work, mut non_finite, mut largest) = (0, 0.0, vec![], None);
        let mut sum = vec![DVec3::ZERO; pixels];
        let mut regions = RegionSums::new(self.film.columns, self.film.rows, GROUPS);
        let chunk = |number| self.forward_chunk(curve, motion, number, progress);
        in_order(GROUPS * self.chunks(), progress, chunk, |number, part| {
            for (pixel, amount) in part.amounts {
                sum[pixel as usize] += amount;
            }
            rays += part.rays;
            work += part.work;
            non_finite.extend(part.non_finite);
            Contribution::keep_larger(&mut largest, part.largest);
            let (group, chunk) = (number / self.chunks(), number % self.chunks());
            if chunk + 1 < self.chunks() {
                return;
            }
            for (pixel, sum) in sum.iter().enumerate() {
                regions.add((pixel % self.film.columns, pixel / self.film.columns), group, *sum);
            }
            for (sum, moments) in sum.iter_mut().zip(&mut moments) {
                moments.push(std::mem::take(sum) / self.count as f64);
            }
        })?;
        let mean = moments.iter().map(Moments::mean).collect();
        let variance = moments.iter().map(Moments::variance_of_mean).collect();
        if let Some(largest) = &mut largest {
            largest.amount *= self.scale();
            largest.among = GROUPS * self.count;
        }
        let regions = regions.finish(GROUPS * self.count);
        let work = work * self.scale();
        Ok(Estimate { mean, variance, regions, rays, work, non_finite, largest })
    }

    fn forward_chunk(
        &self,
        curve: &impl Curve,
        motion: &Motion<'_>,
        number: usize,
        progress: &Progress,
    ) -> Splats {
        let auxiliary = curve.field().auxiliary(&motion.bounds);
        let mut forward = Forward::<1> { scene: self.scene, motion, auxiliary };
        let frame = self.film.moving_frame(&forward);
        let mut splats = Splats::default();
        let before = work(forward.auxiliary.as_ref());
        for address in self.addresses(number) {
            if progress.stopped() {
                break;
            }
            sample(curve, &mut forward, &frame, address, &mut |_, sample| {
                let rate = sample.speed.tangent[0];
                self.splat_into(&mut splats, &sample, address, rate);
            });
        }
        splats.work = work(forward.auxiliary.as_ref()) - before;
        splats.rays = forward.auxiliary.as_ref().map_or(0, Auxiliary::rays);
        splats
    }

    /// Adds the contribution of a sample to every pixel it reaches.
    fn splat_into<T>(&self, splats: &mut Splats, sample: &CurveSample<T>, address: Address, rate: f64) {
        let Splats { amounts, non_finite, largest, .. } = splats;
        let mut sum = 0.0;
        self.splat(
            sample,
            address,
            rate,
            |at| non_finite.push(at),
            |pixel, weight, light| {
                let amount = light * rate;
                amounts.push((pixel as u32, weight * amount));
                sum += weight * amount.abs().element_sum();
            },
        );
        if sum > 0.0
            && let Some(cell) = self.film.cell(sample.at)
        {
            let found = Contribution::new(self.located(cell, address), Source::Jump, sum);
            Contribution::keep_larger(largest, Some(found));
        }
    }

    /// Calls back with every pixel a sample reaches, its filter weight and its light, if light and rate are
    /// finite and nonzero.
    fn splat<T>(
        &self,
        &CurveSample { at, difference, .. }: &CurveSample<T>,
        address: Address,
        rate: f64,
        bad: impl FnOnce(NonFinite),
        mut f: impl FnMut(usize, f64, DVec3),
    ) {
        let (film, Difference { radiance, control_variate: level }) = (&self.film, difference);
        let Some((i, j)) = film.cell(at) else { return };
        if !(radiance * rate).is_finite() || !(level * rate).is_finite() {
            bad(self.located((i, j), address));
            return;
        }
        if rate == 0.0 || radiance == DVec3::ZERO && level == 0.0 {
            return;
        }
        film.for_each_share(at, |x, y, weight| {
            let pixel = y * film.columns + x;
            let level = self.control_variate.get(pixel).map_or(DVec3::ZERO, |l| *l * level);
            f(pixel, weight, radiance - level);
        });
    }

    /// Transpose of [`forward`](Self::forward): adds the derivative of Σ adjoint · I by every active
    /// parameter.
    pub(super) fn reverse(
        &self,
        curve: &impl Curve,
        adjoint: &[DVec3],
        active: &ActiveParameters,
        progress: &Progress,
        sums: &mut Sums,
    ) -> Result<(), Stopped> {
        let inputs = Inputs::new(self.scene, active);
        let bounds = MovingBounds::new(self.scene, &active.shapes, active.implicits.contains(&true));
        sums.gather(GROUPS * self.chunks(), progress, |number, part| {
            self.reverse_chunk(curve, adjoint, (&inputs, &bounds), number, progress, part);
        })
    }

    fn reverse_chunk(
        &self,
        curve: &impl Curve,
        adjoint: &[DVec3],
        (inputs, bounds): (&Inputs, &MovingBounds),
        number: usize,
        progress: &Progress,
        part: &mut Accumulator,
    ) {
        let (mut tape, mut adjoints) = (Tape::new(), vec![]);
        let mut auxiliary = curve.field().auxiliary(bounds);
        for address in self.addresses(number) {
            if progress.stopped() {
                break;
            }
            tape.clear();
            let mut reverse = Reverse::new(self.scene, inputs, &tape, auxiliary.as_mut());
            let frame = self.film.moving_frame(&reverse);
            sample(curve, &mut reverse, &frame, address, &mut |reverse, sample| {
                self.pull(reverse, &sample, adjoint, address, &mut adjoints, part);
                reverse.forget_warps();
            });
        }
    }

    /// Contribution of one sample to the gradient.
    fn pull<'t>(
        &self,
        reverse: &Reverse<'_, 't>,
        sample: &CurveSample<Recorded<'t>>,
        adjoint: &[DVec3],
        address: Address,
        adjoints: &mut Vec<f64>,
        part: &mut Accumulator,
    ) {
        let mut sum = 0.0;
        let bad = |at| part.leave_out(at);
        self.splat(sample, address, 1.0, bad, |pixel, weight, light| {
            sum += weight * adjoint[pixel].dot(light);
        });
        if sum == 0.0 {
            return;
        }
        let outputs = [(sample.speed, sum * self.scale())];
        // A first sweep without a sink: non-finite values must not reach the sums.
        let mut finite = true;
        reverse.tape.sweep(&outputs, adjoints, |_, a, _| finite &= a.iter().all(|a| a.is_finite()));
        finite = finite && reverse.sweep_if_finite(&outputs, adjoints, part);
        let Some(cell) = self.film.cell(sample.at) else { return };
        let at = self.located(cell, address);
        if finite {
            part.end_sample(at, Source::Jump);
        } else {
            part.leave_out(at);
        }
    }

    /// Weight of one sample in the mean.
    fn scale(&self) -> f64 {
        1.0 / (GROUPS * self.count) as f64
    }

    fn located(&self, (i, j): (usize, usize), address: Address) -> NonFinite {
        self.film.located(i, j, address.group * self.count + address.index)
    }
}
