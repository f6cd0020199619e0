//! The samples of one gradient, forward.

use flatland::random::stream;
use glam::{DVec2, DVec3};

use super::WarpedArea;
use crate::calculus::{Dual, Frame, Number, Rgb};
use crate::geometry::Hit;
use crate::gradient::auxiliary::{Auxiliary, Construction, MovingBounds};
use crate::gradient::boundary::SignChanges;
use crate::gradient::driver::{CellSink, finish, over_film, quantities};
use crate::gradient::film::FilmPlane;
use crate::gradient::forward::Forward;
use crate::gradient::groups::{numbers, split_numbers};
use crate::gradient::motion::Motion;
use crate::gradient::silhouette_mean::SceneEdges;
use crate::gradient::{
    AUXILIARY, EDGE, EDGE_AUXILIARY, GRADIENT_PATH, GradientImage, Progress, SPLIT, Stopped,
};
use crate::path::{Paths, Plain, Sequence};

/// What every sample of one gradient shares.
pub(super) struct Job<'s> {
    pub(super) method: &'s WarpedArea,
    pub(super) paths: Paths<'s>,
    pub(super) film: FilmPlane,
    pub(super) control_variate: Vec<DVec3>,
    pub(super) construction: Construction,
    pub(super) edges: Option<SceneEdges>,
}

/// A sample of the film, or its reflection through the centre of its cell.
#[derive(Clone, Copy, Debug)]
pub(super) enum Partner {
    Itself,
    Reflected,
}

impl Partner {
    pub(super) fn within(self, [x, y]: [f64; 2]) -> [f64; 2] {
        match self {
            Self::Itself => [x, y],
            Self::Reflected => [1.0 - x, 1.0 - y],
        }
    }
}

