//! A tangent prepared for evaluation: derived rates, what moves, and where.

use flatland::sdf::{Jet, LevelSetVelocity, Sdf as _};
use glam::DVec3;

use super::followed::Followed;
use super::jump_mean::{AngularSupport, LevelSetTap};
use crate::gradient::{ImplicitTangent, Tangent};
use crate::scene::Scene;

/// A tangent and the rates that follow from it.
#[derive(Clone, Debug)]
pub(crate) struct Motion<'c> {
    pub(crate) change: &'c Tangent,
    /// Rates of all shading normals, computed ones included.
    pub(crate) normals: Vec<DVec3>,
    /// Whether each shape moves.
    pub(crate) moves: Vec<bool>,
    /// Rates of every implicit surface, [pushed forward](ImplicitTangent::pushed_forward).
    pub(crate) implicits: Vec<ImplicitTangent>,
    /// Whether each implicit surface changes.
    pub(crate) moves_implicit: Vec<bool>,
    pub(crate) bounds: MovingBounds,
    pub(crate) camera_moves: bool,
}

impl<'c> Motion<'c> {
    pub(crate) fn new(scene: &Scene, change: &'c Tangent) -> Self {
        let mut normals = change.normals.clone();
        scene.vertex_normals.tangent(&scene.positions, &change.positions, &mut normals);
        let moves: Vec<bool> = (0..scene.description.shapes.len())
            .map(|s| change.positions[scene.position_range(s)].iter().any(|v| *v != DVec3::ZERO))
            .collect();
        let moves_implicit: Vec<bool> = change.implicits.iter().map(|rates| !rates.is_still()).collect();
        let shapes = scene.implicits().iter();
        let implicits = change.implicits.iter().zip(shapes).map(|(rates, shape)| rates.pushed_forward(shape));
        let implicits = implicits.collect();
        let bounds = MovingBounds::new(scene, &moves, moves_implicit.contains(&true));
        let camera_moves = change.camera != crate::gradient::CameraTangent::default();
        Self { change, normals, moves, implicits, moves_implicit, bounds, camera_moves }
    }
}

impl Motion<'_> {
    /// Velocity of a followed point.
    #[inline]
    pub(crate) fn velocity(&self, scene: &Scene, followed: &Followed) -> DVec3 {
        match *followed {
            Followed::LevelSet { implicit, x } => self.level_set_velocity(scene, implicit, x),
            _ => followed.velocity(scene, &self.change.positions),
        }
    }

    /// Velocity of a level set of an implicit surface at x.
    fn level_set_velocity(&self, scene: &Scene, implicit: u32, x: DVec3) -> DVec3 {
        if !self.moves_implicit[implicit as usize] {
            return DVec3::ZERO;
        }
        let shape = &scene.implicits()[implicit as usize];
        let there = shape.second_order(x);
        let rate = self.implicits[implicit as usize].rate(shape, x, &there);
        LevelSetVelocity::new(there.jet.gradient).e() * rate.value
    }

    /// φ̇ and ∇φ̇ of an implicit surface.
    pub(crate) fn level_set_rate(&self, scene: &Scene, tap: &LevelSetTap) -> Jet<DVec3> {
        let rates = &self.implicits[tap.implicit as usize];
        if !self.moves_implicit[tap.implicit as usize] {
            return Jet::ZERO;
        }
        rates.rate(&scene.implicits()[tap.implicit as usize], tap.point(), &tap.there)
    }
}

/// Bounding boxes and balls of everything that moves. A bundle of rays that misses them all, from a static
/// origin, sees no motion and need not be traced.
#[derive(Clone, Debug, Default)]
pub(crate) struct MovingBounds {
    places: Vec<Place>,
    /// Whether an implicit surface moves: the extent of its kernel depends on φ and is unbounded here.
    pub(in crate::gradient) implicit: bool,
}

/// Bounds of a moving object: a box, and a ball around its centre.
#[derive(Clone, Copy, Debug)]
struct Place {
    low: DVec3,
    high: DVec3,
    radius: f64,
}

/// More objects than this are merged into one.
const MOST_PLACES: usize = 8;

impl Place {
    /// Bounds of all points of some parts; `None` if there are none.
    fn around(parts: &[&[DVec3]]) -> Option<Self> {
        let points = || parts.iter().flat_map(|part| part.iter().copied());
        let (low, high) = (points().reduce(DVec3::min)?, points().reduce(DVec3::max)?);
        // Margin for rounding in the tests, a few parts in 10¹⁶: the tests must not lose a ray; a larger box
        // only costs time.
        let margin = 1e-9 * (high - low).max_element() + 1e-12 * high.abs().max(low.abs()).max_element();
        let middle = 0.5 * (low + high);
        let radius = points().map(|p| p.distance(middle)).fold(0.0, f64::max);
        Some(Self { low: low - margin, high: high + margin, radius: radius + margin })
    }
}

impl MovingBounds {
    /// Bounds of the meshes that move, and whether an implicit surface does.
    pub(crate) fn new(scene: &Scene, moves: &[bool], implicit: bool) -> Self {
        let shapes = (0..moves.len()).filter(|&s| moves[s]);
        let parts: Vec<&[DVec3]> = shapes.map(|s| &scene.positions[scene.position_range(s)]).collect();
        let together = if parts.len() > MOST_PLACES { parts.len() } else { 1 };
        let places = parts.chunks(together).filter_map(Place::around).collect();
        Self { places, implicit }
    }

    /// Whether anything that moves may be seen within the reach of a direction.
    pub(crate) fn may_be_near(&self, origin: DVec3, direction: DVec3, reach: AngularSupport) -> bool {
        self.implicit
            || self.places.iter().any(|&Place { low, high, radius }| {
                let way = 0.5 * (low + high) - origin;
                let distance = way.length();
                if distance <= radius {
                    return true;
                }
                let sine = radius / distance;
                let cosine = (1.0 - sine * sine).sqrt();
                way.dot(direction) >= (reach.cosine * cosine - reach.sine * sine) * distance
            })
    }

    /// Whether a ray may hit anything that moves.
    pub(crate) fn may_be_hit(&self, origin: DVec3, direction: DVec3) -> bool {
        let inverse = direction.recip();
        self.implicit
            || self.places.iter().any(|&Place { low, high, .. }| {
                let (a, b) = ((low - origin) * inverse, (high - origin) * inverse);
                // A ray within a face plane of the box gives NaN, which max and min drop.
                let (near, far) = (a.min(b), a.max(b));
                near.x.max(near.y).max(near.z).max(0.0) <= far.x.min(far.y).min(far.z)
            })
    }
}
