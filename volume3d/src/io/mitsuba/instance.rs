//! Shape groups and instances.

use glam::DAffine3;

use super::element::Element;
use super::object::Object;
use super::reader::Reader;
use super::shape::placed;
use super::{support, transform};
use crate::io::{Error, SceneProblem};
use crate::scene::{Instances, Placement};

impl<'a> Reader<'a> {
    /// A shape group creates no shapes by itself; instances copy it.
    pub(super) fn shape_group(object: &Object<'a>) -> Result<(), Error> {
        object.nested("<shape>").into_iter().try_for_each(check_member)?;
        object.finish()
    }

    /// Copies every shape of a group, with its own vertices and the name `INSTANCE_MEMBER`. Copies of one
    /// instance move together by the instance's name, and those of all instances by the group's name.
    pub(super) fn instance(&mut self, element: &'a Element, object: &Object<'a>) -> Result<(), Error> {
        let to_world = object.transform("to_world")?;
        let map = match to_world {
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
        let (first, first_implicit) = (self.shapes.len(), self.implicits.len());
        let read = group.nested("<shape>").into_iter().try_for_each(|member| {
            check_member(member)?;
            self.shape(member)
        });
        if let Err(error) = read.and_then(|()| group.finish()) {
            // An incomplete copy of a group is removed.
            self.shapes.truncate(first);
            self.implicits.truncate(first_implicit);
            return Err(error);
        }
        for shape in &mut self.shapes[first..] {
            shape.id = format!("{name}_{}", shape.id);
            if let Some(element) = to_world {
                shape.mesh = placed(element, shape.mesh.clone(), "instance")?;
            }
        }
        for implicit in &mut self.implicits[first_implicit..] {
            implicit.id = format!("{name}_{}", implicit.id);
            let Some(element) = to_world else { continue };
            let rotation = transform::rotation(element, &map)?;
            let Placement { scale, rotation: turned, translation } = implicit.placement;
            implicit.placement = Placement {
                scale: map.matrix3.z_axis.length() * scale,
                rotation: rotation * turned,
                translation: map.transform_point3(translation),
            };
        }
        let shapes = first..self.shapes.len();
        let implicits = first_implicit..self.implicits.len();
        let all = |id: String| Instances {
            id,
            shapes: shapes.clone().collect(),
            implicits: implicits.clone().collect(),
        };
        self.instances.push(all(name));
        let Some(id) = group.element.attribute("id") else { return Ok(()) };
        match self.instances.iter_mut().find(|instances| instances.id == id) {
            Some(instances) => {
                instances.shapes.extend(shapes);
                instances.implicits.extend(implicits);
            }
            None => self.instances.push(all(id.to_owned())),
        }
        Ok(())
    }
}

/// Refuses groups, instances and networks within groups, in any spelling.
fn check_member(member: &Element) -> Result<(), Error> {
    let plugin = member.attribute("type").unwrap_or_default();
    let usual = support::spelling(&member.tag, plugin).unwrap_or(plugin);
    if ["shapegroup", "instance", "sdfnetwork"].contains(&usual) {
        let what = format!("a shape \"{plugin}\" within a shapegroup");
        return Err(member.unsupported(what, "give meshes or grids"));
    }
    Ok(())
}
