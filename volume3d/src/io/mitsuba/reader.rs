//! The scene as a whole.

use std::collections::{HashMap, HashSet};

use super::element::{Document, Element, Open};
use super::object::{Ids, Object};
use super::sensor::Sensor;
use super::{emitter, sensor};
use crate::io::{Error, SceneProblem};
use crate::scene::{Description, Environment, Integrator, Light, Material, Shape, Texture};

/// What has been read so far. Materials and textures may be shared: they are found again by their element.
pub(super) struct Reader<'a> {
    document: &'a Document,
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
            lights: vec![],
            environment: None,
        }
    }

    pub(super) fn read(mut self) -> Result<Description, Error> {
        self.ids = self.document.by_id()?;
        let scene = Object::with_plugin(&self.document.root, "", &self.ids)?;

        let integrator = match scene.at_most_one("<integrator>")? {
            Some(element) => sensor::integrator(&Object::new(element, &self.ids)?)?,
            None => Integrator::default(),
        };
        let Some(element) = scene.at_most_one("<sensor>")? else { return Err(scene.missing("a <sensor>")) };
        let Sensor { camera, clips, film, samples } =
            sensor::sensor(&Object::new(element, &self.ids)?, &self.ids)?;

        for element in scene.nested("<texture>") {
            self.texture(element)?;
        }
        for element in scene.nested("<bsdf>") {
            self.material(element)?;
        }
        for element in scene.nested("<shape>") {
            self.shape(element)?;
        }
        for element in scene.nested("<emitter>") {
            emitter::light(&mut self, element)?;
        }
        scene.finish()?;
        clips.check(&camera, &film, &self.shapes)?;

        let Self { textures, materials, shapes, lights, environment, .. } = self;
        Ok(Description {
            camera,
            film,
            integrator,
            samples,
            textures,
            materials,
            shapes,
            lights,
            environment,
        })
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
