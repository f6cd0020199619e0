//! Warnings about contacts, intersections and rounding, a line each.

use glam::DVec3;
use volume3d::gradient::Tangent;
use volume3d::lint::{self, Finding};
use volume3d::scene::Scene;

/// A warning for each contact that a motion of positions separates.
pub(super) fn parted(scene: &Scene, velocities: &[DVec3]) -> String {
    warnings(&lint::parted(scene, velocities))
}

/// A warning for each contact of a moving shape.
pub(super) fn in_contact(scene: &Scene, moves: impl Fn(usize) -> bool) -> String {
    warnings(&lint::touching(scene, moves))
}

/// A note on each shape with edges along pixel borders that moves relative to the camera.
pub(super) fn along_pixels(scene: &Scene, moves: impl Fn(usize) -> bool) -> String {
    let all = lint::on_pixel_borders(scene, moves);
    all.iter().map(|finding| format!("NOTE: {}\n", finding.message)).collect()
}

/// The notes of [`along_pixels`] for a change.
pub(super) fn along_pixels_of(scene: &Scene, change: &Tangent) -> String {
    along_pixels(scene, lint::moves_before_camera(scene, change))
}

/// A warning for each intersection with an implicit surface.
pub(super) fn through_implicits(scene: &Scene) -> String {
    warnings(&lint::implicit_crossings(scene))
}

/// A warning for each mesh whose coordinates are too coarse.
pub(super) fn too_coarse(scene: &Scene) -> String {
    warnings(&lint::coarse_meshes(scene))
}

fn warnings(findings: &[Finding]) -> String {
    findings.iter().map(|Finding { message, advice, .. }| format!("WARNING: {message}; {advice}\n")).collect()
}
