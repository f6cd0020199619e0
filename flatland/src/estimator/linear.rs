//! Forward and reverse mode of all methods whose samples are linear in the velocities.

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::{EstimatorError, GradientImage, VertexGradient, check_adjoint};
use crate::moments::Moments;
use crate::plane::{Film, Image, MaterialPoint, Motion, Scene, add};
use crate::random::{Stream, stream};

/// One covector per channel: the derivative of a sample of dI/dθ by the velocity of a material point.
pub(super) type Covectors = [DVec2; 3];

/// A method whose sample is Σ covector · velocity over material points. Forward mode multiplies, reverse mode
/// scatters the same covectors, so each is the transpose of the other by construction.
pub(super) trait LinearMethod: Sync {
    /// Data prepared once per scene.
    type Prepared: Sync;
    /// Data prepared once per pixel.
    type Pixel;

    /// Samples per pixel.
    fn samples(&self) -> usize;

    /// Seed of all streams.
    fn seed(&self) -> u64;

    fn prepare(&self, scene: &Scene, film: &Film) -> Result<Self::Prepared, EstimatorError>;

    fn pixel(&self, view: &View<'_, Self::Prepared>, x: usize, y: usize) -> Self::Pixel;

    /// One sample: emits covectors, and returns the number of rays.
    fn sample(
        &self,
        view: &View<'_, Self::Prepared>,
        pixel: &Self::Pixel,
        rng: &mut Stream,
        emit: impl FnMut(&MaterialPoint, &Covectors),
    ) -> u64;
}

/// A scene and its film, with the prepared data of a method.
#[derive(Debug)]
pub(super) struct View<'a, P> {
    pub(super) scene: &'a Scene,
    pub(super) film: &'a Film,
    pub(super) prepared: P,
}

/// The stream of one sample of one pixel.
pub(super) fn sample_stream(seed: u64, pixel: usize, sample: usize) -> Stream {
    stream(seed, &[pixel as u64, sample as u64])
}

pub(super) fn forward<M: LinearMethod>(
    method: &M,
    scene: &Scene,
    motion: &Motion,
    film: &Film,
) -> Result<GradientImage, EstimatorError> {
    let velocities = motion.velocities(scene)?;
    let view = View { scene, film, prepared: method.prepare(scene, film)? };
    check_samples(method.samples())?;
    Ok(gradient_image(film, method.samples(), |x, y| {
        let pixel = method.pixel(&view, x, y);
        let index = y * film.width() + x;
        let view = &view;
        let velocities = &velocities;
        move |sample| {
            let mut value = DVec3::ZERO;
            let mut rng = sample_stream(method.seed(), index, sample);
            let rays = method.sample(view, &pixel, &mut rng, |point, covectors| {
                let v = point.velocity(velocities);
                value += DVec3::from(covectors.map(|c| c.dot(v)));
            });
            (value, rays)
        }
    }))
}

/// Mean and standard error of `samples` samples of every pixel; `pixel(x, y)` returns the function from the
/// index of a sample to its value and rays.
pub(super) fn gradient_image<F: FnMut(usize) -> (DVec3, u64)>(
    film: &Film,
    samples: usize,
    pixel: impl Fn(usize, usize) -> F + Sync,
) -> GradientImage {
    let width = film.width();
    let pixels: Vec<_> = (0..width * film.height())
        .into_par_iter()
        .map(|i| {
            let mut sample = pixel(i % width, i / width);
            let mut all = Samples::default();
            for s in 0..samples {
                all.add(sample(s));
            }
            all
        })
        .collect();
    GradientImage {
        mean: Image::from_pixels(film, pixels.iter().map(|p| p.values.mean()).collect()),
        standard_error: Image::from_pixels(film, pixels.iter().map(Samples::standard_error).collect()),
        rays: pixels.iter().map(|p| p.rays).sum(),
        non_finite: pixels.iter().map(|p| p.non_finite).sum(),
    }
}

/// Accumulated samples of a pixel.
#[derive(Clone, Copy, Debug, Default)]
struct Samples {
    values: Moments<DVec3>,
    rays: u64,
    non_finite: u64,
}

impl Samples {
    fn add(&mut self, (value, rays): (DVec3, u64)) {
        self.rays += rays;
        // A non-finite sample counts as 0, in forward and reverse mode: both remain a linear map and its
        // transpose.
        let finite = value.is_finite();
        self.values.push(if finite { value } else { DVec3::ZERO });
        self.non_finite += u64::from(!finite);
    }

    fn standard_error(&self) -> DVec3 {
        self.values.variance_of_mean().map(f64::sqrt)
    }
}

/// Number of independent batches in reverse mode: enough for a standard error, few enough to store.
const BATCHES: usize = 16;

