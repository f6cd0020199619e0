//! Exact images and derivatives: every pixel is integrated between its discontinuities.
//!
//! For every sequence of decisions, the curves of the chain are compared at the points of a grid on the
//! film, and bisection finds the discontinuities between them. Where the k-th point reaches the end of its
//! curve, s_k = 0 or 1, the discontinuity has the velocity −(∂s_k/∂u)⁻¹ ∂s_k/∂θ. Where its ray is tangent to
//! an arc, the discontinuity is a zero of R − |ω × (c − o)| and has the velocity of that zero.

use super::error::ChainError;
use super::follow::{Chain, End, Touching, Vertex};
use super::world::{Constants, Source, World};
use crate::calculus::{Dual, Number};
use crate::quadrature::adaptive;
use crate::transport::Camera;

/// Exact integrals of a world of mirrors, glass and openings.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Exact {
    /// Most points of a chain; longer ones carry no light, here as in the estimators.
    pub longest: usize,
    /// Points of the grid per pixel. A feature that is narrower than a cell may be missed.
    pub cells: usize,
}

impl Default for Exact {
    fn default() -> Self {
        Self { longest: 8, cells: 256 }
    }
}

/// The derivative of a pixel, by terms.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ChainTerms {
    /// ∫ h ∂f/∂θ du.
    pub interior: f64,
    /// Discontinuities at the first point: what the camera sees directly.
    pub primary: f64,
    /// Discontinuities at later points: what is seen in mirrors, through glass and through openings.
    pub chain: f64,
    /// Shadows of lights without extent.
    pub shadow: f64,
}

impl ChainTerms {
    /// The derivative.
    #[must_use]
    pub fn total(&self) -> f64 {
        self.interior + self.primary + self.chain + self.shadow
    }
}

/// The image and its derivative.
#[derive(Clone, Debug, PartialEq)]
pub struct ExactImage {
    /// The pixels.
    pub image: Vec<f64>,
    /// Their derivatives.
    pub derivative: Vec<ChainTerms>,
}

/// Relative tolerance of integrals between discontinuities.
const TOLERANCE: f64 = 1e-10;

/// Numbers with derivatives by u and by θ.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Along<'a> {
    /// Rates of the world's numbers, then of the camera's.
    pub(crate) rates: &'a [f64],
}

impl Source for Along<'_> {
    type Number = Dual<2>;

    fn numbers<const K: usize>(&self, first: usize, values: [f64; K]) -> [Dual<2>; K] {
        std::array::from_fn(|i| Dual::new(values[i], [0.0, self.rates[first + i]]))
    }
}

/// The discrete part of a chain: its curves, their sides, its end, and the lights in view.
type Key = Vec<usize>;

fn key_of<T>(chain: &Chain<T>) -> Key {
    let vertex = |v: &Vertex<T>| {
        let flags = [v.is_far, v.is_left, v.is_total].map(usize::from);
        8 * v.surface + 4 * flags[0] + 2 * flags[1] + flags[2]
    };
    let mut key: Key = chain.vertices.iter().map(vertex).collect();
    key.push(usize::MAX - chain.end as usize);
    for part in &chain.parts {
        key.push(usize::MAX - 8 - usize::from(part.is_above));
        key.extend(part.shadows.iter().map(vertex));
    }
    key
}

/// Halvings of a cell towards a discontinuity, in search of others next to it.
const GRADING: i32 = 24;

/// Most repetitions of that search.
const ROUNDS: usize = 2;

/// Adjacent numbers between which the key changes, found by bisection between nodes in ascending order.
fn find_breaks(nodes: &[f64], key: &mut impl FnMut(f64) -> Key) -> Vec<Break> {
    let mut breaks = vec![];
    let mut before: Option<(f64, Key)> = None;
    for &u in nodes {
        let after = (u, key(u));
        let mut open: Vec<_> = before.take().map(|before| (before, after.clone())).into_iter().collect();
        while let Some((a, b)) = open.pop() {
            if a.1 == b.1 {
                continue;
            }
            let u = 0.5 * (a.0 + b.0);
            if u <= a.0 || u >= b.0 {
                breaks.push([a.0, b.0]);
                continue;
            }
            let middle = (u, key(u));
            open.push((middle.clone(), b));
            open.push((a, middle));
        }
        before = Some(after);
    }
    breaks
}

/// A film coordinate where the integrand of a sequence of decisions is not analytic: the floating-point
/// numbers before and after it.
type Break = [f64; 2];

