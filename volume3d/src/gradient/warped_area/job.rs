//! One sample of warped-area sampling, over numbers.

use std::sync::Arc;

use flatland::calculus::{Dual, Number, Rgb};
use flatland::random::{Stream, stream};
use glam::{DVec2, DVec3};

use super::WarpedArea;
use super::camera_rays::CameraRays;
use crate::gradient::auxiliary::{Auxiliary, Construction};
use crate::gradient::boundary::AlongWarp;
use crate::gradient::differential::{Differential, FilmPoint};
use crate::gradient::film::{CutEdges, FilmPlane};
use crate::gradient::groups::{CellNumbers, GROUPS, numbers};
use crate::gradient::jump_mean::SceneEdges;
use crate::gradient::motion::MovingBounds;
use crate::gradient::{AUXILIARY, EDGE, EDGE_AUXILIARY, GRADIENT_PATH, SPLIT};
use crate::path::{Frame, Paths, Sequence};
use crate::scene::{Hit, Surface};

/// What every sample of one gradient shares.
pub(super) struct Job<'s> {
    pub(super) method: &'s WarpedArea,
    pub(super) paths: Paths<'s>,
    pub(super) film: FilmPlane,
    pub(super) control_variate: Vec<DVec3>,
    pub(super) construction: Construction,
    pub(super) edges: Option<Arc<SceneEdges>>,
}

/// So many paths tell the radiance that the film's warp carries from one pixel to another, where it does. Only the first
/// of them carries derivatives.
///
/// Relative variance × processor seconds with 1, 4, 8 and 16 of them (forward, 8 samples a pixel, tent filter, one thread):
/// .077, .054, .052, .060 for a sphere that moves over a plane; .22, .20, .22, .25 for 20 thin prisms that turn; .58, .44,
/// .45, .45 for a block in a closed box with four bounces; 1.14, 1.07, 1.10, 1.32 for 2,000 leaves that turn.
pub(super) const SPLITTING: usize = 8;

/// As many where the camera sees an implicit surface, at which paths take longer: variance × seconds with 1, 2, 4 and 8 were 807, 788, 859 and
/// 986 for a bunny's 64-cell grid before a constant sky.
const SPLITTING_AT_IMPLICIT: usize = 2;

/// A cell of the film, and the number of a sample in it.
pub(super) type Place = (usize, usize, usize);

/// The random numbers of the samples of a cell, and what the camera sees at them.
pub(super) struct PathNumbers {
    /// Of the path that carries derivatives.
    first: CellNumbers,
    /// Of those that do not, and of as many as there are where an implicit surface is seen.
    pub(super) others: CellNumbers,
    others_at_implicit: CellNumbers,
    rays: CameraRays,
}

impl PathNumbers {
    /// Begins those of a cell with so many samples.
    pub(super) fn prepare(&mut self, cell: (usize, usize), samples: usize) {
        for numbers in [&mut self.first, &mut self.others, &mut self.others_at_implicit] {
            numbers.prepare(cell, samples);
        }
    }
}

/// A sample of the film: what each pixel it reaches integrates, but for the pixel's own weight and level.
pub(super) struct Sample<T> {
    point: FilmPoint<T>,
    /// The radiance that the one path finds which carries derivatives.
    radiance: Rgb<T>,
    /// The mean of what all paths find.
    mean_radiance: DVec3,
}

/// A ray of the camera as it stands: its origin, its direction and what it hits.
pub(super) type Ray = (DVec3, DVec3, Option<Hit>);

impl<T: Number> Sample<T> {
    /// The radiance that the one path finds which carries derivatives.
    pub(super) fn radiance(&self) -> DVec3 {
        self.radiance.value()
    }

    /// Adds what all paths find but the one which carries derivatives.
    pub(super) fn add_others(&mut self, light: DVec3, count: usize) {
        self.mean_radiance = (self.radiance.value() + light) / count as f64;
    }
}

/// A sample of an edge of box pixels, or of a border that cuts filters: light, and a number whose derivative is
/// V·ν.
pub(super) struct EdgeSample<T> {
    pub(super) across: T,
    vertical: bool,
    at: DVec2,
    /// One over the probability of this one of the cell's edges.
    scale: f64,
    radiance: DVec3,
}

