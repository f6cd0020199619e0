//! Cost of each method as the plant grows.

use flatland::estimator::{EdgeSampling, Exact, GradientImage, Method, WarpedArea};
use flatland::plane::Film;
use flatland::plane::exact::Arrangement;
use flatland::random::{open01, stream};
use flatland::warp::Warp;
use glam::DVec2;

use super::foliage::{Foliage, SIDE};
use crate::context::Context;
use crate::figures::common::seconds;
use crate::plot::{Color, Marker, Palette, cut};
use crate::ratio::Ratio;

/// A method in the comparison.
pub(super) struct Racer {
    pub(super) name: &'static str,
    pub(super) color: Color,
    pub(super) marker: Marker,
    /// Samples a pixel for the variance in a draft: fewer where one costs more.
    samples: usize,
    /// Samples a pixel for the timing. Edge sampling lists the edges of a pixel once for all of them, so few
    /// would be unfair to it.
    pub(super) timed: usize,
    method: fn(usize, u64) -> Box<dyn Method>,
}

/// Edge sampling, then warped area without bias and as in the original.
pub(super) const RACERS: [Racer; 3] = [
    Racer {
        name: "edge sampling",
        color: Palette::VERMILION,
        marker: Marker::Square,
        samples: 64,
        timed: 64,
        method: |samples, seed| Box::new(EdgeSampling { samples, seed }),
    },
    Racer {
        name: "warped area, unbiased",
        color: Palette::BLUE,
        marker: Marker::Circle,
        samples: 64,
        timed: 16,
        method: |samples, seed| warped(Warp::default(), samples, seed),
    },
    Racer {
        name: "warped area, 16 rays",
        color: Palette::SKY,
        marker: Marker::TriangleUp,
        samples: 32,
        timed: 16,
        method: |samples, seed| warped(Warp::original(16), samples, seed),
    },
];

fn warped(warp: Warp, samples: usize, seed: u64) -> Box<dyn Method> {
    Box::new(WarpedArea { samples, construction: warp.into(), seed, ..WarpedArea::default() })
}

impl Racer {
    pub(super) fn samples(&self, context: &Context) -> usize {
        self.samples * context.spend(1, 16)
    }

    fn forward(&self, plant: &Foliage, samples: usize, seed: u64) -> anyhow::Result<GradientImage> {
        Ok((self.method)(samples, seed).forward(&plant.scene, &plant.motion, &plant.film)?)
    }
}

/// Measured cost of one method.
pub(super) struct Run {
    /// Mean over pixels and channels of the variance of one sample.
    pub(super) variance: f64,
    pub(super) rays: f64,
    /// Seconds a sample on one thread.
    pub(super) seconds: f64,
    /// ⟨estimate, exact⟩/⟨exact, exact⟩ over all pixels: 1 without bias. `None` where no exact derivative was
    /// computed.
    pub(super) recovered: Option<Ratio>,
}

impl Run {
    /// Cost of a given precision in rays.
    pub(super) fn rays_cost(&self) -> f64 {
        self.variance * self.rays
    }

    /// Cost of a given precision in seconds.
    pub(super) fn time_cost(&self) -> f64 {
        self.variance * self.seconds
    }
}

/// One plant and its measurements.
pub(super) struct Plant {
    pub(super) leaves: usize,
    pub(super) edges: usize,
    /// Mean number of leaves over a point of the film.
    pub(super) depth: f64,
    /// Visible part of the edge length on the film: by points on edges, and exactly.
    pub(super) visible: f64,
    pub(super) visible_exact: Option<f64>,
    /// Part of the edge samples whose point was covered.
    pub(super) wasted: f64,
    pub(super) runs: Vec<Run>,
}

