//! One path, and the auxiliary rays at each of its directions with their weights.

use anyhow::Context as _;
use flatland::estimator::transport::Kernels;
use flatland::random::stream;
use flatland::transport::{Hit, Origin};
use flatland::warp::{Circle, Debias, Line, Term, Warp};
use glam::DVec2;

use super::setting::{LIGHT, OCCLUDER, Setting, WALL};

/// Number of auxiliary rays drawn at each direction, fixed; the estimator draws a random number.
pub(super) const RAYS: usize = 32;
/// Drawn length of a ray that meets nothing.
const FAR: f64 = 20.0;
/// Number of places at which visibility is recorded.
const PLACES: usize = 600;
/// Range shown to either side, in kernel widths.
pub(super) const REACH: f64 = 2.5;

/// Distances of the drawn directions from the occluder's silhouette: a film sample's in pixels, an
/// emitter ray's and a scattered ray's in radians.
const FROM_FILM: f64 = 0.1;
const FROM_EMITTER: f64 = 0.03;
const FROM_SCATTERED: f64 = 0.11;
/// Point at which the drawn path meets the floor, and position along the light of its last ray.
const FIRST: DVec2 = DVec2::new(3.8, 0.0);
const LAST: f64 = 0.15;

/// An auxiliary ray.
pub(super) struct Ray {
    /// Its end point.
    pub(super) end: DVec2,
    /// Its distance from the direction itself, in kernel widths.
    pub(super) offset: f64,
    /// ω_i, its share of the weight.
    pub(super) share: f64,
}

/// A direction, or a film sample, with its auxiliary rays.
pub(super) struct Fan {
    pub(super) title: String,
    pub(super) from: DVec2,
    pub(super) rays: Vec<Ray>,
    /// Shapes seen around it: intervals of kernel widths.
    pub(super) seen: Vec<([f64; 2], Option<usize>)>,
}

impl Fan {
    /// Discontinuities of the shape seen.
    fn jumps(&self) -> impl Iterator<Item = f64> + '_ {
        self.seen.iter().skip(1).map(|([from, _], _)| *from)
    }

    pub(super) fn lightest_first(&self) -> Vec<&Ray> {
        let mut rays: Vec<&Ray> = self.rays.iter().collect();
        rays.sort_by(|a, b| a.share.total_cmp(&b.share));
        rays
    }

    /// Share of the weight held by the heaviest `count` rays, and the distance from a discontinuity of the
    /// farthest of them, in kernel widths.
    pub(super) fn heaviest(&self, count: usize) -> (f64, f64) {
        let rays: Vec<&Ray> = self.lightest_first().into_iter().rev().take(count).collect();
        let to_jump = |ray: &&Ray| self.jumps().map(|j| (j - ray.offset).abs()).fold(f64::INFINITY, f64::min);
        (rays.iter().map(|r| r.share).sum(), rays.iter().map(to_jump).fold(0.0, f64::max))
    }
}

/// The path and rays drawn into the world.
pub(super) struct DrawnPath {
    /// The camera, the floor, the wall and the light.
    pub(super) points: [DVec2; 4],
    /// End of the ray from the floor's point on the light.
    pub(super) lit: DVec2,
    /// A film sample beside the silhouette; the path's emitter ray, scattered ray and last emitter ray.
    pub(super) fans: Vec<Fan>,
    /// The corner of the occluder beside which the film sample lies.
    pub(super) corner: DVec2,
}

impl DrawnPath {
    pub(super) fn new(setting: &Setting, seed: u64) -> anyhow::Result<Self> {
        let (world, camera) = (&setting.world, &setting.camera);
        let missed = "the drawn path misses the scene";
        let from_camera = |u: f64| world.trace(Origin::free(camera.position), camera.direction(u));
        let corners = world.shapes()[OCCLUDER].points();
        let on_film = corners.iter().filter_map(|p| Some((camera.project(*p)?, *p)));
        let (upper, corner) = on_film.max_by(|a, b| a.0.total_cmp(&b.0)).context(missed)?;
        let beside = upper + FROM_FILM;
        let u = camera.project(FIRST).context(missed)?;
        let first = from_camera(u).context(missed)?;
        let x1 = world.origin(&first);
        let [low, high] = setting.silhouette(OCCLUDER, x1.point);
        let towards_light = DVec2::from_angle(high + FROM_EMITTER);
        let scattered = DVec2::from_angle(low - FROM_SCATTERED);
        let lit = world.trace(x1, towards_light).context(missed)?;
        let second = world.trace(x1, scattered).context(missed)?;
        anyhow::ensure!(setting.shape(Some(&lit)) == Some(LIGHT), "the drawn emitter ray is blocked");
        anyhow::ensure!(setting.shape(Some(&second)) == Some(WALL), "the drawn path misses the wall");
        let x2 = world.origin(&second);
        let ends = world.shapes()[LIGHT].points();
        let end = ends[1].lerp(ends[0], LAST);
        let last = (end - x2.point).normalize();
        let kernels = Kernels::default();
        let subtended = |x: Origin| {
            let [low, high] = setting.silhouette(LIGHT, x.point);
            (kernels.relative / (high - low)).powi(2).max(kernels.surface)
        };
        let draw = Draw { setting, seed };
        let fans = vec![
            draw.film("film, beside the silhouette", beside, kernels.film),
            draw.surface("x_{1}: emitter ray", 1, x1, towards_light, subtended(x1)),
            draw.surface("x_{1}: scattered ray", 2, x1, scattered, kernels.surface),
            draw.surface("x_{2}: emitter ray", 3, x2, last, subtended(x2)),
        ];
        Ok(Self { points: [camera.position, x1.point, x2.point, end], lit: world.point(&lit), fans, corner })
    }
}

