//! A change made ready: the rates of what follows from parameters, and what moves at all.

use glam::DVec3;

use super::Tangent;
use super::moving_bounds::MovingBounds;
use crate::scene::Scene;

/// A change and what follows from it.
#[derive(Clone, Debug)]
pub(crate) struct Motion<'c> {
    pub(crate) change: &'c Tangent,
    /// Of every shading normal, computed ones included.
    pub(crate) normals: Vec<DVec3>,
    /// Whether each shape moves.
    pub(crate) moves: Vec<bool>,
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
        let bounds = MovingBounds::new(scene, &moves);
        let camera_moves = change.camera != super::CameraTangent::default();
        Self { change, normals, moves, bounds, camera_moves }
    }
}
