//! Numbers of a state: image, field and derivatives, by every method.

use std::collections::BTreeMap;
use std::time::Instant;

use anyhow::Result;
use flatland::estimator::transport::{EdgeSampling, Kernels, Method, WarpedArea};
use flatland::random::stream;
use flatland::transport::exact::Exact;
use flatland::transport::fields::Construction;
use flatland::transport::{Camera, Paths, Tangent, World};
use flatland::warp::{BoundaryFunction, Debias, Warp, Weighting};
use glam::DVec2;
use serde::Serialize;

use super::rays::{Moment, Ray, rays, swing};
use super::state::{FLOOR, LIGHT, OCCLUDER, State, WALL};
use crate::figures::common::Agreement;

/// Places on the film at which the field is shown.
const PLACES: usize = 192;
/// Most samples a pixel while something is dragged.
const QUICK_SAMPLES: usize = 16;
/// Reach of the mean over discontinuities, in kernel widths.
const REACH: f64 = 8.0;

/// Data for the page's plots.
#[derive(Debug, Serialize)]
pub(super) struct Numbers {
    link: String,
    shapes: Vec<Drawn>,
    /// The camera's position, and the directions of the ends of its film.
    eye: [f64; 2],
    view: [[f64; 2]; 2],
    /// The exact image, and its derivative.
    image: Vec<f64>,
    exact: Vec<f64>,
    methods: Vec<Estimate>,
    /// V over the film in pixels per unit of θ, at equally spaced places.
    fields: Vec<Field>,
    /// Auxiliary rays around a film point, and the visible shapes while θ oscillates.
    rays: Vec<Ray>,
    swing: Vec<Moment>,
    ranges: BTreeMap<&'static str, [f64; 2]>,
    milliseconds: f64,
}

#[derive(Debug, Serialize)]
struct Drawn {
    name: &'static str,
    points: Vec<[f64; 2]>,
    is_closed: bool,
    /// Velocity of its middle as θ grows.
    motion: [f64; 2],
}

/// One method's derivative of every pixel.
#[derive(Debug, Serialize)]
struct Estimate {
    name: &'static str,
    values: Vec<f64>,
    errors: Vec<f64>,
    /// Slope on the exact derivative; 1 is right.
    slope: f64,
    slope_error: f64,
    /// Root mean squares relative to the derivative.
    noise: f64,
    /// Rays per sample.
    rays: f64,
    /// Rays a pixel to a noise of 10 %.
    needed: f64,
}

#[derive(Debug, Serialize)]
struct Field {
    name: &'static str,
    values: Vec<f64>,
}

impl Numbers {
    /// All numbers of a state; while something is dragged, coarser ones.
    pub(super) fn new(state: &State, is_quick: bool) -> Result<Self> {
        let start = Instant::now();
        let effort = if is_quick { Effort::QUICK } else { Effort::WHOLE };
        let (world, camera) = (state.world()?, state.camera());
        let change = state.change(&world);
        let exact = Exact { tolerance: effort.tolerance, ..Exact::default() };
        let image = exact.image(&world, &camera)?.pixels;
        let exact: Vec<f64> =
            exact.gradient(&world, &camera, &change)?.pixels.iter().map(|t| t.total()).collect();
        let setting = Posed { state, effort, world: &world, camera: &camera, change: &change };
        let methods = setting.methods(&exact)?;
        let ends = [0.0, camera.film.pixels as f64].map(|u| camera.direction(u).to_array());
        Ok(Self {
            link: state.link(),
            shapes: setting.shapes(),
            eye: camera.position.to_array(),
            view: ends,
            image,
            exact,
            methods,
            fields: setting.fields(),
            rays: rays(state, &world, &camera, setting.warp()),
            swing: swing(state, PLACES)?,
            ranges: State::ranges().collect(),
            milliseconds: start.elapsed().as_secs_f64() * 1e3,
        })
    }
}

/// Resolution of the numbers.
#[derive(Clone, Copy)]
struct Effort {
    /// Tolerance of the values called exact, relative to the sum of absolute terms.
    tolerance: f64,
    most_samples: usize,
    /// Number of estimates averaged at each place of a field.
    repeats: u64,
}

impl Effort {
    /// Finer than any screen.
    const WHOLE: Self = Self { tolerance: 1e-4, most_samples: usize::MAX, repeats: 4 };
    const QUICK: Self = Self { tolerance: 1e-3, most_samples: QUICK_SAMPLES, repeats: 1 };
}

/// A state with the objects built from it.
struct Posed<'a> {
    state: &'a State,
    effort: Effort,
    world: &'a World,
    camera: &'a Camera,
    change: &'a Tangent,
}

