//! Forward and reverse mode of every method whose samples are linear in the rates of change.

use rayon::prelude::*;

use super::{Gradient, GradientImage, PathError};
use crate::moments::Moments;
use crate::random::{Stream, stream};
use crate::transport::{ActiveParameters, Camera, Covector, Tangent, Terms, World, path_stream};

/// A world before its camera, and what of it is to be differentiated.
#[derive(Clone, Copy, Debug)]
pub(super) struct View<'a> {
    pub(super) world: &'a World,
    pub(super) camera: &'a Camera,
    pub(super) active: ActiveParameters,
}

/// The streams of one sample: the path's, which is the image's own, the auxiliary rays', and that of
/// what is seen at the end of a pixel. Paths of one seed may differ in length, by whether they are
/// asked about materials, and must not disturb the others.
#[derive(Debug)]
pub(super) struct Streams {
    pub(super) path: Stream,
    pub(super) auxiliary: Stream,
    pub(super) pixel_end: Stream,
}

/// A method whose sample is a sum of covectors times rates. Forward mode multiplies, reverse mode
/// scatters the same covectors, so each is the other's transpose by construction.
pub(super) trait LinearMethod: Sync {
    /// What is worked out once for a pixel.
    type Pixel: Sync;

    /// Samples a pixel.
    fn samples(&self) -> usize;

    /// The seed of all streams.
    fn seed(&self) -> u64;

    /// Checks the method's own parameters.
    fn check(&self) -> Result<(), PathError>;

