//! Scene export.

use std::collections::HashSet;
use std::fmt::{Display, Write as _};
use std::io::Write as _;
use std::path::{Path, PathBuf};

use glam::{DMat3, DMat4, DVec3};

use crate::geometry::Normals;
use crate::io::{Error, files, write_network, write_obj, write_ply, write_sdf};
use crate::scene::{
    Boundary, Description, Environment, Filter, ImplicitShape, Lens, Light, Material, Placement, Scene, Shape,
};
use crate::sdf::{Baked, Grid, Guided, Interpolation};

/// Writes a scene as Mitsuba 3 XML, with its meshes as PLY or OBJ and its textures as OpenEXR in a separate
/// folder next to it: for `fits/last.xml`, the folder `fits/last.files`. Existing files with the same names
/// are replaced. The scene itself is written last, and every file atomically.
///
/// [`load_scene`](crate::io::load_scene) reads the same scene, except for
///
/// - textures, which are written in single precision, and those of an environment without their `to_uv`,
///   which the format does not have;
/// - the last digits of the camera, whose field of view is written in degrees and whose frame is
///   orthonormalised again;
/// - implicit surfaces: grids are written in single precision, with their own bounding box, and
///   `Description::tracer` is not written;
/// - the order of vertices if a mesh has normals or texture coordinates, and vertices without a triangle: PLY
///   has one topology only. Vertices at the same position are merged;
/// - names that two objects share, which the format does not allow: shapes and lights keep theirs, and others
///   get a `_`.
///
/// Values out of the reader's range, such as a reflectance above 1, are written and refused on reading.
/// Mitsuba itself has no `kappa` of directional lights.
///
/// # Errors
/// [`Error::File`], [`Error::Grid`] for a grid that single precision cannot represent, and
/// [`Error::NoFormat`] for an implicit surface that is neither a grid nor a network.
pub fn write_scene(path: &Path, scene: &Scene) -> Result<(), Error> {
    let parent = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let stem = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let description = scene.description();
    let ids = Ids::new(description);
    let mut writer =
        Writer { parent, folder: format!("{stem}.files"), text: String::new(), depth: 0, ids: &ids };
    writer.scene(description)?;
    let error = |source| Error::File { action: "write", path: path.to_path_buf(), source };
    files::write(path, |file| file.write_all(writer.text.as_bytes()).map_err(error))
}

/// Unique names of all objects.
pub(super) struct Ids {
    shapes: Vec<String>,
    implicits: Vec<String>,
    lights: Vec<String>,
    pub(super) environment: String,
    pub(super) materials: Vec<String>,
    pub(super) textures: Vec<String>,
    pub(super) media: Vec<String>,
}

impl Ids {
    fn new(d: &Description) -> Self {
        let mut taken = HashSet::new();
        let mut unique = |name: &String| {
            let mut name: String = name.chars().map(|c| if is_text(c) { c } else { '_' }).collect();
            while !taken.insert(name.clone()) {
                name.push('_');
            }
            name
        };
        Self {
            shapes: d.shapes.iter().map(|s| unique(&s.id)).collect(),
            implicits: d.implicits.iter().map(|s| unique(&s.id)).collect(),
            lights: d.lights.iter().map(|l| unique(l.id())).collect(),
            environment: d.environment.as_ref().map_or(String::new(), |e| match e {
                Environment::Constant { id, .. } | Environment::Map { id, .. } => unique(id),
            }),
            materials: d.materials.iter().map(|m| unique(&m.id)).collect(),
            textures: d.textures.iter().map(|t| unique(&t.id)).collect(),
            media: d.media.iter().map(|m| unique(&m.id)).collect(),
        }
    }
}

/// Whether a character is allowed in XML.
fn is_text(c: char) -> bool {
    matches!(c, '\t' | '\n' | '\r') || !(c.is_control() || matches!(c, '\u{FFFE}' | '\u{FFFF}'))
}

