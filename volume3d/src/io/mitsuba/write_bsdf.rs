//! Materials, written.

use glam::DVec3;

use super::write::{Writer, escaped};
use crate::scene::{
    Bsdf, Dielectric, Material, Microfacets, Plastic, Principled, PrincipledThin, Reflectance, Relief,
    Roughness,
};

impl Writer<'_> {
    /// A material, by its index.
    pub(super) fn material(&mut self, index: usize, material: &Material) {
        let id = self.ids.materials[index].clone();
        let mut wrappers = vec![];
        if material.two_sided && !material.bsdf.transmits() {
            wrappers.push("twosided");
        }
        if material.opacity.is_some() {
            // Mitsuba does not take a mask within twosided.
            wrappers.insert(0, "mask");
        }
        match material.relief {
            Some(Relief::Bump { .. }) => wrappers.push("bumpmap"),
            Some(Relief::Normals { .. }) => wrappers.push("normalmap"),
            None => {}
        }
        wrappers.push(plugin(&material.bsdf));
        for (depth, name) in wrappers.iter().enumerate() {
            match depth {
                0 => self.open("bsdf", name, &id),
                _ => self.line(&format!("<bsdf type=\"{name}\">")),
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
        self.model(&material.bsdf);
        for _ in wrappers {
            self.line("</bsdf>");
        }
    }

    fn model(&mut self, bsdf: &Bsdf) {
        if let Some(facets) = bsdf.facets() {
            self.facets(facets);
        }
        match bsdf {
            Bsdf::Diffuse { reflectance } => self.reflectance("reflectance", reflectance),
            Bsdf::RoughConductor { eta, k, specular_reflectance, .. }
            | Bsdf::Conductor { eta, k, specular_reflectance } => {
                self.colour("eta", *eta);
                self.colour("k", *k);
                self.reflectance("specular_reflectance", specular_reflectance);
            }
            Bsdf::Plastic(Plastic { eta, diffuse_reflectance, specular_reflectance, nonlinear, .. }) => {
                self.indices(*eta, *specular_reflectance);
                self.value("boolean", "nonlinear", nonlinear);
                self.reflectance("diffuse_reflectance", diffuse_reflectance);
            }
            Bsdf::Dielectric(dielectric) | Bsdf::ThinDielectric(dielectric) => {
                let Dielectric { eta, specular_reflectance, specular_transmittance, .. } = dielectric;
                self.indices(*eta, *specular_reflectance);
                self.reflectance("specular_transmittance", specular_transmittance);
            }
            Bsdf::Principled(principled) => self.principled(principled),
            Bsdf::PrincipledThin(thin) => self.principled_thin(thin),
        }
    }

    fn principled(&mut self, principled: &Principled) {
        let Principled { base_color, roughness, metallic, eta, spec_tint, spec_trans, .. } = principled;
        let Principled { sheen, sheen_tint, flatness, clearcoat, clearcoat_gloss, .. } = principled;
        self.reflectance("base_color", base_color);
        let floats = [
            ("roughness", roughness),
            ("metallic", metallic),
            ("eta", eta),
            ("spec_tint", spec_tint),
            ("spec_trans", spec_trans),
            ("sheen", sheen),
            ("sheen_tint", sheen_tint),
            ("flatness", flatness),
            ("clearcoat", clearcoat),
            ("clearcoat_gloss", clearcoat_gloss),
        ];
        floats.into_iter().for_each(|(name, value)| self.value("float", name, value));
    }

    fn principled_thin(&mut self, thin: &PrincipledThin) {
        let PrincipledThin { base_color, roughness, eta, spec_tint, spec_trans, diff_trans, .. } = thin;
        let PrincipledThin { sheen, sheen_tint, flatness, .. } = thin;
        self.reflectance("base_color", base_color);
        let floats = [
            ("roughness", roughness),
            ("eta", eta),
            ("spec_tint", spec_tint),
            ("spec_trans", spec_trans),
            ("diff_trans", diff_trans),
            ("sheen", sheen),
            ("sheen_tint", sheen_tint),
            ("flatness", flatness),
        ];
        floats.into_iter().for_each(|(name, value)| self.value("float", name, value));
    }

    fn facets(&mut self, Roughness { distribution, alpha }: Roughness) {
        let name = match distribution {
            Microfacets::Beckmann => "beckmann",
            Microfacets::Ggx => "ggx",
        };
        self.value("string", "distribution", name);
        self.value("float", "alpha", alpha);
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
        Bsdf::Plastic(Plastic { facets: None, .. }) => "plastic",
        Bsdf::Plastic(_) => "roughplastic",
        Bsdf::Dielectric(Dielectric { facets: None, .. }) => "dielectric",
        Bsdf::Dielectric(_) => "roughdielectric",
        Bsdf::ThinDielectric(_) => "thindielectric",
        Bsdf::Principled(_) => "principled",
        Bsdf::PrincipledThin(_) => "principledthin",
    }
}
