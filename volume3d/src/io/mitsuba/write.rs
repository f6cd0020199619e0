//! Writing scenes.

use std::collections::HashSet;
use std::fmt::{Display, Write as _};
use std::io::Write as _;
use std::path::{Path, PathBuf};

use glam::{DAffine2, DMat3, DVec2, DVec3};

use crate::geometry::Normals;
use crate::io::{Error, Image, files, write_exr, write_obj, write_ply};
use crate::scene::{
    Bsdf, Camera, Description, Environment, Film, Filter, Integrator, Light, Material, Microfacets,
    Reflectance, Texture, Wrap,
};

/// Writes a scene as Mitsuba 3 XML, with its meshes as PLY or OBJ and its textures as OpenEXR in folders `meshes` and
/// `textures` beside it. The scene itself is written last, and every file atomically.
///
/// [`load_scene`](crate::io::load_scene) reads the same scene, up to the single precision of textures, the last digits of
/// the camera, whose field of view is written in degrees and whose frame is made orthonormal again, and the order of
/// vertices with several normals. A name that two things have in common, which the format does not allow, gets a `_` at its
/// second place. Mitsuba itself knows no `kappa` of directional lights.
///
/// # Errors
/// [`Error::File`].
pub fn write_scene(path: &Path, scene: &Description) -> Result<(), Error> {
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let mut writer =
        Writer { folder: folder.to_path_buf(), text: String::new(), depth: 0, ids: Names::default() };
    writer.scene(scene)?;
    let error = |source| Error::File { action: "write", path: path.to_path_buf(), source };
    files::write(path, |file| file.write_all(writer.text.as_bytes()).map_err(error))
}

/// Names, each once.
#[derive(Default)]
struct Names(HashSet<String>);

impl Names {
    fn unique(&mut self, name: &str) -> String {
        let mut name = name.to_owned();
        while !self.0.insert(name.clone()) {
            name.push('_');
        }
        name
    }
}

struct Writer {
    folder: PathBuf,
    text: String,
    /// How many elements are open.
    depth: usize,
    ids: Names,
}

impl Writer {
    fn scene(&mut self, scene: &Description) -> Result<(), Error> {
        self.line("<scene version=\"3.0.0\">");
        self.integrator(&scene.integrator);
        self.sensor(&scene.camera, &scene.film, scene.samples);
        let map = match &scene.environment {
            Some(Environment::Map { texture, .. }) => Some(*texture),
            _ => None,
        };
        let mut paths = Names::default();
        let (mut textures, mut materials) = (vec![], vec![]);
        for (i, texture) in scene.textures.iter().enumerate() {
            let file = self.texels(texture, &mut paths)?;
            let id = if map == Some(i) { texture.id.clone() } else { self.texture(texture, &file) };
            textures.push((id, file));
        }
        for material in &scene.materials {
            materials.push(self.material(material, &textures));
        }
        for shape in &scene.shapes {
            let (plugin, file) = self.mesh(&shape.id, &shape.mesh, &mut paths)?;
            let id = self.ids.unique(&shape.id);
            self.open("shape", plugin, &id);
            self.value("string", "filename", &file);
            if plugin == "obj" {
                self.value("boolean", "flip_tex_coords", "false");
            }
            if *shape.mesh.normals() == Normals::Face {
                self.value("boolean", "face_normals", "true");
            }
            self.line(&format!("<ref id=\"{}\"/>", escaped(&materials[shape.material])));
            if let Some(radiance) = shape.radiance {
                self.line("<emitter type=\"area\">");
                self.colour("radiance", radiance);
                self.line("</emitter>");
            }
            self.line("</shape>");
        }
        scene.lights.iter().for_each(|light| self.light(light));
        if let Some(environment) = &scene.environment {
            self.environment(environment, &textures);
        }
        self.line("</scene>");
        Ok(())
    }

    fn integrator(&mut self, integrator: &Integrator) {
        self.line("<integrator type=\"path\">");
        let depth = integrator.max_depth.map_or("-1".to_owned(), |depth| depth.to_string());
        self.value("integer", "max_depth", depth);
        self.value("integer", "rr_depth", integrator.rr_depth);
        self.line("</integrator>");
    }

