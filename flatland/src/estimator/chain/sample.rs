//! One sample of a pixel's derivative, as covectors of the rates.

use glam::DVec2;

use super::WarpedArea;
use crate::calculus::{Dual, Number, Tape, Variable};
use crate::chain::{Chain, Constants, End, Source, Vertex, World};
use crate::estimator::driver::Covectors;
use crate::plane::Filter;
use crate::random::{Stream, open01, stream};
use crate::transport::Camera;
use crate::warp::{ChainHit, Line, LinearField as _, Stencil};

/// A mistake that makes the derivative wrong, as a negative control.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
    /// No warp: the interior term alone.
    NoWarp,
    /// A weight for the first point of a chain alone: nothing that is seen in a mirror is followed.
    FirstAlone,
    /// A weight for the last point alone: the mirror's own border is not followed.
    LastAlone,
    /// One weight for a ray, whose B is the least of its points', with the velocity of the last point.
    OneWeight,
    /// No point between the last point and a light: shadows are not followed.
    NoShadows,
}

/// An auxiliary ray of the field at one place on the film.
#[derive(Clone, Debug, PartialEq)]
pub struct AuxiliaryRay {
    /// Its film coordinate.
    pub u: f64,
    /// The points of its chain.
    pub points: Vec<DVec2>,
    /// The share of each point in V: with the rays' weights in the environment, all add up to 1.
    pub weights: Vec<f64>,
}

/// All samples of an image.
#[derive(Debug)]
pub(super) struct Job<'a> {
    method: &'a WarpedArea,
    world: &'a World,
    camera: &'a Camera,
}

/// Decisions at points with two continuations.
struct Decisions {
    made: Vec<bool>,
    stream: Stream,
    /// Probability with which the decisions were made, relative to fair ones.
    density: f64,
}

/// A point of an auxiliary ray.
#[derive(Clone, Copy, Debug)]
struct Point {
    ray: usize,
    /// Index of the chain's point, or the light and the index of its shadow's point. `None` for the
    /// environment, which rests.
    index: Option<(usize, usize)>,
}

/// Derivatives by u.
#[derive(Clone, Copy, Debug)]
struct AlongFilm;

impl Source for AlongFilm {
    type Number = Dual<1>;

    fn numbers<const K: usize>(&self, _: usize, values: [f64; K]) -> [Dual<1>; K] {
        values.map(Dual::constant)
    }
}

/// Records derivatives by the numbers.
struct Recorder<'t>(&'t Tape<usize>);

impl<'t> Source for Recorder<'t> {
    type Number = Variable<'t, usize>;

    fn numbers<const K: usize>(&self, first: usize, values: [f64; K]) -> [Variable<'t, usize>; K] {
        self.0.inputs(first, values)
    }
}

impl Decisions {
    fn decide(&mut self, k: usize, probability: Option<f64>) -> bool {
        if let Some(&made) = self.made.get(k) {
            return made;
        }
        let p = probability.unwrap_or(0.5);
        let first = open01(&mut self.stream) < p;
        self.density *= 2.0 * if first { p } else { 1.0 - p };
        self.made.push(first);
        first
    }
}

/// A place on the film with the coefficients of f and of V f there: h f + h′ V f.
struct Place {
    u: f64,
    value: f64,
    slope: f64,
}

impl<'a> Job<'a> {
    pub(super) fn new(method: &'a WarpedArea, world: &'a World, camera: &'a Camera) -> Self {
        Self { method, world, camera }
    }

    /// Auxiliary rays around u, with the weights of their points in the field of emitted light. All points
    /// with two continuations take the first.
    pub(super) fn auxiliary_rays(&self, u: f64, rng: &mut Stream) -> Vec<AuxiliaryRay> {
        let WarpedArea { warp, kappa, fault, .. } = *self.method;
        let bundle = warp.bundle::<Line>(u, kappa, rng);
        let follow = |u: f64| self.follow(&AlongFilm, Dual::new(u, [1.0]), |_, _| true);
        let chains: Vec<Chain<Dual<1>>> = bundle.points().map(follow).collect();
        let far = warp.reach(kappa);
        let hits = chains.iter().enumerate().map(|(ray, chain)| hits(ray, chain, 0, far, fault)).collect();
        let stencil: Stencil<Line, Point> = warp.chain_stencil(&bundle, kappa, hits);
        let surfaces = self.world.surfaces();
        let point = |v: &Vertex<Dual<1>>| surfaces[v.surface].curve.at(v.s.value);
        let mut rays: Vec<AuxiliaryRay> = bundle
            .points()
            .zip(&chains)
            .map(|(u, chain)| {
                let points: Vec<DVec2> = chain.vertices.iter().map(point).collect();
                AuxiliaryRay { u, weights: vec![0.0; points.len()], points }
            })
            .collect();
        for term in stencil.terms() {
            if let Point { ray, index: Some((_, k)) } = term.hit {
                rays[ray].weights[k] += term.weight;
            }
        }
        rays
    }