impl Job<'_> {
    pub(super) fn rows(&self) -> usize {
        self.film.rows + 2 * self.film.reach
    }

    pub(super) fn columns(&self) -> usize {
        self.film.columns + 2 * self.film.reach
    }

    pub(super) fn control_variate(&self, x: usize, y: usize) -> DVec3 {
        if self.method.control_variate == 0 {
            DVec3::ZERO
        } else {
            self.control_variate[y * self.film.columns + x]
        }
    }

    pub(super) fn auxiliary<'a>(&'a self, bounds: &'a MovingBounds) -> Option<Auxiliary<'a>> {
        let method = self.method;
        method.warps.then(|| {
            let rng = stream(method.seed, &[AUXILIARY]);
            Auxiliary::new(&self.paths, &method.warp, bounds, self.construction, self.edges.as_ref(), rng)
        })
    }

    /// The boundary terms that go with the warp.
    pub(super) fn sign_changes(&self) -> SignChanges<'_> {
        let Self { method, paths, construction, edges, .. } = self;
        let edges = edges.as_ref();
        let (samples, seed) = (method.sign_changes, method.seed);
        SignChanges { paths, warp: &method.warp, construction: *construction, edges, samples, seed }
    }

    /// The derivative of every pixel, but for those.
    pub(super) fn forward<const N: usize, const K: usize>(
        &self,
        motion: &Motion<'_>,
        progress: &Progress,
    ) -> Result<GradientImage, Stopped> {
        let scene = self.paths.scene;
        let begin = || Forward::<N> { scene, motion, auxiliary: self.auxiliary(&motion.bounds) };
        let cell = |forward: &mut Forward<'_, N>, place, sink: CellSink<'_, K>| {
            self.forward_cell(forward, place, sink);
        };
        let rays = |forward: &Forward<'_, N>| forward.auxiliary.as_ref().map_or(0, |a| a.rays);
        let sums = over_film(&self.film, self.method.samples, progress, begin, cell, rays)?;
        Ok(finish::<N, K>(&self.film, sums, self.method.samples))
    }

    pub(super) fn forward_cell<const N: usize, const K: usize>(
        &self,
        forward: &mut Forward<'_, N>,
        (i, j): (usize, usize),
        mut sink: CellSink<'_, K>,
    ) {
        let frame = forward.frame(&self.film);
        for sample in 0..self.method.samples {
            if sink.stopped() {
                return;
            }
            for &partner in self.partners() {
                if let Some(auxiliary) = &mut forward.auxiliary {
                    auxiliary.rng = self.stream(i, j, sample, AUXILIARY);
                }
                self.forward_sample::<N, K>(forward, &frame, (i, j, sample), partner, &mut sink);
            }
            if self.film.is_box() && self.method.warps {
                self.forward_edge::<N, K>(forward, (i, j, sample), &mut sink);
            }
        }
    }

    /// A sample, and its reflection if there is one.
    pub(super) fn partners(&self) -> &'static [Partner] {
        if self.method.antithetic { &[Partner::Itself, Partner::Reflected] } else { &[Partner::Itself] }
    }

    /// The part of a sample that each of its partners is.
    pub(super) fn share(&self) -> f64 {
        1.0 / self.partners().len() as f64
    }

    pub(super) fn numbers(&self, cell: (usize, usize), sample: usize, purpose: u64) -> Sequence {
        numbers(self.method.seed, cell, sample, self.method.samples, purpose)
    }

    pub(super) fn stream(&self, i: usize, j: usize, sample: usize, purpose: u64) -> flatland::random::Stream {
        stream(self.method.seed, &[i as u64, j as u64, sample as u64, purpose])
    }

    /// h(u) J (L − L₀) of one sample for every pixel it reaches.
    pub(super) fn forward_sample<const N: usize, const K: usize>(
        &self,
        forward: &mut Forward<'_, N>,
        frame: &Frame<Dual<N>>,
        (i, j, sample): (usize, usize, usize),
        partner: Partner,
        sink: &mut CellSink<'_, K>,
    ) {
        let film = &self.film;
        if !film.cell_counts(i, j) {
            return;
        }
        let mut numbers = self.numbers((i, j), sample, GRADIENT_PATH);
        let u = film.point(i, j, partner.within(numbers.pair()));
        let hit = self.camera_hit(u);
        let triangle = hit.map(|h| h.triangle);
        let (point, jacobian) = forward.film_warp(film, u, self.method.kernels.film, triangle);
        let direction = film.direction(frame, point);
        let Rgb(radiance) = self.paths.radiance(forward, frame.origin, direction, hit, &mut numbers);
        let value = DVec3::from_array(radiance.map(|l| l.value));
        let warped = [point[0], point[1], jacobian].iter().any(|x| !x.is_still());
        let carried = if warped { self.carried(value, u, hit, (i, j, sample)) } else { value };
        let mut finite = true;
        film.for_each_pixel(i, j, |_, _, x, y| {
            let weight = film.weight(point, x, y) * jacobian;
            let sum: f64 = radiance.iter().map(|l| (*l * weight).tangent.iter().sum::<f64>() + l.value).sum();
            finite &= sum.is_finite() && carried.is_finite();
        });
        if !finite {
            sink.non_finite.push(film.located(i, j, sample));
            return;
        }
        let share = self.share();
        let mut amount = 0.0;
        film.for_each_pixel(i, j, |_, b, x, y| {
            let weight = film.weight(point, x, y) * share;
            let level = self.control_variate(x, y);
            let weighted = weight * jacobian;
            let channels: [[f64; N]; 3] = std::array::from_fn(|c| {
                (Dual::new(carried[c] - level[c], radiance[c].tangent) * weighted).tangent
            });
            amount += channels.iter().map(|c| c.iter().sum::<f64>().abs()).sum::<f64>();
            sink.row_sums.add(sample, b, x, &quantities::<N, K>(value * weight.value, channels));
        });
        sink.contributed(film.located(i, j, sample), amount);
    }

    /// −∮ (L − L₀) V·ν over the edges of box pixels: the filter's own jump does not move (Bangaru et al. 2022).
    pub(super) fn forward_edge<const N: usize, const K: usize>(
        &self,
        forward: &mut Forward<'_, N>,
        (i, j, sample): (usize, usize, usize),
        sink: &mut CellSink<'_, K>,
    ) {
        let film = &self.film;
        if let Some(auxiliary) = &mut forward.auxiliary {
            auxiliary.rng = self.stream(i, j, sample, EDGE_AUXILIARY);
        }
        let mut numbers = self.numbers((i, j), sample, EDGE);
        let (u, vertical) = self.edge_point(i, j, numbers.pair());
        let hit = self.camera_hit(u);
        let (point, _) = forward.film_warp(film, u, self.method.kernels.film, hit.map(|h| h.triangle));
        let across = if vertical { point[0] } else { point[1] };
        if across.tangent == [0.0; N] {
            return;
        }
        let radiance = self.still_radiance(u, hit, &mut numbers);
        if !(radiance * across.tangent.iter().sum::<f64>()).is_finite() {
            sink.non_finite.push(film.located(i, j, sample));
            return;
        }
        let mut amount = 0.0;
        self.for_each_side(i, j, vertical, |_, b, x, y, sign| {
            let light = (radiance - self.control_variate(x, y)) * sign;
            amount += light.abs().element_sum() * across.tangent.iter().sum::<f64>().abs();
            let channels: [[f64; N]; 3] = std::array::from_fn(|c| across.tangent.map(|v| light[c] * v));
            sink.row_sums.add(sample, b, x, &quantities::<N, K>(DVec3::ZERO, channels));
        });
        sink.contributed(film.located(i, j, sample), amount);
    }

    /// A point on the left or the upper edge of a cell, one or the other.
    pub(super) fn edge_point(&self, i: usize, j: usize, [choice, along]: [f64; 2]) -> (DVec2, bool) {
        let vertical = choice < 0.5;
        let within = if vertical { [0.0, along] } else { [along, 0.0] };
        (self.film.point(i, j, within), vertical)
    }

    /// The mean of all paths of a sample, of which one has found `first`.
    ///
    /// The noise of the light in a point is a large part of that of (h ∇·V + V·∇h) L, and costs little to lower.
    pub(super) fn carried(
        &self,
        first: DVec3,
        u: DVec2,
        hit: Option<Hit>,
        (i, j, sample): (usize, usize, usize),
    ) -> DVec3 {
        let (seed, samples, many) = (self.method.seed, self.method.samples, self.method.splitting);
        let others = 1..many;
        let light = others.map(|other| {
            let mut numbers = split_numbers(seed, (i, j), sample, samples, SPLIT, (other - 1, many - 1));
            self.still_radiance(u, hit, &mut numbers)
        });
        (first + light.sum::<DVec3>()) / many as f64
    }

    /// What is hit along the ray through a film point.
    pub(super) fn camera_hit(&self, u: DVec2) -> Option<Hit> {
        let camera = &self.paths.scene.description.camera;
        let direction = self.film.direction(&self.film.frame(camera), [u.x, u.y]);
        self.paths.closest(camera.origin, direction.value(), None)
    }

    /// The radiance seen through a film point.
    pub(super) fn still_radiance(&self, u: DVec2, hit: Option<Hit>, numbers: &mut Sequence) -> DVec3 {
        let frame = self.film.frame(&self.paths.scene.description.camera);
        let direction = self.film.direction(&frame, [u.x, u.y]);
        let mut plain = Plain { scene: self.paths.scene };
        self.paths.radiance(&mut plain, frame.origin, direction, hit, numbers).value()
    }

    /// The pixels on both sides of a cell's left or upper edge, each with the weight of the sample: twice, as
    /// only one of two edges is chosen, and −ν out of the pixel.
    pub(super) fn for_each_side(
        &self,
        i: usize,
        j: usize,
        vertical: bool,
        mut f: impl FnMut(usize, usize, usize, usize, f64),
    ) {
        let film = &self.film;
        let before = if vertical { (0, 1) } else { (1, 0) };
        for ((a, b), sign) in [((1, 1), 2.0), (before, -2.0)] {
            if let (Some(x), Some(y)) = (film.pixel_column(i, a), film.pixel_row(j, b)) {
                f(a, b, x, y, sign);
            }
        }
    }
}