impl Job<'_> {
    pub(super) fn auxiliary<'a>(&'a self, bounds: &'a MovingBounds) -> Option<Auxiliary<'a>> {
        let method = self.method;
        method.warps.then(|| {
            let rng = stream(method.seed, &[AUXILIARY]);
            Auxiliary::new(&self.paths, &method.warp, bounds, self.construction, self.edges.as_deref(), rng)
        })
    }

    /// The warp along which boundary terms are counted.
    pub(super) fn along_warp(&self) -> AlongWarp<'_> {
        let Self { method, paths, construction, edges, .. } = self;
        let (warp, edges, seed) = (&method.warp, edges.as_deref(), method.seed);
        AlongWarp { paths, warp, construction: *construction, edges, seed }
    }

    /// The random numbers of cells that are computed one after the other.
    pub(super) fn path_numbers(&self) -> PathNumbers {
        let (seed, pairs) = (self.method.seed, self.paths.pairs());
        let others = |count| CellNumbers::new(seed, SPLIT, count - 1, pairs);
        PathNumbers {
            // The film point, the point of the lens, and those of bounces.
            first: CellNumbers::new(seed, GRADIENT_PATH, 1, 2 + pairs),
            others: others(SPLITTING),
            others_at_implicit: others(SPLITTING_AT_IMPLICIT),
            rays: CameraRays::default(),
        }
    }

    /// How many samples a cell has.
    pub(super) fn samples(&self, cell: (usize, usize)) -> usize {
        self.method.allocation.as_ref().map_or(self.method.samples, |allocation| allocation.at(cell))
    }

    /// How many samples a cell is counted as: where they are spread unevenly, one of each group.
    pub(super) fn counted(&self) -> usize {
        if self.method.allocation.is_some() { GROUPS } else { self.method.samples }
    }

    /// Whether the edges of a cell are an integral of their own: those of box pixels, and those on a border that
    /// cuts filters.
    pub(super) fn has_edges(&self, cell: (usize, usize)) -> bool {
        self.method.warps && (self.film.is_box() || self.film.cut_edges(cell).is_some())
    }

    /// One sample of a cell, with the numbers of that cell.
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

    /// The same with the one path that carries derivatives, and the ray of the others that are to follow, if there are others. A lens is looked
    /// through at a point of its own, at which the camera has another frame.
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
        let point = calculus.film_warp(&film, u, hit.map(|h| h.surface));
        let direction = film.direction(&frame, point.at);
        let radiance = self.paths.radiance(calculus, frame.origin, direction, hit, 1, &mut numbers);
        let warped = [point.at[0], point.at[1], point.jacobian].iter().any(|x| !x.is_still());
        let mean_radiance = radiance.value();
        (Sample { point, radiance, mean_radiance }, warped.then_some((origin, ray, hit)))
    }

    /// Calls with every pixel in which a sample has a weight, or may get one, as
    /// [`FilmPlane::for_each_weight`] does, with h and the integrand h J (L − L₀).
    pub(super) fn for_each_pixel<T: Number>(
        &self,
        (i, j, _): Place,
        sample: &Sample<T>,
        mut f: impl FnMut([usize; 3], f64, [T; 3]),
    ) {
        let Sample { point, radiance: Rgb(radiance), mean_radiance, .. } = sample;
        self.film.for_each_weight((i, j), point.at, |[b, x, y], weight| {
            let (level, warped) = (self.control_variate(x, y), weight * point.jacobian);
            // The derivative of one path at the value of all.
            let above = |c: usize| radiance[c].chain(mean_radiance[c] - level[c], 1.0);
            f([b, x, y], weight.value(), std::array::from_fn(|c| above(c) * warped));
        });
    }

    /// The numbers that a sample is made of, each with the derivative by it of Σ over pixels and channels of adjoint times integrand.
    pub(super) fn partials<T: Number>(
        &self,
        (i, j, _): Place,
        sample: &Sample<T>,
        adjoint: &[DVec3],
    ) -> [(T, f64); 6] {
        let Sample { point, radiance: Rgb(radiance), mean_radiance, .. } = sample;
        let [u, v] = point.at.map(Number::value);
        let at = [Dual::new(u, [1.0, 0.0]), Dual::new(v, [0.0, 1.0])];
        // Σ h (L − L₀)·adjoint and Σ h adjoint.
        let (mut light, mut weights) = (Dual::constant(0.0), DVec3::ZERO);
        self.film.for_each_pixel(i, j, |_, _, x, y| {
            let (weight, delta) = (self.film.weight(at, x, y), adjoint[y * self.film.columns + x]);
            light = light + weight * delta.dot(*mean_radiance - self.control_variate(x, y));
            weights += weight.value * delta;
        });
        let jacobian = point.jacobian.value();
        let [along_u, along_v] = light.tangent.map(|t| t * jacobian);
        let [r, g, b] = (weights * jacobian).to_array();
        let [x, y] = point.at;
        let [red, green, blue] = *radiance;
        [(x, along_u), (y, along_v), (point.jacobian, light.value), (red, r), (green, g), (blue, b)]
    }

    /// −∮ h (L − L₀) V·ν over the edges of box pixels, or over the border that cuts filters: the filter's own jump
    /// does not move (Bangaru et al. 2022). A point on the left or the upper edge of a cell, or beside it by less
    /// than rounding, if the warp moves it.
    pub(super) fn edge_sample<C: Differential>(
        &self,
        calculus: &mut C,
        place: Place,
    ) -> Option<EdgeSample<C::Number>> {
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
        let [x, y] = calculus.film_warp(&film, u, hit.map(|h| h.surface)).at;
        let across = if vertical { x } else { y };
        let moves = !across.is_still();
        moves.then(|| EdgeSample {
            across,
            vertical,
            at: u,
            scale,
            radiance: self.paths.still_radiance(origin, ray, hit, 1, &mut numbers),
        })
    }

    /// Calls with the pixels on both sides of an edge, and the light that its motion takes from the one to the
    /// other: h (L − L₀) over the probability of the edge, along −ν out of the pixel. On a border that cuts
    /// filters they are all pixels that reach it.
    pub(super) fn for_each_side<T>(
        &self,
        (i, j, _): Place,
        sample: &EdgeSample<T>,
        mut f: impl FnMut([usize; 3], DVec3),
    ) {
        let EdgeSample { vertical, at, scale, radiance, .. } = *sample;
        if let Some(CutEdges { inwards }) = self.film.cut_edges((i, j)) {
            let scale = scale * inwards[usize::from(!vertical)];
            self.film.for_each_pixel(i, j, |_, b, x, y| {
                let weight = self.film.weight(at.to_array(), x, y);
                if weight != 0.0 {
                    f([b, x, y], (radiance - self.control_variate(x, y)) * (weight * scale));
                }
            });
            return;
        }
        let before = if vertical { (0, 1) } else { (1, 0) };
        for ((a, b), sign) in [((1, 1), scale), (before, -scale)] {
            if let (Some(x), Some(y)) = (self.film.pixel_column(i, a), self.film.pixel_row(j, b)) {
                f([b, x, y], (radiance - self.control_variate(x, y)) * sign);
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

    /// Whether all rays of the camera have one origin, and end at meshes.
    fn looks_from_one_place(&self) -> bool {
        !self.film.has_lens() && self.paths.scene.description.implicits.is_empty()
    }

    /// The still ray through a film point.
    fn look<C: Differential>(&self, calculus: &mut C, film: &FilmPlane, u: DVec2) -> Ray {
        let (origin, ray) = (film.still.origin.value(), film.ray(u));
        (origin, ray, calculus.look(self.paths.scene, origin, ray))
    }

    /// Follows the other paths along the ray of a sample.
    ///
    /// The noise of the light in a point is a large part of that of (h ∇·V + V·∇h) L, and costs little to lower.
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
        sample.add_others(self.paths.still_radiances(origin, ray, hit, numbers), count);
    }
}
