//! Coincident surfaces and edges, whose separation has only one-sided derivatives; intersections with
//! implicit surfaces, which no field follows; and meshes distorted by rounding.

use glam::DVec3;

use super::{Finding, Kind};
use crate::gradient::{CameraTangent, OnPixelBorders, Tangent};
use crate::scene::{CoarseMesh, CrossedBy, Description, ImplicitCrossing, Overlap, Scene};

/// Advice for coincident surfaces and edges.
const APART: &str = "move one of them a little";

/// Surfaces and edges that a motion of positions separates: its derivatives are one-sided there.
#[must_use]
pub fn parted(scene: &Scene, velocities: &[DVec3]) -> Vec<Finding> {
    let (planes, edges) = (scene.parted_shapes(velocities), scene.parted_edges(velocities));
    overlaps(scene.description(), true, &planes, edges, scene.lifted_edges(velocities))
}

/// Contacts of moving shapes, which may separate. `moves`: whether the shape with an index moves.
#[must_use]
pub fn touching(scene: &Scene, moves: impl Fn(usize) -> bool) -> Vec<Finding> {
    let moving = |mut overlaps: Vec<Overlap>| {
        overlaps.retain(|o| o.shapes.iter().any(|s| moves(*s)));
        overlaps
    };
    let (planes, edges) = (moving(scene.overlapping_shapes()), moving(scene.coinciding_edges()));
    overlaps(scene.description(), false, &planes, edges, moving(scene.standing_shapes()))
}

/// Edges along pixel borders of a box filter, for each shape that moves relative to the camera. `moves`:
/// whether the shape with an index does.
#[must_use]
pub fn on_pixel_borders(scene: &Scene, moves: impl Fn(usize) -> bool) -> Vec<Finding> {
    let mut all = OnPixelBorders::of(scene);
    all.retain(|found| moves(found.shape));
    let d = scene.description();
    let finding = |found: &OnPixelBorders| Finding {
        kind: Kind::PixelBorder,
        shapes: vec![d.shapes[found.shape].id.clone()],
        is_wrong: false,
        message: along_borders(d, found),
        advice: "move the camera a little, or take another filter",
    };
    all.iter().map(finding).collect()
}

/// Whether a change moves a shape, given by its index, relative to the camera.
pub fn moves_before_camera(scene: &Scene, change: &Tangent) -> impl Fn(usize) -> bool {
    let camera = change.camera != CameraTangent::default();
    move |s| camera || change.positions[scene.position_range(s)].iter().any(|v| *v != DVec3::ZERO)
}

/// A sentence about edges along pixel borders of a box filter.
fn along_borders(d: &Description, &OnPixelBorders { shape, edges, distance }: &OnPixelBorders) -> String {
    let id = &d.shapes[shape].id;
    let (edges, lie) =
        if edges == 1 { ("1 edge".to_owned(), "lies") } else { (format!("{edges} edges"), "lie") };
    if distance == 0.0 {
        format!(
            "{edges} of shape `{id}` {lie} on pixel borders, where the box filter is discontinuous: where they move across, \
             the gradient of both pixels is the mean of two one-sided derivatives"
        )
    } else {
        format!(
            "{edges} of shape `{id}` {lie} within {distance:.1e} pixels of pixel borders, where the box filter is \
             discontinuous: where they move across, the gradient holds for motions shorter than this"
        )
    }
}

/// Intersections with implicit surfaces, whose curves no field follows.
#[must_use]
pub fn implicit_crossings(scene: &Scene) -> Vec<Finding> {
    let d = scene.description();
    let finding = |crossing: &ImplicitCrossing| Finding {
        kind: Kind::Crossing,
        shapes: vec![crossing_name(d, crossing).1.clone(), d.implicits[crossing.implicit].id.clone()],
        is_wrong: true,
        message: passing_through(d, crossing),
        advice: "separate them, or model them as one: both as meshes, whose crossings are followed, or as one function",
    };
    scene.implicit_crossings().iter().map(finding).collect()
}

