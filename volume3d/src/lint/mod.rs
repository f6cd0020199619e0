//! Problems of a scene for gradients with respect to geometry, with advice.
//!
//! ```no_run
//! # fn f(scene: &volume3d::scene::Scene) {
//! for finding in volume3d::lint::lint(scene) {
//!     println!("{}: {}", finding.message, finding.advice);
//! }
//! # }
//! ```

mod contact;
mod mesh_faults;

pub use contact::{
    coarse_meshes, implicit_crossings, moves_before_camera, on_pixel_borders, parted, touching,
};
use mesh_faults::MeshFaults;

use crate::gradient::{Missing, Tangent, Unsupported, unsupported};
use crate::scene::{Material, Scene, Shape};

/// A problem, or a possible one, for gradients.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Finding {
    /// Kind of problem.
    pub kind: Kind,
    /// Names of the shapes, implicit surfaces or lights concerned; none if it is the scene as a whole.
    pub shapes: Vec<String>,
    /// Whether gradients are wrong or refused; otherwise it is a hint.
    pub is_wrong: bool,
    /// The problem and its place.
    pub message: String,
    /// Advice.
    pub advice: &'static str,
}

/// Kind of problem.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Kind {
    /// A derivative that methods refuse.
    Unsupported,
    /// Something passes through an implicit surface.
    Crossing,
    /// Coordinates so large that rounding distorts a mesh.
    Coordinates,
    /// Nothing emits light.
    Unlit,
    /// Coplanar surfaces, coincident edges, or edges in a face.
    Contact,
    /// Edges along pixel borders of a box filter.
    PixelBorder,
    /// A property of a mesh that is legal, but often not intended.
    Mesh,
}

impl Kind {
    /// The name of the kind, in lower case.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Unsupported => "unsupported",
            Self::Crossing => "crossing",
            Self::Coordinates => "coordinates",
            Self::Unlit => "unlit",
            Self::Contact => "contact",
            Self::PixelBorder => "pixel-border",
            Self::Mesh => "mesh",
        }
    }
}

/// All findings for a scene in which any shape may move. Surfaces in contact are only hints: gradients are
/// wrong only where they separate, not where they slide.
#[must_use]
pub fn lint(scene: &Scene) -> Vec<Finding> {
    let d = scene.description();
    let mut found = implicit_crossings(scene);
    found.extend(coarse_meshes(scene));
    found.extend(d.shapes.iter().filter_map(|shape| {
        let parts = d.parts_of_material(shape.material).into_iter();
        parts.map(|part| &d.materials[part]).find_map(|material| unseen(shape, material))
    }));
    found.extend(d.lights.iter().filter(|l| l.is_delta()).map(|l| Finding {
        kind: Kind::Unsupported,
        shapes: vec![l.id().clone()],
        is_wrong: false,
        message: format!("light `{}` has no extent, and its shadows no penumbra", l.id()),
        advice: IN_CHAINS,
    }));
    found.extend(unlit(scene));
    let touching = touching(scene, |_| true).into_iter();
    found.extend(touching.map(|finding| Finding { advice: MAY_PART, ..finding }));
    d.shapes.iter().for_each(|shape| faults(shape, &mut found));
    found
}

/// Advice for shapes in contact, if no motion is given.
const MAY_PART: &str =
    "move one of them a little, unless they only slide: `lint` along a given motion says whether they part";

/// The findings for the gradient along a change: refusals first, then warnings and hints.
#[must_use]
pub fn lint_change(scene: &Scene, change: &Tangent) -> Vec<Finding> {
    let refused = |reason: &Unsupported| Finding {
        kind: Kind::Unsupported,
        shapes: reason.place().map(str::to_owned).into_iter().collect(),
        is_wrong: true,
        message: reason.to_string(),
        advice: otherwise(reason),
    };
    let mut found: Vec<Finding> = unsupported(scene, change).iter().map(refused).collect();
    found.extend(parted(scene, &change.positions));
    if change.is_geometric() {
        found.extend(implicit_crossings(scene));
        found.extend(coarse_meshes(scene));
    }
    found.extend(unlit(scene));
    found.extend(on_pixel_borders(scene, moves_before_camera(scene, change)));
    scene.description().shapes.iter().for_each(|shape| faults(shape, &mut found));
    found
}

