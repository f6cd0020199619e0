//! Rays of paths that the field of implicit surfaces follows, too: what it finds of them is kept for it.

use flatland::sdf::fields::MeanPoint;
use glam::DVec3;

use super::Auxiliary;
use crate::gradient::implicit_field::ImplicitField;
use crate::gradient::jump_mean::{Known, Sight};
use crate::scene::{Hit, Surface};

/// The ray that was looked along last, and what was found of it at implicit surfaces.
#[derive(Debug)]
pub(super) struct Ahead {
    origin: DVec3,
    direction: DVec3,
    /// For each surface, if it is a ray of the camera that passes all meshes.
    points: Vec<MeanPoint<DVec3>>,
    /// If it leaves a surface, whether that keeps away.
    leaves: Option<bool>,
}

impl Ahead {
    pub(super) fn nothing() -> Self {
        Self { origin: DVec3::ZERO, direction: DVec3::ZERO, points: vec![], leaves: None }
    }

    /// Another ray, of which nothing is known yet.
    fn begin(&mut self, origin: DVec3, direction: DVec3) {
        (self.origin, self.direction, self.leaves) = (origin, direction, None);
        self.points.clear();
    }

    /// What is known of a ray.
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
    /// What the camera sees along a ray. The field of implicit surfaces follows the ray as soon as one of them or the camera moves, and its end is
    /// what is seen. So it is whatever moves: images must not depend on that, to the bit.
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

    /// What a ray meets that leaves a surface. Where the field has to know whether the surface keeps away from the ray, the ray does not hit it if so.
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
