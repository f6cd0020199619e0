//! Tests of the kernels of implicit surfaces along scans of directions, and of whole fields with meshes.

use flatland::random::{open01, stream};
use flatland::sdf::shapes::{Ball, SmoothUnion};
use flatland::sdf::{Sdf as _, Tracer};
use flatland::warp::LinearField as _;

use super::*;
use crate::geometry::Mesh;
use crate::gradient::Tangent;
use crate::gradient::warp::jump_mean::{
    AngularSupport, HalfSpace, JumpMean, SceneEdges, Silhouettes, View as Seen,
};
use crate::gradient::warp::motion::Motion;
use crate::path::VisibilityDomain;
use crate::scene::{Camera, Description, Film, Filter, ImplicitSurface, Material};
use crate::sdf::{Grid, Interpolation};

const EYE: DVec3 = DVec3::new(0.3, -5.0, 3.0);

fn description() -> Description {
    let camera = Camera::look_at(EYE, DVec3::ZERO, DVec3::Z, 0.7);
    let film = Film { width: 4, height: 4, crop: None, sample_border: true, filter: Filter::Box };
    let mut description = Description::new(camera, film);
    description.add_material(Material::diffuse("clay", DVec3::ONE));
    description
}

fn ball(x: f64, y: f64, z: f64, radius: f64) -> Ball<DVec3> {
    Ball::new(DVec3::new(x, y, z), radius).expect("a ball")
}

fn no_trace() -> Trace<DVec3> {
    Trace { direction: EYE, points: vec![], end: End::Miss }
}

/// A small ball in front of a floor on which rays end. Near the viewer's side of the ball they end within the
/// tracer's first step and have no further trace points.
#[test]
fn kernels_do_not_jump_where_rays_end_within_the_first_step() {
    let mut description = description();
    description.add_implicit("ball", ball(0.1, 0.0, 0.3, 0.3), 0);
    let scene = Scene::new(description).expect("a scene");
    for field in [ImplicitField::default(), ImplicitField::bangaru()] {
        let sight =
            Sight { origin: EYE, from: None, plane: Some((DVec3::Z, 0.0)), field, known: Known::Nothing };
        does_not_jump(&scene, &sight);
    }
}

fn does_not_jump(scene: &Scene, sight: &Sight) {
    let mut trace = no_trace();
    let mut at = |y: f64| {
        let u = (DVec3::new(0.12, y, 0.0) - EYE).normalize();
        let kernel: f64 = sight.near(scene, u, 60.0, &mut trace).iter().map(|near| near.kernel.value).sum();
        let sdf = &scene.description.implicits[0];
        let view = View { sdf, eye: EYE, start: 0.0, tracer: scene.description.tracer };
        let open = Scalar::constant(scene.far_of(0, EYE));
        let wall =
            sight.plane.and_then(|plane| distance(plane, EYE, u)).filter(|wall| wall.value < open.value);
        view.trace_until(u, wall.unwrap_or(open), &mut trace);
        (kernel, trace.points.len())
    };
    let (low, high) = (-0.9, -0.35);
    let count = 400;
    let place = |i: usize| low + (high - low) * i as f64 / count as f64;
    let points: Vec<usize> = (0..=count).map(|i| at(place(i)).1).collect();
    assert!(points.contains(&1) && points.iter().any(|&n| n > 1), "{points:?}");
    let mut greatest = 0.0_f64;
    for i in 0..count {
        let (mut a, mut b) = (place(i), place(i + 1));
        greatest = greatest.max(at(a).0);
        // Bisection down to rounding, towards the half with the larger change.
        for _ in 0..40 {
            let middle = 0.5 * (a + b);
            let [left, there, right] = [a, middle, b].map(|y| at(y).0);
            if (left - there).abs() > (right - there).abs() { b = middle } else { a = middle }
        }
        let jump = (at(a).0 - at(b).0).abs();
        assert!(jump < 1e-9, "{jump} at {a}");
    }
    assert!(greatest > 0.1, "{greatest}");
}

