//! What each method pays as the plant grows.

use std::time::Instant;

use flatland::estimator::{EdgeSampling, Exact, GradientImage, Method, WarpedArea};
use flatland::plane::Film;
use flatland::plane::exact::Arrangement;
use flatland::random::{open01, stream};
use flatland::warp::Warp;
use glam::DVec2;

use super::foliage::{Foliage, SIDE};
use crate::context::Context;
use crate::plot::{Color, Marker, Palette};

/// A method in the race.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Racer {
    Edges,
    Warped,
    Original,
}

impl Racer {
    pub(super) const ALL: [Self; 3] = [Self::Edges, Self::Warped, Self::Original];

    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Edges => "edge sampling",
            Self::Warped => "warped area, unbiased",
            Self::Original => "warped area, 16 rays",
        }
    }

    pub(super) fn color(self) -> Color {
        match self {
            Self::Edges => Palette::VERMILION,
            Self::Warped => Palette::BLUE,
            Self::Original => Palette::SKY,
        }
    }

    pub(super) fn marker(self) -> Marker {
        match self {
            Self::Edges => Marker::Square,
            Self::Warped => Marker::Circle,
            Self::Original => Marker::TriangleUp,
        }
    }

    /// Samples a pixel to measure the variance: fewer where one costs more.
    pub(super) fn samples(self, context: &Context) -> usize {
        let draft = match self {
            Self::Edges => 64,
            Self::Warped => 64,
            Self::Original => 32,
        };
        draft * context.spend(1, 16)
    }

    /// Samples a pixel to measure the time. Edge sampling lists the edges of a pixel once for all of
    /// them, so few would be unfair to it.
    pub(super) fn timed_samples(self) -> usize {
        if self == Self::Edges { 64 } else { 16 }
    }

    fn forward(self, plant: &Foliage, samples: usize, seed: u64) -> anyhow::Result<GradientImage> {
        let Foliage { scene, motion, film } = plant;
        let warped =
            |warp: Warp| WarpedArea { samples, construction: warp.into(), seed, ..WarpedArea::default() };
        Ok(match self {
            Self::Edges => EdgeSampling { samples, seed }.forward(scene, motion, film)?,
            Self::Warped => warped(Warp::default()).forward(scene, motion, film)?,
            Self::Original => warped(Warp::original(16)).forward(scene, motion, film)?,
        })
    }
}

/// What one method paid.
pub(super) struct Run {
    /// Mean over pixels and channels of the variance of one sample.
    pub(super) variance: f64,
    pub(super) rays: f64,
    /// Seconds a sample on one thread.
    pub(super) seconds: f64,
    /// ⟨estimate, exact⟩/⟨exact, exact⟩ over all pixels, 1 without bias, and its standard error. None
    /// where no exact derivative was computed.
    pub(super) recovered: Option<[f64; 2]>,
}

impl Run {
    /// What a given precision costs in rays.
    pub(super) fn rays_cost(&self) -> f64 {
        self.variance * self.rays
    }

    /// What a given precision costs in seconds.
    pub(super) fn time_cost(&self) -> f64 {
        self.variance * self.seconds
    }
}

/// One plant and what it costs.
pub(super) struct Plant {
    pub(super) leaves: usize,
    pub(super) edges: usize,
    /// Leaves over a point of the film, on average.
    pub(super) depth: f64,
    /// Visible part of the edge length on the film: by points on edges, and exactly.
    pub(super) visible: f64,
    pub(super) visible_exact: Option<f64>,
    /// Part of the edge samples that found their point covered.
    pub(super) wasted: f64,
    pub(super) runs: Vec<Run>,
}

/// Measures one plant.
pub(super) fn measure(context: &Context, leaves: usize) -> anyhow::Result<Plant> {
    let plant = Foliage::new(leaves, context.seed())?;
    let has_reference = leaves <= context.spend(256, 1024);
    let arrangement = has_reference.then(|| Arrangement::new(&plant.scene, &plant.film)).transpose()?;
    let exact = has_reference.then(|| Exact.forward(&plant.scene, &plant.motion, &plant.film)).transpose()?;
    let mut runs = vec![];
    let mut wasted = f64::NAN;
    for racer in Racer::ALL {
        let samples = racer.samples(context);
        let gradient = racer.forward(&plant, samples, context.seed())?;
        if racer == Racer::Edges {
            wasted = covered_part(&plant, &gradient, samples);
        }
        let errors = gradient.standard_error.pixels();
        let variance = mean(errors.iter().map(|e| e.length_squared() / 3.0)) * samples as f64;
        let rays = gradient.rays as f64 / (samples * SIDE * SIDE) as f64;
        let recovered = exact.as_ref().map(|exact| recovered(&gradient, exact));
        runs.push(Run { variance, rays, seconds: time(&plant, racer, context)?, recovered });
    }
    let all = all_length(&plant);
    Ok(Plant {
        leaves,
        edges: plant.scene.edges().count(),
        depth: depth(&plant),
        visible: visible_part(&plant, context),
        visible_exact: arrangement.map(|arrangement| seen_length(&arrangement, &plant.film) / all),
        wasted,
        runs,
    })
}

fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values.fold((0.0, 0), |(sum, count), value| (sum + value, count + 1));
    sum / f64::from(count.max(1))
}

/// The part of the exact derivative that the estimate recovers, by projection, and its standard error.
fn recovered(gradient: &GradientImage, exact: &GradientImage) -> [f64; 2] {
    let size = exact.mean.dot(&exact.mean);
    let noise = gradient.standard_error.zip(&exact.mean, |a, b| a * b);
    [gradient.mean.dot(&exact.mean) / size, noise.dot(&noise).sqrt() / size]
}

/// Seconds a sample on one thread: the faster of two runs, because other programs can only slow it down.
fn time(plant: &Foliage, racer: Racer, context: &Context) -> anyhow::Result<f64> {
    let samples = racer.timed_samples();
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build()?;
    let run = || -> anyhow::Result<f64> {
        let start = Instant::now();
        racer.forward(plant, samples, context.seed())?;
        Ok(start.elapsed().as_secs_f64() / (samples * SIDE * SIDE) as f64)
    };
    pool.install(|| Ok(run()?.min(run()?)))
}

/// Of the edge samples, those that cost two rays: one for the area, one that found its point covered.
/// A visible one costs three, a pixel without edges one.
fn covered_part(plant: &Foliage, gradient: &GradientImage, samples: usize) -> f64 {
    let bare = (0..SIDE * SIDE).filter(|i| !has_edges(plant, i % SIDE, i / SIDE)).count();
    let drawn = ((SIDE * SIDE - bare) * samples) as f64;
    let visible = gradient.rays as f64 - (bare * samples) as f64 - 2.0 * drawn;
    1.0 - visible / drawn
}

fn has_edges(plant: &Foliage, x: usize, y: usize) -> bool {
    let (low, high) = plant.film.support(plant.film.centre(x, y));
    plant.scene.edges().any(|(_, e)| inside(e.map(|v| plant.scene.vertices()[v]), low, high).is_some())
}

/// The part of a segment in a box, as parameters along it (Liang and Barsky 1984).
fn inside([p, q]: [DVec2; 2], low: DVec2, high: DVec2) -> Option<(f64, f64)> {
    let d = q - p;
    let (mut start, mut end) = (0.0_f64, 1.0_f64);
    for axis in 0..2 {
        let [a, b] = [(low[axis] - p[axis]) / d[axis], (high[axis] - p[axis]) / d[axis]];
        if d[axis] == 0.0 {
            if p[axis] < low[axis] || p[axis] > high[axis] {
                return None;
            }
            continue;
        }
        (start, end) = (start.max(a.min(b)), end.min(a.max(b)));
    }
    (start < end).then_some((start, end))
}

fn clipped_length(ends: [DVec2; 2], film: &Film) -> f64 {
    let (low, high) = film.extent();
    inside(ends, low, high).map_or(0.0, |(start, end)| (end - start) * ends[0].distance(ends[1]))
}

/// The length of all edges on the film, seen or not.
fn all_length(plant: &Foliage) -> f64 {
    plant.scene.edges().map(|(_, e)| clipped_length(e.map(|v| plant.scene.vertices()[v]), &plant.film)).sum()
}

fn seen_length(arrangement: &Arrangement<'_>, film: &Film) -> f64 {
    arrangement.silhouettes().map(|(ends, _)| clipped_length(ends, film)).sum()
}

/// The visible part of the edges on the film, by uniform points on them.
fn visible_part(plant: &Foliage, context: &Context) -> f64 {
    let (low, high) = plant.film.extent();
    let mut rng = stream(context.seed(), &[u64::MAX]);
    let mut parts = vec![];
    let mut total = 0.0;
    for (shape, e) in plant.scene.edges() {
        let ends = e.map(|v| plant.scene.vertices()[v]);
        if let Some((start, end)) = inside(ends, low, high) {
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

/// Leaves over a point of the film, on average over a grid.
fn depth(plant: &Foliage) -> f64 {
    let count = 24;
    let layers = |i: usize| {
        let place = DVec2::new((i % count) as f64, (i / count) as f64) + 0.5;
        let u = place * SIDE as f64 / count as f64;
        std::iter::successors(plant.scene.hit(u), |hit| plant.scene.hit_below(u, hit.shape())).count()
    };
    mean((0..count * count).map(|i| layers(i) as f64))
}
