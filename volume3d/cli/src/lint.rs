//! `volume3d lint`.

use std::fmt::Write as _;

use clap::Args;
use volume3d::gradient::{Missing, Tangent, Unsupported, unsupported};
use volume3d::scene::{Light, Material, Scene, Shape};

use super::contact::{self, APART, NEARER, PART, coarse, passing_through};
use super::mesh_faults::MeshFaults;
use super::movement::{Moves, change};
use super::report::{Outcome, Report};
use super::session::SceneOptions;

/// Names what will hurt gradients of a scene by geometry, shape by shape, and says what to do about it.
///
/// With --move it is asked about the gradient by that motion, and says what `gradient` says of it. Without,
/// what lies upon something else is a hint: it may slide, and is wrong only where it parts.
///
/// Exit status 1 if something makes them wrong or has them refused; 0 if there are hints only, or nothing.
#[derive(Args, Debug)]
pub(super) struct Options {
    #[command(flatten)]
    scene: SceneOptions,
    #[command(flatten)]
    moves: Moves,
}

/// Something that hurts gradients, or may.
pub(super) struct Finding {
    /// Whether gradients are wrong or refused, and not only noisy or a surprise.
    pub(super) grave: bool,
    /// What it is, and where.
    pub(super) what: String,
    /// What to do.
    pub(super) advice: &'static str,
}

pub(super) fn run(options: &Options) -> anyhow::Result<Report> {
    let scene = options.scene.load()?.scene;
    let found = if options.moves.moves.is_empty() {
        findings(&scene)
    } else {
        findings_of(&scene, &change(&scene, &options.moves.moves)?)
    };
    let grave = found.iter().filter(|f| f.grave).count();
    let mut text = String::new();
    for finding in &found {
        let kind = if finding.grave { "WRONG" } else { "hint" };
        let _ = writeln!(text, "{kind}: {}\n    {}", finding.what, finding.advice);
    }
    let _ = match (found.len(), grave) {
        (0, _) => writeln!(text, "nothing found"),
        (hints, 0) => writeln!(text, "{hints} hints, nothing that makes gradients wrong"),
        (all, grave) => {
            writeln!(text, "{grave} of {all} findings make gradients by geometry wrong, or refused")
        }
    };
    Ok(Report { text, outcome: if grave > 0 { Outcome::Bad } else { Outcome::Good } })
}

/// All findings in a scene whose shapes may all move, grave ones first.
pub(super) fn findings(scene: &Scene) -> Vec<Finding> {
    let d = scene.description();
    let mut found = vec![];
    found.extend(crossed(scene));
    found.extend(too_coarse(scene));
    found.extend(d.shapes.iter().filter_map(|shape| {
        let parts = d.parts_of_material(shape.material).into_iter();
        parts.map(|part| &d.materials[part]).find_map(|material| unseen(shape, material))
    }));
    found.extend(d.lights.iter().filter(|l| l.is_delta()).map(|l| Finding {
        grave: true,
        what: format!("light `{}` has no extent: its shadows jump where no warp sees it", l.id()),
        advice: match l {
            Light::Point { .. } | Light::Spot { .. } | Light::Projector { .. } => {
                "put a small shape that emits in its place, or take --method finite-difference"
            }
            Light::Directional { .. } => "give it a finite kappa, or take --method finite-difference",
        },
    }));
    found.extend(unlit(scene));
    let touching = contact::touching(scene, |_| true).into_iter();
    found.extend(touching.map(|what| Finding { grave: false, what, advice: MAY_PART }));
    d.shapes.iter().for_each(|shape| faults(shape, &mut found));
    found
}

/// Advice for shapes in contact that may move.
const MAY_PART: &str =
    "move one of them a little, unless they only slide over one another: lint tells of a motion, with --move";

/// All of the gradient of a scene by a motion, what is grave first: what makes `gradient` refuse, and what it
/// warns of.
fn findings_of(scene: &Scene, change: &Tangent) -> Vec<Finding> {
    let grave = |what: String, advice| Finding { grave: true, what, advice };
    let refused = unsupported(scene, change);
    let mut found: Vec<Finding> =
        refused.iter().map(|jumps| grave(jumps.to_string(), otherwise(jumps))).collect();
    found.extend(contact::parted_by(scene, &change.positions).into_iter().map(|what| grave(what, APART)));
    if change.is_geometric() {
        found.extend(crossed(scene));
        found.extend(too_coarse(scene));
    }
    found.extend(unlit(scene));
    let borders = contact::on_pixel_borders(scene, contact::moves_before_camera(scene, change)).into_iter();
    found.extend(borders.map(|what| Finding { grave: false, what, advice: ASIDE }));
    scene.description().shapes.iter().for_each(|shape| faults(shape, &mut found));
    found
}

