//! One sample of warped-area sampling, over numbers.

use std::sync::Arc;

use flatland::calculus::{Dual, Number, Rgb, Vec3};
use flatland::random::{Stream, stream};
use glam::{DVec2, DVec3};

use super::WarpedArea;
use crate::gradient::auxiliary::{Auxiliary, Construction};
use crate::gradient::chain::Through;
use crate::gradient::curve::{Curves, Warping};
use crate::gradient::film::camera_rays::CellRays;
use crate::gradient::film::{CutEdges, FilmPlane, FilmPoint};
use crate::gradient::modes::differential::Differential;
use crate::gradient::run::groups::{CellNumbers, GROUPS, numbers};
use crate::gradient::run::streams::{AUXILIARY, EDGE, EDGE_AUXILIARY, GRADIENT_PATH, SPLIT};
use crate::gradient::warp::jump_mean::SceneEdges;
use crate::gradient::warp::motion::MovingBounds;
use crate::path::{Branch, Draws, Frame, Parts, Paths, Sequence};
use crate::scene::{Hit, Surface};

/// Data shared by all samples of one gradient.
pub(super) struct Job<'s> {
    pub(super) method: &'s WarpedArea,
    pub(super) paths: Paths<'s>,
    pub(super) film: FilmPlane,
    pub(super) control_variate: Vec<DVec3>,
    pub(super) construction: Construction,
    pub(super) edges: Option<Arc<SceneEdges>>,
    /// Whether chains of ideal boundaries, and lights without extent, have warps of their own.
    pub(super) follows_chains: bool,
}

/// Paths averaged for the radiance in the warp term of one sample, where the film's warp is nonzero; only the
/// first carries derivatives. Variance × time of four test scenes is lowest with 4 to 8.
pub(super) const SPLITTING: usize = 8;

/// [`SPLITTING`] where the camera sees an implicit surface, at which paths cost more.
const SPLITTING_AT_IMPLICIT: usize = 2;

/// A cell of the film, and the index of a sample in it.
pub(super) type Place = (usize, usize, usize);

/// Random numbers of a cell's samples, and their camera rays.
pub(super) struct PathNumbers {
    /// Random numbers of the path that carries derivatives.
    first: CellNumbers,
    /// Random numbers of the additional primal paths (first hit on a mesh / on an implicit surface).
    pub(super) others: CellNumbers,
    others_at_implicit: CellNumbers,
    rays: CellRays,
}

impl PathNumbers {
    /// Prepares a cell with the given number of samples.
    pub(super) fn prepare(&mut self, cell: (usize, usize), samples: usize) {
        for numbers in [&mut self.first, &mut self.others, &mut self.others_at_implicit] {
            numbers.prepare(cell, samples);
        }
    }
}

/// A film sample: the integrand of each pixel it reaches, without the pixel's own weight and control variate.
pub(super) struct Sample<T> {
    first: Part<T>,
    /// Light through chains and of lights without extent, with warps of their own.
    rest: Vec<Part<T>>,
}

/// The light of a sample that has one warp.
pub(super) struct Part<T> {
    point: FilmPoint<T>,
    /// Radiance of the path that carries derivatives.
    radiance: Rgb<T>,
    /// Mean radiance of all paths.
    mean_radiance: DVec3,
}

impl<T: Number> Part<T> {
    fn new(point: FilmPoint<T>, radiance: Rgb<T>) -> Self {
        Self { point, mean_radiance: radiance.value(), radiance }
    }

    fn is_warped(&self) -> bool {
        let FilmPoint { at: [x, y], jacobian } = self.point;
        [x, y, jacobian].iter().any(|number| !number.is_still())
    }
}

/// Parts of a sample as its path finds them.
struct FilmParts<'f, T> {
    film: &'f FilmPlane,
    frame: &'f Frame<T>,
    u: DVec2,
    first: Rgb<T>,
    rest: Vec<(FilmPoint<T>, Rgb<T>)>,
    /// Index in `rest`, and that of the part that a light's part interrupts; `None` for the first.
    current: Option<usize>,
    interrupted: Option<usize>,
}

