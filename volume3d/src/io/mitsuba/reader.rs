//! What has been read of a scene.

use std::collections::{HashMap, HashSet};
use std::path::PathBuf;
use std::rc::Rc;

use super::attribute::Attributes;
use super::document::Document;
use super::element::{Element, Open};
use super::journal::Journal;
use super::object::Ids;
use crate::io::{Error, SceneProblem};
use crate::scene::{Alias, Environment, ImplicitShape, Instances, Light, Material, Medium, Shape, Texture};

/// What has been read so far. Materials and textures may be shared: they are found again by their element.
pub(super) struct Reader<'a> {
    pub(super) document: &'a Document,
    pub(super) open: Open<'a>,
    pub(super) journal: Rc<Journal>,
    pub(super) ids: Ids<'a>,
    names: HashSet<String>,
    /// How many materials are being read, each within the one before.
    pub(super) within: usize,
    /// How many vertices the curves have so far.
    pub(super) curve_vertices: usize,
    pub(super) textures: Vec<Texture>,
    /// Textures by their element, and by whether they give numbers.
    pub(super) texture_of: HashMap<(*const Element, bool), usize>,
    pub(super) materials: Vec<Material>,
    pub(super) material_of: HashMap<*const Element, usize>,
    /// Materials of shapes without a bsdf, by whether the shape emits.
    pub(super) default_materials: [Option<usize>; 2],
    pub(super) media: Vec<Medium>,
    pub(super) medium_of: HashMap<*const Element, usize>,
    pub(super) shapes: Vec<Shape>,
    pub(super) implicits: Vec<ImplicitShape>,
    pub(super) lights: Vec<Light>,
    pub(super) environment: Option<Environment>,
    /// Shapes that were copied as one.
    pub(super) instances: Vec<Instances>,
    /// Names of what is within materials.
    pub(super) aliases: Vec<Alias>,
    /// Whether the integrator would see media.
    pub(super) sees_media: bool,
    /// The elements with an attribute within.
    pub(super) asking: HashSet<*const Element>,
    /// The mesh of whose attributes textures are made now.
    pub(super) attributes: Option<Attributes>,
    /// The textures that were made of attributes.
    pub(super) attribute_textures: HashSet<usize>,
    /// The images that once were made of attributes, with texels out of range that no triangle is to show.
    pub(super) triangle_textures: HashSet<usize>,
}

impl<'a> Reader<'a> {
    pub(super) fn new(document: &'a Document, open: Open<'a>) -> Self {
        Self {
            document,
            open,
            journal: document.journal.clone(),
            ids: Ids::new(HashMap::new(), document.journal.clone()),
            names: HashSet::new(),
            within: 0,
            curve_vertices: 0,
            textures: vec![],
            texture_of: HashMap::new(),
            materials: vec![],
            material_of: HashMap::new(),
            default_materials: [None; 2],
            media: vec![],
            medium_of: HashMap::new(),
            shapes: vec![],
            implicits: vec![],
            lights: vec![],
            environment: None,
            instances: vec![],
            aliases: vec![],
            sees_media: false,
            asking: HashSet::new(),
            attributes: None,
            attribute_textures: HashSet::new(),
            triangle_textures: HashSet::new(),
        }
    }

    /// Whether an element has an attribute of a mesh within.
    pub(super) fn asks(&self, element: &Element) -> bool {
        self.asking.contains(&std::ptr::from_ref(element))
    }

    /// Finds and reads a file that an element names.
    pub(super) fn file(&self, element: &Element, name: &str) -> Result<(PathBuf, Vec<u8>), Error> {
        element.open(name, &self.document.folders, self.open)
    }

    /// The id of an element, or a name that nothing else has.
    pub(super) fn name(&mut self, element: &Element, number: usize) -> String {
        let mut name = match element.attribute("id") {
            // What is made of attributes is made anew for every mesh. Copies of shapes are given names of their own later.
            Some(id) if self.names.insert(id.to_owned()) || !matches!(&*element.tag, "bsdf" | "texture") => {
                return id.to_owned();
            }
            Some(id) => format!("{id}_{number}"),
            None => format!("{}_{number}", element.tag),
        };
        while self.ids.contains_key(name.as_str()) || !self.names.insert(name.clone()) {
            name.push('_');
        }
        name
    }

    /// Takes back the last materials and textures, but for so many of each, and their names.
    pub(super) fn take_back(&mut self, materials: usize, textures: usize) {
        for name in self.materials.drain(materials..).map(|material| material.id) {
            self.names.remove(&name);
        }
        self.aliases.retain(|alias| alias.material < materials);
        for name in self.textures.drain(textures..).map(|texture| texture.id) {
            self.names.remove(&name);
        }
        self.attribute_textures.retain(|&texture| texture < textures);
        self.triangle_textures.retain(|&texture| texture < textures);
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
