//! What is read of the format, in one table: from it come the messages of what is refused, `volume3d info --support`, and the
//! table in the documentation.

use std::fmt::Write as _;

/// Plugins of one kind.
pub(super) struct Kind {
    /// The element.
    pub(super) tag: &'static str,
    /// The plugins, separated by commas.
    pub(super) plugins: &'static str,
    /// What there is to say about them.
    pub(super) remarks: &'static str,
}

pub(super) const SHAPES: &str =
    "obj, ply, serialized, rectangle, cube, sphere, disk, cylinder, sdfgrid, sdfnetwork";
pub(super) const TEXTURES: &str = "bitmap, checkerboard";
pub(super) const SENSORS: &str = "perspective, and thinlens with an aperture_radius of 0";
pub(super) const FILMS: &str = "hdrfilm, ldrfilm, mfilm";
pub(super) const FILTERS: &str = "box, tent, gaussian, mitchell, catmullrom, lanczos";
pub(super) const SAMPLERS: &str = "independent, stratified, multijitter, orthogonal, ldsampler";
pub(super) const INTEGRATORS: &str = "path, direct, prb, prb_basic, prb_reparam, prb_projective, direct_reparam, \
    direct_projective, volpath, volpathmis, prbvolpath, ptracer, bdpt, moment, aov, stokes";