pub(super) struct Writer<'a> {
    /// The folder of the scene.
    parent: &'a Path,
    /// The folder of its other files, relative to it.
    folder: String,
    text: String,
    /// The number of open elements.
    depth: usize,
    pub(super) ids: &'a Ids,
}

impl Writer<'_> {
    fn scene(&mut self, scene: &Description) -> Result<(), Error> {
        self.line("<scene version=\"3.0.0\">");
        self.integrator(scene);
        self.media(scene);
        self.sensor(scene);
        let mut files = vec![];
        for (i, texture) in scene.textures.iter().enumerate() {
            let file = self.texels(i, texture)?;
            let used = scene.materials.iter().flat_map(Material::textures);
            let used = used.chain(scene.lights.iter().filter_map(Light::texture));
            let mut used = used.chain(scene.shapes.iter().filter_map(|shape| shape.radiance_texture));
            let is_map = matches!(scene.environment, Some(Environment::Map { texture, .. }) if texture == i);
            if !is_map || used.any(|texture| texture == i) {
                self.texture(i, texture, &file);
            }
            files.push(file);
        }
        for i in 0..scene.materials.len() {
            self.material(scene, i)?;
        }
        for (i, shape) in scene.shapes.iter().enumerate() {
            let (plugin, file) = self.mesh(i, shape)?;
            self.open("shape", plugin, &self.ids.shapes[i]);
            self.value("string", "filename", &file);
            if plugin == "obj" {
                self.value("boolean", "flip_tex_coords", "false");
            }
            if *shape.mesh.normals() == Normals::Face {
                self.value("boolean", "face_normals", "true");
            }
            self.line(&format!("<ref id=\"{}\"/>", escaped(&self.ids.materials[shape.material])));
            if let Some(Boundary { interior, exterior }) = shape.boundary {
                self.medium_reference("interior", interior);
                self.medium_reference("exterior", exterior);
            }
            if let Some(radiance) = shape.radiance {
                self.line("<emitter type=\"area\">");
                match shape.radiance_texture {
                    None => self.colour("radiance", radiance),
                    Some(texture) => {
                        self.scaled_texture(
                            "radiance",
                            (scene, texture),
                            scene.textures.len() + i,
                            radiance,
                        )?;
                    }
                }
                self.line("</emitter>");
            }
            self.line("</shape>");
        }
        for (i, shape) in scene.implicits.iter().enumerate() {
            self.implicit(i, shape)?;
        }
        for (i, light) in scene.lights.iter().enumerate() {
            self.light(&self.ids.lights[i], light);
        }
        if let Some(environment) = &scene.environment {
            self.environment(environment, &files);
        }
        self.line("</scene>");
        Ok(())
    }

    fn integrator(&mut self, Description { integrator, hide_emitters, media, .. }: &Description) {
        let plugin = if media.is_empty() { "path" } else { "volpath" };
        self.line(&format!("<integrator type=\"{plugin}\">"));
        let depth = integrator.max_depth.map_or("-1".to_owned(), |depth| depth.to_string());
        self.value("integer", "max_depth", depth);
        self.value("integer", "rr_depth", integrator.rr_depth);
        if *hide_emitters {
            self.value("boolean", "hide_emitters", true);
        }
        self.line("</integrator>");
    }

    fn sensor(&mut self, Description { camera, film, samples, camera_medium, .. }: &Description) {
        let orthographic = camera.orthographic.map(|distance| distance * (0.5 * camera.field_of_view).tan());
        match camera.lens {
            None if orthographic.is_some() => self.line("<sensor type=\"orthographic\">"),
            None => self.line("<sensor type=\"perspective\">"),
            Some(Lens { radius, focus_distance }) => {
                self.line("<sensor type=\"thinlens\">");
                self.value("float", "aperture_radius", radius);
                self.value("float", "focus_distance", focus_distance);
            }
        }
        if orthographic.is_none() {
            self.value("float", "fov", camera.field_of_view.to_degrees());
        }
        // Mitsuba's convention, see the reader.
        let offset = -camera.principal_point;
        for (name, offset) in [("principal_point_offset_x", offset.x), ("principal_point_offset_y", offset.y)]
        {
            if offset != 0.0 {
                self.value("float", name, offset);
            }
        }
        if camera.pixel_aspect != 1.0 && orthographic.is_none() {
            self.value("float", "pixel_aspect", camera.pixel_aspect);
        }
        // Mitsuba's x axis points to the left of the image.
        let frame = DMat3::from_cols(-camera.right, camera.up, camera.forward);
        // The scales are half the width and height of an orthographic sensor.
        let scale = orthographic.map_or(DVec3::ONE, |x| DVec3::new(x, x / camera.pixel_aspect, 1.0));
        self.world_transform(frame * DMat3::from_diagonal(scale), camera.pivot());
        self.medium_reference("medium", *camera_medium);
        self.line("<sampler type=\"independent\">");
        self.value("integer", "sample_count", samples);
        self.line("</sampler>");
        self.line("<film type=\"hdrfilm\">");
        self.value("integer", "width", film.width);
        self.value("integer", "height", film.height);
        if let Some(crop) = film.crop {
            self.value("integer", "crop_offset_x", crop.x);
            self.value("integer", "crop_offset_y", crop.y);
            self.value("integer", "crop_width", crop.width);
            self.value("integer", "crop_height", crop.height);
        }
        if film.sample_border {
            self.value("boolean", "sample_border", true);
        }
        let (plugin, parameters) = match film.filter {
            Filter::Box => ("box", vec![]),
            Filter::Tent { radius } => ("tent", vec![("float", "radius", radius)]),
            Filter::Gaussian { deviation } => ("gaussian", vec![("float", "stddev", deviation)]),
            Filter::Cubic { b, c } => ("mitchell", vec![("float", "B", b), ("float", "C", c)]),
            Filter::Lanczos { lobes } => ("lanczos", vec![("integer", "lobes", f64::from(lobes))]),
        };
        self.line(&format!("<rfilter type=\"{plugin}\">"));
        for (tag, name, value) in parameters {
            self.value(tag, name, value);
        }
        self.line("</rfilter>");
        self.line("</film>");
        self.line("</sensor>");
    }

    /// The plugin and the file of a mesh, relative to the scene. PLY has one topology only, which suffices
    /// except for computed normals with texture coordinates.
    fn mesh(&self, index: usize, shape: &Shape) -> Result<(&'static str, String), Error> {
        let computed = matches!(shape.mesh.normals(), Normals::AngleWeighted { .. });
        let plugin = if computed && shape.mesh.uvs().is_some() { "obj" } else { "ply" };
        let file = self.file("shape", index, &shape.id, plugin);
        let place = self.place(&file)?;
        if plugin == "obj" {
            write_obj(&place, &shape.mesh)?;
        } else {
            write_ply(&place, &shape.mesh)?;
        }
        Ok((plugin, file))
    }

    /// Writes a grid or network with its file; the format has no other implicit surfaces.
    fn implicit(&mut self, index: usize, shape: &ImplicitShape) -> Result<(), Error> {
        let (id, surface) = (self.ids.implicits[index].clone(), &shape.surface);
        if let Some(grid) = surface.downcast::<Grid>() {
            let file = self.file("implicit", index, &shape.id, "vol");
            write_sdf(&self.place(&file)?, grid)?;
            self.open("shape", "sdfgrid", &id);
            self.value("string", "filename", &file);
            self.value("boolean", "use_grid_bbox", "true");
            if grid.interpolation() == Interpolation::Trilinear {
                self.value("string", "interpolation", "trilinear");
            }
        } else {
            let baked = surface.network();
            let network = baked.map(Baked::network).or_else(|| surface.downcast());
            let network = network.ok_or_else(|| Error::NoFormat { shape: shape.id.clone() })?;
            let file = self.file("implicit", index, &shape.id, "safetensors");
            write_network(&self.place(&file)?, network)?;
            self.open("shape", "sdfnetwork", &id);
            self.value("string", "filename", &file);
            self.value("integer", "cells", baked.map_or(0, Baked::cells));
            if surface.downcast::<Guided>().is_some() {
                self.value("boolean", "itself", "true");
            }
            if let Some((low, high)) = baked.map(Baked::bounds) {
                self.vector("low", low);
                self.vector("high", high);
            }
        }
        if shape.placement != Placement::default() {
            let Placement { scale, rotation, translation } = shape.placement;
            let map = DMat4::from_translation(translation) * DMat4::from_mat3(rotation * scale);
            let rows = map.transpose().to_cols_array_2d();
            self.line("<transform name=\"to_world\">");
            self.line(&format!("<matrix value=\"{}\"/>", spaced(rows.as_flattened())));
            self.line("</transform>");
        }
        self.line(&format!("<ref id=\"{}\"/>", escaped(&self.ids.materials[shape.material])));
        self.line("</shape>");
        Ok(())
    }

    /// A file's name, relative to the scene: with a number, so that names differ on systems that ignore case,
    /// and the letters and digits of the id.
    pub(super) fn file(&self, kind: &str, index: usize, id: &str, extension: &str) -> String {
        const LONGEST: usize = 40;
        let plain = |c: char| if c.is_ascii_alphanumeric() || c == '-' { c } else { '_' };
        let id: String = id.chars().map(plain).take(LONGEST).collect();
        format!("{}/{kind}{index}-{id}.{extension}", self.folder)
    }

    /// The path of a file, in a folder that is created if necessary.
    pub(super) fn place(&self, file: &str) -> Result<PathBuf, Error> {
        let path = self.parent.join(file);
        if let Some(folder) = path.parent() {
            std::fs::create_dir_all(folder).map_err(|source| Error::File {
                action: "make",
                path: folder.to_path_buf(),
                source,
            })?;
        }
        Ok(path)
    }

    pub(super) fn open(&mut self, tag: &str, plugin: &str, id: &str) {
        self.line(&format!("<{tag} type=\"{plugin}\" id=\"{}\">", escaped(id)));
    }

    pub(super) fn value(&mut self, tag: &str, name: &str, value: impl Display) {
        self.line(&format!("<{tag} name=\"{name}\" value=\"{}\"/>", escaped(&value.to_string())));
    }

    pub(super) fn colour(&mut self, name: &str, c: DVec3) {
        self.value("rgb", name, spaced(&c.to_array()));
    }

    pub(super) fn vector(&mut self, name: &str, v: DVec3) {
        self.line(&format!("<vector name=\"{name}\" x=\"{}\" y=\"{}\" z=\"{}\"/>", v.x, v.y, v.z));
    }

    pub(super) fn world_transform(&mut self, m: DMat3, t: DVec3) {
        let row = |i: usize| [m.x_axis[i], m.y_axis[i], m.z_axis[i], t[i]];
        let rows = [row(0), row(1), row(2), [0.0, 0.0, 0.0, 1.0]];
        self.line("<transform name=\"to_world\">");
        self.line(&format!("<matrix value=\"{}\"/>", spaced(rows.as_flattened())));
        self.line("</transform>");
    }

    /// Writes a line, indented by the open elements.
    pub(super) fn line(&mut self, line: &str) {
        let closes = line.starts_with("</");
        self.depth -= usize::from(closes);
        writeln!(self.text, "{:1$}{line}", "", 2 * self.depth).expect("strings can be written to");
        self.depth += usize::from(!closes && !line.ends_with("/>"));
    }
}

pub(super) fn spaced(numbers: &[f64]) -> String {
    numbers.iter().map(f64::to_string).collect::<Vec<_>>().join(" ")
}

/// Escapes text for the value of an attribute.
pub(super) fn escaped(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => escaped.push_str("&amp;"),
            '<' => escaped.push_str("&lt;"),
            '"' => escaped.push_str("&quot;"),
            // Otherwise a variable's name would begin.
            '$' => escaped.push_str("\\$"),
            '\t' | '\n' | '\r' => {
                let _ = write!(escaped, "&#{};", u32::from(c));
            }
            c => escaped.push(c),
        }
    }
    escaped
}
