//! Groups of shapes, and copies of them.

use glam::DAffine3;

use super::element::Element;
use super::object::Object;
use super::reader::Reader;
use super::transform;
use crate::io::{Error, SceneProblem};

impl<'a> Reader<'a> {
    /// Nothing by itself: what instances copy.
    pub(super) fn shape_group(object: &Object<'a>) -> Result<(), Error> {
        object.nested("<shape>");
        object.finish()
    }

    /// A copy of every shape of a group, with vertices of its own: `INSTANCE_MEMBER` by name.
    pub(super) fn instance(&mut self, element: &'a Element, object: &Object<'a>) -> Result<(), Error> {
        let map = match object.transform("to_world")? {
            Some(element) => transform::invertible(element)?,
            None => DAffine3::IDENTITY,
        };
        let groups = object.nested("<shape>");
        object.finish()?;
        let [group] = groups[..] else {
            return Err(element.error(SceneProblem::Count {
                what: "shapes \"shapegroup\"".to_owned(),
                parent: object.describe(),
                found: groups.len(),
                expected: "one",
            }));
        };
        let group = Object::new(group, &self.ids)?;
        if group.plugin != "shapegroup" {
            return Err(group.unknown_plugin("shape", "shapegroup, within an instance"));
        }
        let name = self.name(element, self.shapes.len());
        let first = self.shapes.len();
        for member in group.nested("<shape>") {
            if !self.is_mesh(member) {
                let what =
                    format!("a shape \"{}\" within a shapegroup", member.attribute("type").unwrap_or(""));
                return Err(member.unsupported(what, "give meshes"));
            }
            self.shape(member)?;
        }
        group.finish()?;
        for shape in &mut self.shapes[first..] {
            shape.id = format!("{name}_{}", shape.id);
            shape.mesh = shape.mesh.clone().transformed(&map);
        }
        Ok(())
    }

    /// Groups hold no groups, and no copies of themselves.
    fn is_mesh(&self, member: &Element) -> bool {
        let plugin = member.attribute("type").unwrap_or_default();
        !["shapegroup", "instance", "sdfgrid", "sdfnetwork"].contains(&plugin)
    }
}