    fn sensor(&mut self, camera: &Camera, film: &Film, samples: usize) {
        self.line("<sensor type=\"perspective\">");
        self.value("float", "fov", camera.field_of_view.to_degrees());
        // Mitsuba's x axis points to the left of the image.
        self.to_world(DMat3::from_cols(-camera.right, camera.up, camera.forward), camera.origin);
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
        let (plugin, parameter) = match film.filter {
            Filter::Box => ("box", None),
            Filter::Tent { radius } => ("tent", Some(("radius", radius))),
            Filter::Gaussian { deviation } => ("gaussian", Some(("stddev", deviation))),
        };
        self.line(&format!("<rfilter type=\"{plugin}\">"));
        if let Some((name, value)) = parameter {
            self.value("float", name, value);
        }
        self.line("</rfilter>");
        self.line("</film>");
        self.line("</sensor>");
    }

    /// The file of a texture, relative to the scene.
    fn texels(&self, texture: &Texture, paths: &mut Names) -> Result<String, Error> {
        let file = paths.unique(&format!("textures/{}", plain(&texture.id))) + ".exr";
        let Texture { width, height, texels, .. } = texture;
        let image = Image { width: *width, height: *height, pixels: texels.clone() };
        write_exr(&self.place(&file)?, &image)?;
        Ok(file)
    }

    fn texture(&mut self, texture: &Texture, file: &str) -> String {
        let id = self.ids.unique(&texture.id);
        self.open("texture", "bitmap", &id);
        self.value("string", "filename", file);
        let wrap = match texture.wrap {
            Wrap::Repeat => "repeat",
            Wrap::Mirror => "mirror",
            Wrap::Clamp => "clamp",
        };
        self.value("string", "wrap_mode", wrap);
        // Mitsuba's first row is at v = 0, that of a texture here at v = 1.
        let flip = DAffine2::from_scale_angle_translation(DVec2::new(1.0, -1.0), 0.0, DVec2::Y);
        let to_uv = flip * texture.to_uv;
        if to_uv != DAffine2::IDENTITY {
            let (x, y, t) = (to_uv.matrix2.x_axis, to_uv.matrix2.y_axis, to_uv.translation);
            let rows = [[x.x, y.x, t.x], [x.y, y.y, t.y], [0.0, 0.0, 1.0]];
            self.line("<transform name=\"to_uv\">");
            self.line(&format!("<matrix value=\"{}\"/>", spaced(rows.as_flattened())));
            self.line("</transform>");
        }
        self.line("</texture>");
        id
    }

    fn material(&mut self, material: &Material, textures: &[(String, String)]) -> String {
        let id = self.ids.unique(&material.id);
        let plugin = match material.bsdf {
            Bsdf::Diffuse { .. } => "diffuse",
            Bsdf::RoughConductor { .. } => "roughconductor",
            Bsdf::Conductor { .. } => "conductor",
        };
        if material.two_sided {
            self.open("bsdf", "twosided", &id);
            self.line(&format!("<bsdf type=\"{plugin}\">"));
        } else {
            self.open("bsdf", plugin, &id);
        }
        if let Bsdf::RoughConductor { distribution, alpha, .. } = &material.bsdf {
            let name = match distribution {
                Microfacets::Beckmann => "beckmann",
                Microfacets::Ggx => "ggx",
            };
            self.value("string", "distribution", name);
            self.value("float", "alpha", alpha);
        }
        let name = match &material.bsdf {
            Bsdf::Diffuse { .. } => "reflectance",
            Bsdf::RoughConductor { eta, k, .. } | Bsdf::Conductor { eta, k, .. } => {
                self.colour("eta", *eta);
                self.colour("k", *k);
                "specular_reflectance"
            }
        };
        match material.bsdf.reflectance() {
            Reflectance::Constant(colour) => self.colour(name, *colour),
            Reflectance::Texture(texture) => {
                self.line(&format!("<ref name=\"{name}\" id=\"{}\"/>", escaped(&textures[*texture].0)));
            }
        }
        if material.two_sided {
            self.line("</bsdf>");
        }
        self.line("</bsdf>");
        id
    }

    /// The plugin and the file of a mesh, relative to the scene. PLY has one topology only, which does for all but computed
    /// normals with texture coordinates.
    fn mesh(
        &self,
        id: &str,
        mesh: &crate::geometry::Mesh,
        paths: &mut Names,
    ) -> Result<(&'static str, String), Error> {
        let stem = paths.unique(&format!("meshes/{}", plain(id)));
        let computed = matches!(mesh.normals(), Normals::AngleWeighted { .. });
        if computed && mesh.uvs().is_some() {
            let file = stem + ".obj";
            write_obj(&self.place(&file)?, mesh)?;
            return Ok(("obj", file));
        }
        let file = stem + ".ply";
        write_ply(&self.place(&file)?, mesh)?;
        Ok(("ply", file))
    }

