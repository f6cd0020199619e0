//! Test of this module's lemma by scanning: V from both sides of every curve at which the visible face
//! changes.
//!
//! A scene for each kind of curve, and for coincidences of two, has random velocities of all vertices.
//! Directions along lines across it are bisected wherever another triangle becomes visible, down to rounding,
//! and V is compared from both sides. Fields that violate a condition of the lemma must fail on the same
//! scenes.

use std::sync::Arc;

use flatland::random::{Stream, open01, stream};
use flatland::sdf::{End, Trace};
use flatland::warp::LinearField as _;
use glam::{DMat3, DVec3};

use super::edge::Edge;
use super::scene_edges::{SceneEdges, edges};
use super::{AngularSupport, HalfSpace, JumpMean, Known, Sight, Silhouettes, View};
use crate::geometry::Mesh;
use crate::gradient::ImplicitField;
use crate::gradient::edges::EdgeList;
use crate::path::VisibilityDomain;
use crate::scene::{Camera, Description, Film, Filter, Material, NONE, Scene, Span, Surface};

/// Tolerance for V from both sides: its variation over the distance between them, and rounding.
const TOLERANCE: f64 = 1e-6;

const REACH: f64 = 0.2;

/// A sheet of quads between two rows of points.
fn strip(near: &[DVec3], far: &[DVec3]) -> Mesh {
    let n = near.len() as u32;
    let quads = (0..n - 1).flat_map(|i| [[i, i + 1, n + i + 1], [i, n + i + 1, n + i]]);
    Mesh::new([near, far].concat(), quads.collect()).expect("a mesh")
}

/// A plate at a depth, over x and y.
fn plate(x: [f64; 2], y: [f64; 2], z: f64) -> Mesh {
    let row = |y: f64| x.map(|x| DVec3::new(x, y, -z));
    strip(&row(y[0]), &row(y[1]))
}

/// A sheet along the polyline of x and depth through some points, over y from −1 to 1.
fn fold(points: &[(f64, f64)]) -> Mesh {
    let row = |y: f64| points.iter().map(|&(x, z)| DVec3::new(x, y, -z)).collect::<Vec<_>>();
    strip(&row(-1.0), &row(1.0))
}

fn wall() -> Mesh {
    plate([-4.0, 4.0], [-4.0, 4.0], 6.0)
}

/// A name, its meshes, and whether V must fail without crossings, or with seams as discontinuities.
struct Kind {
    name: &'static str,
    meshes: Vec<Mesh>,
    needs_crossings: bool,
    needs_seams: bool,
}

fn kind(name: &'static str, meshes: Vec<Mesh>) -> Kind {
    Kind { name, meshes, needs_crossings: false, needs_seams: false }
}

fn crossing(name: &'static str, meshes: Vec<Mesh>) -> Kind {
    Kind { needs_crossings: true, ..kind(name, meshes) }
}

fn seam(name: &'static str, meshes: Vec<Mesh>) -> Kind {
    Kind { needs_seams: true, ..kind(name, meshes) }
}

fn kinds() -> Vec<Kind> {
    let before = || plate([-1.0, 0.0], [-0.9, 0.7], 2.0);
    let bent = &[(-1.2, 3.3), (0.0, 3.0), (1.1, 3.4)];
    let slope = || fold(&[(-0.7, 2.2), (0.9, 3.9)]);
    let turned = DMat3::from_rotation_y(0.4) * DMat3::from_rotation_x(0.7);
    let cube = |centre: DVec3, size: f64, turn: DMat3| {
        Mesh::cube().transformed(&glam::DAffine3::from_mat3_translation(turn * size, centre))
    };
    let flat = || fold(&[(-1.2, 3.0), (0.0, 3.0), (1.1, 3.0)]);
    vec![
        kind("open border", vec![plate([-1.0, 0.3], [-0.8, 0.9], 2.0), wall()]),
        kind("silhouette of a solid", vec![cube(DVec3::new(0.1, 0.1, -3.0), 0.6, turned), wall()]),
        kind("crease", vec![fold(bent), wall()]),
        kind("curved smooth seam", vec![fold(bent).smooth(), wall()]),
        crossing("crossing", vec![flat(), slope(), wall()]),
        crossing(
            "crossing of solids",
            vec![
                cube(DVec3::new(-0.2, 0.1, -3.0), 0.6, turned),
                cube(DVec3::new(0.3, -0.1, -3.2), 0.7, turned * turned),
                wall(),
            ],
        ),
        crossing(
            "crossings that meet in a point",
            vec![
                flat(),
                slope(),
                strip(
                    &[DVec3::new(-1.0, -0.6, -2.1), DVec3::new(1.0, -0.5, -2.0)],
                    &[DVec3::new(-1.0, 0.5, -4.0), DVec3::new(1.0, 0.7, -4.2)],
                ),
            ],
        ),
        kind(
            "T-junction",
            vec![
                plate([-1.0, 0.0], [-1.0, 1.0], 3.0),
                plate([0.0, 1.0], [-1.0, 0.1], 3.0),
                plate([0.0, 1.0], [0.1, 1.0], 3.0),
                wall(),
            ],
        ),
        kind(
            "contact",
            vec![
                cube(DVec3::new(0.1, 0.2, -2.5), 0.5, DMat3::IDENTITY),
                plate([-1.5, 1.2], [-1.0, 1.0], 3.0),
            ],
        ),
        seam("border exactly before a flat seam", vec![before(), flat(), wall()]),
        seam(
            "silhouette exactly before a flat seam",
            vec![fold(&[(-1.0, 1.5), (0.0, 2.0), (-0.9, 2.4)]), flat()],
        ),
        seam("border exactly before a curved smooth seam", vec![before(), fold(bent).smooth(), wall()]),
        crossing(
            "crossing along a flat seam",
            vec![flat(), fold(&[(0.0, 2.0), (0.0, 3.0), (0.001, 4.0)]), slope()],
        ),
        crossing(
            "crossing along a curved smooth seam",
            vec![fold(bent).smooth(), fold(&[(-0.3, 2.0), (0.3, 4.0)])],
        ),
    ]
}

