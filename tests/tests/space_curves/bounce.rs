//! Light after a bounce: a lamp seen only by a ceiling lights a floor.
//!
//! With E the irradiance of the ceiling, the radiance of the floor at x is ρ/π ∫ ρ/π E(y) cos θ cos θ′/|x −
//! y|² dy over the part of the ceiling visible from x. If the lamp moves, or its occluder, dE/dθ is exact and
//! its integral smooth. If something occludes the ceiling from x, the integral is over a polygon whose
//! corners move.

use std::f64::consts::PI;

use glam::{DAffine3, DQuat, DVec3};
use tests::quadrature::rule;
use tests::space::irradiance::{Receiver, Surface, World, irradiance};
use tests::space::scenes::film;
use volume3d::geometry::Mesh;
use volume3d::gradient::Tangent;
use volume3d::scene::{Camera, Description, Filter, Integrator, Material, Scene};

use super::{Case, after_a_bounce, edges, softened};

const ALBEDO: f64 = 0.7;
const BRIGHT: f64 = 20.0;
/// Height of the ceiling, a square of at most this half side.
const HEIGHT: f64 = 2.0;
const HALF: f64 = 2.6;

/// A lamp, and its occluder from the ceiling.
struct Room {
    lamp: Mesh,
    screen: Option<Mesh>,
    /// Half the side of the ceiling.
    half: f64,
}

fn placed(mesh: Mesh, normal: DVec3, place: DVec3, half: f64) -> Mesh {
    let turn = DQuat::from_rotation_arc(DVec3::Z, normal.normalize());
    mesh.transformed(&DAffine3::from_scale_rotation_translation(DVec3::splat(half), turn, place))
}

/// The lamp's place: next to the ceiling and facing it; its back faces the floor.
const PLACE: DVec3 = DVec3::new(2.3, 0.0, 1.0);
const FACING: DVec3 = DVec3::new(-0.25, 0.0, 0.97);

fn flat_lamp() -> Mesh {
    placed(Mesh::rectangle(), FACING, PLACE, 0.4)
}

fn triangles(mesh: &Mesh, radiance: f64, velocity: DVec3) -> Vec<Surface> {
    let triangle = |t: &[u32; 3]| {
        let vertices = t.map(|v| mesh.positions()[v as usize]).to_vec();
        let surface = Surface::emitter(vertices, DVec3::splat(radiance));
        Surface { velocities: vec![velocity; 3], ..surface }
    };
    mesh.triangles().iter().map(triangle).collect()
}

const CAMERA: DVec3 = DVec3::new(-0.05, -0.1, 0.7);
/// Field of view of the camera.
const WIDE: f64 = 1.6;

impl Room {
    /// With or without a black plate in front of the ceiling.
    fn scene(&self, plate: Option<&Mesh>) -> Scene {
        let camera = Camera::look_at(CAMERA, DVec3::ZERO, DVec3::Y, WIDE);
        let mut d = Description::new(camera, film(1, Filter::Box));
        d.integrator = Integrator { max_depth: Some(3), rr_depth: 100 };
        let white = d.add_material(Material::diffuse("white", DVec3::splat(ALBEDO)));
        let black = d.add_material(Material::diffuse("black", DVec3::ZERO));
        d.add_shape("floor", placed(Mesh::rectangle(), DVec3::Z, DVec3::ZERO, 1.0), white);
        d.add_shape("ceiling", placed(Mesh::rectangle(), DVec3::NEG_Z, HEIGHT * DVec3::Z, self.half), white);
        d.add_emitter("lamp", self.lamp.clone(), DVec3::splat(BRIGHT));
        for (name, mesh) in [("screen", self.screen.as_ref()), ("plate", plate)] {
            if let Some(mesh) = mesh {
                d.add_shape(name, mesh.clone(), black);
            }
        }
        Scene::new(d).expect("a scene")
    }

    fn world(&self, [lamp, screen]: [DVec3; 2]) -> World {
        let mut surfaces = triangles(&self.lamp, BRIGHT, lamp);
        surfaces.extend(self.screen.iter().flat_map(|mesh| triangles(mesh, 0.0, screen)));
        World { surfaces, environment: DVec3::ZERO }
    }

    /// Derivative of the floor's radiance at a point.
    fn rate(&self, x: DVec3, velocities: [DVec3; 2]) -> f64 {
        let world = self.world(velocities);
        let cells = 32;
        let step = 2.0 * self.half / f64::from(cells);
        let at = |i: i32| (f64::from(i) + 0.5) * step - self.half;
        let places = (0..cells).flat_map(|i| (0..cells).map(move |j| DVec3::new(at(i), at(j), HEIGHT)));
        let rate = |y: DVec3| {
            let light = irradiance(&world, &Receiver::still(y, DVec3::NEG_Z)).expect("a reference");
            light.derivative.x * kernel(x, y)
        };
        places.map(rate).sum::<f64>() * step * step
    }
}

/// (ρ/π)² cos θ cos θ′/|x − y|² between two horizontal surfaces.
fn kernel(x: DVec3, y: DVec3) -> f64 {
    let way = y - x;
    (ALBEDO / PI).powi(2) * way.z * way.z / way.length_squared().powi(2)
}

