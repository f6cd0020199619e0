//! Monte Carlo driver of boundary terms: splats onto the film or, transposed, gradients of parameters.

use flatland::calculus::Tape;
use flatland::moments::Moments;
use flatland::random::{Stream, stream};
use glam::{DVec2, DVec3};

use crate::gradient::accumulator::{Accumulator, Sums};
use crate::gradient::auxiliary::{Auxiliary, work};
use crate::gradient::contribution::{Contribution, Source};
use crate::gradient::differential::Differential;
use crate::gradient::film::FilmPlane;
use crate::gradient::forward::Forward;
use crate::gradient::groups::GROUPS;
use crate::gradient::motion::{Motion, MovingBounds};
use crate::gradient::parts::in_order;
use crate::gradient::regions::{RegionSums, Regions};
use crate::gradient::reverse::{Inputs, Recorded, Reverse};
use crate::gradient::{ActiveParameters, NonFinite, Progress, Stopped};
use crate::path::{Frame, Sequence};
use crate::scene::Scene;

/// One point of a discontinuity, as seen on the film.
#[derive(Clone, Copy, Debug)]
pub(in crate::gradient) struct BoundarySample<T> {
    pub(in crate::gradient) at: DVec2,
    /// Difference of radiance divided by the density of the sample; or the radiance on one side, if the sides
    /// have separate speeds.
    pub(in crate::gradient) light: DVec3,
    /// Factor of the pixel's control variate in the sample: 0 for a difference, in which it cancels.
    pub(in crate::gradient) level: f64,
    /// A number whose derivative is the normal velocity of the discontinuity, from the side before to the
    /// side behind, relative to the warp if there is one; times |∇G| if `light` is divided by it.
    pub(in crate::gradient) speed: T,
}

/// Identity of a sample.
#[derive(Clone, Copy, Debug)]
pub(in crate::gradient) struct Address {
    pub(in crate::gradient) seed: u64,
    group: usize,
    /// Index within its group, and size of the group.
    index: usize,
    count: usize,
}

impl Address {
    /// Random numbers of the sample: samples of one group are stratified; groups are independent.
    pub(in crate::gradient) fn numbers(&self, purpose: u64) -> Sequence {
        Sequence::new(self.seed, &[purpose, self.group as u64], self.index)
    }

    /// A random stream of this sample alone.
    pub(in crate::gradient) fn stream(&self, purpose: u64) -> Stream {
        stream(self.seed, &[purpose, self.group as u64, self.index as u64])
    }

    /// The sample's stratified position in (0, 1).
    pub(in crate::gradient) fn fraction(&self, numbers: &mut Sequence) -> f64 {
        (self.index as f64 + numbers.one()) / self.count as f64
    }
}

/// Integral over discontinuities.
pub(in crate::gradient) trait Boundary: Sync {
    /// Whether there is nothing to sample.
    fn is_empty(&self) -> bool;

    /// The warps relative to which speeds are measured; `None` for the whole velocity.
    fn auxiliary<'a>(&'a self, _: &'a MovingBounds) -> Option<Auxiliary<'a>> {
        None
    }

    /// Calls back with everything one sample finds; the mean over samples is the integral.
    fn sample<C: Differential>(
        &self,
        calculus: &mut C,
        frame: &Frame<C::Number>,
        address: Address,
        found: &mut impl FnMut(&mut C, BoundarySample<C::Number>),
    );
}

/// Mean over samples by pixel, and variance of that mean.
#[derive(Clone, Debug)]
pub(in crate::gradient) struct Estimate {
    pub(in crate::gradient) mean: Vec<DVec3>,
    pub(in crate::gradient) variance: Vec<DVec3>,
    pub(in crate::gradient) regions: Regions,
    /// Number of auxiliary rays.
    pub(in crate::gradient) rays: u64,
    /// Cost of one sample, in rays.
    pub(in crate::gradient) work: f64,
    pub(in crate::gradient) non_finite: Vec<NonFinite>,
    /// The sample with the largest contribution.
    pub(in crate::gradient) largest: Option<Contribution>,
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

/// Settings of the summation over a boundary.
#[derive(Clone, Copy, Debug)]
pub(in crate::gradient) struct Driver<'s> {
    pub(in crate::gradient) scene: &'s Scene,
    pub(in crate::gradient) film: FilmPlane,
    pub(in crate::gradient) seed: u64,
    /// Control variate of every pixel; empty if it is 0.
    levels: &'s [DVec3],
    /// Samples per group.
    count: usize,
}

impl<'s> Driver<'s> {
    /// A driver with at least `samples` samples in total.
    pub(in crate::gradient) fn new(scene: &'s Scene, seed: u64, samples: usize) -> Self {
        let count = samples.div_ceil(GROUPS).max(1);
        Self { scene, film: FilmPlane::new(scene), seed, levels: &[], count }
    }