impl Posed<'_> {
    /// The warp field of warped-area sampling, with the state's γ and N′.
    fn warp(&self) -> Warp {
        let first = Warp::one_dimensional();
        let weighting =
            Weighting::BoundaryAware { gamma: self.state.gamma(), boundary: BoundaryFunction::default() };
        let debias = self.state.rays().map_or(first.debias, |rays| Debias::Consistent { rays });
        Warp { weighting, debias, ..first }
    }

    fn methods(&self, exact: &[f64]) -> Result<Vec<Estimate>> {
        let (samples, seed) = (self.state.samples().min(self.effort.most_samples), self.state.seed());
        let paths = Paths { bounces: 1, ..Paths::default() };
        let kernels = Kernels { film: self.state.kappa(), ..Kernels::default() };
        let warped = |construction| WarpedArea {
            samples,
            paths,
            construction,
            kernels,
            seed,
            ..WarpedArea::default()
        };
        let edges = EdgeSampling { samples, paths, seed, ..EdgeSampling::default() };
        let all: [(&'static str, &dyn Method); 4] = [
            ("naive differentiation", &warped(Construction::Still)),
            ("edge sampling", &edges),
            ("warped area", &warped(Construction::Local(self.warp()))),
            ("warped area, mean over jumps", &warped(Construction::JumpMean { reach: REACH })),
        ];
        let estimate = |(name, method): (&'static str, &dyn Method)| -> Result<Estimate> {
            let found = method.forward(self.world, self.camera, self.change)?;
            let values = found.total();
            let agreement = Agreement::new(&values, &found.standard_error.total, exact);
            Ok(Estimate {
                name,
                slope: agreement.slope.value,
                slope_error: agreement.slope.error,
                noise: agreement.noise,
                rays: found.rays as f64 / (samples * values.len()) as f64,
                needed: found.rays as f64 / values.len() as f64 * (agreement.noise / 0.1).powi(2),
                values,
                errors: found.standard_error.total,
            })
        };
        all.into_iter().map(estimate).collect()
    }

    fn fields(&self) -> Vec<Field> {
        let vertices = &self.change.vertices;
        let width = self.camera.film.pixels as f64;
        let along = |name, construction: Construction, repeats: u64| {
            let at = |place: usize| {
                let u = width * (place as f64 + 0.5) / PLACES as f64;
                let one = |repeat: u64| {
                    let mut dice = stream(self.state.seed(), &[place as u64, repeat]);
                    let form =
                        construction.over_film(self.world, self.camera, u, self.state.kappa(), &mut dice);
                    form.at(vertices, self.change.camera.position, &self.change.camera)[0]
                };
                (0..repeats).map(one).sum::<f64>() / repeats as f64
            };
            Field { name, values: (0..PLACES).map(at).collect() }
        };
        vec![
            along("direct: what is seen", Construction::Direct, 1),
            along("warped area", Construction::Local(self.warp()), self.effort.repeats),
            along("mean over jumps", Construction::JumpMean { reach: REACH }, 1),
        ]
    }

    fn shapes(&self) -> Vec<Drawn> {
        let drawn = |(index, shape): (usize, &flatland::transport::Shape)| {
            let moved = self.world.vertices_of(index).map(|v| self.change.vertices[v]);
            let motion = moved.sum::<DVec2>() / shape.points().len() as f64;
            Drawn {
                name: match index {
                    FLOOR => "floor",
                    LIGHT => "light",
                    OCCLUDER => "occluder",
                    WALL => "wall",
                    _ => "leaf",
                },
                points: shape.points().iter().map(DVec2::to_array).collect(),
                is_closed: shape.is_closed(),
                motion: motion.to_array(),
            }
        };
        self.world.shapes().iter().enumerate().map(drawn).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unbiased_methods_agree_with_the_exact_derivative_and_naive_differentiation_does_not() {
        for link in [
            "samples=1024&rays=0",
            "samples=1024&rays=0&width=0.3&moves=3",
            "samples=1024&rays=0&moves=4&gamma=2",
            "samples=1024&rays=0&leaves=30",
        ] {
            let numbers = Numbers::new(&State::parse(link).unwrap(), false).unwrap();
            let [naive, edges, warped, jumps] = numbers.methods.as_slice() else { panic!() };
            for method in [edges, warped, jumps] {
                let off = (method.slope - 1.0).abs();
                assert!(off < 5.0 * method.slope_error && method.slope_error < 0.1, "{link} {method:?}");
            }
            assert!((naive.slope - 1.0).abs() > 0.3, "{link} {}", naive.slope);
            let shares: f64 = numbers.rays.iter().map(|ray| ray.share).sum();
            assert!((shares - 1.0).abs() < 1e-9 && numbers.rays.len() == 16, "{link} {shares}");
            assert_eq!(numbers.swing.len(), 13);
        }
    }
}
