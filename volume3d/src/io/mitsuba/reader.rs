//! What has been read of a scene.

use std::collections::{HashMap, HashSet};

use super::element::{Document, Element, Open};
use super::object::Ids;
use crate::io::{Error, SceneProblem};
use crate::scene::{Environment, ImplicitShape, Light, Material, Shape, Texture};

/// What has been read so far. Materials and textures may be shared: they are found again by their element.
pub(super) struct Reader<'a> {
    pub(super) document: &'a Document,
    pub(super) open: Open<'a>,
    pub(super) ids: Ids<'a>,
    names: HashSet<String>,
    pub(super) textures: Vec<Texture>,
    pub(super) texture_of: HashMap<*const Element, usize>,
    pub(super) materials: Vec<Material>,
    pub(super) material_of: HashMap<*const Element, usize>,
    /// Materials of shapes without a bsdf, by whether the shape emits.
    pub(super) default_materials: [Option<usize>; 2],
    pub(super) shapes: Vec<Shape>,
    pub(super) implicits: Vec<ImplicitShape>,
    pub(super) lights: Vec<Light>,
    pub(super) environment: Option<Environment>,
}

impl<'a> Reader<'a> {
    pub(super) fn new(document: &'a Document, open: Open<'a>) -> Self {
        Self {
            document,
            open,
            ids: HashMap::new(),
            names: HashSet::new(),
            textures: vec![],
            texture_of: HashMap::new(),
            materials: vec![],
            material_of: HashMap::new(),
            default_materials: [None; 2],
            shapes: vec![],
            implicits: vec![],
            lights: vec![],
            environment: None,
        }
    }

    /// The id of an element, or a name that nothing else has.
    pub(super) fn name(&mut self, element: &Element, number: usize) -> String {
        if let Some(id) = element.attribute("id") {
            return id.to_owned();
        }
        let mut name = format!("{}_{number}", element.tag);
        while self.ids.contains_key(name.as_str()) || !self.names.insert(name.clone()) {
            name.push('_');
        }
        name
    }

    /// An error unless there is no environment yet.
    pub(super) fn check_no_environment(&self, element: &Element) -> Result<(), Error> {
        if self.environment.is_none() {
            return Ok(());
        }
        Err(element.error(SceneProblem::Count {
            what: "environments (emitters \"constant\" and \"envmap\")".to_owned(),
            parent: "the scene".to_owned(),
            found: 2,
            expected: "at most one",
        }))
    }
}