struct Draw<'a> {
    setting: &'a Setting,
    seed: u64,
}

impl Draw<'_> {
    fn warp() -> Warp {
        Warp { debias: Debias::Consistent { rays: RAYS }, ..Warp::one_dimensional() }
    }

    fn end(&self, origin: Origin, direction: DVec2, hit: Option<&Hit>) -> DVec2 {
        hit.map_or(origin.point + FAR * direction, |h| self.setting.world.point(h))
    }

    fn film(&self, title: &str, u: f64, kappa: f64) -> Fan {
        let Setting { world, camera, .. } = self.setting;
        let origin = Origin::free(camera.position);
        let trace = |at: f64| world.trace(origin, camera.direction(at));
        let width = kappa.sqrt().recip();
        let mut rng = stream(self.seed, &[0]);
        let stencil = Self::warp().stencil::<Line, _>(u, kappa, &mut rng, |at| {
            let hit = trace(at);
            let ends = hit.as_ref().map(|h| world.segments()[h.segment].ends());
            let far = |end: DVec2| camera.project(end).map_or(f64::INFINITY, |p| (p - at).abs());
            let distance = ends.map_or(f64::INFINITY, |[a, b]| far(a).min(far(b)));
            ((self.end(origin, camera.direction(at), hit.as_ref()), (at - u) / width), distance)
        });
        let rays = stencil.terms().iter().map(ray).collect();
        let seen = seen(|offset| self.setting.shape(trace(u + offset * width).as_ref()));
        Fan { title: title.to_owned(), from: camera.position, rays, seen }
    }

    /// The angle to the nearer end of the shape hit serves as the distance to a discontinuity; the estimator
    /// takes its sine, which is equal to first order.
    fn surface(&self, title: &str, index: u64, origin: Origin, direction: DVec2, kappa: f64) -> Fan {
        let world = &self.setting.world;
        let width = kappa.sqrt().recip();
        let mut rng = stream(self.seed, &[index]);
        let stencil = Self::warp().stencil::<Circle, _>(direction, kappa, &mut rng, |d| {
            let hit = world.trace(origin, d);
            let ends = hit.as_ref().map(|h| world.segments()[h.segment].ends());
            let far = |end: DVec2| d.angle_to(end - origin.point).abs();
            let distance = ends.map_or(f64::INFINITY, |[a, b]| far(a).min(far(b)));
            ((self.end(origin, d, hit.as_ref()), direction.angle_to(d) / width), distance)
        });
        let rays = stencil.terms().iter().map(ray).collect();
        let turned = |offset: f64| DVec2::from_angle(offset * width).rotate(direction);
        let seen = seen(|offset| self.setting.shape(world.trace(origin, turned(offset)).as_ref()));
        Fan { title: title.to_owned(), from: origin.point, rays, seen }
    }
}

fn ray<P>(term: &Term<P, (DVec2, f64)>) -> Ray {
    Ray { end: term.hit.0, offset: term.hit.1, share: term.weight }
}

/// Intervals over which one shape is seen.
fn seen(at: impl Fn(f64) -> Option<usize>) -> Vec<([f64; 2], Option<usize>)> {
    let mut out: Vec<([f64; 2], Option<usize>)> = vec![];
    let step = 2.0 * REACH / PLACES as f64;
    for i in 0..PLACES {
        let start = -REACH + i as f64 * step;
        let shape = at(start + 0.5 * step);
        match out.last_mut() {
            Some((interval, last)) if *last == shape => interval[1] = start + step,
            _ => out.push(([start, start + step], shape)),
        }
    }
    out
}