impl Exact {
    /// The image and its derivative along `rates` of the world's [`numbers`](World::numbers) and then of the
    /// camera's position (2), angle and field of view.
    ///
    /// # Errors
    /// A [`ChainError`] if the camera is invalid, the number of rates is another one, or the grid has no
    /// points.
    pub fn image(&self, world: &World, camera: &Camera, rates: &[f64]) -> Result<ExactImage, ChainError> {
        camera.check()?;
        let expected = world.count() + 4;
        if rates.len() != expected {
            return Err(ChainError::Numbers { expected, found: rates.len() });
        }
        if self.cells == 0 {
            return Err(ChainError::NoCells);
        }
        let pixels = camera.film.pixels;
        let mut out =
            ExactImage { image: vec![0.0; pixels], derivative: vec![ChainTerms::default(); pixels] };
        let job = Job { exact: *self, world, camera, rates };
        let mut open = vec![vec![]];
        while let Some(decisions) = open.pop() {
            let (breaks, needed) = job.breaks(&decisions);
            if needed > decisions.len() {
                open.extend([false, true].map(|d| [&decisions[..], &[d]].concat()));
            } else {
                job.add(&decisions, &breaks, &mut out);
            }
        }
        Ok(out)
    }
}

struct Job<'a> {
    exact: Exact,
    world: &'a World,
    camera: &'a Camera,
    rates: &'a [f64],
}

impl Job<'_> {
    fn chain(&self, u: f64, decisions: &[bool], touching: Option<Touching>) -> Chain<Dual<2>> {
        let decide = |k: usize, _| decisions.get(k).copied().unwrap_or(false);
        let u = Dual::new(u, [1.0, 0.0]);
        self.world.follow(&Along { rates: self.rates }, self.camera, u, self.exact.longest, touching, decide)
    }

    /// Places where the integrand is not analytic, in order, and the most decisions made anywhere.
    fn breaks(&self, decisions: &[bool]) -> (Vec<Break>, usize) {
        let mut needed = 0;
        let mut key = |u: f64| {
            let decide = |k: usize, _| {
                needed = needed.max(k + 1);
                decisions.get(k).copied().unwrap_or(false)
            };
            key_of(&self.world.follow(&Constants, self.camera, u, self.exact.longest, None, decide))
        };
        let film = self.camera.film;
        let reach = film.filter.radius() - 0.5;
        let [first, last] = [-reach, film.pixels as f64 + reach];
        let count = self.exact.cells * (film.pixels + 4);
        let cell = (last - first) / count as f64;
        let grid: Vec<f64> = (0..=count).map(|i| first + cell * i as f64).collect();
        let mut breaks = find_breaks(&grid, &mut key);
        // Near the tangent of an arc, reflections and refractions of everything crowd.
        for _ in 0..ROUNDS {
            let graded = breaks.iter().flatten().flat_map(|&u| {
                (1..GRADING).flat_map(move |k| [-1.0, 1.0].map(|sign| u + sign * cell * 0.5_f64.powi(k)))
            });
            let mut nodes: Vec<f64> = grid.iter().copied().chain(graded).collect();
            nodes.retain(|u| (first..=last).contains(u));
            nodes.sort_unstable_by(f64::total_cmp);
            let found = find_breaks(&nodes, &mut key);
            let is_complete = found.len() == breaks.len();
            breaks = found;
            if is_complete {
                break;
            }
        }
        (breaks, needed)
    }

    fn add(&self, decisions: &[bool], breaks: &[Break], out: &mut ExactImage) {
        let share = 0.5_f64.powi(decisions.len() as i32);
        let film = self.camera.film;
        for pixel in 0..film.pixels {
            let pieces = self.pieces(pixel, breaks);
            // The k-th piece is [k, k + 1] in t, so that all have one tolerance.
            let panels: Vec<[f64; 2]> = (0..pieces.len()).map(|k| [k as f64, k as f64 + 1.0]).collect();
            let f = |t: f64| {
                let [from, to] = pieces[(t as usize).min(pieces.len() - 1)];
                let t = t.fract();
                // Roots at either end, of arcs seen along their tangent, become smooth.
                let u = from + (to - from) * t * t * (3.0 - 2.0 * t);
                let weight = 6.0 * t * (1.0 - t) * (to - from) * film.filter_value(pixel, u);
                let value = total(&self.chain(u, decisions, None));
                let both = [value.value, value.tangent[1]].map(|x| x * weight);
                (both, both[0].abs() + both[1].abs())
            };
            let [image, interior] = adaptive(&panels, f, TOLERANCE).value;
            out.image[pixel] += share * image;
            out.derivative[pixel].interior += share * interior;
        }
        for place in breaks {
            let Some((step, kind)) = self.step(*place, decisions) else { continue };
            for (pixel, terms) in out.derivative.iter_mut().enumerate() {
                let amount = share * step * film.filter_share(pixel, place[0]);
                match kind {
                    Touching::Chain(0) => terms.primary += amount,
                    Touching::Chain(_) => terms.chain += amount,
                    Touching::Shadow(_) => terms.shadow += amount,
                }
            }
        }
    }

    /// The parts of a pixel's support on which filter and integrand are analytic.
    fn pieces(&self, pixel: usize, breaks: &[Break]) -> Vec<[f64; 2]> {
        let mut pieces = vec![];
        for [first, last] in self.camera.film.cells(pixel) {
            let mut from = first;
            for &[before, after] in breaks.iter().filter(|b| b[0] > first && b[1] < last) {
                pieces.push([from, before]);
                from = after;
            }
            pieces.push([from, last]);
        }
        pieces.retain(|[a, b]| a < b);
        pieces
    }

    /// (f⁻ − f⁺) u̇ at a discontinuity, and the point that ends there; `None` where f is continuous.
    fn step(&self, [before, after]: Break, decisions: &[bool]) -> Option<(f64, Touching)> {
        let chains = [before, after].map(|u| self.chain(u, decisions, None));
        let [left, right] = chains.each_ref();
        if let Some(k) = first_difference(&left.vertices, &right.vertices) {
            // Refraction up to total reflection, where no light is left.
            if chains.iter().any(|c| c.end == End::Dark && c.vertices.len() == k) {
                return None;
            }
            let (velocity, touches) = ending([left, right].map(|c| c.vertices.get(k)))?;
            let touching = |side| (touches == Some(side)).then_some(Touching::Chain(k));
            let [left, right] = [(before, 0), (after, 1)]
                .map(|(u, side)| total(&self.chain(u, decisions, touching(side))).value);
            return Some(((left - right) * velocity, Touching::Chain(k)));
        }
        let mut sum: Option<(f64, Touching)> = None;
        for light in 1..left.parts.len() {
            let shadows = [&left.parts[light].shadows, &right.parts[light].shadows];
            let is_above = left.parts[light].is_above && right.parts[light].is_above;
            let Some(k) = first_difference(shadows[0], shadows[1]).filter(|_| is_above) else { continue };
            let Some((velocity, touches)) = ending(shadows.map(|s| s.get(k))) else { continue };
            let touching = |side| (touches == Some(side)).then_some(Touching::Shadow(k));
            let [left, right] = [(before, 0), (after, 1)]
                .map(|(u, side)| self.chain(u, decisions, touching(side)).parts[light].value.value);
            let others = sum.map_or(0.0, |(step, _)| step);
            sum = Some((others + (left - right) * velocity, Touching::Shadow(k)));
        }
        sum
    }
}

