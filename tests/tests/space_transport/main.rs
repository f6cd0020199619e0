//! Whole paths, compared with central differences with common random numbers where there is no closed form;
//! and forward with reverse mode for every parameter.
//!
//! Every scene is reduced to one number: its gradient image weighted by a rough, independent estimate of it,
//! so that parts of opposite sign do not cancel and every pixel counts by its size. Differences are biased by
//! powers of their step. They are extrapolated from three steps (Richardson); the difference between the last
//! two extrapolations is allowed as error, in addition to the standard errors of both sides. Edge sampling,
//! whose samples have light tails, is compared with the differences, and warped area with edge sampling.
//! Every method must reject errors in its own terms, among them a bias of [`NOTICED`].

mod methods;
mod parameters;

use glam::{DAffine3, DQuat, DVec3};
use tests::effort::{pick, thorough};
use tests::power::Power;
use tests::space::campaign::Known;
use tests::space::scenes::{film, plate};
use volume3d::geometry::Mesh;
use volume3d::gradient::Tangent;
use volume3d::scene::{
    Bsdf, Camera, Description, Filter, Integrator, Material, Microfacets, Reflectance, Scene,
};

use methods::{ALL, FILM, compare};

const TENT: Filter = Filter::Tent { radius: 1.0 };

/// A sphere of 80 triangles with normals of its vertices.
fn sphere(centre: DVec3, radius: f64) -> Mesh {
    let mut mesh = (
        vec![DVec3::X, DVec3::Y, DVec3::Z, -DVec3::X, -DVec3::Y, -DVec3::Z],
        vec![[0, 1, 2], [1, 3, 2], [3, 4, 2], [4, 0, 2], [1, 0, 5], [3, 1, 5], [4, 3, 5], [0, 4, 5]],
    );
    for _ in 0..2 {
        let (mut positions, mut triangles) = (vec![], vec![]);
        for t in &mesh.1 {
            let [a, b, c]: [DVec3; 3] = t.map(|i: u32| mesh.0[i as usize]);
            let k = positions.len() as u32;
            positions.extend([a, b, c, (a + b).normalize(), (b + c).normalize(), (c + a).normalize()]);
            triangles.extend([
                [k, k + 3, k + 5],
                [k + 3, k + 1, k + 4],
                [k + 5, k + 4, k + 2],
                [k + 3, k + 4, k + 5],
            ]);
        }
        mesh = (positions, triangles);
    }
    let positions = mesh.0.into_iter().map(|p| centre + radius * p).collect();
    Mesh::new(positions, mesh.1).expect("a mesh").smooth()
}

fn conductor(id: &str, alpha: f64) -> Material {
    let bsdf = Bsdf::RoughConductor {
        distribution: Microfacets::Ggx,
        alpha,
        stretch: 1.0,
        eta: DVec3::new(0.2, 0.9, 1.1),
        k: DVec3::new(3.9, 2.4, 2.2),
        specular_reflectance: Reflectance::Constant(DVec3::splat(0.9)),
    };
    Material::new(id, bsdf, true)
}

/// A floor that fills the view, a lamp above it, and an object between them.
fn court(depth: usize, floor: Material, thing: Option<Mesh>) -> Description {
    let camera = Camera::look_at(DVec3::new(0.0, 1.2, 1.6), DVec3::ZERO, DVec3::Y, 0.35);
    let mut d = Description::new(camera, film(3, TENT));
    d.integrator = Integrator { max_depth: Some(depth), rr_depth: 100 };
    let floor = d.add_material(floor);
    let grey = d.add_material(Material::diffuse("grey", DVec3::new(0.7, 0.6, 0.5)));
    d.add_shape("floor", plate(DVec3::ZERO, DVec3::Y, 3.0), floor);
    let thing = thing.unwrap_or_else(|| plate(DVec3::new(0.1, 0.8, -0.3), DVec3::new(0.1, 1.0, 0.3), 0.25));
    d.add_shape("thing", thing, grey);
    d.add_emitter(
        "lamp",
        plate(DVec3::new(0.2, 2.0, -0.6), DVec3::new(-0.1, -1.0, 0.2), 0.5),
        DVec3::splat(6.0),
    );
    d
}

/// A scene and its motion.
fn known(d: Description, moves: impl Fn(&Scene, &mut Tangent), label: &str) -> Known {
    let scene = Scene::new(d).expect("a scene");
    let mut change = Tangent::still(&scene);
    moves(&scene, &mut change);
    Known::given(scene, change, 0.0, label)
}

