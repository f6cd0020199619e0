//! The whole scene.

use super::element::Element;
use super::integrator::{integrator, sees_media};
use super::journal::Note;
use super::object::{Ids, Object};
use super::reader::Reader;
use super::sensor::{Sensor, default_sensor, sensor};
use super::{attribute, emitter};
use crate::io::Error;
use crate::scene::{Description, Integrator, SPHERE_TRACING};

impl Reader<'_> {
    /// Reads the whole scene, and reports all errors. The film may be given another size.
    pub(super) fn read(mut self, size: Option<(usize, usize)>) -> Result<(Description, Vec<Note>), Error> {
        let journal = self.journal.clone();
        self.ids = Ids::new(self.document.by_id()?, journal.clone());
        self.asking = attribute::asking(&self.document.root, &self.ids);
        let scene = Object::with_plugin(&self.document.root, "", &self.ids)?;

        let (integrator, hide_emitters) = match scene.at_most_one("<integrator>")? {
            Some(element) => {
                self.sees_media = sees_media(element);
                let read = Object::new(element, &self.ids).and_then(|object| integrator(&object, &self.ids));
                journal.accept(read, element, "all paths are rendered").unwrap_or_default()
            }
            None => (Integrator::default(), false),
        };
        let sensors = scene.nested("<sensor>");
        if let Some(second) = sensors.get(1) {
            journal.note(second, "of several sensors the first is rendered");
        }
        let mut sensor = match sensors.first() {
            Some(element) => {
                let read = Object::new(element, &self.ids)
                    .and_then(|object| sensor(&object, &self.ids, size, self.sees_media));
                read.map_err(|error| journal.refuse(error)).ok()
            }
            None => None,
        };
        // These may be referenced by sensors and shapes.
        for tag in ["<sampler>", "<film>", "<medium>", "<phase>", "<spectrum>"] {
            scene.nested(tag);
        }

        let camera_medium = sensor.as_ref().and_then(|sensor| sensor.medium).and_then(|element| {
            let read = self.medium(element);
            journal.accept(read, element, "the sensor stands in empty space")
        });

        // Textures and materials of attributes are made with their mesh.
        let [textures, materials] = ["<texture>", "<bsdf>"].map(|tag| {
            let mut elements = scene.nested(tag);
            elements.retain(|element| !self.asks(element));
            elements
        });
        for element in textures {
            let read = self.texture(element);
            journal.accept(read, element, "the texture is left out");
        }
        for element in materials {
            let read = self.material(element);
            journal.accept(read, element, "the material is left out");
        }
        for element in scene.nested("<shape>") {
            let read = self.shape(element);
            journal.accept(read, element, "the shape is left out");
        }
        // An emitter with an id may be referenced by shapes.
        let is_of_shapes = |e: &Element| e.attribute("type") == Some("area") && e.attribute("id").is_some();
        for element in scene.nested("<emitter>").into_iter().filter(|e| !is_of_shapes(e)) {
            let read = emitter::light(&mut self, element);
            journal.accept(read, element, "the emitter is left out");
        }
        journal.accept(scene.finish(), &self.document.root, "");
        let orthographic = |e: &&Element| e.attribute("type") == Some("orthographic");
        if let Some(element) = sensors.first().filter(|e| orthographic(e) && !self.implicits.is_empty()) {
            // At the distance of its camera, rays lose implicit surfaces.
            journal.refuse(
                element
                    .unsupported("an orthographic sensor before implicit surfaces", "a perspective sensor"),
            );
        }
        if sensors.is_empty() {
            let corners = self.shapes.iter().flat_map(|shape| shape.mesh.positions());
            match default_sensor(corners.copied(), size) {
                Some(usual) if self.implicits.is_empty() => {
                    journal
                        .note(&self.document.root, "without a sensor the scene is seen along z, as a whole");
                    sensor = Some(usual);
                }
                _ => journal.refuse(scene.missing("a <sensor>")),
            }
        }
        if let Some(Sensor { camera, clips, film, .. }) = &sensor {
            let read = clips.check(camera, film, &self.shapes);
            journal.accept(read, &self.document.root, "nothing is clipped");
        }

        let notes = journal.close()?;
        // Without a sensor an error was reported.
        let Some(Sensor { camera, film, samples, .. }) = sensor else {
            return Err(scene.missing("a <sensor>"));
        };
        let Self { textures, materials, media, shapes, implicits, lights, environment, .. } = self;
        let (instances, aliases) = (self.instances, self.aliases);
        let description = Description {
            camera,
            film,
            integrator,
            hide_emitters,
            samples,
            textures,
            materials,
            media,
            camera_medium,
            shapes,
            implicits,
            tracer: SPHERE_TRACING,
            lights,
            environment,
            instances,
            aliases,
        };
        Ok((description, notes))
    }
}