impl<'f, T: Number> FilmParts<'f, T> {
    fn new(film: &'f FilmPlane, frame: &'f Frame<T>, u: DVec2) -> Self {
        let first = Rgb::constant(DVec3::ZERO);
        Self { film, frame, u, first, rest: vec![], current: None, interrupted: None }
    }
}

impl<C: Differential> Parts<C> for FilmParts<'_, C::Number> {
    fn total(&mut self) -> &mut Rgb<C::Number> {
        match self.current {
            None => &mut self.first,
            Some(index) => &mut self.rest[index].1,
        }
    }

    fn begin(
        &mut self,
        calculus: &mut C,
        chain: &[Branch],
        light: Option<usize>,
    ) -> Option<(Vec3<C::Number>, Vec3<C::Number>)> {
        let point = calculus.chain_film_warp(self.film, self.frame, self.u, Through { chain, light })?;
        self.interrupted = self.current;
        self.current = Some(self.rest.len());
        self.rest.push((point, Rgb::constant(DVec3::ZERO)));
        Some((self.frame.origin, self.film.direction(self.frame, point.at)))
    }

    fn resume(&mut self) {
        self.current = self.interrupted;
    }
}

/// A ray of the static camera: origin, direction and hit.
pub(super) type Ray = (DVec3, DVec3, Option<Hit>);

impl<T: Number> Sample<T> {
    /// Radiance of the path that carries derivatives.
    pub(super) fn radiance(&self) -> DVec3 {
        self.rest.iter().map(|part| part.radiance.value()).fold(self.first.radiance.value(), |a, b| a + b)
    }

    /// Adds the radiance of the additional paths, which have the first part's light.
    pub(super) fn add_others(&mut self, light: DVec3, count: usize) {
        self.first.mean_radiance = (self.first.radiance.value() + light) / count as f64;
    }

    /// All parts, with the factor of the control variate in each.
    pub(super) fn parts(&self) -> impl Iterator<Item = (&Part<T>, f64)> {
        [(&self.first, 1.0)].into_iter().chain(self.rest.iter().map(|part| (part, 0.0)))
    }
}

/// A sample of an edge of box pixels, or of a border that cuts filters: light, and a number whose derivative
/// is V·ν.
pub(super) struct EdgeSample<T> {
    pub(super) across: T,
    vertical: bool,
    at: DVec2,
    /// One over the probability of this one of the cell's edges.
    scale: f64,
    radiance: DVec3,
    /// Factor of the control variate.
    level: f64,
}

