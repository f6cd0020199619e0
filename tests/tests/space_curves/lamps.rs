//! Direct light of lamps: shadows and outlines, compared with Lambert's formula over clipped polygons.

use flatland::plane::Filter;
use glam::DVec3;
use rayon::prelude::*;
use tests::comparison::{Comparison, Estimate};
use tests::power::Power;
use tests::space::coverage::{Camera, CameraMotion};
use tests::space::direct::DirectScene;
use tests::space::irradiance::{Ground, Surface, World};
use tests::space::scenes;
use tests::statistics::student;
use volume3d::geometry::Mesh;
use volume3d::gradient::{Progress, render};
use volume3d::scene::Scene;

use super::{Case, RUNS, edges, exact_mean, power, softened};

/// A square with a given centre and half side, facing down or up.
pub(super) fn square(centre: [f64; 3], half: f64, faces_down: bool) -> Vec<DVec3> {
    let mut corners: Vec<DVec3> = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]
        .map(|[x, y]| DVec3::from(centre) + half * DVec3::new(x, y, 0.0))
        .to_vec();
    if faces_down {
        corners.reverse();
    }
    corners
}

fn moving(surface: Surface, velocity: DVec3) -> Surface {
    let velocities = vec![velocity; surface.vertices.len()];
    Surface { velocities, ..surface }
}

const BRIGHT: DVec3 = DVec3::new(6.0, 5.0, 4.0);

fn lamp() -> Surface {
    Surface::emitter(square([0.3, 0.2, 2.0], 0.5, true), BRIGHT)
}

fn occluder() -> Surface {
    Surface::occluder(square([-0.1, 0.2, 1.0], 0.4, true))
}

/// A floor that fills a film of 2 × 2 pixels, on which neither lamps nor occluders are visible.
fn floor(surfaces: Vec<Surface>, environment: DVec3) -> DirectScene {
    let origin = DVec3::new(0.6, -0.5, 0.9);
    let forward = (DVec3::new(0.1, 0.1, 0.0) - origin).normalize();
    let right = forward.cross(DVec3::Z).normalize();
    let up = right.cross(forward);
    let camera = Camera { origin, right, up, forward, field_of_view: 1.0, width: 2, height: 2 };
    let corners = [[-40.0, -40.0, 0.0], [80.0, -40.0, 0.0], [-40.0, 80.0, 0.0]].map(DVec3::from);
    DirectScene {
        world: World { surfaces, environment },
        ground: Ground { corners, velocities: [DVec3::ZERO; 3] },
        albedo: DVec3::new(0.8, 0.7, 0.6),
        camera,
        camera_motion: CameraMotion::default(),
        filter: Filter::Box,
    }
}

fn case(direct: &DirectScene) -> Case {
    let scenes::Moving { scene, change } = scenes::direct(direct);
    let start = std::time::Instant::now();
    let pixels = direct.image(1e-3).expect("a reference");
    let exact = pixels.iter().map(|p| p.derivative).sum::<DVec3>().element_sum();
    println!("reference: {:.2} s", start.elapsed().as_secs_f64());
    let error = pixels.iter().map(|p| 3.0 * p.derivative_error).sum::<f64>().min(1e-2 * exact.abs());
    Case { scene, change, exact, error }
}

const SHIFT: DVec3 = DVec3::new(0.5, 0.2, -0.1);

/// A narrow lamp, half hidden along its whole length. The field moves with the shadow's edge from one side of
/// the lamp to the other, and the flux through the other side is nearly the whole derivative.
fn strip_half_hidden() -> Case {
    let rectangle = |x: [f64; 2], y: [f64; 2], z: f64| {
        [[x[0], y[1]], [x[1], y[1]], [x[1], y[0]], [x[0], y[0]]].map(|[x, y]| DVec3::new(x, y, z)).to_vec()
    };
    let lamp = Surface::emitter(rectangle([0.25, 0.35], [-0.8, 1.2], 2.0), BRIGHT);
    let screen = Surface::occluder(rectangle([-2.0, 0.2], [-3.0, 3.0], 1.0));
    let mut direct = floor(vec![lamp, moving(screen, DVec3::new(0.5, 0.0, 0.0))], DVec3::ZERO);
    // The visible part of the floor lies in the penumbra.
    direct.camera.field_of_view = 0.03;
    case(&direct)
}

#[test]
fn shadows_of_one_lamp() {
    let case = case(&floor(vec![lamp(), moving(occluder(), SHIFT)], DVec3::ZERO));
    let mut power = power("space_curves::shadows_of_one_lamp");
    case.accept(&mut power, "edge sampling", &edges(1, [1, 256, 1]));
    case.accept(&mut power, "softened", &softened(64, 0.4, [1, 1024, 0]));
    case.accept(&mut power, "mean over jumps", &exact_mean(640));
    strip_half_hidden().accept(&mut power, "half of a strip, mean over jumps", &exact_mean(64));
    case.reject("nothing is warped", &volume3d::gradient::WarpedArea { warps: false, ..exact_mean(8) });
}