/// Rays that leave a surface and are clear of it have no mean point in reach, and most rays without one are
/// known to be clear.
#[test]
fn clear_rays_have_no_kernel() {
    let union = SmoothUnion::new(ball(-0.3, 0.0, 0.4, 0.6), ball(0.6, 0.2, 0.2, 0.45), 0.3).expect("a union");
    let corners = (DVec3::splat(-1.5), DVec3::splat(1.5));
    let grid = Grid::sampled(Interpolation::Cubic, corners, 40, |x| union.value(x)).expect("a grid");
    let surfaces = [ImplicitSurface::new(union), ImplicitSurface::new(grid)];
    for surface in surfaces {
        let mut description = description();
        description.add_implicit("union", ball(0.0, 0.0, 0.0, 1.0), 0);
        description.implicits[0].surface = surface;
        description.implicits[0].placement.scale = 1.3;
        let scene = Scene::new(description).expect("a scene");
        let shape = &scene.description.implicits[0];
        let Weights::Vicini(field) = ImplicitField::default().weights(scene.implicit_size(0), true) else {
            panic!("the default is Vicini's");
        };
        let mut random = stream(3, &[]);
        let mut vector = || DVec3::from_array([(); 3].map(|()| 2.0 * open01(&mut random) - 1.0));
        let (mut clear, mut far_away, mut near) = (0, 0, 0);
        for _ in 0..4000 {
            let u = (0.8 * vector() - EYE).normalize();
            let Some(hit) = scene.closest(EYE, u, None) else { continue };
            let (eye, start) = (EYE + hit.distance * u, scene.leaving(0));
            let way = (scene.normal_of(hit.surface, eye) + 0.999 * vector().normalize()).normalize();
            let far = scene.far_of(0, eye);
            let view = View { sdf: shape, eye, start, tracer: scene.description.tracer };
            let walk = Walk::new(field, shape, &view, (way, Scalar::constant(far)));
            let found = walk.near(0, shape, &walk.mean_point());
            let keeps_away = scene.keeps_away(0, (eye, way), (start, far), 0.1);
            assert!(!(keeps_away && found.is_some()), "{eye} {way} {found:?}");
            clear += i32::from(keeps_away);
            far_away += i32::from(found.is_none());
            near += i32::from(found.is_some());
        }
        assert!(clear > 1000 && 10 * clear > 9 * far_away && near > 30, "{clear} {far_away} {near}");
    }
}

/// The end of a ray that the field has traced is the ray's hit; a trace that ran out of steps gives no
/// information.
#[test]
fn ends_of_walks_are_what_is_hit() {
    let (scene, _) = crowded();
    let field = ImplicitField::default();
    let sight = Sight { origin: EYE, from: None, plane: None, field, known: Known::Nothing };
    let mut random = stream(5, &[]);
    let mut known = vec![];
    let (mut hits, mut misses, mut silent) = (0, 0, 0);
    for _ in 0..4000 {
        let aim = DVec3::from_array([(); 3].map(|()| 3.0 * open01(&mut random) - 1.5));
        let u = (aim - EYE).normalize();
        let expected = scene.closest_implicit(EYE, u, None, (0.0, f64::INFINITY), None);
        match (sight.meet(&scene, u, &mut known), expected) {
            (None, _) => silent += 1,
            (Some(None), None) => misses += 1,
            (Some(Some(found)), Some(expected)) => {
                assert_eq!(found.surface, expected.surface);
                let off = (found.distance - expected.distance).abs();
                assert!(off < 1e-9, "{off}");
                hits += 1;
            }
            (found, expected) => panic!("{u}: {found:?} for {expected:?}"),
        }
    }
    assert!(hits > 500 && misses > 500 && silent < 10, "{hits} {misses} {silent}");
}