impl Job<'_> {
    pub(super) fn auxiliary<'a>(&'a self, bounds: &'a MovingBounds) -> Option<Auxiliary<'a>> {
        let method = self.method;
        method.warps.then(|| {
            let rng = stream(method.seed, &[AUXILIARY]);
            let edges = self.edges.as_deref();
            let mut auxiliary =
                Auxiliary::new(&self.paths, &method.warp, bounds, self.construction, edges, rng);
            auxiliary.follows_chains = self.follows_chains;
            auxiliary
        })
    }

    /// The curves that the field leaves.
    pub(super) fn curves(&self) -> Curves<'_, Warping<'_>> {
        let Self { method, paths, construction, edges, .. } = self;
        let (warp, edges, seed) = (&method.warp, edges.as_deref(), method.seed);
        let splits = self.follows_chains;
        let field = Warping { paths, warp, construction: *construction, edges, seed, splits };
        Curves { paths, field, budget: method.budget(*construction, &self.control_variate) }
    }

    /// Random numbers of cells that are computed sequentially.
    pub(super) fn path_numbers(&self) -> PathNumbers {
        let (seed, pairs) = (self.method.seed, self.paths.pairs());
        let others = |count| CellNumbers::new(seed, SPLIT, count - 1, pairs);
        PathNumbers {
            // Pairs for the film point and the lens point, and those of the bounces.
            first: CellNumbers::new(seed, GRADIENT_PATH, 1, 2 + pairs),
            others: others(SPLITTING),
            others_at_implicit: others(SPLITTING_AT_IMPLICIT),
            rays: CellRays::default(),
        }
    }

    /// Number of samples of a cell.
    pub(super) fn samples(&self, cell: (usize, usize)) -> usize {
        self.method.allocation.as_ref().map_or(self.method.samples, |allocation| allocation.at(cell))
    }

    /// Number of samples for statistics: with an uneven allocation, one per group.
    pub(super) fn counted(&self) -> usize {
        if self.method.allocation.is_some() { GROUPS } else { self.method.samples }
    }

    /// Whether the edges of a cell are an integral of their own: those of box pixels, and those on a border
    /// that cuts filters.
    pub(super) fn has_edges(&self, cell: (usize, usize)) -> bool {
        self.method.warps && (self.film.is_box() || self.film.cut_edges(cell).is_some())
    }

    /// One sample of a cell, with that cell's random numbers.
    pub(super) fn sample<C: Differential>(
        &self,
        calculus: &mut C,
        frame: &Frame<C::Number>,
        place: Place,
        path_numbers: &mut PathNumbers,
    ) -> Sample<C::Number> {
        let (mut sample, split) = self.first_path(calculus, frame, place, path_numbers);
        if let Some(ray) = split {
            self.add_others(&mut sample, ray, place, path_numbers);
        }
        sample
    }

    /// One sample with only the path that carries derivatives, and the camera ray for additional paths, if
    /// any are needed. Each sample has its own lens point, and with it its own camera frame.
    pub(super) fn first_path<C: Differential>(
        &self,
        calculus: &mut C,
        frame: &Frame<C::Number>,
        place: Place,
        path_numbers: &mut PathNumbers,
    ) -> (Sample<C::Number>, Option<Ray>) {
        let (i, j, sample) = place;
        if let Some(rng) = calculus.rng() {
            *rng = self.stream(place, AUXILIARY);
        }
        let PathNumbers { first, rays, .. } = path_numbers;
        let (_, mut numbers) = first.of(sample, 0);
        let u = self.film.point(i, j, numbers.pair());
        let film = self.film.through(&mut numbers);
        let frame = film.frame_through(calculus, frame);
        let (origin, ray, hit) = if self.looks_from_one_place() {
            let (ray, hit) = rays.of(self.paths.scene, &self.film, place, self.samples((i, j)), first);
            (film.still.origin.value(), ray, hit)
        } else {
            self.look(calculus, &film, u)
        };
        let sample = self.parts(calculus, (&film, &frame), u, hit, &mut numbers);
        let split = sample.first.is_warped().then_some((origin, ray, hit));
        (sample, split)
    }

    /// The path from a film point, with every part's warp.
    fn parts<C: Differential>(
        &self,
        calculus: &mut C,
        (film, frame): (&FilmPlane, &Frame<C::Number>),
        u: DVec2,
        hit: Option<Hit>,
        numbers: &mut Draws<'_>,
    ) -> Sample<C::Number> {
        let point = calculus.film_warp(film, u, hit.map(|h| h.surface));
        let ray = (frame.origin, film.direction(frame, point.at));
        let mut parts = FilmParts::new(film, frame, u);
        self.paths.radiance_in_parts(calculus, &mut parts, ray, hit, 1, numbers);
        let rest = parts.rest.into_iter().map(|(point, radiance)| Part::new(point, radiance));
        Sample { first: Part::new(point, parts.first), rest: rest.collect() }
    }

    /// Calls back with every pixel in which a sample has a weight or may get one, as
    /// [`FilmPlane::for_each_weight`] does, with h and the integrand h J (L − L₀).
    pub(super) fn for_each_pixel<T: Number>(
        &self,
        (i, j, _): Place,
        sample: &Sample<T>,
        mut f: impl FnMut([usize; 3], f64, [T; 3]),
    ) {
        let each = |part: &Part<T>, factor: f64, f: &mut dyn FnMut([usize; 3], f64, [T; 3])| {
            let Part { point, radiance: Rgb(radiance), mean_radiance } = part;
            self.film.for_each_weight((i, j), point.at, |[b, x, y], weight| {
                let (level, warped) = (self.control_variate(x, y) * factor, weight * point.jacobian);
                // The derivative of one path with the mean value of all.
                let above = |c: usize| radiance[c].chain(mean_radiance[c] - level[c], 1.0);
                f([b, x, y], weight.value(), std::array::from_fn(|c| above(c) * warped));
            });
        };
        if sample.rest.is_empty() {
            each(&sample.first, 1.0, &mut f);
            return;
        }
        let mut sums: Vec<([usize; 3], f64, [T; 3])> = vec![];
        for (part, factor) in sample.parts() {
            each(part, factor, &mut |at, weight, integrand| match sums.iter_mut().find(|s| s.0 == at) {
                Some((_, _, sum)) => sum.iter_mut().zip(integrand).for_each(|(a, b)| *a = *a + b),
                None => sums.push((at, weight, integrand)),
            });
        }
        for (at, weight, integrand) in sums {
            f(at, weight, integrand);
        }
    }

    /// The numbers of a part of a sample, each with the derivative by it of Σ over pixels and channels of
    /// adjoint times integrand.
    pub(super) fn partials<T: Number>(
        &self,
        (i, j, _): Place,
        (part, factor): (&Part<T>, f64),
        adjoint: &[DVec3],
    ) -> [(T, f64); 6] {
        let Part { point, radiance: Rgb(radiance), mean_radiance } = part;
        let [u, v] = point.at.map(Number::value);
        let at = [Dual::new(u, [1.0, 0.0]), Dual::new(v, [0.0, 1.0])];
        // Σ h (L − L₀)·adjoint and Σ h adjoint.
        let (mut light, mut weights) = (Dual::constant(0.0), DVec3::ZERO);
        self.film.for_each_pixel(i, j, |_, _, x, y| {
            let (weight, delta) = (self.film.weight(at, x, y), adjoint[y * self.film.columns + x]);
            let level = self.control_variate(x, y) * factor;
            light = light + weight * delta.dot(*mean_radiance - level);
            weights += weight.value * delta;
        });
        let jacobian = point.jacobian.value();
        let [along_u, along_v] = light.tangent.map(|t| t * jacobian);
        let [r, g, b] = (weights * jacobian).to_array();
        let [x, y] = point.at;
        let [red, green, blue] = *radiance;
        [(x, along_u), (y, along_v), (point.jacobian, light.value), (red, r), (green, g), (blue, b)]
    }

    /// −∮ h (L − L₀) V·ν over the edges of box pixels, or over the border that cuts filters: the filter's own
    /// jump does not move (Bangaru et al. 2022). A point on the left or the upper edge of a cell, or beside
    /// it by less than rounding, for every part of its light whose warp moves it.
    pub(super) fn edge_samples<C: Differential>(
        &self,
        calculus: &mut C,
        place: Place,
        mut found: impl FnMut(EdgeSample<C::Number>),
    ) {
        let (i, j, _) = place;
        if let Some(rng) = calculus.rng() {
            *rng = self.stream(place, EDGE_AUXILIARY);
        }
        let mut numbers = self.numbers(place, EDGE);
        let [choice, along] = numbers.pair();
        let (vertical, scale) = match self.film.cut_edges((i, j)) {
            Some(CutEdges { inwards: [_, 0.0] }) => (true, 1.0),
            Some(CutEdges { inwards: [0.0, _] }) => (false, 1.0),
            _ => (choice < 0.5, 2.0),
        };
        let across = self.film.beside_border((2.0 * choice).fract());
        let u = self.film.point(i, j, if vertical { [across, along] } else { [along, across] });
        let film = self.film.through(&mut numbers);
        let (origin, ray, hit) = self.look(calculus, &film, u);
        let across = |[x, y]: [C::Number; 2]| if vertical { x } else { y };
        let mut edge = |across: C::Number, radiance: DVec3, level: f64| {
            if !across.is_still() {
                found(EdgeSample { across, vertical, at: u, scale, radiance, level });
            }
        };
        if calculus.follows_chains() {
            let frame = self.film.moving_frame(calculus);
            let frame = film.frame_through(calculus, &frame);
            let sample = self.parts(calculus, (&film, &frame), u, hit, &mut numbers);
            for (part, level) in sample.parts() {
                edge(across(part.point.at), part.radiance.value(), level);
            }
            return;
        }
        let across = across(calculus.film_warp(&film, u, hit.map(|h| h.surface)).at);
        if !across.is_still() {
            edge(across, self.paths.still_radiance(origin, ray, hit, 1, &mut numbers), 1.0);
        }
    }

    /// Calls with the pixels on both sides of an edge, and the light that its motion takes from the one to
    /// the other: h (L − L₀) over the probability of the edge, along −ν out of the pixel. On a border that
    /// cuts filters they are all pixels that reach it.
    pub(super) fn for_each_side<T>(
        &self,
        (i, j, _): Place,
        sample: &EdgeSample<T>,
        mut f: impl FnMut([usize; 3], DVec3),
    ) {
        let EdgeSample { vertical, at, scale, radiance, level, .. } = *sample;
        if let Some(CutEdges { inwards }) = self.film.cut_edges((i, j)) {
            let scale = scale * inwards[usize::from(!vertical)];
            self.film.for_each_pixel(i, j, |_, b, x, y| {
                let weight = self.film.weight(at.to_array(), x, y);
                if weight != 0.0 {
                    let level = self.control_variate(x, y) * level;
                    f([b, x, y], (radiance - level) * (weight * scale));
                }
            });
            return;
        }
        let before = if vertical { (0, 1) } else { (1, 0) };
        for ((a, b), sign) in [((1, 1), scale), (before, -scale)] {
            if let (Some(x), Some(y)) = (self.film.pixel_column(i, a), self.film.pixel_row(j, b)) {
                f([b, x, y], (radiance - self.control_variate(x, y) * level) * sign);
            }
        }
    }

    fn control_variate(&self, x: usize, y: usize) -> DVec3 {
        if self.method.control_variate == 0 {
            DVec3::ZERO
        } else {
            self.control_variate[y * self.film.columns + x]
        }
    }

    fn numbers(&self, (i, j, sample): Place, purpose: u64) -> Sequence {
        numbers(self.method.seed, (i, j), sample, self.samples((i, j)), purpose)
    }

    fn stream(&self, (i, j, sample): Place, purpose: u64) -> Stream {
        stream(self.method.seed, &[i as u64, j as u64, sample as u64, purpose])
    }

    /// Whether all camera rays have one origin and end at meshes.
    fn looks_from_one_place(&self) -> bool {
        !self.film.has_lens() && self.paths.scene.description.implicits.is_empty()
    }

    /// The static ray through a film point.
    fn look<C: Differential>(&self, calculus: &mut C, film: &FilmPlane, u: DVec2) -> Ray {
        let (origin, ray) = (film.still.origin.value(), film.ray(u));
        (origin, ray, calculus.look(self.paths.scene, origin, ray))
    }

    /// Traces the additional paths along the ray of a sample.
    ///
    /// The noise of the radiance at a point is a large part of that of (h ∇·V + V·∇h) L, and cheap to reduce.
    pub(super) fn add_others<T: Number>(
        &self,
        sample: &mut Sample<T>,
        (origin, ray, hit): Ray,
        (.., number): Place,
        path_numbers: &PathNumbers,
    ) {
        let (count, others) = match hit.map(|h| h.surface) {
            Some(Surface::Implicit(_)) => (SPLITTING_AT_IMPLICIT, &path_numbers.others_at_implicit),
            _ => (SPLITTING, &path_numbers.others),
        };
        let numbers = (1..count).map(|other| others.of(number, other - 1).1);
        let light = if self.follows_chains {
            let one = |mut numbers| self.paths.still_radiance_of_first(origin, ray, hit, 1, &mut numbers);
            numbers.map(one).sum()
        } else {
            self.paths.still_radiances(origin, ray, hit, numbers)
        };
        sample.add_others(light, count);
    }
}
