//! State of the scene reader.

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

/// Objects read so far. Materials and textures may be shared: they are looked up by their element.
pub(super) struct Reader<'a> {
    pub(super) document: &'a Document,
    pub(super) open: Open<'a>,
    pub(super) journal: Rc<Journal>,
    pub(super) ids: Ids<'a>,
    names: HashSet<String>,
    /// The current nesting depth of materials.
    pub(super) within: usize,
    /// The number of vertices of all curves so far.
    pub(super) curve_vertices: usize,
    pub(super) textures: Vec<Texture>,
    /// Textures by their element, and whether they hold numbers.
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
    /// Shapes copied together.
    pub(super) instances: Vec<Instances>,
    /// Names of materials nested in others.
    pub(super) aliases: Vec<Alias>,
    /// Whether the integrator supports media.
    pub(super) sees_media: bool,
    /// The elements that contain an attribute.
    pub(super) asking: HashSet<*const Element>,
    /// The mesh whose attributes are currently converted to textures.
    pub(super) attributes: Option<Attributes>,
    /// The textures converted from attributes.
    pub(super) attribute_textures: HashSet<usize>,
    /// Images that were once converted from attributes, with out-of-range texels that no triangle may show.
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

    /// Whether an element contains a mesh attribute.
    pub(super) fn asks(&self, element: &Element) -> bool {
        self.asking.contains(&std::ptr::from_ref(element))
    }

    /// Finds and reads a file that an element references.
    pub(super) fn file(&self, element: &Element, name: &str) -> Result<(PathBuf, Vec<u8>), Error> {
        element.open(name, &self.document.folders, self.open)
    }

    /// The id of an element, or a unique name.
    pub(super) fn name(&mut self, element: &Element, number: usize) -> String {
        let mut name = match element.attribute("id") {
            // Materials of attributes are made anew for every mesh. Copies of shapes get their names later.
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

    /// Removes the last materials and textures beyond these counts, and their names.
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

    /// An error if there already is an environment.
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
