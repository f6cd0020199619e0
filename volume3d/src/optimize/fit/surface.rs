//! Replacement of implicit surfaces by refined ones during a fit.

use super::super::parameters::{Group, Parameters};
use super::super::quantity::Quantity;
use crate::scene::{ImplicitSurface, Scene, SceneError};
use crate::sdf::{BakeError, Baked, Grid, Guided};

/// The implicit surface whose parameters a group is; `None` for other groups.
fn surface<'s>(group: &Group, scene: &'s Scene) -> Option<&'s ImplicitSurface> {
    let Quantity::Sdf { implicit } = group.quantity else { return None };
    Some(&scene.description().implicits[implicit].surface)
}

/// The grid whose nodes a group is.
pub(super) fn grid<'s>(group: &Group, scene: &'s Scene) -> Option<&'s Grid> {
    surface(group, scene)?.downcast()
}

/// The network on a grid whose weights a group is.
pub(super) fn network<'s>(group: &Group, scene: &'s Scene) -> Option<&'s Baked> {
    surface(group, scene)?.downcast()
}

/// The network traced directly, from the network on a grid whose weights a group is; `None` for other groups.
pub(super) fn itself(group: &Group, scene: &Scene) -> Option<ImplicitSurface> {
    Some(ImplicitSurface::new(Guided::new(network(group, scene)?.clone())))
}

/// Whether a group is the weights of a network that is traced directly.
pub(super) fn is_itself(group: &Group, scene: &Scene) -> bool {
    surface(group, scene).is_some_and(|surface| surface.downcast::<Guided>().is_some())
}

/// The same network on a grid of twice as many cells; `None` for other groups.
pub(super) fn finer_network(group: &Group, scene: &Scene) -> Option<Result<ImplicitSurface, BakeError>> {
    let baked = network(group, scene)?;
    Some(baked.with_cells(2 * baked.cells()).map(ImplicitSurface::new))
}

/// The placeholder for a surface when a fit is resumed: a grid with the refined number of nodes, whose values
/// are set later.
pub(super) fn finer(group: &Group, scene: &Scene) -> Option<ImplicitSurface> {
    let subdivided = |grid: &Grid| grid.subdivided().ok().map(ImplicitSurface::new);
    grid(group, scene).and_then(subdivided).or_else(|| finer_network(group, scene)?.ok())
}

/// Replaces the surface of a group of parameters, whose size may change.
pub(super) fn replace(
    parameters: Parameters,
    x: &[f64],
    group: usize,
    surface: ImplicitSurface,
    scene: &mut Scene,
) -> Result<(Parameters, Vec<f64>), SceneError> {
    let Group { range, quantity, .. } = &parameters.groups()[group];
    let next = [&x[..range.start], &surface.parameters(), &x[range.end..]].concat();
    if let Quantity::Sdf { implicit } = *quantity {
        let mut shape = scene.description().implicits[implicit].clone();
        shape.surface = surface;
        scene.set_implicit(implicit, shape)?;
    }
    Ok((parameters.resized(scene), next))
}
