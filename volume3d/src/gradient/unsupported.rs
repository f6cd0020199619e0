//! Unsupported derivatives, and which of them may be omitted explicitly.

use glam::DVec3;

use super::hard_shadows::{beam_ends, casts_shadows};
use crate::gradient::parameters::tangent::{ActiveParameters, Tangent};
use crate::scene::{Light, Scene, parts};

/// A derivative that is not supported.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Unsupported {
    /// Geometry moves in front of an ideal mirror or a smooth coating, and the method is not warped-area
    /// sampling.
    #[error(
        "material `{material}` of shape `{shape}` reflects as an ideal mirror, and no list says where edges are seen in it; use warped-area sampling or finite differences, or edge sampling and allow missing mirrors"
    )]
    Mirror {
        /// The mirror's shape.
        shape: String,
        /// Its material.
        material: String,
    },
    /// Geometry moves that is visible through a transmissive surface, and the method is not warped-area
    /// sampling.
    #[error(
        "material `{material}` of shape `{shape}` transmits light, and no list says where edges are seen through it; use warped-area sampling or finite differences, or edge sampling and allow missing transmission"
    )]
    Transmission {
        /// The shape.
        shape: String,
        /// Its material.
        material: String,
    },
    /// Geometry moves in front of a bump or normal map.
    #[error(
        "material `{material}` of shape `{shape}` has a bump or normal map: discontinuities of its shading normals are not handled; remove the map, keep geometry static, or use finite differences, or edge sampling and allow missing relief"
    )]
    Relief {
        /// The shape.
        shape: String,
        /// Its material.
        material: String,
    },
    /// The scene has a participating medium, whatever changes.
    #[error(
        "the scene contains medium `{medium}`, and derivatives do not support media; remove it, or use finite differences"
    )]
    Medium {
        /// Name of the medium.
        medium: String,
    },
    /// The method supports meshes only.
    #[error(
        "{method} does not follow the silhouettes of implicit surface `{shape}`; use warped-area sampling or finite differences, or keep geometry static"
    )]
    Implicit {
        /// Name of the implicit surface.
        shape: String,
        /// The method.
        method: &'static str,
    },
    /// The field of view of an orthographic camera changes.
    #[error("the camera is orthographic and has no field of view; translate or rotate it instead")]
    FieldOfView,
    /// A point light moves, or geometry under it, and the method is not warped-area sampling: its shadows
    /// have no penumbra.
    #[error(
        "point light `{light}` casts shadows without a penumbra, whose motion is not handled; use warped-area sampling or finite differences, or edge sampling and allow missing point lights, or replace it by a small emitting shape"
    )]
    Delta {
        /// The light.
        light: String,
    },
    /// A light with an abrupt beam border moves, or geometry under it.
    #[error(
        "the light of `{light}` ends abruptly, at the border of its slide or cone, whose motion no warp sees; make the slide black along its border, or beam_width less than cutoff_angle, or take finite differences, or edge sampling and allow missing point lights"
    )]
    Beam {
        /// The light.
        light: String,
    },
    /// A directional light moves, or geometry under it, and the method is not warped-area sampling.
    #[error(
        "light `{light}` casts shadows without a penumbra, whose motion is not handled; use warped-area sampling or finite differences, or edge sampling and allow missing parallel lights, or give it a finite kappa"
    )]
    Parallel {
        /// The light.
        light: String,
    },
}

/// Discontinuities whose motion [`EdgeSampling`](super::EdgeSampling) may omit, if permitted.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Missing {
    /// Objects reflected in ideal mirrors and smooth coatings: [`Unsupported::Mirror`].
    Mirror,
    /// Objects behind glass, reflected in it, or behind partly transparent surfaces:
    /// [`Unsupported::Transmission`].
    Transmission,
    /// Curves on which bump- or normal-mapped normals turn away: [`Unsupported::Relief`].
    Relief,
    /// Shadows of point, spot and projector lights: [`Unsupported::Delta`].
    PointLight,
    /// Shadows of directional lights: [`Unsupported::Parallel`].
    ParallelLight,
}

impl Missing {
    /// Every kind.
    const ALL: [Self; 5] =
        [Self::Mirror, Self::Transmission, Self::Relief, Self::PointLight, Self::ParallelLight];
}

impl Unsupported {
    /// The kind of discontinuity, if the remaining derivative is meaningful without it.
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

    /// Name of the shape, light or medium, if it is not the camera.
    #[must_use]
    pub fn place(&self) -> Option<&str> {
        match self {
            Self::Mirror { shape, .. }
            | Self::Transmission { shape, .. }
            | Self::Relief { shape, .. }
            | Self::Implicit { shape, .. } => Some(shape),
            Self::Delta { light } | Self::Beam { light } | Self::Parallel { light } => Some(light),
            Self::Medium { medium } => Some(medium),
            Self::FieldOfView => None,
        }
    }
}

impl Unsupported {
    /// Whether the field of chains follows it.
    fn is_in_a_chain(&self) -> bool {
        matches!(
            self,
            Self::Mirror { .. } | Self::Transmission { .. } | Self::Delta { .. } | Self::Parallel { .. }
        )
    }
}

/// Whether light reaches the camera through ideal boundaries or transmissive surfaces, or from lights without
/// extent.
pub(super) fn has_chains(scene: &Scene) -> bool {
    jumps_unseen(scene).iter().any(Unsupported::is_in_a_chain)
}

