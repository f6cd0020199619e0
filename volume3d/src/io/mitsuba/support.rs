//! Table of supported plugins, from which error messages, `volume3d info --support` and the table in the
//! documentation are generated.

use std::fmt::Write as _;

/// Plugins of one kind.
struct Kind {
    tag: &'static str,
    plugins: &'static str,
    remarks: &'static str,
}

pub(super) const SHAPES: &str = "obj, ply, serialized, rectangle, cube, sphere, disk, cylinder, bsplinecurve, linearcurve, shapegroup, instance, sdfgrid, sdfnetwork";
pub(super) const TEXTURES: &str = "bitmap, checkerboard, mesh_attribute";
pub(super) const SENSORS: &str = "perspective, thinlens, orthographic";
pub(super) const FILMS: &str = "hdrfilm, ldrfilm, mfilm, transient_hdr_film, streakhdrfilm";
pub(super) const FILTERS: &str = "box, tent, gaussian, mitchell, catmullrom, lanczos";
pub(super) const SAMPLERS: &str = "independent, stratified, multijitter, orthogonal, ldsampler";
pub(super) const INTEGRATORS: &str = "path, direct, prb, prb_basic, prb_reparam, prb_projective, direct_reparam, \
    direct_projective, volpath, volpathmis, prbvolpath, ptracer, bdpt, transient_path, transientpath, moment, aov, stokes, \
    transientstokes";
pub(super) const BSDFS: &str = "diffuse, conductor, roughconductor, plastic, roughplastic, pplastic, dielectric, thindielectric, \
                     roughdielectric, principled, principledthin, null, polarizer, circular, retarder, blendbsdf, mask, bumpmap, normalmap, twosided";
pub(super) const MEDIA: &str = "homogeneous";
pub(super) const PHASES: &str = "isotropic, hg";
pub(super) const EMITTERS: &str =
    "constant, envmap, directional, point, spot, projector, and area within a shape";

const KINDS: [Kind; 12] = [
    Kind {
        tag: "shape",
        plugins: SHAPES,
        remarks: "`to_world`, `face_normals`, `flip_normals`, `flip_tex_coords`, `shape_index`; `center`, `radius`, `p0`, `p1`",
    },
    Kind {
        tag: "bsdf",
        plugins: BSDFS,
        remarks: "named metals and glasses; textures for colours, for the numbers of `principled` and `principledthin`, for `alpha`, `alpha_u` and `alpha_v` of `roughconductor`, `roughdielectric` and `pplastic`, and for the weight of `blendbsdf`; `twosided` with one or two materials",
    },
    Kind {
        tag: "medium",
        plugins: MEDIA,
        remarks: "as `interior` and `exterior` of meshes, and around the sensor; for integrators that support media; images and finite differences only",
    },
    Kind { tag: "phase", plugins: PHASES, remarks: "within a medium" },
    Kind {
        tag: "texture",
        plugins: TEXTURES,
        remarks: "PNG, JPEG, BMP, OpenEXR, Radiance HDR; bilinear; steps become narrow ramps; `to_uv`; `mesh_attribute` of PLY files",
    },
    Kind {
        tag: "emitter",
        plugins: EMITTERS,
        remarks: "textures for the radiance of `area`, and for `spot` and `projector`; in lenient mode `sky` and `sunsky` become constant",
    },
    Kind {
        tag: "spectrum",
        plugins: "pairs of wavelength and value, files of them, uniform, d65, srgb, rawconstant, blackbody, regular, irregular",
        remarks: "converted to linear RGB; the plugins also as constant textures",
    },
    Kind {
        tag: "sensor",
        plugins: SENSORS,
        remarks: "the first of several; the default of Mitsuba 2 if there is none; `orthographic` is a distant perspective camera",
    },
    Kind { tag: "film", plugins: FILMS, remarks: "read as hdrfilm" },
    Kind {
        tag: "rfilter",
        plugins: FILTERS,
        remarks: "`B` and `C` of `mitchell` from 0 to 1, up to 16 `lobes`",
    },
    Kind { tag: "sampler", plugins: "all", remarks: "only `sample_count` matters" },
    Kind {
        tag: "integrator",
        plugins: INTEGRATORS,
        remarks: "integrators of light paths; of nested ones, the image of the inner one",
    },
];

/// The current name of a plugin given by an older name, or with other capitals; `None` if the name is
/// current.
pub(super) fn spelling(tag: &str, plugin: &str) -> Option<&'static str> {
    let names = match tag {
        "shape" => SHAPES,
        "bsdf" => BSDFS,
        _ => return None,
    };
    match plugin {
        "disney" => return Some("principled"),
        "disneythin" => return Some("principledthin"),
        _ => {}
    }
    names.split(", ").find(|name| *name != plugin && name.eq_ignore_ascii_case(plugin))
}

/// The supported plugins, as a table in Markdown.
#[must_use]
pub fn support_table() -> String {
    let mut text = "| element | plugins | |\n|---|---|---|\n".to_owned();
    for Kind { tag, plugins, remarks } in &KINDS {
        let _ = writeln!(text, "| {tag} | {plugins} | {remarks} |");
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::read_scene;

    /// The table in the documentation is up to date.
    #[test]
    fn the_documentation_has_the_table() {
        assert_eq!(include_str!("support.md"), support_table(), "write the table to support.md");
    }

    /// Messages list the plugins of the table.
    #[test]
    fn messages_have_the_table() {
        for (tag, plugins) in
            [("bsdf", BSDFS), ("emitter", EMITTERS), ("shape", SHAPES), ("texture", TEXTURES)]
        {
            let scene =
                format!("<scene version='3.0.0'><sensor type='perspective'/><{tag} type='?'/></scene>");
            let none = |_: &std::path::Path| Err(std::io::Error::from(std::io::ErrorKind::NotFound));
            let error = read_scene(scene.as_bytes(), std::path::Path::new("s.xml"), &[], &none);
            let message = error.map(|_| ()).unwrap_err().to_string();
            assert!(message.ends_with(&format!("supported: {plugins}")), "{message}");
        }
    }
}
