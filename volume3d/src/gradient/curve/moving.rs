//! Moving and active parameters.

use glam::DVec3;

use crate::gradient::ActiveParameters;
use crate::gradient::warp::motion::Motion;
use crate::scene::Scene;

/// Cap on the weight of static edges relative to that of moving ones, if any geometry moves. Static edges
/// contribute only if the shading point moves; with a smaller fraction their samples would be rare and large.
const STILL: f64 = 0.5;

/// Moving or active shapes and camera.
#[derive(Clone, Debug)]
pub(super) struct Moving {
    pub(super) shapes: Vec<bool>,
    pub(super) camera: bool,
}

impl Moving {
    /// Everything moves.
    pub(super) fn everything(scene: &Scene) -> Self {
        let description = &scene.description;
        Self { shapes: vec![true; description.shapes.len() + description.implicits.len()], camera: true }
    }

    /// Shapes that move or whose normals change.
    pub(super) fn of(scene: &Scene, motion: &Motion<'_>) -> Self {
        let turns = |s: usize| motion.normals[scene.normal_range(s)].iter().any(|n| *n != DVec3::ZERO);
        let meshes = motion.moves.iter().enumerate().map(|(s, moves)| *moves || turns(s));
        let shapes = meshes.chain(motion.change.implicits.iter().map(|rates| !rates.is_still())).collect();
        Self { shapes, camera: motion.camera_moves }
    }

    /// Active shapes and camera.
    pub(super) fn active(active: &ActiveParameters) -> Self {
        let shapes = active.shapes.iter().chain(&active.implicits).copied().collect();
        Self { shapes, camera: active.camera }
    }

    pub(super) fn anything(&self) -> bool {
        self.camera || self.shapes.iter().any(|&s| s)
    }

    /// Whether any of the given shapes moves.
    pub(super) fn has_any(&self, shapes: [u32; 2]) -> bool {
        shapes.iter().any(|&s| self.shapes[s as usize])
    }

    /// Scales the weights of static entries down to a fraction of those of moving ones, if there are any.
    pub(super) fn limit_still(&self, weights: &mut [f64], moves: impl Fn(usize) -> bool) {
        let sum = |moving: bool| -> f64 {
            weights.iter().enumerate().filter(|&(i, _)| moves(i) == moving).map(|(_, w)| w).sum()
        };
        let (moving, still) = (sum(true), sum(false));
        if moving > 0.0 && still > STILL * moving && !self.camera {
            let factor = STILL * moving / still;
            weights.iter_mut().enumerate().filter(|&(i, _)| !moves(i)).for_each(|(_, w)| *w *= factor);
        }
    }
}