    /// Pushes the covectors of one sample of a pixel, times `factor`; returns the number of rays.
    pub(super) fn sample(&self, pixel: usize, sample: usize, factor: f64, out: &mut Covectors<f64>) -> u64 {
        let film = self.camera.film;
        let address = [pixel as u64, sample as u64];
        let mut rng = stream(self.method.seed, &address);
        let stream = stream(self.method.seed, &[address[0], address[1], u64::MAX]);
        let at = film.sample(pixel, &mut rng);
        let mut decisions = Decisions { made: vec![], stream, density: 1.0 };
        let u = at.u;
        let chain = self.follow(&AlongFilm, Dual::new(u, [1.0]), |k, p| decisions.decide(k, Some(p)));
        let factor = factor / decisions.density;
        let mut rays = chain.rays;
        self.record(
            u,
            &mut decisions,
            |chain| chain.parts.iter().map(|part| (part.value, factor * at.value)).collect(),
            out,
        );
        if self.method.fault == Some(Fault::NoWarp) {
            return rays;
        }
        // A constant is subtracted: ∫ ∂(h V)/∂u du = 0.
        let middle = self.follow(&Constants, film.centre(pixel), |k, _| decisions.decide(k, None));
        rays += middle.rays;
        let level: Vec<f64> = middle.parts.iter().map(|part| part.value).collect();
        let place = Place { u, value: factor * at.value, slope: factor * at.slope };
        rays += self.warp(&place, &chain, &level, &mut decisions, &mut rng, out);
        if film.filter == Filter::Box {
            // h′ of the box: at one of its two ends.
            let sign = if open01(&mut rng) < 0.5 { -1.0 } else { 1.0 };
            let u = film.centre(pixel) + 0.5 * sign;
            let chain = self.follow(&AlongFilm, Dual::new(u, [1.0]), |k, _| decisions.decide(k, None));
            let place = Place { u, value: 0.0, slope: -2.0 * sign * factor };
            rays += chain.rays + self.warp(&place, &chain, &level, &mut decisions, &mut rng, out);
        }
        rays
    }

    fn follow<S: Source>(
        &self,
        source: &S,
        u: S::Number,
        decide: impl FnMut(usize, f64) -> bool,
    ) -> Chain<S::Number> {
        self.world.follow(source, self.camera, u, self.method.longest, None, decide)
    }

    /// Pushes the derivatives of some outputs of the chain at u, each times its factor.
    fn record(
        &self,
        u: f64,
        decisions: &mut Decisions,
        outputs: impl for<'t> FnOnce(&Chain<Variable<'t, usize>>) -> Vec<(Variable<'t, usize>, f64)>,
        out: &mut Covectors<f64>,
    ) {
        let tape = Tape::new();
        let chain = self.follow(&Recorder(&tape), Variable::constant(u), |k, _| decisions.decide(k, None));
        tape.sweep(&outputs(&chain), &mut vec![], |first, adjoints: &[f64], _| {
            out.extend(adjoints.iter().enumerate().map(|(i, a)| (first + i, *a)));
        });
    }

