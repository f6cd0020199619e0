//! Parameters that change noise, storage or time, but not the computed image.

const NOISE: &str = "it changes noise, not what is computed";
const STORAGE: &str = "it changes how an image is stored or shown";
const TIME: &str = "it changes time and memory only";
const DERIVATIVES: &str = "derivatives are computed another way";
const NO_TIME: &str = "the image is of light at all times";
const NO_LENS: &str = "there is no lens, or no shutter";

/// The element, the parameters, and why they are ignored.
const HARMLESS: &[(&str, &[&str], &str)] = &[
    ("integrator", &["emitter_samples", "bsdf_samples", "shading_samples", "samples_per_pass"], NOISE),
    (
        "integrator",
        &["luminaire_samples", "direct_samples", "light_image", "two_stage", "bidirectional"],
        NOISE,
    ),
    ("integrator", &["block_size", "timeout", "stop", "samples", "granularity", "parallel"], TIME),
    (
        "integrator",
        &["sppc", "sppp", "sppi", "guiding", "guiding_proj", "guiding_rounds", "proj_seed"],
        DERIVATIVES,
    ),
    (
        "integrator",
        &["reparam", "reparam_max_depth", "reparam_rays", "reparam_kappa", "reparam_exp"],
        DERIVATIVES,
    ),
    ("integrator", &["reparam_antithetic", "reparam_unroll", "antithetic_pass", "use_mis"], DERIVATIVES),
    (
        "film",
        &["banner", "attach_log", "component_format", "file_format", "gamma", "tonemap_method"],
        STORAGE,
    ),
    ("film", &["exposure", "key", "burn", "label", "digits", "variable", "cache", "filename"], STORAGE),
    ("film", &["compensate"], "sums are exact enough in any case"),
    ("sampler", &["seed", "jitter", "strength", "dimension", "scramble", "wrap"], NOISE),
    ("sensor", &["focus_distance", "shutter_open", "shutter_close", "aperture_radius"], NO_LENS),
    ("sensor", &["cone_scale"], "textures have no levels"),
    ("integrator", &["camera_unwarp", "temporal_filter", "use_nlos_only"], NO_TIME),
    ("film", &["temporal_bins", "start_opl", "bin_width_opl", "auto_detect_bins"], NO_TIME),
    ("film", &["time", "exposure_time", "time_offset", "auto_detect_exposure"], NO_TIME),
    ("emitter", &["sampling_weight", "samples", "mis_compensation", "cache_file"], NOISE),
    ("shape", &["sampling_weight", "silhouette_sampling_weight", "initialize_mesh_sampling"], NOISE),
    ("texture", &["format", "accel", "cache", "max_anisotropy"], STORAGE),
    ("bsdf", &["sample_visible"], NOISE),
    ("medium", &["sample_emitters", "has_spectral_extinction"], NOISE),
    ("scene", &["allow_thread_reordering", "embree_use_robust_intersections"], TIME),
];

/// Why a parameter of an element may be ignored, if it may.
pub(super) fn reason(tag: &str, name: &str) -> Option<&'static str> {
    HARMLESS.iter().find(|(t, names, _)| *t == tag && names.contains(&name)).map(|(_, _, why)| *why)
}