/// The mean of a function of floor points over the pixel.
fn over_pixel(f: impl Fn(DVec3) -> f64) -> f64 {
    let camera = Camera::look_at(CAMERA, DVec3::ZERO, DVec3::Y, WIDE);
    let half = (0.5 * WIDE).tan();
    let mut sum = 0.0;
    for (a, v) in rule(6) {
        for (b, w) in rule(6) {
            let way = camera.forward + half * ((2.0 * a - 1.0) * camera.right + (2.0 * b - 1.0) * camera.up);
            sum += v * w * f(camera.origin - way * (camera.origin.z / way.z));
        }
    }
    sum
}

fn case(room: &Room, velocities: [DVec3; 2]) -> Case {
    let scene = room.scene(None);
    let mut change = Tangent::still(&scene);
    change.translate(&scene, 2, velocities[0]);
    if room.screen.is_some() {
        change.translate(&scene, 3, velocities[1]);
    }
    // Three channels; the midpoint rule has an error of a thousandth.
    let exact = 3.0 * over_pixel(|x| room.rate(x, velocities));
    Case { scene, change, exact, error: 2e-3 * exact.abs() }
}

const SHIFT: DVec3 = DVec3::new(-0.5, 0.1, 0.4);

#[test]
fn outlines_of_a_flat_lamp_after_a_bounce() {
    let case = case(&Room { lamp: flat_lamp(), screen: None, half: HALF }, [SHIFT, DVec3::ZERO]);
    let mut power = after_a_bounce("space_curves::outlines_of_a_flat_lamp_after_a_bounce");
    case.accept(&mut power, "edge sampling", &edges(1, [1, 1, 12288]));
    case.accept(&mut power, "softened", &softened(2048, 0.4, [1, 1, 0]));
}

/// A solid lamp has no border: its outlines are silhouettes.
#[test]
fn outlines_of_a_solid_lamp_after_a_bounce() {
    // The lamp is below the floor's plane and lights the ceiling past the floor.
    let lamp = placed(Mesh::cube(), DVec3::Z, DVec3::new(2.4, 0.3, -0.5), 0.45);
    let case = case(&Room { lamp, screen: None, half: HALF }, [SHIFT, DVec3::ZERO]);
    let mut power = after_a_bounce("space_curves::outlines_of_a_solid_lamp_after_a_bounce");
    case.accept(&mut power, "softened", &softened(1, 0.4, [1, 20480, 0]));
}

/// The screen does not occlude the ceiling from the floor.
#[test]
fn shadows_after_a_bounce() {
    let screen = placed(Mesh::rectangle(), FACING, PLACE + 0.5 * DVec3::new(-0.5, 0.1, 0.85), 0.25);
    let case = case(
        &Room { lamp: flat_lamp(), screen: Some(screen), half: 1.4 },
        [DVec3::ZERO, DVec3::new(0.4, 0.1, 0.3)],
    );
    let mut power = after_a_bounce("space_curves::shadows_after_a_bounce");
    case.accept(&mut power, "edge sampling", &edges(1, [1, 8192, 1]));
}

/// The ceiling seen past a plate that moves between it and the floor.
#[test]
fn what_hides_a_ceiling() {
    let room = Room { lamp: flat_lamp(), screen: None, half: HALF };
    let (centre, half, velocity) = (DVec3::new(0.1, -0.05, 0.8), 0.3, DVec3::new(0.3, 0.2, -0.6));
    let scene = room.scene(Some(&placed(Mesh::rectangle(), DVec3::Z, centre, half)));
    let mut change = Tangent::still(&scene);
    change.translate(&scene, 3, velocity);
    let world = room.world([DVec3::ZERO; 2]);
    // The plate occludes the square behind it.
    let hidden = |x: DVec3, theta: f64| {
        let place = centre + theta * velocity;
        let scale = (HEIGHT - x.z) / (place.z - x.z);
        let (middle, half) = (x + (place - x) * scale, half * scale);
        let low = middle - half;
        assert!(low.truncate().min_element() > -HALF && low.truncate().max_element() + 2.0 * half < HALF);
        let at = |s: f64, t: f64| DVec3::new(low.x + 2.0 * half * s, low.y + 2.0 * half * t, HEIGHT);
        let light = |y: DVec3| {
            let light = irradiance(&world, &Receiver::still(y, DVec3::NEG_Z)).expect("a reference");
            light.value.x * kernel(x, y)
        };
        let nodes = rule(6);
        let row = |s: f64| nodes.iter().map(|(t, w)| w * light(at(s, *t))).sum::<f64>();
        nodes.iter().map(|(s, w)| w * row(*s)).sum::<f64>() * 4.0 * half * half
    };
    let h = 1e-3;
    let exact = 3.0 * over_pixel(|x| (hidden(x, -h) - hidden(x, h)) / (2.0 * h));
    let case = Case { scene, change, exact, error: 2e-3 * exact.abs() };
    let mut power = after_a_bounce("space_curves::what_hides_a_ceiling");
    case.accept(&mut power, "edge sampling", &edges(1, [1, 1, 12288]));
    case.accept(&mut power, "softened", &softened(256, f64::INFINITY, [1, 1, 8192]));
}