/// Two blended balls and a separate one, between a wall and plates in front of them, all of which move.
fn crowded() -> (Scene, Tangent) {
    let mut description = description();
    description.tracer = Tracer { tolerance: 1e-10, max_steps: 20_000, ..description.tracer };
    let plate = |centre: DVec3, size: f64| {
        let turn = glam::DQuat::from_rotation_x(0.9) * glam::DQuat::from_rotation_y(0.2);
        let placed = glam::DAffine3::from_scale_rotation_translation(DVec3::splat(size), turn, centre);
        Mesh::rectangle().transformed(&placed)
    };
    description.add_shape("wall", plate(DVec3::new(0.0, 3.0, -1.0), 20.0), 0);
    description.add_shape("plate", plate(DVec3::new(0.4, -2.2, 1.6), 0.25), 0);
    description.add_shape("behind", plate(DVec3::new(-0.7, 1.6, 0.0), 0.5), 0);
    let union = SmoothUnion::new(ball(-0.3, 0.0, 0.4, 0.6), ball(0.6, 0.2, 0.2, 0.45), 0.3);
    description.add_implicit("union", union.expect("a union"), 0);
    description.add_implicit("ball", ball(0.0, -1.4, 1.2, 0.15), 0);
    let scene = Scene::new(description).expect("a scene");
    let mut change = Tangent::still(&scene);
    change.implicits[0].translation = DVec3::new(0.7, -0.4, 0.5);
    change.implicits[1].translation = DVec3::new(-0.5, 0.2, 0.8);
    change.translate(&scene, 1, DVec3::new(0.3, 0.9, -0.6));
    change.translate(&scene, 2, DVec3::new(-0.8, 0.1, 0.4));
    (scene, change)
}

/// Gradients of kernels agree with central differences, in front of a plane and without one.
#[test]
fn gradients_of_kernels_are_those_of_differences() {
    let (scene, _) = crowded();
    let (h, mut random) = (1e-6, stream(7, &[]));
    for plane in [None, Some((DVec3::new(0.1, 0.9, -0.2), 0.3))] {
        let field = ImplicitField::default();
        let sight = Sight { origin: EYE, from: None, plane, field, known: Known::Nothing };
        let mut trace = no_trace();
        let (mut off, mut count) = (vec![], 0);
        for _ in 0..3000 {
            let aim = DVec3::from_array([(); 3].map(|()| 3.0 * open01(&mut random) - 1.5));
            let u = (aim - EYE).normalize();
            let e = u.any_orthonormal_vector();
            let mut near = |u: DVec3| sight.near(&scene, u, 60.0, &mut trace);
            let [there, plus, minus] = [u, (u + h * e).normalize(), (u - h * e).normalize()].map(&mut near);
            for one in &there {
                let value = |of: &[NearLevelSet]| {
                    of.iter().find(|other| other.implicit == one.implicit).map(|other| other.kernel.value)
                };
                let (Some(plus), Some(minus)) = (value(&plus), value(&minus)) else { continue };
                let (slope, found) = ((plus - minus) / (2.0 * h), one.kernel.gradient.dot(e));
                count += 1;
                off.push((found - slope).abs() / one.kernel.gradient.length());
            }
        }
        off.sort_by(f64::total_cmp);
        let [half, most] = [0.5, 0.95].map(|part| off[(part * off.len() as f64) as usize]);
        println!(
            "{plane:?}: of {count} half are off by less than {half:.1e} of the slope, most by {most:.1e}"
        );
        // The exceptions are points that the tracer adds or drops between two directions.
        assert!(count > 2000 && half < 1e-7 && most < 1e-4, "{count}: {half} {most}");
    }
}

/// V at the camera, and the surface seen.
fn seen(
    scene: &Scene,
    tree: &SceneEdges,
    motion: &Motion<'_>,
    field: ImplicitField,
    u: DVec3,
) -> (DVec3, Option<Surface>) {
    let surface = scene.closest(EYE, u, None).map(|hit| hit.surface);
    let triangle = surface.and_then(|s| if let Surface::Triangle(t) = s { Some(t) } else { None });
    let plane = triangle.map(|t| {
        let (point, normal) = (scene.corners(tree.plane(t))[0], scene.face_normal(t));
        let normal = if normal.dot(EYE - point) < 0.0 { -normal } else { normal };
        (HalfSpace { normal, point, slack: 6e-6 }, (normal, normal.dot(point)))
    });
    let front = plane.map(|p| p.0);
    let view = Seen {
        origin: EYE,
        planes: front.as_slice(),
        domain: VisibilityDomain::Radiance,
        seen: triangle,
        left: None,
        border_softness: 0.0,
        rounding: 6e-13,
    };
    let sight = Sight { origin: EYE, from: None, plane: plane.map(|p| p.1), field, known: Known::Nothing };
    let (reach, mut trace) = (AngularSupport::new(0.1), no_trace());
    let mean = JumpMean::new(scene, tree, Silhouettes::All, &view, u, reach, &sight, &mut trace);
    let value = mean.map_or(DVec3::ZERO, |mean| {
        let of_edges = mean.field(|seen| {
            let velocity = seen.followed.velocity(scene, &motion.change.positions);
            (velocity - velocity.dot(seen.direction) * seen.direction) / seen.distance
        });
        of_edges.value + mean.level_set_field(|tap| motion.level_set_rate(scene, tap)).value
    });
    (value, surface)
}