fn scene(kind: &Kind) -> Scene {
    let camera = Camera::look_at(DVec3::ZERO, -DVec3::Z, DVec3::Y, 1.0);
    let film =
        Film { width: 4, height: 4, crop: None, sample_border: true, filter: Filter::Tent { radius: 1.0 } };
    let mut d = Description::new(camera, film);
    let grey = d.add_material(Material::diffuse("grey", DVec3::splat(0.5)));
    for (i, mesh) in kind.meshes.iter().enumerate() {
        d.add_shape(&i.to_string(), mesh.clone(), grey);
    }
    Scene::new(d).expect("a scene")
}

fn seen(scene: &Scene, direction: DVec3) -> Option<u32> {
    scene.closest(DVec3::ZERO, direction, None)?.surface.triangle()
}

/// V for camera rays.
fn field(
    scene: &Scene,
    tree: &SceneEdges,
    reach: AngularSupport,
    velocities: &[DVec3],
    u: DVec3,
    triangle: Option<u32>,
) -> DVec3 {
    let plane = triangle.map(|t| {
        let [a, b, c] = scene.corners(tree.plane(t));
        let normal = (b - a).cross(c - a).normalize();
        let normal = if normal.dot(a) > 0.0 { -normal } else { normal };
        HalfSpace { normal, point: a, slack: 6e-6 }
    });
    let view = View {
        origin: DVec3::ZERO,
        planes: plane.as_slice(),
        domain: VisibilityDomain::Radiance,
        seen: triangle,
        left: None,
        border_softness: 0.0,
        rounding: 6e-13,
    };
    let sight = Sight {
        origin: DVec3::ZERO,
        from: None,
        plane: None,
        field: ImplicitField::default(),
        known: Known::Nothing,
    };
    let mut trace = Trace { direction: u, points: vec![], end: End::Miss };
    let mean = JumpMean::new(scene, tree, Silhouettes::All, &view, u, reach, &sight, &mut trace);
    mean.map_or(DVec3::ZERO, |mean| {
        mean.field(|seen| {
            let velocity = seen.followed.velocity(scene, velocities);
            (velocity - velocity.dot(seen.direction) * seen.direction) / seen.distance
        })
        .value
    })
}

fn random(rng: &mut Stream) -> DVec3 {
    DVec3::from_array(std::array::from_fn(|_| 2.0 * open01(rng) - 1.0))
}

/// Bisects for the position along a line at which the visible triangle changes: an interval.
fn halved(scene: &Scene, at: impl Fn(f64) -> DVec3, [mut low, mut high]: [f64; 2]) -> [f64; 2] {
    let first = seen(scene, at(low));
    while high - low > 1e-14 {
        let middle = 0.5 * (low + high);
        if seen(scene, at(middle)) == first { low = middle } else { high = middle }
    }
    [low, high]
}

/// The largest difference of V·ν between the two sides of a curve, the number of curves met, and the largest
/// V.
///
/// The component along a curve may be discontinuous: it is the velocity of a part of an edge in front of a
/// plane, as if the ends of that part kept their positions on the edge.
fn scan(scene: &Scene, tree: &SceneEdges) -> (f64, usize, f64) {
    scan_where(scene, tree, AngularSupport::new(REACH), |_| true)
}

