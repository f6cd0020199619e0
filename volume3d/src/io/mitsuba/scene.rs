//! The scene as a whole.

use super::object::Object;
use super::reader::Reader;
use super::sensor::Sensor;
use super::{emitter, sensor};
use crate::io::Error;
use crate::scene::{Description, Integrator, SPHERE_TRACING};

impl Reader<'_> {
    /// Reads everything.
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

        let Self { textures, materials, shapes, implicits, lights, environment, .. } = self;
        Ok(Description {
            camera,
            film,
            integrator,
            samples,
            textures,
            materials,
            shapes,
            implicits,
            tracer: SPHERE_TRACING,
            lights,
            environment,
        })
    }
}
