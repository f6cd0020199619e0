//! What cannot be differentiated, and what of it may be left out knowingly.

use glam::DVec3;

use super::hard_shadows::{beam_ends, casts_shadows};
use super::tangent::{ActiveParameters, Tangent};
use crate::scene::{Light, Scene, parts};

/// What cannot be differentiated.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Unsupported {
    /// Geometry moves before an ideal mirror, or a smooth coating.
    #[error(
        "material `{material}` of shape `{shape}` reflects as an ideal mirror: what moves in its image jumps where no warp sees it; give it a roughness, or move nothing, or take edge sampling and allow missing mirrors"
    )]
    Mirror {
        /// The mirror's shape.
        shape: String,
        /// Its material.
        material: String,
    },
    /// Geometry moves that can be seen through a surface.
    #[error(
        "light passes material `{material}` of shape `{shape}`: what moves behind it jumps where no warp sees it; give it another material, or move nothing, or take finite differences, or edge sampling and allow missing transmission"
    )]
    Transmission {
        /// The shape.
        shape: String,
        /// Its material.
        material: String,
    },
    /// Geometry moves before a texture that tilts normals.
    #[error(
        "a bump or normal map tilts the normals of material `{material}` of shape `{shape}`, whose jumps no warp sees; leave the map out, or move nothing, or take finite differences, or edge sampling and allow missing relief"
    )]
    Relief {
        /// The shape.
        shape: String,
        /// Its material.
        material: String,
    },
    /// There is a medium, whatever moves or changes.
    #[error(
        "medium `{medium}` fills a part of the scene, and derivatives do not see media; leave it out, or take finite differences"
    )]
    Medium {
        /// The medium.
        medium: String,
    },
    /// A method that knows meshes only.
    #[error(
        "{method} does not follow the silhouettes of implicit surface `{shape}`; take warped-area sampling, or finite differences, or move nothing"
    )]
    Implicit {
        /// The surface.
        shape: String,
        /// The method.
        method: &'static str,
    },
    /// An orthographic camera's field of view changes.
    #[error(
        "the camera is orthographic, and has no field of view that could change; move or turn it, or change nothing of it"
    )]
    FieldOfView,
    /// A light moves that casts shadows without width, or geometry does before such a light.
    #[error(
        "point light `{light}` casts shadows without a penumbra, whose motion no warp sees; put a small shape that emits in its place, or move nothing, or take finite differences, or edge sampling and allow missing point lights"
    )]
    Delta {
        /// The light.
        light: String,
    },
    /// A light moves whose beam ends abruptly.
    #[error(
        "the light of `{light}` ends abruptly, at the border of its slide or cone, whose motion no warp sees; make the slide black along its border, or beam_width less than cutoff_angle, or take finite differences, or edge sampling and allow missing point lights"
    )]
    Beam {
        /// The light.
        light: String,
    },
    /// The same of parallel light.
    #[error(
        "light `{light}` casts shadows without a penumbra, whose motion no warp sees; give it a finite kappa, or move nothing, or take finite differences, or edge sampling and allow missing parallel lights"
    )]
    Parallel {
        /// The light.
        light: String,
    },
}

/// A kind of jump whose motion [`EdgeSampling`](super::EdgeSampling) may leave out, if it is allowed to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Missing {
    /// What moves in ideal mirrors and smooth coatings: [`Unsupported::Mirror`].
    Mirror,
    /// What moves behind glass and in its reflection, and behind what is partly transparent: [`Unsupported::Transmission`].
    Transmission,
    /// Where normals tilted by a bump or normal map turn away: [`Unsupported::Relief`].
    Relief,
    /// Shadows of points, spots and projectors: [`Unsupported::Delta`].
    PointLight,
    /// Shadows of parallel light: [`Unsupported::Parallel`].
    ParallelLight,
}

impl Unsupported {
    /// The kind of jump, if the rest of the derivative makes sense without it.
    #[must_use]
    pub fn missing(&self) -> Option<Missing> {
        match self {
            Self::Mirror { .. } => Some(Missing::Mirror),
            Self::Transmission { .. } => Some(Missing::Transmission),
            Self::Relief { .. } => Some(Missing::Relief),
            Self::Delta { .. } | Self::Beam { .. } => Some(Missing::PointLight),
            Self::Parallel { .. } => Some(Missing::ParallelLight),
            Self::Implicit { .. } | Self::Medium { .. } | Self::FieldOfView => None,
        }
    }
}

/// Everything in a scene for which gradients along a change are refused, but for [finite
/// differences](super::FiniteDifference).
#[must_use]
pub fn unsupported(scene: &Scene, change: &Tangent) -> Vec<Unsupported> {
    let all = [
        Missing::Mirror,
        Missing::Transmission,
        Missing::Relief,
        Missing::PointLight,
        Missing::ParallelLight,
    ];
    left_out_of_tangent(scene, change, &all).unwrap_or_else(|refused| vec![refused])
}

