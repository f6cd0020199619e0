//! A ray's way along a chain, over numbers.

use flatland::calculus::{Number as _, Vec3};
use glam::DVec3;

use crate::path::{Branch, Calculus, SurfacePoint};
use crate::scene::{Hit, Light, Scene, Surface};

/// The light that a field is for.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Through<'c> {
    /// The branches of its chain.
    pub(crate) chain: &'c [Branch],
    /// The light without extent that it comes from, if it is only that one's.
    pub(crate) light: Option<usize>,
}

/// Data shared by all rays of a field.
#[derive(Clone, Copy, Debug)]
pub(super) struct Course<'c> {
    pub(super) scene: &'c Scene,
    /// The surface from which the rays start.
    pub(super) from: Option<Surface>,
    pub(super) through: Through<'c>,
}

/// A ray's hits, in the order in which the walk asks for them.
#[derive(Clone, Debug, Default)]
pub(super) struct Hits {
    /// The points of the chain; less than the longest chain has if the ray leaves the scene.
    pub(super) points: Vec<Hit>,
    /// The occluder between the last point and the light.
    pub(super) occluder: Option<Hit>,
    /// Whether the last ray left the scene.
    pub(super) escapes: bool,
}

/// A point of a chain over numbers, with the ray to it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Point<T> {
    pub(super) origin: Vec3<T>,
    pub(super) direction: Vec3<T>,
    pub(super) at: SurfacePoint<T>,
    /// Its interpolated normal, if it has one.
    pub(super) shading_normal: Option<Vec3<T>>,
    /// The direction in which the chain continues.
    pub(super) onwards: Option<Vec3<T>>,
}

/// The points of a ray.
#[derive(Clone, Debug)]
pub(super) struct Points<T> {
    pub(super) chain: Vec<Point<T>>,
    pub(super) occluder: Option<Point<T>>,
}

impl Course<'_> {
    /// The points of a ray, whose hits are found.
    pub(super) fn trace<C: Calculus>(
        &self,
        calculus: &C,
        ray: (Vec3<C::Number>, Vec3<C::Number>),
    ) -> (Hits, Points<C::Number>) {
        let mut hits = Hits::default();
        let points = self.walk(calculus, ray, |step| match step {
            Step::Next { from, origin, direction } => {
                let hit = self.scene.closest(origin, direction, from);
                hits.escapes = hit.is_none();
                hits.points.extend(hit);
                hit
            }
            Step::Light { from, origin, direction, distance } => {
                let hit = self.scene.closest(origin, direction, Some(from));
                hits.occluder = hit.filter(|hit| hit.distance < self.scene.short_of(distance));
                hits.occluder
            }
        });
        (hits, points)
    }

    /// The points of a ray, whose hits are known.
    pub(super) fn repeat<C: Calculus>(
        &self,
        calculus: &C,
        ray: (Vec3<C::Number>, Vec3<C::Number>),
        hits: &Hits,
    ) -> Points<C::Number> {
        let mut next = hits.points.iter().copied();
        self.walk(calculus, ray, |step| match step {
            Step::Next { .. } => next.next(),
            Step::Light { .. } => hits.occluder,
        })
    }

    /// Follows a ray along the branches as far as the materials have them. `hit` is asked for the surface at
    /// the end of every segment.
    fn walk<C: Calculus>(
        &self,
        calculus: &C,
        (mut origin, mut direction): (Vec3<C::Number>, Vec3<C::Number>),
        mut hit: impl FnMut(Step) -> Option<Hit>,
    ) -> Points<C::Number> {
        let Self { scene, mut from, through } = *self;
        let mut points = Points { chain: vec![], occluder: None };
        let point = |origin, direction, hit: Hit| {
            let at = SurfacePoint::new(scene, calculus, origin, direction, hit.surface, hit.distance);
            let shading_normal = at.smooth_normal(scene, calculus);
            Point { origin, direction, at, shading_normal, onwards: None }
        };
        for k in 0..=through.chain.len() {
            let step = Step::Next { from, origin: origin.value(), direction: direction.value() };
            let Some(found) = hit(step) else { return points };
            let mut next = point(origin, direction, found);
            let branch = through.chain.get(k);
            next.onwards = branch.and_then(|branch| next.at.shading(scene, calculus)?.ideal(*branch));
            points.chain.push(next);
            if branch.is_none() {
                break;
            }
            let Some(onwards) = next.onwards else { return points };
            (origin, direction, from) = (next.at.position, onwards, Some(found.surface));
        }
        if let (Some(light), Some(last)) = (through.light, points.chain.last()) {
            let x = last.at.position;
            let (towards, distance) = towards(calculus, &scene.lights()[light], light, x);
            let (from, origin, direction) = (last.at.surface, x.value(), towards.value());
            let occluder = hit(Step::Light { from, origin, direction, distance });
            points.occluder = occluder.map(|found| point(x, towards, found));
        }
        points
    }
}

/// A question for the next surface.
enum Step {
    Next { from: Option<Surface>, origin: DVec3, direction: DVec3 },
    Light { from: Surface, origin: DVec3, direction: DVec3, distance: f64 },
}

/// Direction and distance from x to a light without extent.
fn towards<C: Calculus>(
    calculus: &C,
    light: &Light,
    index: usize,
    x: Vec3<C::Number>,
) -> (Vec3<C::Number>, f64) {
    match light {
        Light::Directional { direction, .. } => {
            (Vec3::turned(-*direction, calculus.pose(index)), f64::INFINITY)
        }
        Light::Point { position, .. } | Light::Spot { position, .. } | Light::Projector { position, .. } => {
            let place = Vec3::constant(*position);
            let way = calculus.pose(index).map_or(place, |shift| place + shift) - x;
            (way.normalized(), way.dot(way).value().sqrt())
        }
    }
}
