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

/// Lists problems of a scene for gradients with respect to geometry, shape by shape, with advice.
///
/// With --move, the findings are those for the gradient along that motion: the refusals and warnings of
/// `volume3d gradient`. Without --move, surfaces in contact are only hints, because gradients are wrong only
/// where they separate, not where they slide.
///
/// Exit status: 1 if a finding makes gradients wrong or has them refused; 0 if there are only hints or no
/// findings.
#[derive(Args, Debug)]
pub(super) struct Options {
    #[command(flatten)]
    scene: SceneOptions,
    #[command(flatten)]
    moves: Moves,
}

/// A problem, or a possible one, for gradients.
pub(super) struct Finding {
    /// Whether gradients are wrong or refused; otherwise it is a hint.
    pub(super) grave: bool,
    /// The problem and its place.
    pub(super) what: String,
    /// Advice.
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
        (hints, 0) => writeln!(text, "{hints} hints, no finding that makes gradients wrong"),
        (all, grave) => {
            writeln!(text, "{grave} of {all} findings make gradients by geometry wrong or refused")
        }
    };
    Ok(Report { text, outcome: if grave > 0 { Outcome::Bad } else { Outcome::Good } })
}

/// All findings for a scene in which any shape may move.
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
        what: format!("light `{}` has no extent: no warp sees the discontinuities of its shadows", l.id()),
        advice: match l {
            Light::Point { .. } | Light::Spot { .. } | Light::Projector { .. } => {
                "replace it by a small emitting shape, or take --method finite-difference"
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

/// Advice for shapes in contact, without --move.
const MAY_PART: &str =
    "move one of them a little, unless they only slide: lint with --move checks a given motion";

/// The findings for the gradient along a change: refusals first, then warnings and hints.
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

/// Advice for edges on pixel borders.
const ASIDE: &str = "move the camera a little, or take another filter";

/// Meshes whose coordinates are too coarse.
fn too_coarse(scene: &Scene) -> impl Iterator<Item = Finding> {
    let all = scene.coarse_meshes().into_iter();
    all.map(|mesh| Finding { grave: true, what: coarse(scene.description(), &mesh), advice: NEARER })
}

/// Advice for a refusal.
fn otherwise(jumps: &Unsupported) -> &'static str {
    match jumps.missing() {
        Some(
            Missing::PointLight
            | Missing::ParallelLight
            | Missing::Mirror
            | Missing::Transmission
            | Missing::Relief,
        ) => {
            "take --method finite-difference, or --allow-missing, which leaves out this part of the derivative"
        }
        _ if *jumps == Unsupported::FieldOfView => "leave that motion out",
        _ => "take --method finite-difference",
    }
}

/// Intersections with implicit surfaces.
fn crossed(scene: &Scene) -> impl Iterator<Item = Finding> {
    let all = scene.implicit_crossings().into_iter();
    all.map(|crossing| Finding {
        grave: true,
        what: passing_through(scene.description(), &crossing),
        advice: PART,
    })
}

/// A finding if the scene has no emitter.
fn unlit(scene: &Scene) -> Option<Finding> {
    let d = scene.description();
    let lit =
        d.environment.is_some() || !d.lights.is_empty() || d.shapes.iter().any(|s| s.radiance.is_some());
    let what = "nothing emits light: the image is black".to_owned();
    (!lit).then_some(Finding { grave: true, what, advice: "add an emitter" })
}

/// A finding if a material has discontinuities that no warp sees.
fn unseen(shape: &Shape, material: &Material) -> Option<Finding> {
    let finding = |what: String, advice| Some(Finding { grave: true, what, advice });
    let id = &shape.id;
    if material.relief.is_some() {
        let what = format!("shape `{id}` has a bump or normal map: no warp sees its discontinuities");
        return finding(what, "leave out the bump or normal map, or take --method finite-difference");
    }
    None
}

/// Creases beyond this number are probably not intended.
const MANY_CREASES: usize = 1000;

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
    let contrary = shape.mesh.turned_normals();
    if contrary > 0 {
        let what = format!(
            "shape `{}`: {contrary} triangles have vertex normals that point to their back sides",
            shape.id
        );
        let advice = "flip the triangles or the normals: triangles emit light from their front sides";
        found.push(Finding { grave: false, what, advice });
    }
    let many = (creases.count > MANY_CREASES).then_some((
        creases,
        "creases, edges at which flat shading is discontinuous",
        "give the mesh normals if it is meant to be smooth: every crease costs time and adds noise",
    ));
    for (fault, what, advice) in all.into_iter().chain(many) {
        if let Some(example) = fault.example {
            let what = format!("shape `{}`: {} {what}, such as {example}", shape.id, fault.count);
            found.push(Finding { grave: false, what, advice });
        }
    }
}