    /// The driver with a control variate.
    pub(in crate::gradient) fn above(self, levels: &'s [DVec3]) -> Self {
        Self { levels, ..self }
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
    pub(in crate::gradient) fn forward(
        &self,
        boundary: &impl Boundary,
        motion: &Motion<'_>,
        progress: &Progress,
    ) -> Result<Estimate, Stopped> {
        let pixels = self.film.columns * self.film.rows;
        let mut moments = vec![Moments::<DVec3>::default(); pixels];
        let (mut rays, mut work, mut non_finite, mut largest) = (0, 0.0, vec![], None);
        let mut sum = vec![DVec3::ZERO; pixels];
        let mut regions = RegionSums::new(self.film.columns, self.film.rows, GROUPS);
        let chunk = |number| self.forward_chunk(boundary, motion, number, progress);
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
        boundary: &impl Boundary,
        motion: &Motion<'_>,
        number: usize,
        progress: &Progress,
    ) -> Splats {
        let auxiliary = boundary.auxiliary(&motion.bounds);
        let mut forward = Forward::<1> { scene: self.scene, motion, auxiliary };
        let frame = self.film.moving_frame(&forward);
        let mut splats = Splats::default();
        let before = work(forward.auxiliary.as_ref());
        for address in self.addresses(number) {
            if progress.stopped() {
                break;
            }
            boundary.sample(&mut forward, &frame, address, &mut |_, sample| {
                let rate = sample.speed.tangent[0];
                self.splat_into(&mut splats, &sample, address, rate);
            });
        }
        splats.work = work(forward.auxiliary.as_ref()) - before;
        splats.rays = forward.auxiliary.as_ref().map_or(0, Auxiliary::rays);
        splats
    }

    /// Adds the contribution of a sample to every pixel it reaches.
    fn splat_into<T>(&self, splats: &mut Splats, sample: &BoundarySample<T>, address: Address, rate: f64) {
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
        &BoundarySample { at, light, level, .. }: &BoundarySample<T>,
        address: Address,
        rate: f64,
        bad: impl FnOnce(NonFinite),
        mut f: impl FnMut(usize, f64, DVec3),
    ) {
        let film = &self.film;
        let Some((i, j)) = film.cell(at) else { return };
        if !(light * rate).is_finite() || !(level * rate).is_finite() {
            bad(self.located((i, j), address));
            return;
        }
        if rate == 0.0 || light == DVec3::ZERO && level == 0.0 {
            return;
        }
        film.for_each_share(at, |x, y, weight| {
            let pixel = y * film.columns + x;
            let level = self.levels.get(pixel).map_or(DVec3::ZERO, |l| *l * level);
            f(pixel, weight, light - level);
        });
    }

    /// Transpose of [`forward`](Self::forward): adds the derivative of Σ adjoint · I by every active
    /// parameter.
    pub(in crate::gradient) fn reverse(
        &self,
        boundary: &impl Boundary,
        adjoint: &[DVec3],
        active: &ActiveParameters,
        progress: &Progress,
        sums: &mut Sums,
    ) -> Result<(), Stopped> {
        let inputs = Inputs::new(self.scene, active);
        let bounds = MovingBounds::new(self.scene, &active.shapes, active.implicits.contains(&true));
        sums.gather(GROUPS * self.chunks(), progress, |number, part| {
            self.reverse_chunk(boundary, adjoint, (&inputs, &bounds), number, progress, part);
        })
    }

    fn reverse_chunk(
        &self,
        boundary: &impl Boundary,
        adjoint: &[DVec3],
        (inputs, bounds): (&Inputs, &MovingBounds),
        number: usize,
        progress: &Progress,
        part: &mut Accumulator,
    ) {
        let (mut tape, mut adjoints) = (Tape::new(), vec![]);
        let mut auxiliary = boundary.auxiliary(bounds);
        for address in self.addresses(number) {
            if progress.stopped() {
                break;
            }
            tape.clear();
            let mut reverse = Reverse::new(self.scene, inputs, &tape, auxiliary.as_mut());
            let frame = self.film.moving_frame(&reverse);
            boundary.sample(&mut reverse, &frame, address, &mut |reverse, sample| {
                self.pull(reverse, &sample, adjoint, address, &mut adjoints, part);
                reverse.forget_warps();
            });
        }
    }

    /// Contribution of one boundary sample to the gradient.
    fn pull<'t>(
        &self,
        reverse: &Reverse<'_, 't>,
        sample: &BoundarySample<Recorded<'t>>,
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