fn total<T: Number>(chain: &Chain<T>) -> T {
    chain.parts.iter().fold(T::constant(0.0), |sum, part| sum + part.value)
}

fn first_difference<T: Number>(a: &[Vertex<T>], b: &[Vertex<T>]) -> Option<usize> {
    let is_same = |k: usize| a.get(k).zip(b.get(k)).is_some_and(|(v, w)| v.is_like(w));
    (0..a.len().max(b.len())).find(|&k| !is_same(k))
}

/// Velocity of the discontinuity between two points: the point that is at the end of its curve, or whose ray
/// touches it, moves with it. Also the index of the point whose ray touches its curve, if one does.
fn ending(vertices: [Option<&Vertex<Dual<2>>>; 2]) -> Option<(f64, Option<usize>)> {
    let mut best: Option<(f64, f64, Option<usize>)> = None;
    for (side, vertex) in vertices.into_iter().enumerate() {
        let Some(vertex) = vertex else { continue };
        let mut offer = |distance: f64, zero: Dual<2>, touches: Option<usize>| {
            let velocity = -zero.tangent[1] / zero.tangent[0];
            if best.is_none_or(|(d, ..)| distance < d) {
                best = Some((distance, velocity, touches));
            }
        };
        let steepness = vertex.s.tangent[0].abs();
        offer(vertex.s.value.abs().min((1.0 - vertex.s.value).abs()) / steepness, vertex.s, None);
        if let Some(depth) = vertex.depth {
            offer(depth.value.abs() / (steepness * vertex.across), depth, Some(side));
        }
    }
    best.map(|(_, velocity, touches)| (velocity, touches))
}