/// Advice for a refusal.
fn otherwise(reason: &Unsupported) -> &'static str {
    match reason.missing() {
        Some(
            Missing::PointLight
            | Missing::ParallelLight
            | Missing::Mirror
            | Missing::Transmission
            | Missing::Relief,
        ) => "take finite differences, or edge sampling that may leave out this part of the derivative",
        _ if *reason == Unsupported::FieldOfView => "leave that motion out",
        _ => "take finite differences",
    }
}

/// A finding if the scene has no emitter.
fn unlit(scene: &Scene) -> Option<Finding> {
    let d = scene.description();
    let lit =
        d.environment.is_some() || !d.lights.is_empty() || d.shapes.iter().any(|s| s.radiance.is_some());
    (!lit).then(|| Finding {
        kind: Kind::Unlit,
        shapes: vec![],
        is_wrong: true,
        message: "nothing emits light: the image is black".to_owned(),
        advice: "add an emitter",
    })
}

/// A finding if a material has discontinuities that not all methods support.
fn unseen(shape: &Shape, material: &Material) -> Option<Finding> {
    let id = &shape.id;
    let all = |is_wrong: bool, message: String, advice| {
        let shapes = vec![id.clone()];
        Some(Finding { kind: Kind::Unsupported, shapes, is_wrong, message, advice })
    };
    let finding = |message: String, advice| all(true, message, advice);
    let hint = |message: String| all(false, message, IN_CHAINS);
    if material.relief.is_some() {
        let message = format!("shape `{id}` has a bump or normal map: no warp sees its discontinuities");
        return finding(message, "leave out the bump or normal map, or take finite differences");
    }
    if material.bsdf.transmits() || material.opacity.is_some() {
        return hint(format!("shape `{id}` transmits light"));
    }
    if material.bsdf.is_mirror() {
        return hint(format!("shape `{id}` reflects as an ideal mirror"));
    }
    None
}

/// Advice for light in chains.
const IN_CHAINS: &str = "where geometry moves, take warped-area sampling (the default) or finite differences: edge sampling does not support it";

/// Creases beyond this number are probably not intended.
const MANY_CREASES: usize = 1000;

/// Adds the faults of a shape's mesh.
fn faults(shape: &Shape, found: &mut Vec<Finding>) {
    let MeshFaults { borders, non_manifold, turned, zero_area, duplicated, unused, creases } =
        MeshFaults::of(&shape.mesh);
    let all = [
        (
            borders,
            "border edges (silhouettes from everywhere)",
            "close the mesh if it is meant to be a solid",
        ),
        (
            non_manifold,
            "edges of more than two triangles (silhouettes from everywhere)",
            "separate the sheets that meet there, unless they are meant to",
        ),
        (
            turned,
            "edges between triangles that face opposite ways (silhouettes from everywhere)",
            "orient the triangles alike; the back of a one-sided material is black",
        ),
        (
            zero_area,
            "triangles of zero area (never hit)",
            "remove them: gradients miss motions that give them an area",
        ),
        (
            duplicated,
            "vertices at the position of others (merged)",
            "expect them to move together, with one derivative",
        ),
        (unused, "vertices without a triangle (zero gradient)", "remove them, or expect zeros"),
    ];
    let id = &shape.id;
    let mut hint = |message: String, advice| {
        let shapes = vec![id.clone()];
        found.push(Finding { kind: Kind::Mesh, shapes, is_wrong: false, message, advice });
    };
    let contrary = shape.mesh.turned_normals();
    if contrary > 0 {
        hint(
            format!("shape `{id}`: {contrary} triangles have vertex normals that point to their back sides"),
            "flip the triangles or the normals: triangles emit light from their front sides",
        );
    }
    let many = (creases.count > MANY_CREASES).then_some((
        creases,
        "creases, edges at which flat shading is discontinuous",
        "give the mesh normals if it is meant to be smooth: every crease costs time and adds noise",
    ));
    for (fault, what, advice) in all.into_iter().chain(many) {
        if let Some(example) = fault.example {
            hint(format!("shape `{id}`: {} {what}, such as {example}", fault.count), advice);
        }
    }
}
