//! Warnings about coincident surfaces and edges, whose separation has only one-sided derivatives; about
//! intersections with implicit surfaces, which no field follows; and about meshes distorted by rounding.

use glam::DVec3;
use volume3d::gradient::{CameraTangent, OnPixelBorders, Tangent};
use volume3d::scene::{CoarseMesh, CrossedBy, Description, ImplicitCrossing, Overlap, Scene};

/// Advice for coincident surfaces and edges.
pub(super) const APART: &str = "move one of them a little";

/// Surfaces and edges that a motion of positions separates, with one-sided derivatives: a sentence each.
pub(super) fn parted_by(scene: &Scene, velocities: &[DVec3]) -> Vec<String> {
    let (planes, edges) = (scene.parted_shapes(velocities), scene.parted_edges(velocities));
    sentences(scene.description(), &planes, edges, scene.lifted_edges(velocities))
}

/// Contacts of moving shapes, which may separate: a sentence each.
pub(super) fn touching(scene: &Scene, moves: impl Fn(usize) -> bool) -> Vec<String> {
    let moving = |mut overlaps: Vec<Overlap>| {
        overlaps.retain(|o| o.shapes.iter().any(|s| moves(*s)));
        overlaps
    };
    let (planes, edges) = (moving(scene.overlapping_shapes()), moving(scene.coinciding_edges()));
    sentences(scene.description(), &planes, edges, moving(scene.standing_shapes()))
}

/// A warning for each contact that a motion of positions separates, a line each.
pub(super) fn parted(scene: &Scene, velocities: &[DVec3]) -> String {
    warnings(&parted_by(scene, velocities))
}

/// A warning for each contact of a moving shape, a line each.
pub(super) fn in_contact(scene: &Scene, moves: impl Fn(usize) -> bool) -> String {
    warnings(&touching(scene, moves))
}

fn warnings(sentences: &[String]) -> String {
    sentences.iter().map(|what| format!("WARNING: {what}; {APART}\n")).collect()
}

/// Edges along pixel borders of a box filter: a sentence for each shape that moves relative to the camera.
pub(super) fn on_pixel_borders(scene: &Scene, moves: impl Fn(usize) -> bool) -> Vec<String> {
    let mut all = OnPixelBorders::of(scene);
    all.retain(|found| moves(found.shape));
    all.iter().map(|found| along_borders(scene.description(), found)).collect()
}

/// The sentences of [`on_pixel_borders`] as notes, a line each.
pub(super) fn along_pixels(scene: &Scene, moves: impl Fn(usize) -> bool) -> String {
    on_pixel_borders(scene, moves).iter().map(|what| format!("NOTE: {what}\n")).collect()
}

/// Whether a change moves a shape relative to the camera.
pub(super) fn moves_before_camera(scene: &Scene, change: &Tangent) -> impl Fn(usize) -> bool {
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

/// A warning for each intersection with an implicit surface, a line each.
pub(super) fn through_implicits(scene: &Scene) -> String {
    let all = scene.implicit_crossings();
    all.iter().map(|c| format!("WARNING: {}; {PART}\n", passing_through(scene.description(), c))).collect()
}

/// A warning for each mesh whose coordinates are too coarse, a line each.
pub(super) fn too_coarse(scene: &Scene) -> String {
    let all = scene.coarse_meshes();
    all.iter().map(|c| format!("WARNING: {}; {NEARER}\n", coarse(scene.description(), c))).collect()
}

/// Advice for coordinates that are too coarse.
pub(super) const NEARER: &str = "move the scene to the origin before writing its coordinates";

/// A sentence about a mesh that rounding has distorted.
pub(super) fn coarse(d: &Description, mesh: &CoarseMesh) -> String {
    let CoarseMesh { shape, coordinate, spacing, edge } = *mesh;
    format!(
        "shape `{}` has coordinates up to {coordinate:.1e}, which are rounded to {spacing:.1e}, {:.1e} of its median \
         edge: image and gradient are those of the rounded mesh",
        d.shapes[shape].id,
        spacing / edge
    )
}

/// A sentence for each pair of shapes: coplanar faces are reported before coincident edges, and these before
/// edges in a face.
fn sentences(
    d: &Description,
    planes: &[Overlap],
    mut edges: Vec<Overlap>,
    mut standing: Vec<Overlap>,
) -> Vec<String> {
    edges.retain(|e| planes.iter().all(|p| p.shapes != e.shapes));
    standing.retain(|s| planes.iter().chain(&edges).all(|p| p.shapes != s.shapes));
    let all = planes.iter().map(|p| covering(d, p)).chain(edges.iter().map(|e| coinciding(d, e)));
    all.chain(standing.iter().map(|s| upon_face(d, s))).collect()
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

/// Advice for intersections with an implicit surface.
pub(super) const PART: &str =
    "separate them, or model them as one: both as meshes, whose crossings are followed, or as one function";

/// A sentence about an intersection with an implicit surface.
pub(super) fn passing_through(d: &Description, crossing: &ImplicitCrossing) -> String {
    let ImplicitCrossing { implicit, with, at } = crossing;
    let (kind, other) = match *with {
        CrossedBy::Mesh(mesh) => ("shape", &d.shapes[mesh].id),
        CrossedBy::Implicit(other) => ("implicit surface", &d.implicits[other].id),
    };
    let id = &d.implicits[*implicit].id;
    format!(
        "{kind} `{other}` passes through implicit surface `{id}`, near {at:.3}: no field follows the curve in which they meet"
    )
}