/// Everything in a scene that prevents gradients along a tangent by
/// [warped-area sampling](super::WarpedArea). Edge sampling and the rotation heuristic support less: no
/// mirrors, no transmission and no lights without extent where geometry moves.
#[must_use]
pub fn unsupported(scene: &Scene, change: &Tangent) -> Vec<Unsupported> {
    left_out_of_tangent(scene, change, true, &Missing::ALL).unwrap_or_else(|refused| vec![refused])
}

/// Whether a tangent moves light that comes through chains, or of lights without extent.
pub(super) fn moves_chains(scene: &Scene, change: &Tangent) -> bool {
    left_out_of_tangent(scene, change, false, &Missing::ALL).is_ok_and(has_any_in_a_chain)
}

/// Like [`moves_chains`], for active parameters.
pub(super) fn may_move_chains(scene: &Scene, active: &ActiveParameters) -> bool {
    left_out_of_active(scene, active, false, &Missing::ALL).is_ok_and(has_any_in_a_chain)
}

#[expect(clippy::needless_pass_by_value, reason = "for results")]
fn has_any_in_a_chain(all: Vec<Unsupported>) -> bool {
    all.iter().any(Unsupported::is_in_a_chain)
}

/// Discontinuities of a tangent whose motion would be lost, if all of them are permitted.
///
/// # Errors
/// The first one that is not permitted.
pub(super) fn left_out_of_tangent(
    scene: &Scene,
    change: &Tangent,
    follows_chains: bool,
    allowed: &[Missing],
) -> Result<Vec<Unsupported>, Unsupported> {
    supports_field_of_view(scene, change)?;
    let still = |l: usize| change.pose[l] == DVec3::ZERO && change.light_rotation[l] == DVec3::ZERO;
    let moved = (0..change.pose.len()).filter(|&l| !still(l));
    left_out(scene, change.is_geometric(), moved, (follows_chains, allowed))
}

/// Like [`left_out_of_tangent`], for active parameters.
///
/// # Errors
/// The first one that is not permitted.
pub(super) fn left_out_of_active(
    scene: &Scene,
    active: &ActiveParameters,
    follows_chains: bool,
    allowed: &[Missing],
) -> Result<Vec<Unsupported>, Unsupported> {
    let moved = (0..active.poses.len()).filter(|&l| active.poses[l]);
    left_out(scene, active.is_geometric(), moved, (follows_chains, allowed))
}

/// Refuses a change of the field of view of a camera that has none.
pub(super) fn supports_field_of_view(scene: &Scene, change: &Tangent) -> Result<(), Unsupported> {
    let is_orthographic = scene.description().camera.orthographic.is_some();
    if is_orthographic && change.camera.field_of_view != 0.0 { Err(Unsupported::FieldOfView) } else { Ok(()) }
}

/// Refuses scenes with media: derivatives cover paths between surfaces only.
pub(super) fn supports_no_media(scene: &Scene) -> Result<(), Unsupported> {
    match scene.description().media.first() {
        Some(medium) => Err(Unsupported::Medium { medium: medium.id.clone() }),
        None => Ok(()),
    }
}

/// Refuses a method that supports meshes only if geometry moves in a scene with implicit surfaces.
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
    (follows_chains, allowed): (bool, &[Missing]),
) -> Result<Vec<Unsupported>, Unsupported> {
    supports_no_media(scene)?;
    let all = if geometric { jumps_unseen(scene) } else { Vec::new() };
    let all = if sees_no_reflection(scene) { all } else { with_lights(all, scene, moved) };
    let all: Vec<Unsupported> = all.into_iter().filter(|u| !(follows_chains && u.is_in_a_chain())).collect();
    let refused = all.iter().find(|jumps| jumps.missing().is_none_or(|kind| !allowed.contains(&kind)));
    refused.cloned().map_or(Ok(all), Err)
}

/// All discontinuities that no method follows when geometry moves.
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
    let beams = d.lights.iter().filter(|light| beam_ends(scene, light));
    let beams = beams.map(|light| Unsupported::Beam { light: light.id().clone() });
    surfaces.chain(d.lights.iter().filter_map(hard_shadows)).chain(beams).collect()
}

/// Whether only emission is visible: no reflection, transmission or illumination.
fn sees_no_reflection(scene: &Scene) -> bool {
    scene.description().integrator.max_depth.is_some_and(|depth| depth < 2)
}

/// Adds the discontinuities that move with lights.
fn with_lights(
    mut all: Vec<Unsupported>,
    scene: &Scene,
    moved: impl Iterator<Item = usize>,
) -> Vec<Unsupported> {
    for light in moved.map(|l| &scene.lights()[l]).filter(|light| light.is_delta()) {
        let shadows = hard_shadows(light).filter(|shadows| !all.contains(shadows));
        all.extend(shadows.filter(|_| casts_shadows(scene, light)));
        let beam = Unsupported::Beam { light: light.id().clone() };
        if !all.contains(&beam) && beam_ends(scene, light) {
            all.push(beam);
        }
    }
    all
}

/// The error for a light without extent.
fn hard_shadows(light: &Light) -> Option<Unsupported> {
    light.is_delta().then(|| match light {
        Light::Directional { id, .. } => Unsupported::Parallel { light: id.clone() },
        light => Unsupported::Delta { light: light.id().clone() },
    })
}