/// Measures one plant.
pub(super) fn measure(context: &Context, leaves: usize) -> anyhow::Result<Plant> {
    let plant = Foliage::new(leaves, context.seed())?;
    let has_reference = leaves <= context.spend(256, 1024);
    let arrangement = has_reference.then(|| Arrangement::new(&plant.scene, &plant.film)).transpose()?;
    let exact = has_reference.then(|| Exact.forward(&plant.scene, &plant.motion, &plant.film)).transpose()?;
    let (mut runs, mut wasted) = (vec![], f64::NAN);
    for (index, racer) in RACERS.iter().enumerate() {
        let samples = racer.samples(context);
        let gradient = racer.forward(&plant, samples, context.seed())?;
        if index == 0 {
            wasted = covered_part(&plant, &gradient, samples);
        }
        let errors = gradient.standard_error.pixels();
        let seconds = seconds(|| racer.forward(&plant, racer.timed, context.seed()))?;
        runs.push(Run {
            variance: mean(errors.iter().map(|e| e.length_squared() / 3.0)) * samples as f64,
            rays: gradient.rays as f64 / (samples * SIDE * SIDE) as f64,
            seconds: seconds / (racer.timed * SIDE * SIDE) as f64,
            recovered: exact.as_ref().map(|exact| recovered(&gradient, exact)),
        });
    }
    let seen = |arrangement: Arrangement<'_>| {
        length(arrangement.silhouettes().map(|(ends, _)| ends), &plant.film)
            / length(edges(&plant), &plant.film)
    };
    Ok(Plant {
        leaves,
        edges: plant.scene.edges().count(),
        depth: depth(&plant),
        visible: visible_part(&plant, context),
        visible_exact: arrangement.map(seen),
        wasted,
        runs,
    })
}

fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values.fold((0.0, 0), |(sum, count), value| (sum + value, count + 1));
    sum / f64::from(count.max(1))
}

/// The part of the exact derivative that the estimate recovers, by projection.
fn recovered(gradient: &GradientImage, exact: &GradientImage) -> Ratio {
    let size = exact.mean.dot(&exact.mean);
    let noise = gradient.standard_error.zip(&exact.mean, |a, b| a * b);
    Ratio { value: gradient.mean.dot(&exact.mean) / size, error: noise.dot(&noise).sqrt() / size }
}

/// Part of the edge samples that cost two rays: one for the area, and one that found its point covered. A
/// visible one costs three, a pixel without edges one.
fn covered_part(plant: &Foliage, gradient: &GradientImage, samples: usize) -> f64 {
    let bare = (0..SIDE * SIDE).filter(|i| !has_edges(plant, i % SIDE, i / SIDE)).count();
    let drawn = ((SIDE * SIDE - bare) * samples) as f64;
    let visible = gradient.rays as f64 - (bare * samples) as f64 - 2.0 * drawn;
    1.0 - visible / drawn
}

fn edges(plant: &Foliage) -> impl Iterator<Item = [DVec2; 2]> {
    plant.scene.edges().map(|(_, edge)| edge.map(|v| plant.scene.vertices()[v]))
}

fn has_edges(plant: &Foliage, x: usize, y: usize) -> bool {
    let (low, high) = plant.film.support(plant.film.centre(x, y));
    edges(plant).any(|ends| cut(ends, low, high).is_some())
}

/// The length of segments on the film.
fn length(segments: impl Iterator<Item = [DVec2; 2]>, film: &Film) -> f64 {
    let (low, high) = film.extent();
    let on_film = |ends: [DVec2; 2]| {
        cut(ends, low, high).map_or(0.0, |(start, end)| (end - start) * ends[0].distance(ends[1]))
    };
    segments.map(on_film).sum()
}

/// The visible part of the edges on the film, by uniform points on them.
fn visible_part(plant: &Foliage, context: &Context) -> f64 {
    let (low, high) = plant.film.extent();
    let mut rng = stream(context.seed(), &[u64::MAX]);
    let mut parts = vec![];
    let mut total = 0.0;
    for (shape, e) in plant.scene.edges() {
        let ends = e.map(|v| plant.scene.vertices()[v]);
        if let Some((start, end)) = cut(ends, low, high) {
            total += (end - start) * ends[0].distance(ends[1]);
            parts.push((total, shape, ends[0].lerp(ends[1], start), ends[0].lerp(ends[1], end)));
        }
    }
    let count = context.spend(40_000, 400_000);
    let seen = (0..count).filter(|_| {
        let at = open01(&mut rng) * total;
        let (_, shape, p, q) = parts[parts.partition_point(|part| part.0 < at).min(parts.len() - 1)];
        !plant.scene.is_covered(p.lerp(q, open01(&mut rng)), shape)
    });
    seen.count() as f64 / f64::from(count)
}

/// Mean number of leaves over a point of the film, over a grid.
fn depth(plant: &Foliage) -> f64 {
    let count = 24;
    let layers = |i: usize| {
        let place = DVec2::new((i % count) as f64, (i / count) as f64) + 0.5;
        let u = place * SIDE as f64 / count as f64;
        std::iter::successors(plant.scene.hit(u), |hit| plant.scene.hit_below(u, hit.shape())).count()
    };
    mean((0..count * count).map(|i| layers(i) as f64))
}