/// More than 32 triangles of lamps, so that directions are sampled by next-event estimation. All but one lamp
/// are faint, and below the floor.
#[test]
fn shadows_of_many_lamps() {
    let places = (0..16).map(|i| [0.5 * f64::from(i % 4), 0.5 * f64::from(i / 4), -2.0]);
    let faint = places.map(|place| Surface::emitter(square(place, 0.06, true), 1e-6 * BRIGHT));
    let surfaces = faint.chain([lamp(), moving(occluder(), SHIFT)]).collect();
    let scenes::Moving { scene, change } = scenes::direct(&floor(surfaces, DVec3::ZERO));
    // None of the faint ones is visible.
    let case = Case { scene, change, ..case(&floor(vec![lamp(), moving(occluder(), SHIFT)], DVec3::ZERO)) };
    let mut power = power("space_curves::shadows_of_many_lamps");
    case.accept(&mut power, "edge sampling", &edges(1, [1, 1024, 1]));
}

#[test]
fn outlines_of_a_flat_lamp() {
    let case = case(&floor(vec![moving(lamp(), DVec3::new(-0.1, 0.1, -1.0))], DVec3::ZERO));
    let mut power = power("space_curves::outlines_of_a_flat_lamp");
    case.accept(&mut power, "edge sampling", &edges(1, [1, 256, 1]));
    case.accept(&mut power, "softened", &softened(128, 0.4, [1, 1, 0]));
    case.accept(&mut power, "mean over jumps", &exact_mean(128));
    image_under_a_near_lamp(&mut power);
}

/// The image itself, under a lamp so near and large that both strategies of the balance heuristic sample it
/// equally often.
fn image_under_a_near_lamp(power: &mut Power) {
    let lamp = Surface::emitter(square([0.1, 0.1, 1.6], 1.5, true), BRIGHT);
    let direct = floor(vec![lamp], DVec3::ZERO);
    let scene = scenes::direct(&direct).scene;
    let exact = direct.image(1e-6).expect("a reference").iter().map(|p| p.value).sum::<DVec3>().element_sum();
    let run = |seed| {
        let image = render(&scene, 2048, seed, &Progress::none()).expect("an image").image;
        image.pixels.iter().sum::<DVec3>().element_sum()
    };
    let found = Estimate::of((0..RUNS).into_par_iter().map(run).collect::<Vec<_>>());
    let limit = student(RUNS - 1);
    let comparison = Comparison { found, reference: Estimate::exact(exact), limit, slack: 1e-5 * exact };
    comparison.accept(power, "the image under a near lamp", exact);
}

/// A cube that emits, as separate polygons and as one shape.
fn cube(centre: [f64; 3], half: f64, velocity: DVec3) -> (Vec<Surface>, Mesh) {
    let place = glam::DAffine3::from_scale_rotation_translation(
        DVec3::splat(half),
        glam::DQuat::IDENTITY,
        DVec3::from(centre),
    );
    let mesh = Mesh::cube().transformed(&place);
    let faces = mesh.triangles().iter().map(|t| {
        let corners = t.map(|v| mesh.positions()[v as usize]).to_vec();
        moving(Surface::emitter(corners, BRIGHT), velocity)
    });
    (faces.collect(), mesh)
}

#[test]
fn outlines_of_a_solid_lamp() {
    let velocity = DVec3::new(-0.1, 0.1, -1.0);
    let (faces, mesh) = cube([0.3, 0.2, 1.8], 0.3, velocity);
    let direct = floor(faces, DVec3::ZERO);
    let reference = case(&direct);
    // One closed shape instead of separate faces.
    let dark = floor(vec![], DVec3::ZERO);
    let mut description = scenes::direct(&dark).scene.description().clone();
    description.add_emitter("lamp", mesh, BRIGHT);
    let scene = Scene::new(description).expect("a scene");
    let mut change = volume3d::gradient::Tangent::still(&scene);
    change.translate(&scene, 1, velocity);
    let case = Case { scene, change, ..reference };
    let mut power = power("space_curves::outlines_of_a_solid_lamp");
    case.accept(&mut power, "edge sampling", &edges(1, [1, 2048, 1]));
    case.accept(&mut power, "softened", &softened(1, 0.4, [1, 2048, 0]));
    case.accept(&mut power, "mean over jumps", &exact_mean(1024));
}

/// A constant sky, partly occluded.
#[test]
fn what_hides_the_sky() {
    let case = case(&floor(vec![moving(occluder(), DVec3::new(0.3, 0.2, -0.8))], DVec3::new(1.0, 2.0, 3.0)));
    let mut power = power("space_curves::what_hides_the_sky");
    case.accept(&mut power, "edge sampling", &edges(1, [1, 1, 2560]));
    // Fields at bounces have more variance.
    let mut power = super::after_a_bounce("space_curves::what_hides_the_sky: fields");
    case.accept(&mut power, "mean over jumps", &exact_mean(768));
    // Longer paths have a control variate: the sky's radiance, also subtracted where the sky is occluded.
    let mut longer = case.scene.description().clone();
    longer.integrator.max_depth = Some(3);
    let scene = Scene::new(longer).expect("a scene");
    let longer = Case { scene, change: case.change.clone(), exact: case.exact, error: case.error };
    longer.accept(&mut power, "mean over jumps, longer paths", &exact_mean(1024));
    for softness in [0.4, f64::INFINITY] {
        case.accept(&mut power, &format!("softened, ε = {softness}"), &softened(512, softness, [1, 1, 1280]));
    }
}
