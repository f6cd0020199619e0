//! Material export.

use glam::DVec3;

use super::write::{Writer, escaped};
use crate::io::Error;
use crate::scene::{
    Bsdf, Description, Dielectric, Microfacets, Plastic, Reflectance, Relief, Roughness, Scattering, Value,
};

impl Writer<'_> {
    /// Writes a material, by its index.
    pub(super) fn material(&mut self, scene: &Description, index: usize) -> Result<(), Error> {
        let material = &scene.materials[index];
        let id = self.ids.materials[index].clone();
        let mut wrappers = vec![];
        if material.two_sided && !material.bsdf.transmits() {
            wrappers.push("twosided");
        }
        if material.opacity.is_some() {
            // Mitsuba does not support a mask within twosided.
            wrappers.insert(0, "mask");
        }
        match material.relief {
            Some(Relief::Bump { .. }) => wrappers.push("bumpmap"),
            Some(Relief::Normals { .. }) => wrappers.push("normalmap"),
            None => {}
        }
        if material.blend.is_some() {
            wrappers.push("blendbsdf");
        }
        wrappers.push(plugin(&material.bsdf));
        for (depth, name) in wrappers.iter().enumerate() {
            match depth {
                0 => self.open("bsdf", name, &id),
                _ => self.line(&format!("<bsdf type=\"{name}\">")),
            }
            if let ("blendbsdf", Some(blend)) = (*name, &material.blend) {
                self.number("weight", blend.weight);
            }
            match (*name, &material.opacity, &material.relief) {
                ("mask", Some(opacity), _) => self.reflectance("opacity", opacity),
                ("bumpmap", _, Some(Relief::Bump { texture, scale })) => {
                    self.value("float", "scale", scale);
                    self.texture_reference("height", *texture);
                }
                ("normalmap", _, Some(Relief::Normals { texture })) => {
                    self.texture_reference("normalmap", *texture);
                }
                _ => {}
            }
        }
        if let Some(facets) = material.bsdf.facets() {
            self.facets(scene, index, facets)?;
        } else if let Bsdf::Plastic(Plastic { scattering: Scattering::Once, .. }) = material.bsdf {
            self.value("float", "alpha", 0);
        }
        self.model(&material.bsdf);
        let mut wrappers = wrappers.into_iter().rev();
        wrappers.next();
        self.line("</bsdf>");
        for name in wrappers {
            // The second material of a blend follows the first.
            let second = match name {
                "blendbsdf" => material.blend.map(|blend| blend.other),
                "twosided" => material.back,
                _ => None,
            };
            if let Some(second) = second {
                self.line(&format!("<ref id=\"{}\"/>", escaped(&self.ids.materials[second])));
            }
            self.line("</bsdf>");
        }
        Ok(())
    }

    fn model(&mut self, bsdf: &Bsdf) {
        match bsdf {
            Bsdf::Diffuse { reflectance } => self.reflectance("reflectance", reflectance),
            Bsdf::RoughConductor { eta, k, specular_reflectance, .. }
            | Bsdf::Conductor { eta, k, specular_reflectance } => {
                self.colour("eta", *eta);
                self.colour("k", *k);
                self.reflectance("specular_reflectance", specular_reflectance);
            }
            Bsdf::Plastic(Plastic { eta, diffuse_reflectance, specular_reflectance, scattering, .. }) => {
                self.indices(*eta, *specular_reflectance);
                if *scattering == Scattering::Nonlinear {
                    self.value("boolean", "nonlinear", true);
                }
                self.reflectance("diffuse_reflectance", diffuse_reflectance);
            }
            Bsdf::Dielectric(dielectric) | Bsdf::ThinDielectric(dielectric) => {
                let Dielectric { eta, specular_reflectance, specular_transmittance, .. } = dielectric;
                self.indices(*eta, *specular_reflectance);
                self.reflectance("specular_transmittance", specular_transmittance);
            }
            Bsdf::Principled(p) => self.principled(&p.base_color, p.eta, p.values()),
            Bsdf::PrincipledThin(thin) => self.principled(&thin.base_color, thin.eta, thin.values()),
        }
    }

    fn principled(&mut self, base_color: &Reflectance, eta: f64, values: Vec<(&'static str, Value, f64)>) {
        self.reflectance("base_color", base_color);
        self.value("float", "eta", eta);
        values.into_iter().for_each(|(name, value, _)| self.number(name, value));
    }

    fn number(&mut self, name: &str, value: Value) {
        match value {
            Value::Constant(value) => self.value("float", name, value),
            Value::Texture(texture) => self.texture_reference(name, texture),
        }
    }

    fn distribution(&mut self, distribution: Microfacets) {
        let name = match distribution {
            Microfacets::Beckmann => "beckmann",
            Microfacets::Ggx => "ggx",
        };
        self.value("string", "distribution", name);
    }

    /// Writes the facets of a material, by its index, and the textures of their roughness.
    fn facets(&mut self, scene: &Description, index: usize, facets: Roughness) -> Result<(), Error> {
        let Roughness { distribution, alpha, stretch } = facets;
        self.distribution(distribution);
        let [along, across] = scene.materials[index].roughness_textures;
        let first = scene.textures.len() + scene.shapes.len() + 2 * index;
        if along == across && stretch == 1.0 {
            return self.alpha(scene, "alpha", (alpha, along), first);
        }
        self.alpha(scene, "alpha_u", (alpha, along), first)?;
        self.alpha(scene, "alpha_v", (alpha * stretch, across), first + 1)
    }

    /// Writes a roughness, or a texture multiplied by it in a file with a unique number.
    fn alpha(
        &mut self,
        scene: &Description,
        name: &str,
        (alpha, texture): (f64, Option<usize>),
        number: usize,
    ) -> Result<(), Error> {
        match texture {
            Some(texture) => self.scaled_texture(name, (scene, texture), number, DVec3::splat(alpha)),
            None => {
                self.value("float", name, alpha);
                Ok(())
            }
        }
    }

    fn indices(&mut self, eta: f64, specular_reflectance: DVec3) {
        self.value("float", "int_ior", eta);
        self.value("float", "ext_ior", 1);
        self.colour("specular_reflectance", specular_reflectance);
    }

    fn reflectance(&mut self, name: &str, reflectance: &Reflectance) {
        match reflectance {
            Reflectance::Constant(colour) => self.colour(name, *colour),
            Reflectance::Texture(texture) => self.texture_reference(name, *texture),
        }
    }

    pub(super) fn texture_reference(&mut self, name: &str, texture: usize) {
        let id = escaped(&self.ids.textures[texture]);
        self.line(&format!("<ref name=\"{name}\" id=\"{id}\"/>"));
    }
}

fn plugin(bsdf: &Bsdf) -> &'static str {
    match bsdf {
        Bsdf::Diffuse { .. } => "diffuse",
        Bsdf::RoughConductor { .. } => "roughconductor",
        Bsdf::Conductor { .. } => "conductor",
        Bsdf::Plastic(Plastic { scattering: Scattering::Once, .. }) => "pplastic",
        Bsdf::Plastic(Plastic { facets: None, .. }) => "plastic",
        Bsdf::Plastic(_) => "roughplastic",
        Bsdf::Dielectric(Dielectric { facets: None, .. }) => "dielectric",
        Bsdf::Dielectric(_) => "roughdielectric",
        Bsdf::ThinDielectric(_) => "thindielectric",
        Bsdf::Principled(_) => "principled",
        Bsdf::PrincipledThin(_) => "principledthin",
    }
}