    fn pixel(&self, view: &View<'_>, pixel: usize) -> Self::Pixel;

    /// One sample of a pixel: pushes covectors and returns the number of rays.
    fn sample(
        &self,
        view: &View<'_>,
        pixel: &Self::Pixel,
        streams: &mut Streams,
        covectors: &mut Vec<Covector>,
    ) -> u64;
}

/// Words of stream addresses that no sample has.
const AUXILIARY: u64 = u64::MAX;
const PIXEL_END: u64 = u64::MAX - 1;
pub(super) const CONTROL: u64 = u64::MAX - 2;

fn streams(seed: u64, pixel: usize, sample: usize) -> Streams {
    Streams {
        path: path_stream(seed, pixel, sample),
        auxiliary: stream(seed, &[pixel as u64, sample as u64, AUXILIARY]),
        pixel_end: stream(seed, &[pixel as u64, sample as u64, PIXEL_END]),
    }
}

fn check<M: LinearMethod>(method: &M, camera: &Camera) -> Result<(), PathError> {
    camera.check()?;
    method.check()?;
    if method.samples() == 0 { Err(PathError::NoSamples) } else { Ok(()) }
}

pub(super) fn forward<M: LinearMethod>(
    method: &M,
    world: &World,
    camera: &Camera,
    change: &Tangent,
) -> Result<GradientImage, PathError> {
    check(method, camera)?;
    change.check(world)?;
    let active = ActiveParameters {
        geometry: change.is_geometric(),
        materials: change.materials.iter().any(|m| *m != Default::default()),
    };
    let view = View { world, camera, active };
    let pixels: Vec<PixelMoments> = (0..camera.film.pixels)
        .into_par_iter()
        .map(|pixel| {
            let prepared = method.pixel(&view, pixel);
            let mut covectors = vec![];
            let mut moments = PixelMoments::default();
            for sample in 0..method.samples() {
                covectors.clear();
                let mut streams = streams(method.seed(), pixel, sample);
                moments.rays += method.sample(&view, &prepared, &mut streams, &mut covectors);
                let mut value = [0.0; 3];
                for covector in &covectors {
                    let terms = change.pick(covector).to_array();
                    value.iter_mut().zip(terms).for_each(|(v, t)| *v += t);
                }
                if !moments.add(value) {
                    moments.non_finite.push((pixel, sample));
                }
            }
            moments
        })
        .collect();
    Ok(GradientImage {
        mean: pixels.iter().map(|p| terms([0, 1, 2].map(|i| p.moments[i].mean()))).collect(),
        term_error: pixels.iter().map(|p| terms([0, 1, 2].map(|i| p.moments[i].standard_error()))).collect(),
        standard_error: pixels.iter().map(|p| p.moments[3].standard_error()).collect(),
        rays: pixels.iter().map(|p| p.rays).sum(),
        non_finite: pixels.into_iter().flat_map(|p| p.non_finite).collect(),
    })
}

fn terms([interior, primary, secondary]: [f64; 3]) -> Terms<f64> {
    Terms { interior, primary, secondary }
}

/// Moments of the three terms and of their sum.
#[derive(Clone, Debug, Default)]
struct PixelMoments {
    moments: [Moments; 4],
    rays: u64,
    non_finite: Vec<(usize, usize)>,
}

impl PixelMoments {
    /// Whether the sample is finite; if not it counts as 0.
    fn add(&mut self, value: [f64; 3]) -> bool {
        let total = value[0] + value[1] + value[2];
        let finite = total.is_finite() && value.iter().all(|v| v.is_finite());
        let all = if finite { [value[0], value[1], value[2], total] } else { [0.0; 4] };
        self.moments.iter_mut().zip(all).for_each(|(m, v)| m.push(v));
        finite
    }
}

/// Independent batches in reverse mode: enough for a standard error, few enough to hold.
const BATCHES: usize = 16;

pub(super) fn reverse<M: LinearMethod>(
    method: &M,
    world: &World,
    camera: &Camera,
    adjoint: &[f64],
) -> Result<Gradient, PathError> {
    check(method, camera)?;
    if adjoint.len() != camera.film.pixels {
        return Err(PathError::AdjointSize { expected: camera.film.pixels, found: adjoint.len() });
    }
    let view = View { world, camera, active: ActiveParameters { geometry: true, materials: true } };
    let batches = BATCHES.min(method.samples());
    let parts: Vec<Batch> =
        (0..batches).into_par_iter().map(|batch| Batch::run(method, &view, adjoint, batch)).collect();
    let none = Tangent::none(world);
    let mut mean = Terms { interior: none.clone(), primary: none.clone(), secondary: none.clone() };
    for part in &parts {
        mean.interior.add(1.0, &part.gradient.interior);
        mean.primary.add(1.0, &part.gradient.primary);
        mean.secondary.add(1.0, &part.gradient.secondary);
    }
    let standard_error = standard_error(method.samples(), &parts, &mean, none);
    Ok(Gradient {
        mean,
        standard_error,
        rays: parts.iter().map(|p| p.rays).sum(),
        non_finite: parts.into_iter().flat_map(|p| p.non_finite).collect(),
    })
}

/// Each batch estimates its share of the gradient; shares differ by one sample at most.
fn standard_error(samples: usize, parts: &[Batch], mean: &Terms<Tangent>, mut out: Tangent) -> Tangent {
    let sum = |t: &Terms<Tangent>| t.interior.clone().and(&t.primary).and(&t.secondary);
    let total = sum(mean);
    let mut squares = vec![0.0; total.values().count()];
    for (batch, part) in parts.iter().enumerate() {
        let share = ((samples - batch).div_ceil(parts.len())) as f64 / samples as f64;
        let part = sum(&part.gradient);
        for ((s, g), m) in squares.iter_mut().zip(part.values()).zip(total.values()) {
            *s += (g - share * m).powi(2);
        }
    }
    let factor = parts.len() as f64 / (parts.len() as f64 - 1.0);
    let mut errors = squares.into_iter().map(|s| (s * factor).sqrt());
    out.for_each_value(|x| *x = errors.next().unwrap_or(f64::NAN));
    out
}

struct Batch {
    gradient: Terms<Tangent>,
    rays: u64,
    non_finite: Vec<(usize, usize)>,
}

impl Batch {
    fn run<M: LinearMethod>(method: &M, view: &View<'_>, adjoint: &[f64], batch: usize) -> Self {
        let none = Tangent::none(view.world);
        let gradient = Terms { interior: none.clone(), primary: none.clone(), secondary: none };
        let mut this = Self { gradient, rays: 0, non_finite: vec![] };
        let step = BATCHES.min(method.samples());
        let mut covectors = vec![];
        for (pixel, &delta) in adjoint.iter().enumerate() {
            if delta == 0.0 {
                continue;
            }
            let prepared = method.pixel(view, pixel);
            for sample in (batch..method.samples()).step_by(step) {
                covectors.clear();
                let mut streams = streams(method.seed(), pixel, sample);
                this.rays += method.sample(view, &prepared, &mut streams, &mut covectors);
                if covectors.iter().all(Covector::is_finite) {
                    let factor = delta / method.samples() as f64;
                    covectors.iter().for_each(|c| c.scatter(factor, &mut this.gradient));
                } else {
                    this.non_finite.push((pixel, sample));
                }
            }
        }
        this
    }
}
