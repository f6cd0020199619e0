//! Direct light of lamps: shadows and outlines, against Lambert's formula over clipped polygons.

use flatland::plane::Filter;
use glam::DVec3;
use tests::space::coverage::{Camera, CameraMotion};
use tests::space::direct::DirectScene;
use tests::space::irradiance::{Ground, Surface, World};
use tests::space::scenes;
use volume3d::geometry::Mesh;
use volume3d::scene::Scene;

use super::{Case, edges, exact_mean, power, softened};

/// A square about a place, of half a side, that faces down or up.
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

/// A floor that fills a film of 2 × 2 pixels, from which neither lamps nor what hides them is seen.
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

#[test]
fn shadows_of_one_lamp() {
    let case = case(&floor(vec![lamp(), moving(occluder(), SHIFT)], DVec3::ZERO));
    let mut power = power("space_curves::shadows_of_one_lamp");
    case.accept(&mut power, "edge sampling", &edges(1, [1, 256, 1]));
    case.accept(&mut power, "softened", &softened(1, 0.4, [1, 1024, 0]));
    case.accept(&mut power, "mean over jumps", &exact_mean(640));
    case.reject("nothing is warped", &volume3d::gradient::WarpedArea { warps: false, ..exact_mean(8) });
}

/// So many triangles of lamps that directions are those of next-event estimation: all but one are faint, and
/// below the floor.
#[test]
fn shadows_of_many_lamps() {
    let places = (0..16).map(|i| [0.5 * f64::from(i % 4), 0.5 * f64::from(i / 4), -2.0]);
    let faint = places.map(|place| Surface::emitter(square(place, 0.06, true), 1e-6 * BRIGHT));
    let surfaces = faint.chain([lamp(), moving(occluder(), SHIFT)]).collect();
    let scenes::Moving { scene, change } = scenes::direct(&floor(surfaces, DVec3::ZERO));
    // Nothing of the faint ones is seen.
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
}

/// A cube that emits, as polygons and as one shape.
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
    // One closed shape instead of its faces.
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

/// A constant sky past what hides some of it.
#[test]
fn what_hides_the_sky() {
    let case = case(&floor(vec![moving(occluder(), DVec3::new(0.3, 0.2, -0.8))], DVec3::new(1.0, 2.0, 3.0)));
    let mut power = power("space_curves::what_hides_the_sky");
    case.accept(&mut power, "edge sampling", &edges(1, [1, 1, 2560]));
    // Fields at bounces scatter more.
    let mut power = super::after_a_bounce("space_curves::what_hides_the_sky: fields");
    case.accept(&mut power, "mean over jumps", &exact_mean(768));
    for softness in [0.4, f64::INFINITY] {
        case.accept(&mut power, &format!("softened, ε = {softness}"), &softened(512, softness, [1, 1, 1280]));
    }
}
