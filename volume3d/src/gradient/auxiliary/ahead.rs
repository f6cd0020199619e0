//! Reuse of path rays by the field of implicit surfaces, which traces the same rays.

use flatland::sdf::fields::MeanPoint;
use glam::DVec3;

use super::Auxiliary;
use crate::gradient::warp::implicit_field::ImplicitField;
use crate::gradient::warp::jump_mean::{Known, Sight};
use crate::scene::{Hit, Surface};

/// The ray traced last, and its results at implicit surfaces.
#[derive(Debug)]
pub(super) struct Ahead {
    origin: DVec3,
    direction: DVec3,
    /// The mean point for each surface, for a camera ray that misses all meshes.
    points: Vec<MeanPoint<DVec3>>,
    /// Whether the surface that the ray leaves keeps away from it; `None` if it leaves none.
    leaves: Option<bool>,
}

impl Ahead {
    pub(super) fn nothing() -> Self {
        Self { origin: DVec3::ZERO, direction: DVec3::ZERO, points: vec![], leaves: None }
    }

    /// Starts a new ray, without results.
    fn begin(&mut self, origin: DVec3, direction: DVec3) {
        (self.origin, self.direction, self.leaves) = (origin, direction, None);
        self.points.clear();
    }

    /// Known results for a ray.
    pub(super) fn of(&self, origin: DVec3, direction: DVec3) -> Known<'_> {
        if (origin, direction) != (self.origin, self.direction) {
            return Known::Nothing;
        }
        match self.leaves {
            Some(keeps_away) => Known::Leaves(keeps_away),
            None if self.points.is_empty() => Known::Nothing,
            None => Known::Points(&self.points),
        }
    }
}

impl Auxiliary<'_> {
    /// First hit of a camera ray. If an implicit surface or the camera moves, the field of implicit surfaces
    /// traces the ray, and its end is the hit. The same is done whatever moves: images must not depend on it,
    /// to the bit.
    pub(crate) fn look(&mut self, origin: DVec3, direction: DVec3) -> Option<Hit> {
        let scene = self.paths.scene;
        self.ahead.begin(origin, direction);
        if let Some(field @ ImplicitField::Vicini { .. }) = self.field_of_implicits()
            && scene.passes_meshes(origin, direction)
        {
            let sight = Sight { origin, from: None, plane: None, field, known: Known::Nothing };
            if let Some(hit) = sight.meet(scene, direction, &mut self.ahead.points) {
                return hit;
            }
            self.ahead.points.clear();
        }
        scene.closest(origin, direction, None)
    }

    /// First hit of a ray that leaves a surface. If the field must know whether the surface keeps away from
    /// the ray, the test also shows that the ray does not hit it.
    pub(crate) fn look_from(&mut self, x: DVec3, from: Surface, direction: DVec3) -> Option<Hit> {
        let scene = self.paths.scene;
        let mut clear = None;
        if let Some(ImplicitField::Vicini { reach }) = self.field_of_implicits()
            && self.moving.implicit
            && let Surface::Implicit(implicit) = from
        {
            let part = (scene.leaving(implicit), scene.far_of(implicit, x));
            let keeps_away = scene.keeps_away(implicit, (x, direction), part, reach);
            self.ahead.begin(x, direction);
            self.ahead.leaves = Some(keeps_away);
            clear = keeps_away.then_some(implicit);
        }
        scene.closest_beside(x, direction, Some(from), clear)
    }
}