pub(super) fn reverse<M: LinearMethod>(
    method: &M,
    scene: &Scene,
    film: &Film,
    adjoint: &Image,
) -> Result<VertexGradient, EstimatorError> {
    check_adjoint(film, adjoint)?;
    check_samples(method.samples())?;
    let view = View { scene, film, prepared: method.prepare(scene, film)? };
    let batches = BATCHES.min(method.samples());
    let parts: Vec<_> =
        (0..batches).into_par_iter().map(|batch| reverse_batch(method, &view, adjoint, batch)).collect();
    let mut mean = vec![DVec2::ZERO; scene.vertices().len()];
    parts.iter().for_each(|part| add(&mut mean, &part.gradient));
    // Each batch estimates its share; shares differ by at most one sample.
    let mut squares = vec![DVec2::ZERO; mean.len()];
    for (batch, part) in parts.iter().enumerate() {
        let share = share(method.samples(), batch) as f64 / method.samples() as f64;
        for ((s, g), m) in squares.iter_mut().zip(&part.gradient).zip(&mean) {
            let d = *g - share * *m;
            *s += d * d;
        }
    }
    let factor = batches as f64 / (batches as f64 - 1.0);
    Ok(VertexGradient {
        mean,
        standard_error: squares.iter().map(|s| (*s * factor).map(f64::sqrt)).collect(),
        rays: parts.iter().map(|p| p.rays).sum(),
        non_finite: parts.iter().map(|p| p.non_finite).sum(),
    })
}

struct Batch {
    gradient: Vec<DVec2>,
    rays: u64,
    non_finite: u64,
}

/// Number of samples in a batch: those congruent to its index.
fn share(samples: usize, batch: usize) -> usize {
    (samples - batch).div_ceil(BATCHES.min(samples))
}

fn reverse_batch<M: LinearMethod>(
    method: &M,
    view: &View<'_, M::Prepared>,
    adjoint: &Image,
    batch: usize,
) -> Batch {
    let film = view.film;
    let mut out = Batch { gradient: vec![DVec2::ZERO; view.scene.vertices().len()], rays: 0, non_finite: 0 };
    let scale = 1.0 / method.samples() as f64;
    let mut emitted: Vec<(MaterialPoint, DVec2)> = vec![];
    for y in 0..film.height() {
        for x in 0..film.width() {
            let delta = adjoint.pixel(x, y) * scale;
            if delta == DVec3::ZERO {
                continue;
            }
            let pixel = method.pixel(view, x, y);
            for sample in (batch..method.samples()).step_by(BATCHES.min(method.samples())) {
                let mut rng = sample_stream(method.seed(), y * film.width() + x, sample);
                emitted.clear();
                out.rays += method.sample(view, &pixel, &mut rng, |point, covectors| {
                    let c = delta.x * covectors[0] + delta.y * covectors[1] + delta.z * covectors[2];
                    emitted.push((*point, c));
                });
                if emitted.iter().all(|(_, c)| c.is_finite()) {
                    emitted.iter().for_each(|(point, c)| point.scatter(*c, &mut out.gradient));
                } else {
                    out.non_finite += 1;
                }
            }
        }
    }
    out
}

pub(super) fn check_samples(samples: usize) -> Result<(), EstimatorError> {
    if samples == 0 { Err(EstimatorError::NoSamples) } else { Ok(()) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plane::{Filter, Polygon, Shade, Shape};
    use crate::random::open01;

    /// Samples with occasional non-finite covectors.
    struct Failing;

    impl LinearMethod for Failing {
        type Prepared = ();
        type Pixel = ();

        fn samples(&self) -> usize {
            50
        }

        fn seed(&self) -> u64 {
            3
        }

        fn prepare(&self, _: &Scene, _: &Film) -> Result<(), EstimatorError> {
            Ok(())
        }

        fn pixel(&self, _: &View<'_, ()>, _: usize, _: usize) {}

        fn sample(
            &self,
            _: &View<'_, ()>,
            (): &(),
            rng: &mut Stream,
            mut emit: impl FnMut(&MaterialPoint, &Covectors),
        ) -> u64 {
            for v in 0..3 {
                let fails = open01(rng) < 0.1;
                let x = if fails { f64::INFINITY } else { open01(rng) };
                emit(&MaterialPoint::vertex(v), &[DVec2::new(x, open01(rng)); 3]);
            }
            1
        }
    }

    /// Non-finite samples count as 0 forward and in reverse, and both report their number.
    #[test]
    fn forward_and_reverse_are_transposes_where_samples_fail() {
        let corners = [(-0.5, -0.5), (0.5, -0.5), (0.0, 0.6)].map(|(x, y)| DVec2::new(x, y));
        let shape = Shape::new(Polygon::simple(corners).unwrap(), Shade::constant(DVec3::ONE));
        let scene = Scene::new(DVec3::ZERO, vec![shape]).unwrap();
        let film = Film::new(2, 2, Filter::Tent).unwrap();
        let motion = Motion::translate([0], DVec2::new(0.3, -0.7));
        let weights: Vec<DVec3> = (1..5).map(|i| DVec3::new(1.0, 0.5, -0.2) * f64::from(i)).collect();
        let image = forward(&Failing, &scene, &motion, &film).unwrap();
        let pairs = image.mean.pixels().iter().zip(&weights);
        let along: f64 = pairs.map(|(g, w)| g.dot(*w)).sum();
        let gradient = reverse(&Failing, &scene, &film, &Image::from_pixels(&film, weights)).unwrap();
        let velocities = motion.velocities(&scene).unwrap();
        let back: f64 = gradient.mean.iter().zip(&velocities).map(|(g, v)| g.dot(*v)).sum();
        assert!(image.non_finite > 20 && image.non_finite == gradient.non_finite, "{}", image.non_finite);
        assert!((along - back).abs() < 1e-12 * along.abs(), "{along} {back}");
    }
}