/// Meshes whose coordinates are too coarse.
#[must_use]
pub fn coarse_meshes(scene: &Scene) -> Vec<Finding> {
    let d = scene.description();
    let finding = |mesh: &CoarseMesh| Finding {
        kind: Kind::Coordinates,
        shapes: vec![d.shapes[mesh.shape].id.clone()],
        is_wrong: true,
        message: coarse(d, mesh),
        advice: "move the scene to the origin before writing its coordinates",
    };
    scene.coarse_meshes().iter().map(finding).collect()
}

/// A sentence about a mesh that rounding has distorted.
fn coarse(d: &Description, mesh: &CoarseMesh) -> String {
    let CoarseMesh { shape, coordinate, spacing, edge } = *mesh;
    format!(
        "shape `{}` has coordinates up to {coordinate:.1e}, which are rounded to {spacing:.1e}, {:.1e} of its median \
         edge: image and gradient are those of the rounded mesh",
        d.shapes[shape].id,
        spacing / edge
    )
}

/// A finding for each pair of shapes: coplanar faces are reported before coincident edges, and these before
/// edges in a face.
fn overlaps(
    d: &Description,
    is_wrong: bool,
    planes: &[Overlap],
    mut edges: Vec<Overlap>,
    mut standing: Vec<Overlap>,
) -> Vec<Finding> {
    edges.retain(|e| planes.iter().all(|p| p.shapes != e.shapes));
    standing.retain(|s| planes.iter().chain(&edges).all(|p| p.shapes != s.shapes));
    let finding = |of: fn(&Description, &Overlap) -> String| {
        move |overlap: &Overlap| {
            let [a, b] = overlap.shapes.map(|s| d.shapes[s].id.clone());
            let shapes = if a == b { vec![a] } else { vec![a, b] };
            Finding { kind: Kind::Contact, shapes, is_wrong, message: of(d, overlap), advice: APART }
        }
    };
    let all = planes.iter().map(finding(covering)).chain(edges.iter().map(finding(coinciding)));
    all.chain(standing.iter().map(finding(upon_face))).collect()
}

/// The derivative where surfaces separate.
const ONE_SIDED: &str =
    "a motion that separates them has only one-sided derivatives, and the result need not be either of them";

/// A sentence about coplanar faces that overlap.
fn covering(d: &Description, overlap: &Overlap) -> String {
    format!(
        "{} cover the same part of a plane ({}): rounding decides which is visible, and {ONE_SIDED}",
        shapes(d, overlap),
        pairs(overlap)
    )
}

/// A sentence about coincident edges.
fn coinciding(d: &Description, overlap: &Overlap) -> String {
    format!(
        "edges of {} coincide ({}): where both are visible, {ONE_SIDED}",
        shapes(d, overlap),
        pairs(overlap)
    )
}

/// A sentence about edges that lie in a face.
fn upon_face(d: &Description, overlap: &Overlap) -> String {
    let (shapes, pairs) = (shapes(d, overlap), pairs(overlap));
    format!("{shapes}: edges of one lie in a face of the other ({pairs}): {ONE_SIDED}")
}

fn shapes(d: &Description, overlap: &Overlap) -> String {
    let [a, b] = overlap.shapes.map(|s| &d.shapes[s].id);
    if a == b { format!("parts of shape `{a}`") } else { format!("shapes `{a}` and `{b}`") }
}

fn pairs(Overlap { pairs, example: [i, j], .. }: &Overlap) -> String {
    let count = if *pairs == 1 { "1 pair".to_owned() } else { format!("{pairs} pairs") };
    format!("{count} of triangles, such as {i} and {j}")
}

/// Kind and name of what passes through an implicit surface.
fn crossing_name<'a>(d: &'a Description, crossing: &ImplicitCrossing) -> (&'static str, &'a String) {
    match crossing.with {
        CrossedBy::Mesh(mesh) => ("shape", &d.shapes[mesh].id),
        CrossedBy::Implicit(other) => ("implicit surface", &d.implicits[other].id),
    }
}

/// A sentence about an intersection with an implicit surface.
fn passing_through(d: &Description, crossing: &ImplicitCrossing) -> String {
    let ImplicitCrossing { implicit, at, .. } = crossing;
    let (kind, other) = crossing_name(d, crossing);
    let id = &d.implicits[*implicit].id;
    format!(
        "{kind} `{other}` passes through implicit surface `{id}`, near {at:.3}: no field follows the curve in which they meet"
    )
}
