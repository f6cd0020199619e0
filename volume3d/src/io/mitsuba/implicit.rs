//! Implicit surfaces: the shapes `sdfgrid` and `sdfnetwork`.

use glam::DVec3;

use super::element::Element;
use super::object::Object;
use super::reader::Reader;
use super::transform;
use crate::io::sdf::into_sdf;
use crate::io::{Error, SceneProblem, parse_network};
use crate::scene::{ImplicitShape, ImplicitSurface, Placement};
use crate::sdf::network::{Architecture, Network};
use crate::sdf::{BakeError, Baked, Grid, Guided, Interpolation};

/// Maximum number of cells along the longest side of a network's grid, which then takes up to 8 GB.
const MOST_CELLS: i64 = 1024;

/// Names of interpolations in files.
const INTERPOLATIONS: [(&str, Interpolation); 2] =
    [("cubic", Interpolation::Cubic), ("trilinear", Interpolation::Trilinear)];

impl<'a> Reader<'a> {
    pub(super) fn sdf_grid(&mut self, element: &'a Element, object: &Object<'a>) -> Result<(), Error> {
        let chosen =
            object.choice("interpolation", &INTERPOLATIONS.map(|(name, _)| name), "cubic or trilinear")?;
        let interpolation = INTERPOLATIONS[chosen.unwrap_or(0)].1;
        object.string("normals")?;
        let grid = match (object.string("filename")?, object.positive("radius")?) {
            (None, None) => return Err(object.missing("filename")),
            (None, Some(radius)) => {
                let (corners, cells) = (corners(object)?, cells(object, 1, 16)?);
                Grid::sampled(interpolation, corners, cells, |x| x.length() - radius)
                    .map_err(|error| element.error(SceneProblem::Grid(error)))?
            }
            (Some(_), Some(_)) => return Err(object.conflict("filename", "radius")),
            (Some(name), None) => {
                let (path, bytes) = self.file(element, name)?;
                let keeps_box = object.boolean("use_grid_bbox")? == Some(true);
                let grid = into_sdf(bytes, &path, interpolation, keeps_box);
                grid.map_err(|e| element.referenced(e))?
            }
        };
        self.implicit(element, object, ImplicitSurface::new(grid))
    }

    /// A network on a grid, or traced directly.
    pub(super) fn sdf_network(&mut self, element: &'a Element, object: &Object<'a>) -> Result<(), Error> {
        let network = match object.string("filename")? {
            Some(name) => {
                let (path, bytes) = self.file(element, name)?;
                parse_network(&bytes, &path).map_err(|e| element.referenced(e))?
            }
            None => new_network(element, object)?,
        };
        let (corners, cells) = (corners(object)?, cells(object, 0, 64)?);
        let itself = object.boolean("itself")? == Some(true);
        let surface = if cells == 0 {
            ImplicitSurface::new(network)
        } else {
            let baked = Baked::new(network, corners, cells);
            let baked = baked.map_err(|error| element.error(SceneProblem::Network(error)))?;
            if itself { ImplicitSurface::new(Guided::new(baked)) } else { ImplicitSurface::new(baked) }
        };
        self.implicit(element, object, surface)
    }

    /// Places a surface.
    fn implicit(
        &mut self,
        element: &'a Element,
        object: &Object<'a>,
        surface: ImplicitSurface,
    ) -> Result<(), Error> {
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
        self.check_seen(element, material, None)?;
        object.finish()?;
        let id = self.name(element, self.shapes.len() + self.implicits.len());
        self.implicits.push(ImplicitShape { id, surface, placement, material });
        Ok(())
    }
}

/// The corners of a surface's grid.
fn corners(object: &Object<'_>) -> Result<(DVec3, DVec3), Error> {
    Ok((object.vector("low")?.unwrap_or(DVec3::NEG_ONE), object.vector("high")?.unwrap_or(DVec3::ONE)))
}

/// The number of cells along the longest side of a grid, with a minimum.
fn cells(object: &Object<'_>, least: i64, usual: usize) -> Result<usize, Error> {
    let expected = if least == 0 { "0 to 1024 cells" } else { "1 to 1024 cells" };
    let cells = object.integer_in("cells", least..=MOST_CELLS, expected)?;
    Ok(cells.map_or(usual, |cells| cells as usize))
}

/// An untrained network: geometric initialisation to a ball.
fn new_network(element: &Element, object: &Object<'_>) -> Result<Network, Error> {
    let usual = Architecture::default();
    let size = |name, range: std::ops::RangeInclusive<i64>, expected, usual: usize| {
        object.integer_in(name, range, expected).map(|size| size.map_or(usual, |size| size as usize))
    };
    let architecture = Architecture {
        hidden: size("hidden", 1..=64, "1 to 64 layers", usual.hidden)?,
        width: size("width", 1..=4096, "1 to 4096 neurons", usual.width)?,
        sharpness: object.positive("sharpness")?.unwrap_or(usual.sharpness),
        frequencies: size("frequencies", 0..=32, "0 to 32 frequencies", usual.frequencies)?,
    };
    let radius = object.positive("radius")?.unwrap_or(0.5);
    let seed = size("seed", 0..=i64::MAX, "an integer, not negative", 0)?;
    let network = Network::sphere(architecture, radius, seed as u64);
    network.map_err(|error| element.error(SceneProblem::Network(BakeError::Network(error))))
}
