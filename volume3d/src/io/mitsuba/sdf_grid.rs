//! Implicit surfaces: the shape `sdfgrid`.

use std::path::Path;

use glam::DVec3;

use super::element::Element;
use super::object::Object;
use super::reader::Reader;
use super::transform;
use crate::io::{Error, GridProblem, parse_sdf};
use crate::scene::{ImplicitShape, ImplicitSurface, Placement};
use crate::sdf::{Grid, Interpolation};

/// How grids are interpolated, by their names in files.
const INTERPOLATIONS: [(&str, Interpolation); 2] =
    [("cubic", Interpolation::Cubic), ("trilinear", Interpolation::Trilinear)];

impl<'a> Reader<'a> {
    pub(super) fn sdf_grid(&mut self, element: &'a Element, object: &Object<'a>) -> Result<(), Error> {
        let name = object.string("filename")?.ok_or_else(|| object.missing("filename"))?;
        let chosen =
            object.choice("interpolation", &INTERPOLATIONS.map(|(name, _)| name), "cubic or trilinear")?;
        let interpolation = INTERPOLATIONS[chosen.unwrap_or(0)].1;
        object.string("normals")?;
        let path = element.beside(name);
        let bytes = element.open(&path, self.open)?;
        let mut grid = parse_sdf(&bytes, &path, interpolation).map_err(|e| element.referenced(e))?;
        if object.boolean("use_grid_bbox")? != Some(true) {
            grid = in_unit_cube(&grid, &path).map_err(|e| element.referenced(e))?;
        }
        let placement = match object.transform("to_world")? {
            None => Placement::default(),
            Some(element) => {
                let map = transform::invertible(element)?;
                let rotation = transform::rotation(element, &map)?;
                Placement { scale: map.matrix3.z_axis.length(), rotation, translation: map.translation }
            }
        };
        if object.at_most_one("<emitter>")?.is_some() {
            return Err(element.unsupported(
                "an implicit surface that emits light",
                "put a mesh that emits in its place: `volume3d sdf` makes one of a grid",
            ));
        }
        let material = match object.at_most_one("<bsdf>")? {
            Some(bsdf) => self.material(bsdf)?,
            None => self.default_material(false),
        };
        object.finish()?;
        let id = self.name(element, self.shapes.len() + self.implicits.len());
        let surface = ImplicitSurface::new(grid);
        self.implicits.push(ImplicitShape { id, surface, placement, material });
        Ok(())
    }
}

/// The nodes of a grid with the outermost on the faces of [0, 1]³, where Mitsuba puts them.
fn in_unit_cube(grid: &Grid, path: &Path) -> Result<Grid, Error> {
    let size = grid.size();
    let spacing = DVec3::from_array(size.map(|n| 1.0 / (n - 1) as f64));
    Grid::new(grid.interpolation(), DVec3::ZERO, spacing, size, grid.nodes().to_vec())
        .map_err(|e| Error::Grid { path: path.to_path_buf(), problem: GridProblem::from(e) })
}
