//! Reconstruction targets, in scenes of one size.

use std::path::Path;

use anyhow::Context as _;
use glam::{DAffine3, DVec3};
use volume3d::geometry::Mesh;
use volume3d::io::read_obj;

/// The Stanford bunny; see figures/assets/CREDITS.md for its origin.
const BUNNY: &[u8] = include_bytes!("../../assets/bunny.obj");

/// The diagonal of the box around a target, in scene units.
pub(crate) const DIAGONAL: f64 = 2.0;

/// The bunny, centred and scaled.
pub(crate) fn bunny() -> anyhow::Result<Mesh> {
    placed(read_obj(BUNNY, Path::new("figures/assets/bunny.obj"))?)
}

/// A mesh centred at the origin and scaled to the size of targets.
pub(crate) fn placed(mesh: Mesh) -> anyhow::Result<Mesh> {
    let low = mesh.positions().iter().copied().reduce(DVec3::min).context("a target has vertices")?;
    let high = mesh.positions().iter().copied().fold(low, DVec3::max);
    let scale = DIAGONAL / low.distance(high);
    let place = DAffine3::from_scale(DVec3::splat(scale)) * DAffine3::from_translation(-0.5 * (low + high));
    Ok(mesh.transformed(&place))
}