/// What of a change would be silently lost, unless it is allowed to be: then it is listed.
///
/// # Errors
/// The first thing that is not allowed.
pub(super) fn left_out_of_tangent(
    scene: &Scene,
    change: &Tangent,
    allowed: &[Missing],
) -> Result<Vec<Unsupported>, Unsupported> {
    supports_field_of_view(scene, change)?;
    let still = |l: usize| change.pose[l] == DVec3::ZERO && change.light_rotation[l] == DVec3::ZERO;
    let moved = (0..change.pose.len()).filter(|&l| !still(l));
    left_out(scene, change.is_geometric(), moved, allowed)
}

/// The same of the parameters whose derivatives are asked for.
///
/// # Errors
/// The first thing that is not allowed.
pub(super) fn left_out_of_active(
    scene: &Scene,
    active: &ActiveParameters,
    allowed: &[Missing],
) -> Result<Vec<Unsupported>, Unsupported> {
    let moved = (0..active.poses.len()).filter(|&l| active.poses[l]);
    left_out(scene, active.is_geometric(), moved, allowed)
}

/// Refuses a change of a field of view where there is none.
pub(super) fn supports_field_of_view(scene: &Scene, change: &Tangent) -> Result<(), Unsupported> {
    let is_orthographic = scene.description().camera.orthographic.is_some();
    if is_orthographic && change.camera.field_of_view != 0.0 { Err(Unsupported::FieldOfView) } else { Ok(()) }
}

/// Refuses scenes with media: derivatives are of paths between surfaces.
pub(super) fn supports_no_media(scene: &Scene) -> Result<(), Unsupported> {
    match scene.description().media.first() {
        Some(medium) => Err(Unsupported::Medium { medium: medium.id.clone() }),
        None => Ok(()),
    }
}

/// Refuses a method that knows meshes only, where geometry moves beside implicit surfaces.
pub(super) fn supports_meshes_only(scene: &Scene, method: &'static str) -> Result<(), Unsupported> {
    match scene.description().implicits.first() {
        Some(shape) => Err(Unsupported::Implicit { shape: shape.id.clone(), method }),
        None => Ok(()),
    }
}

fn left_out(
    scene: &Scene,
    geometric: bool,
    moved: impl Iterator<Item = usize>,
    allowed: &[Missing],
) -> Result<Vec<Unsupported>, Unsupported> {
    supports_no_media(scene)?;
    let all = if geometric { jumps_unseen(scene) } else { Vec::new() };
    let all = if sees_no_reflection(scene) { all } else { with_lights(all, scene, moved) };
    let refused = all.iter().find(|jumps| jumps.missing().is_none_or(|kind| !allowed.contains(&kind)));
    refused.cloned().map_or(Ok(all), Err)
}

/// All jumps that no method follows when geometry moves.
fn jumps_unseen(scene: &Scene) -> Vec<Unsupported> {
    let d = scene.description();
    if sees_no_reflection(scene) {
        return vec![];
    }
    let meshes = d.shapes.iter().map(|shape| (&shape.id, shape.material));
    let shapes = meshes.chain(d.implicits.iter().map(|shape| (&shape.id, shape.material)));
    let parts = shapes.flat_map(|(id, material)| {
        parts(&d.materials, material).into_iter().map(move |material| (id, material))
    });
    let surfaces = parts.flat_map(|(id, material)| {
        let material = &d.materials[material];
        let named = || (id.clone(), material.id.clone());
        let transmission = (material.bsdf.transmits() || material.opacity.is_some()).then(|| {
            let (shape, material) = named();
            Unsupported::Transmission { shape, material }
        });
        let mirror = (material.bsdf.is_mirror() && !material.bsdf.transmits()).then(|| {
            let (shape, material) = named();
            Unsupported::Mirror { shape, material }
        });
        let relief = material.relief.is_some().then(|| {
            let (shape, material) = named();
            Unsupported::Relief { shape, material }
        });
        [transmission, mirror, relief].into_iter().flatten()
    });
    surfaces.chain(d.lights.iter().filter_map(hard_shadows)).collect()
}

/// Whether emission alone is seen, and nothing is reflected, passed or lit.
fn sees_no_reflection(scene: &Scene) -> bool {
    scene.description().integrator.max_depth.is_some_and(|depth| depth < 2)
}

/// Adds the jumps that move with lights, if there are any.
fn with_lights(
    mut all: Vec<Unsupported>,
    scene: &Scene,
    moved: impl Iterator<Item = usize>,
) -> Vec<Unsupported> {
    for light in moved.map(|l| &scene.lights()[l]).filter(|light| light.is_delta()) {
        let shadows = hard_shadows(light).filter(|shadows| !all.contains(shadows));
        all.extend(shadows.filter(|_| casts_shadows(scene, light)));
        all.extend(beam_ends(scene, light).then(|| Unsupported::Beam { light: light.id().clone() }));
    }
    all
}

/// The shadows of a light without extent.
fn hard_shadows(light: &Light) -> Option<Unsupported> {
    light.is_delta().then(|| match light {
        Light::Directional { id, .. } => Unsupported::Parallel { light: id.clone() },
        light => Unsupported::Delta { light: light.id().clone() },
    })
}
