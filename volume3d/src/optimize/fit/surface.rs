//! Surfaces that a fit replaces by finer ones.

use super::super::parameters::{Group, Parameters};
use super::super::quantity::Quantity;
use crate::scene::{ImplicitSurface, Scene, SceneError};
use crate::sdf::{BakeError, Baked, Grid, Guided};

/// The surface whose parameters a group is; nothing if it is of something else.
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

/// The network itself that a group's weights are on a grid of; nothing if the group is of something else.
pub(super) fn itself(group: &Group, scene: &Scene) -> Option<ImplicitSurface> {
    Some(ImplicitSurface::new(Guided::new(network(group, scene)?.clone())))
}

/// Whether a group is the weights of a network that is traced itself.
pub(super) fn is_itself(group: &Group, scene: &Scene) -> bool {
    surface(group, scene).is_some_and(|surface| surface.downcast::<Guided>().is_some())
}

/// The same network on a grid of twice as many cells; nothing if the group is of something else.
pub(super) fn finer_network(group: &Group, scene: &Scene) -> Option<Result<ImplicitSurface, BakeError>> {
    let baked = network(group, scene)?;
    Some(baked.with_cells(2 * baked.cells()).map(ImplicitSurface::new))
}

/// What takes the place of a surface when a fit is gone on with: a grid of as many nodes as later, whose values are still to come.
pub(super) fn finer(group: &Group, scene: &Scene) -> Option<ImplicitSurface> {
    let subdivided = |grid: &Grid| grid.subdivided().ok().map(ImplicitSurface::new);
    grid(group, scene).and_then(subdivided).or_else(|| finer_network(group, scene)?.ok())
}

/// Gives the scene another surface in the place of that of a group of parameters, which may then be more numbers.
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