#[test]
fn direct_light() {
    let mut power = Power::of("space_transport::direct_light");
    let grey = || Material::diffuse("floor", DVec3::splat(0.6));
    let fall = |scene: &Scene, change: &mut Tangent| {
        change.translate(scene, 1, DVec3::new(0.1, 0.2, 0.1));
        change.scale(scene, 1, DVec3::new(0.1, 0.8, -0.3), 1.0);
    };
    compare(&mut power, known(court(2, grey(), None), fall, "direct light, occluder"), 3e-2, [1, 1, 1], ALL);
    let turn = |scene: &Scene, change: &mut Tangent| {
        change.rotate(scene, 2, DVec3::new(0.4, 2.2, -0.6), DVec3::new(0.4, 0.5, -0.6));
        change.scale(scene, 2, DVec3::new(0.2, 2.0, -0.6), 0.5);
    };
    compare(&mut power, known(court(2, grey(), None), turn, "direct light, lamp"), 3e-2, [1, 1, 1], &[]);
    let floor = |scene: &Scene, change: &mut Tangent| {
        change.translate(scene, 0, DVec3::new(0.2, 0.5, -0.4));
        change.rotate(scene, 0, DVec3::ZERO, DVec3::new(0.3, 0.0, 0.2));
    };
    compare(
        &mut power,
        known(court(2, grey(), None), floor, "a floor moves under an occluder"),
        3e-2,
        [2, 2, 4],
        ALL,
    );
}

/// A two-sided reflecting plate, seen and lit from behind.
#[test]
fn two_sided_surfaces_from_behind() {
    let mut power = Power::of("space_transport::two_sided_surfaces_from_behind");
    let behind = plate(DVec3::new(0.1, 0.5, -0.1), DVec3::new(0.1, -1.0, -0.3), 0.3);
    let mut d = court(3, Material::diffuse("floor", DVec3::splat(0.6)), Some(behind));
    d.camera = Camera::look_at(DVec3::new(0.0, 1.2, 1.6), DVec3::new(0.1, 0.3, -0.1), DVec3::Y, 0.7);
    let fall = |scene: &Scene, change: &mut Tangent| {
        change.translate(scene, 1, DVec3::new(0.3, 0.4, 0.1));
        change.rotate(scene, 1, DVec3::new(0.1, 0.5, -0.1), DVec3::new(0.5, 0.2, 0.3));
    };
    compare(&mut power, known(d, fall, "a plate from behind"), 4.5e-2, [3, 1, 1], ALL);
}

/// Without vertex normals a sphere is a polyhedron of 128 faces, of which every edge is a discontinuity.
#[test]
fn a_flat_shaded_body() {
    let mut power = Power::of("space_transport::a_flat_shaded_body");
    let flat = sphere(DVec3::new(0.05, 0.7, -0.2), 0.3);
    let flat = Mesh::new(flat.positions().to_vec(), flat.triangles().to_vec()).expect("a mesh");
    let mut d = court(2, Material::diffuse("floor", DVec3::splat(0.3)), Some(flat));
    d.camera = Camera::look_at(DVec3::new(0.0, 1.2, 1.6), DVec3::new(0.05, 0.6, -0.2), DVec3::Y, 0.6);
    let turn = |scene: &Scene, change: &mut Tangent| {
        change.rotate(scene, 1, DVec3::new(0.05, 0.7, -0.2), DVec3::new(0.5, 1.0, 0.2));
        change.translate(scene, 1, DVec3::new(0.2, 0.1, 0.1));
    };
    compare(&mut power, known(d, turn, "a flat-shaded body turns"), 4.5e-2, [4, 2, 2], FILM);
}