/// Result of a scan: the number of discontinuities of V within one visible surface, the number of curves at
/// which the visible surface changes, the largest difference of V across these, and the largest |V|.
#[derive(Debug, Default)]
struct Found {
    jumps: usize,
    curves: usize,
    across: f64,
    largest: f64,
}

/// Largest change of V between neighbours that is not examined for a discontinuity.
const SUSPECT: f64 = 3e-3;

fn scan(field: ImplicitField) -> Found {
    let (scene, change) = crowded();
    let (tree, motion) = (SceneEdges::new(&scene), Motion::new(&scene, &change));
    let mut found = Found::default();
    for line in 0..3 {
        let height = 0.05 + 0.42 * f64::from(line);
        let way = |x: f64, aside: f64| (DVec3::new(x, 0.3 * x, height + 0.1 * x + aside) - EYE).normalize();
        let at = |x: f64| seen(&scene, &tree, &motion, field, way(x, 0.0));
        let count = 600;
        let place = |i: usize| -1.4 + 2.8 * i as f64 / count as f64;
        let all: Vec<_> = (0..=count).map(|i| at(place(i))).collect();
        for (i, pair) in all.windows(2).enumerate() {
            found.largest = found.largest.max(pair[0].0.length());
            let differs = |a: Option<Surface>, b: Option<Surface>| {
                let wall =
                    |s: Option<Surface>| s.map(|s| (scene.shape_of(s), matches!(s, Surface::Triangle(_))));
                wall(a) != wall(b)
            };
            let is_curve = differs(pair[0].1, pair[1].1);
            if !is_curve && (pair[0].0 - pair[1].0).length() <= SUSPECT {
                continue;
            }
            let (mut low, mut high) = ((place(i), pair[0]), (place(i + 1), pair[1]));
            for _ in 0..44 {
                let middle = 0.5 * (low.0 + high.0);
                let there = at(middle);
                let lower = if is_curve {
                    differs(low.1.1, there.1)
                } else {
                    (low.1.0 - there.0).length() >= (there.0 - high.1.0).length()
                };
                if lower { high = (middle, there) } else { low = (middle, there) }
            }
            if is_curve {
                found.curves += 1;
                let sides = [low.0 - 1e-9, high.0 + 1e-9].map(|x| at(x).0);
                found.across = found.across.max((sides[0] - sides[1]).length());
            } else {
                found.jumps += usize::from((low.1.0 - high.1.0).length() > 1e-7);
            }
        }
    }
    found
}

/// The field is continuous across silhouettes, edges and everywhere else; Bangaru's field with few points is
/// not.
#[test]
fn whole_fields_do_not_jump() {
    for (field, rate) in [(ImplicitField::default(), 1e-5), (ImplicitField::bangaru(), 1e-4)] {
        let found = scan(field);
        println!("{field:?}: {found:?}");
        assert_eq!(found.jumps, 0, "{field:?}");
        assert!(found.curves > 10 && found.largest > 0.05 && found.across < rate, "{field:?}: {found:?}");
    }
    let few = scan(ImplicitField::Bangaru { gamma: 3.0, lambda: 0.1, nearest: Some(14) });
    println!("14 points: {few:?}");
    assert!(few.jumps > 0, "{few:?}");
}