/// [`scan`], restricted to curves with given surfaces on both sides.
fn scan_where(
    scene: &Scene,
    tree: &SceneEdges,
    reach: AngularSupport,
    counts: impl Fn([Option<u32>; 2]) -> bool,
) -> (f64, usize, f64) {
    let mut rng = stream(77, &[]);
    let velocities: Vec<DVec3> = scene.positions.iter().map(|_| random(&mut rng)).collect();
    let (mut worst, mut met, mut largest) = (0.0_f64, 0, 0.0_f64);
    for _ in 0..60 {
        let [from, to] = [-0.5, 0.5].map(|x| DVec3::new(x, 0.25 * random(&mut rng).y, -1.0));
        let line = |aside: f64| move |s: f64| (from.lerp(to, s) + aside * DVec3::Y).normalize();
        let (at, beside) = (line(0.0), line(1e-6));
        let steps = 150;
        for i in 0..steps {
            let span = [i, i + 1].map(|i| f64::from(i) / f64::from(steps));
            let [first, last] = span.map(|s| seen(scene, at(s)));
            if first == last || span.map(|s| seen(scene, beside(s))) != [first, last] {
                continue;
            }
            let [low, high] = halved(scene, at, span);
            if !counts([first, last]) {
                continue;
            }
            let along = beside(halved(scene, beside, span)[0]) - at(low);
            let normal = along.cross(at(low)).normalize();
            // Away from the curve by far more than rounding, and far less than the reach.
            let sides = [low - 1e-10, high + 1e-10].map(at);
            let [a, b] = sides.map(|u| field(scene, tree, reach, &velocities, u, seen(scene, u)));
            met += 1;
            worst = worst.max((a - b).dot(normal).abs());
            largest = largest.max(a.length());
        }
    }
    (worst, met, largest)
}

/// A softened field need agree only away from silhouettes: where a face continues as another, at creases and
/// seams. It does there, as both faces follow their borders exactly; with softened borders it would not.
#[test]
fn a_softened_field_is_the_same_from_both_sides_where_faces_continue_one_another() {
    let reach = AngularSupport::new(REACH).softened(0.05);
    for kind in kinds().into_iter().filter(|kind| ["crease", "curved smooth seam"].contains(&kind.name)) {
        let scene = scene(&kind);
        let continues = |sides: [Option<u32>; 2]| {
            let [Some(a), Some(b)] = sides else { return false };
            [a, b].map(|t| scene.shape_of(Surface::Triangle(t))) == [0; 2]
        };
        let all = |e: &Edge| Edge { owners: [NONE; 2], seam: false, ..*e };
        let list = EdgeList::new(&scene);
        let softened = edges(&scene, &list, list.first()).iter().map(all).collect();
        let softened = SceneEdges::assemble(softened, Arc::clone(list.first()));
        let (jump, met, largest) = scan_where(&scene, &SceneEdges::new(&scene), reach, continues);
        let (wrong, ..) = scan_where(&scene, &softened, reach, continues);
        println!("{}: met {met}, jump {jump:.1e}, with softened borders {wrong:.1e}", kind.name);
        assert!(
            jump < TOLERANCE && met > 50 && largest > 0.05 && wrong > 1e3 * TOLERANCE,
            "{jump} {met} {largest} {wrong}"
        );
    }
}

/// Edges without crossings.
fn uncrossed(scene: &Scene) -> SceneEdges {
    let list = EdgeList::new(scene);
    let kept = |e: &Edge| matches!(e.span, Span::Edge(_));
    let kept = edges(scene, &list, list.first()).into_iter().filter(kept).collect();
    SceneEdges::assemble(kept, Arc::clone(list.first()))
}

/// Edges of triangles in place of faces, with seams as discontinuities.
fn faceless(scene: &Scene) -> SceneEdges {
    let faces: Vec<u32> = (0..scene.triangles.len() as u32).collect();
    let split = edges(scene, &EdgeList::new(scene), &faces).into_iter().map(|e| Edge { seam: false, ..e });
    SceneEdges::assemble(split.collect(), faces.into())
}

#[test]
fn the_field_is_the_same_from_both_sides_of_every_curve() {
    println!("{:44} {:>6} {:>9} {:>11} {:>11}", "curve", "met", "jump", "no crossing", "triangles");
    let mut failures = vec![];
    for kind in kinds() {
        let scene = scene(&kind);
        let (jump, met, largest) = scan(&scene, &SceneEdges::new(&scene));
        let [open, split] = [uncrossed(&scene), faceless(&scene)].map(|tree| scan(&scene, &tree).0);
        println!("{:44} {met:6} {jump:9.1e} {open:11.1e} {split:11.1e}", kind.name);
        let right = jump < TOLERANCE && met > 50 && largest > 0.05;
        let found_out = (!kind.needs_crossings || open > 0.01) && (!kind.needs_seams || split > 0.01);
        if !right || !found_out {
            failures.push(kind.name);
        }
    }
    assert!(failures.is_empty(), "{failures:?}");
}