    fn light(&mut self, light: &Light) {
        let id = self.ids.unique(light.id());
        match light {
            Light::Directional { direction, irradiance, kappa, .. } => {
                self.open("emitter", "directional", &id);
                self.vector("direction", *direction);
                self.colour("irradiance", *irradiance);
                if kappa.is_finite() {
                    self.value("float", "kappa", kappa);
                }
            }
            Light::Point { position, intensity, .. } => {
                self.open("emitter", "point", &id);
                self.vector("position", *position);
                self.colour("intensity", *intensity);
            }
        }
        self.line("</emitter>");
    }

    fn environment(&mut self, environment: &Environment, textures: &[(String, String)]) {
        match environment {
            Environment::Constant { id, radiance } => {
                let id = self.ids.unique(id);
                self.open("emitter", "constant", &id);
                self.colour("radiance", *radiance);
            }
            Environment::Map { id, texture, scale, to_world } => {
                let id = self.ids.unique(id);
                self.open("emitter", "envmap", &id);
                self.value("string", "filename", &textures[*texture].1);
                self.value("float", "scale", scale);
                self.to_world(*to_world, DVec3::ZERO);
            }
        }
        self.line("</emitter>");
    }

    /// A file's place, in a folder that exists.
    fn place(&self, file: &str) -> Result<PathBuf, Error> {
        let path = self.folder.join(file);
        if let Some(folder) = path.parent() {
            std::fs::create_dir_all(folder).map_err(|source| Error::File {
                action: "make",
                path: folder.to_path_buf(),
                source,
            })?;
        }
        Ok(path)
    }

    fn open(&mut self, tag: &str, plugin: &str, id: &str) {
        self.line(&format!("<{tag} type=\"{plugin}\" id=\"{}\">", escaped(id)));
    }

    fn value(&mut self, tag: &str, name: &str, value: impl Display) {
        self.line(&format!("<{tag} name=\"{name}\" value=\"{}\"/>", escaped(&value.to_string())));
    }

    fn colour(&mut self, name: &str, c: DVec3) {
        self.value("rgb", name, spaced(&c.to_array()));
    }

    fn vector(&mut self, name: &str, v: DVec3) {
        self.line(&format!("<vector name=\"{name}\" x=\"{}\" y=\"{}\" z=\"{}\"/>", v.x, v.y, v.z));
    }

    fn to_world(&mut self, m: DMat3, t: DVec3) {
        let row = |i: usize| [m.x_axis[i], m.y_axis[i], m.z_axis[i], t[i]];
        let rows = [row(0), row(1), row(2), [0.0, 0.0, 0.0, 1.0]];
        self.line("<transform name=\"to_world\">");
        self.line(&format!("<matrix value=\"{}\"/>", spaced(rows.as_flattened())));
        self.line("</transform>");
    }

    /// A line, indented by the elements that are open.
    fn line(&mut self, line: &str) {
        let closes = line.starts_with("</");
        self.depth -= usize::from(closes);
        writeln!(self.text, "{:1$}{line}", "", 2 * self.depth).expect("strings can be written to");
        self.depth += usize::from(!closes && !line.ends_with("/>"));
    }
}

fn spaced(numbers: &[f64]) -> String {
    numbers.iter().map(f64::to_string).collect::<Vec<_>>().join(" ")
}

/// As the value of an attribute.
fn escaped(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => escaped.push_str("&amp;"),
            '<' => escaped.push_str("&lt;"),
            '"' => escaped.push_str("&quot;"),
            // Or a variable's name would begin.
            '$' => escaped.push_str("\\$"),
            '\t' | '\n' | '\r' => {
                let _ = write!(escaped, "&#{};", u32::from(c));
            }
            // No reader takes other control characters, however they are written.
            c if c.is_control() => escaped.push('_'),
            c => escaped.push(c),
        }
    }
    escaped
}

/// A file's name for an id: what is neither letter nor digit becomes `_`.
fn plain(id: &str) -> String {
    id.chars().map(|c| if c.is_alphanumeric() || c == '-' { c } else { '_' }).collect()
}