/// A floor that sees no lamp: its light comes from a ceiling, past a moving block that is lit too.
#[test]
fn light_scattered_several_times() {
    let mut power = Power::of("space_transport::light_scattered_several_times");
    let low = plate(DVec3::new(0.1, 0.45, -0.3), DVec3::new(0.1, 1.0, 0.3), 0.35);
    let bounces = pick(2, 4);
    let mut d = court(bounces + 1, Material::diffuse("floor", DVec3::splat(0.7)), Some(low));
    let white = d.add_material(Material::diffuse("white", DVec3::splat(0.8)));
    // The lamp shines up to the ceiling.
    d.shapes[2].mesh = plate(DVec3::new(0.3, 1.6, -0.4), DVec3::new(0.1, 1.0, 0.0), 0.4);
    d.shapes[2].radiance = Some(DVec3::splat(20.0));
    d.add_shape("ceiling", plate(DVec3::new(0.0, 2.6, 0.0), DVec3::NEG_Y, 3.0), white);
    d.add_shape("wall", plate(DVec3::new(0.0, 1.3, -2.5), DVec3::Z, 3.0), white);
    let fall = |scene: &Scene, change: &mut Tangent| {
        change.scale(scene, 1, DVec3::new(0.1, 0.45, -0.3), 1.0);
    };
    compare(&mut power, known(d, fall, &format!("{bounces} bounces")), 6e-2, [4, 3, 12], FILM);
}

#[test]
fn glossy_reflection() {
    let mut power = Power::of("space_transport::glossy_reflection");
    // The first is nearly a mirror: its lobe is 3 degrees wide, and few samples hit the relevant directions.
    for (alpha, times) in [(0.03, [3, 4, 4]), (0.1, [2, 1, 1]), (0.3, [1, 1, 1])] {
        if alpha != 0.1 && !thorough() {
            continue;
        }
        let d = court(2, conductor("metal", alpha), None);
        let fall = |scene: &Scene, change: &mut Tangent| {
            change.scale(scene, 1, DVec3::new(0.1, 0.8, -0.3), 1.0);
            change.scale(scene, 2, DVec3::new(0.2, 2.0, -0.6), -0.5);
        };
        let k = known(d, fall, &format!("rough conductor, alpha {alpha}"));
        compare(&mut power, k, 3e-2, times, FILM);
    }
}

/// A smooth-shaded sphere as occluder and in view, and a floor that tilts below it.
#[test]
fn a_smooth_sphere() {
    let mut power = Power::of("space_transport::a_smooth_sphere");
    let thing = Some(sphere(DVec3::new(0.05, 0.7, -0.2), 0.3));
    let d = court(2, Material::diffuse("floor", DVec3::splat(0.6)), thing.clone());
    let fall = |scene: &Scene, change: &mut Tangent| {
        change.scale(scene, 1, DVec3::new(0.05, 0.7, -0.2), 1.0);
    };
    compare(&mut power, known(d, fall, "shadow of a sphere"), 3e-2, [1, 1, 1], ALL);
    if !thorough() {
        // Differences of a visible object are noisy: a smooth cube in view suffices.
        return;
    }
    let mut d = court(2, Material::diffuse("floor", DVec3::splat(0.1)), thing);
    d.camera = Camera::look_at(DVec3::new(0.0, 1.2, 1.6), DVec3::new(0.05, 0.7, -0.2), DVec3::Y, 0.5);
    let grow = |scene: &Scene, change: &mut Tangent| {
        change.scale(scene, 1, DVec3::new(0.05, 0.7, -0.2), 0.5);
        change.translate(scene, 1, DVec3::new(0.2, 0.1, 0.1));
    };
    compare(&mut power, known(d, grow, "a sphere in view"), 4.5e-2, [6, 4, 2], FILM);
}

/// A cube with a sphere's normals, which turns its other side to the camera and to the floor far from any
/// edge.
#[test]
fn a_smooth_cube() {
    let mut power = Power::of("space_transport::a_smooth_cube");
    let turned = DAffine3::from_rotation_translation(
        DQuat::from_euler(glam::EulerRot::XYZ, 0.3, 0.5, 0.2),
        DVec3::new(0.05, 0.4, -0.2),
    );
    let cube = Mesh::cube().smooth().transformed(&(turned * DAffine3::from_scale(DVec3::splat(0.25))));
    let mut d = court(3, Material::diffuse("floor", DVec3::splat(0.6)), Some(cube));
    d.camera = Camera::look_at(DVec3::new(0.0, 1.2, 1.6), DVec3::new(0.05, 0.3, -0.2), DVec3::Y, 0.5);
    let turn = |scene: &Scene, change: &mut Tangent| {
        change.rotate(scene, 1, DVec3::new(0.05, 0.4, -0.2), DVec3::new(0.5, 1.0, 0.2));
        change.scale(scene, 1, DVec3::new(0.05, 0.4, -0.2), 0.5);
    };
    compare(&mut power, known(d, turn, "a smooth cube"), 4.5e-2, [3, 1, 2], FILM);
}