    /// Pushes the covectors of h (V ∂f/∂u + ∇·V (f − L₀)) + h′ V (f − L₀) at one place.
    fn warp(
        &self,
        place: &Place,
        chain: &Chain<Dual<1>>,
        level: &[f64],
        decisions: &mut Decisions,
        rng: &mut Stream,
        out: &mut Covectors<f64>,
    ) -> u64 {
        let WarpedArea { warp, kappa, fault, .. } = *self.method;
        let far = warp.reach(kappa);
        let bundle = warp.bundle::<Line>(place.u, kappa, rng);
        let points: Vec<f64> = bundle.points().collect();
        let chains: Vec<Chain<Dual<1>>> = points
            .iter()
            .map(|&u| self.follow(&AlongFilm, Dual::new(u, [1.0]), |k, _| decisions.decide(k, None)))
            .collect();
        // Covectors of V_k, in the order of the chain's points and then of each light's shadow.
        let mut covectors: Vec<Vec<(usize, usize, f64)>> = vec![vec![]; chains.len()];
        for (p, part) in chain.parts.iter().enumerate() {
            let difference = part.value.value - level[p];
            let by_place = place.value * part.value.slope() + place.slope * difference;
            let by_divergence = place.value * difference;
            if by_place == 0.0 && by_divergence == 0.0 {
                continue;
            }
            let hits =
                chains.iter().enumerate().map(|(ray, chain)| hits(ray, chain, p, far, fault)).collect();
            let stencil: Stencil<Line, Point> = warp.chain_stencil(&bundle, kappa, hits);
            stencil.scatter(by_place, by_divergence, |point, covector| {
                if let Some((part, k)) = point.index {
                    covectors[point.ray].push((part, k, covector));
                }
            });
        }
        for ((u, chain), covectors) in points.iter().zip(&chains).zip(covectors) {
            if covectors.is_empty() {
                continue;
            }
            self.record(
                *u,
                decisions,
                |recorded| {
                    let output = |&(part, k, covector): &(usize, usize, f64)| {
                        let slope = vertices(chain, part)[k].s.slope();
                        (vertices(recorded, part)[k].s, -covector / slope)
                    };
                    covectors.iter().map(output).collect()
                },
                out,
            );
        }
        chains.iter().map(|chain| chain.rays).sum()
    }
}

/// The points of a chain, part 0, or of the shadow of a light.
fn vertices<T>(chain: &Chain<T>, part: usize) -> &[Vertex<T>] {
    if part == 0 { &chain.vertices } else { &chain.parts[part].shadows }
}

/// The points of an auxiliary ray that have a weight in the field of one part, with their distances on the
/// film from the ends of their curves. The environment is at the distance `far`.
fn hits(
    ray: usize,
    chain: &Chain<Dual<1>>,
    part: usize,
    far: f64,
    fault: Option<Fault>,
) -> Vec<ChainHit<Point>> {
    let points = |part: usize| {
        let distances = vertices(chain, part).iter().map(distance).enumerate();
        distances.map(move |(k, distance)| (Point { ray, index: Some((part, k)) }, distance))
    };
    let mut hits: Vec<(Point, f64)> = points(0).collect();
    // A chain of no points, if none are allowed, is black as the environment is: at rest.
    if chain.end == End::Environment || hits.is_empty() {
        hits.push((Point { ray, index: None }, far));
    }
    match fault {
        Some(Fault::FirstAlone) => hits.truncate(1),
        Some(Fault::LastAlone) => {
            hits.drain(..hits.len().saturating_sub(1));
        }
        Some(Fault::OneWeight) => {
            let least = hits.iter().map(|hit| hit.1).fold(f64::INFINITY, f64::min);
            hits.drain(..hits.len().saturating_sub(1));
            hits.iter_mut().for_each(|hit| hit.1 = least);
        }
        Some(Fault::NoWarp | Fault::NoShadows) | None => {}
    }
    if part > 0 && fault != Some(Fault::NoShadows) {
        hits.extend(points(part));
    }
    // Far from both ends, s and V are unbounded in a focus.
    let hit = |(hit, distance)| ChainHit { hit, distance, convergence: far / distance };
    hits.into_iter().map(hit).collect()
}

/// Distance on the film, to first order, from a point to the end of its curve, or to the tangent of it.
fn distance(vertex: &Vertex<Dual<1>>) -> f64 {
    let s = vertex.s.value;
    let steepness = vertex.s.slope().abs();
    let to_end = s.min(1.0 - s).max(0.0) / steepness;
    let to_tangent = vertex.depth.map_or(f64::INFINITY, |d| d.value.max(0.0) / (steepness * vertex.across));
    to_end.min(to_tangent)
}