/// Advice for edges on borders of pixels.
const ASIDE: &str = "move the camera a little, or take another filter";

/// Meshes whose coordinates are too coarse.
fn too_coarse(scene: &Scene) -> impl Iterator<Item = Finding> {
    let all = scene.coarse_meshes().into_iter();
    all.map(|mesh| Finding { grave: true, what: coarse(scene.description(), &mesh), advice: NEARER })
}

/// Advice for a refusal, beside its own words.
fn otherwise(jumps: &Unsupported) -> &'static str {
    match jumps.missing() {
        Some(
            Missing::PointLight
            | Missing::ParallelLight
            | Missing::Mirror
            | Missing::Transmission
            | Missing::Relief,
        ) => "--method finite-difference takes it, and so does --allow-missing, which leaves it out",
        _ if *jumps == Unsupported::FieldOfView => "leave that motion out",
        _ => "--method finite-difference takes it",
    }
}

/// Surfaces that pass through implicit surfaces.
fn crossed(scene: &Scene) -> impl Iterator<Item = Finding> {
    let all = scene.implicit_crossings().into_iter();
    all.map(|crossing| Finding {
        grave: true,
        what: passing_through(scene.description(), &crossing),
        advice: PART,
    })
}

/// A scene without light.
fn unlit(scene: &Scene) -> Option<Finding> {
    let d = scene.description();
    let lit =
        d.environment.is_some() || !d.lights.is_empty() || d.shapes.iter().any(|s| s.radiance.is_some());
    let what = "nothing emits light: the image is black".to_owned();
    (!lit).then_some(Finding { grave: true, what, advice: "add an emitter" })
}

/// What no warp sees because of a shape's material.
fn unseen(shape: &Shape, material: &Material) -> Option<Finding> {
    let finding = |what: String, advice| Some(Finding { grave: true, what, advice });
    let id = &shape.id;
    if material.bsdf.transmits() || material.opacity.is_some() {
        let what = format!("light passes shape `{id}`: what moves behind it jumps where no warp sees it");
        return finding(what, "give it another material, or take --method finite-difference");
    }
    if material.bsdf.is_mirror() {
        let what = format!(
            "shape `{id}` reflects as an ideal mirror: what moves in its image jumps where no warp sees it"
        );
        return finding(what, "give it a roughness, or take --method finite-difference");
    }
    if material.relief.is_some() {
        let what = format!("a texture tilts the normals of shape `{id}`, whose jumps no warp sees");
        return finding(what, "leave out the bump or normal map, or take --method finite-difference");
    }
    None
}

/// So many creases are hardly meant.
const MANY_CREASES: usize = 1000;

fn faults(shape: &Shape, found: &mut Vec<Finding>) {
    let MeshFaults { borders, non_manifold, turned, zero_area, duplicated, unused, creases } =
        MeshFaults::of(&shape.mesh);
    let all = [
        (borders, "border edges (silhouettes from everywhere)", "close the mesh if a solid is meant"),
        (
            non_manifold,
            "edges of more than two triangles (silhouettes from everywhere)",
            "part the sheets that meet there, if they are not meant to",
        ),
        (
            turned,
            "edges between triangles that face opposite ways (silhouettes from everywhere)",
            "turn the triangles one way; a back that is not two-sided is black",
        ),
        (zero_area, "triangles of zero area (never hit)", "remove them: none sees a motion that opens them"),
        (
            duplicated,
            "vertices at the place of others (made one)",
            "expect them to move together, by one derivative",
        ),
        (unused, "vertices without a triangle (zero gradient)", "remove them, or expect zeros"),
    ];
    let contrary = shape.mesh.turned_normals();
    if contrary > 0 {
        let what = format!(
            "shape `{}`: {contrary} triangles have vertex normals that point to their backs",
            shape.id
        );
        let advice = "turn the triangles or the normals: light is emitted from the front of triangles";
        found.push(Finding { grave: false, what, advice });
    }
    let many = (creases.count > MANY_CREASES).then_some((
        creases,
        "edges at which flat shading jumps",
        "give the mesh normals if it is meant to be smooth: every jump costs time and noise",
    ));
    for (fault, what, advice) in all.into_iter().chain(many) {
        if let Some(example) = fault.example {
            let what = format!("shape `{}`: {} {what}, such as {example}", shape.id, fault.count);
            found.push(Finding { grave: false, what, advice });
        }
    }
}
