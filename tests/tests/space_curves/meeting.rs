//! Two sheets that pass through one another, seen from a floor below: along their crossing one ends and the
//! other begins.
//!
//! Both are lit evenly from below, and reflect sunlight as if they were emitters: the floor's irradiance is
//! Lambert's formula over the unoccluded part of each.

use std::f64::consts::PI;

use glam::{DAffine3, DQuat, DVec3};
use tests::power::Power;
use tests::quadrature::rule;
use tests::space::irradiance::{Receiver, Sides, Surface, World, irradiance};
use tests::space::scenes::film;
use volume3d::geometry::Mesh;
use volume3d::gradient::Tangent;
use volume3d::scene::{Camera, Description, Filter, Integrator, Light, Material, Scene};

use super::{Case, exact_mean};

#[test]
fn sheets_that_cross_over_a_floor() {
    let (floor, albedos, kappa, sun) = (0.7, [0.9, 0.15], 1e4, 3.0);
    let light = DVec3::new(0.0, -0.97, -0.24).normalize();
    let sheet = |x: f64, tilt: f64| {
        let turn = DQuat::from_rotation_y(-tilt);
        let place = DAffine3::from_scale_rotation_translation(
            DVec3::new(3.0, 1.5, 1.0),
            turn,
            DVec3::new(x, 0.0, 1.0),
        );
        Mesh::rectangle().transformed(&place)
    };
    let sheets = [sheet(0.0, 0.6), sheet(0.1, -0.6)];
    let velocity = DVec3::new(0.0, 0.0, -0.4);
    let camera = Camera::look_at(DVec3::new(0.05, -0.2, 0.7), DVec3::ZERO, DVec3::Y, 0.6);
    let mut d = Description::new(camera.clone(), film(1, Filter::Box));
    d.integrator = Integrator { max_depth: Some(3), rr_depth: 100 };
    let grey = d.add_material(Material::diffuse("floor", DVec3::splat(floor)));
    let plate = Mesh::rectangle().transformed(&DAffine3::from_scale(DVec3::splat(0.5)));
    d.add_shape("floor", plate, grey);
    let mut surfaces = vec![];
    for (i, (mesh, albedo)) in sheets.iter().zip(albedos).enumerate() {
        let paint = d.add_material(Material::diffuse(&format!("paint {i}"), DVec3::splat(albedo)));
        d.add_shape(&format!("sheet {i}"), mesh.clone(), paint);
        let p = mesh.positions();
        let normal = (p[1] - p[0]).cross(p[2] - p[0]).normalize();
        assert!(normal.z > 0.0 && normal.dot(light) < 0.0);
        let radiance = albedo / PI * sun * (1.0 / f64::tanh(kappa) - 1.0 / kappa) * -normal.dot(light);
        let corners = [0, 1, 2, 3].map(|k: usize| p[k]).to_vec();
        let velocities = vec![if i == 1 { velocity } else { DVec3::ZERO }; 4];
        let surface = Surface::emitter(corners, DVec3::splat(radiance));
        surfaces.push(Surface { velocities, sides: Sides::Both, ..surface });
    }
    d.lights.push(Light::Directional {
        id: "sun".to_owned(),
        direction: -light,
        irradiance: DVec3::splat(sun),
        kappa,
    });
    let scene = Scene::new(d).expect("a scene");
    let mut change = Tangent::still(&scene);
    change.translate(&scene, 2, velocity);
    let world = World { surfaces, environment: DVec3::ZERO };
    let half = 0.3_f64.tan();
    let at = |a: f64, b: f64| {
        let way = camera.forward + half * ((2.0 * a - 1.0) * camera.right + (2.0 * b - 1.0) * camera.up);
        let x = camera.origin - way * (camera.origin.z / way.z);
        let found = irradiance(&world, &Receiver::still(x, DVec3::Z)).expect("a reference");
        found.outgoing(DVec3::splat(floor)).derivative.element_sum()
    };
    let nodes = rule(8);
    let exact: f64 =
        nodes.iter().map(|(a, v)| nodes.iter().map(|(b, w)| v * w * at(*a, *b)).sum::<f64>()).sum();
    println!("derivative {exact}");
    let case = Case { scene, change, exact, error: 3e-3 * exact.abs() };
    let mut power = Power::of("space_curves::sheets_that_cross_over_a_floor");
    case.accept(&mut power, "mean over jumps", &exact_mean(1024));
}
