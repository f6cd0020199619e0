//! Effects of smooth shading: curves where a surface turns its other side to the camera or to another
//! surface, and the horizon of a rotating face.
//!
//! A lobe of light gives a surface of shading normal n the radiance ρ/π E (n·d)₊, with d the direction of the
//! light and E its irradiance times (coth κ − 1/κ), if no part of the lobe is below the horizon. The sign of
//! ±n depends on the viewer, with a discontinuity where n·ω = 0. Integrals are split there, and derivatives
//! are central differences of the integrals.

use std::f64::consts::PI;

use glam::{DAffine3, DQuat, DVec3};
use tests::quadrature::rule;
use tests::space::irradiance::{Receiver, Surface, World, irradiance};
use tests::space::scenes::film;
use volume3d::geometry::{Attribute, Mesh, Normals};
use volume3d::gradient::{Tangent, WarpedArea};
use volume3d::scene::{Camera, Description, Filter, Integrator, Light, Material, Scene};

use super::{Case, after_a_bounce, edges, exact_mean, power, softened};

const ALBEDO: f64 = 0.7;
const IRRADIANCE: f64 = 3.0;
const KAPPA: f64 = 1e4;

/// A triangle with a normal at each corner.
#[derive(Clone, Copy, Debug)]
struct Sheet {
    corners: [DVec3; 3],
    normals: [DVec3; 3],
}

/// Rotation of a sheet about its first corner; its normals may rotate alone.
#[derive(Clone, Copy, Debug)]
struct Turn {
    corners: DVec3,
    normals: DVec3,
}

impl Sheet {
    fn new(corners: [[f64; 3]; 3], normals: [[f64; 3]; 3]) -> Self {
        Self { corners: corners.map(DVec3::from), normals: normals.map(|n| DVec3::from(n).normalize()) }
    }

    fn turned(&self, turn: Turn, theta: f64) -> Self {
        let about = |axis: DVec3| DQuat::from_scaled_axis(theta * axis);
        let [centre, ..] = self.corners;
        Self {
            corners: self.corners.map(|p| centre + about(turn.corners) * (p - centre)),
            normals: self.normals.map(|n| about(turn.normals) * n),
        }
    }

    fn mesh(&self) -> Mesh {
        let normals = Attribute { values: self.normals.to_vec(), triangles: vec![[0, 1, 2]] };
        let mesh = Mesh::new(self.corners.to_vec(), vec![[0, 1, 2]]).expect("a mesh");
        mesh.with_normals(Normals::Given(normals)).expect("normals")
    }

    /// The tangent of a scene in which the sheet is the only shape with normals.
    fn change(&self, scene: &Scene, shape: usize, turn: Turn) -> Tangent {
        let mut change = Tangent::still(scene);
        let rates = self.corners.map(|p| turn.corners.cross(p - self.corners[0]));
        change.positions_of_mut(scene, shape).copy_from_slice(&rates);
        change.normals.copy_from_slice(&self.normals.map(|n| turn.normals.cross(n)));
        change
    }
}

fn mix(weights: [f64; 3], values: [DVec3; 3]) -> DVec3 {
    weights[0] * values[0] + weights[1] * values[1] + weights[2] * values[2]
}

/// The radiance towards ω of a point with normal n, under light from d.
fn reflected(normal: DVec3, towards: DVec3, light: DVec3) -> f64 {
    let side = normal.dot(towards).signum();
    let lobe = 1.0 / KAPPA.tanh() - 1.0 / KAPPA;
    ALBEDO / PI * IRRADIANCE * lobe * (side * normal.dot(light)).max(0.0)
}

/// ∫ over [0, 1] of f, which is smooth except where one of `signs` changes.
fn cut(f: impl Fn(f64) -> f64, signs: &[&dyn Fn(f64) -> f64]) -> f64 {
    let mut cuts = vec![0.0, 1.0];
    let parts = 64;
    for sign in signs {
        for k in 0..parts {
            let [mut low, mut high] = [k, k + 1].map(|k| f64::from(k) / f64::from(parts));
            let first = sign(low) > 0.0;
            if first == (sign(high) > 0.0) {
                continue;
            }
            for _ in 0..60 {
                let middle = 0.5 * (low + high);
                if (sign(middle) > 0.0) == first { low = middle } else { high = middle }
            }
            cuts.push(low);
        }
    }
    cuts.sort_by(f64::total_cmp);
    let piece = |a: f64, b: f64| rule(12).iter().map(|(t, w)| w * (b - a) * f(a + t * (b - a))).sum::<f64>();
    cuts.windows(2).map(|w| piece(w[0], w[1])).sum()
}

/// The mean of a function over [0, 1] by the midpoint rule: its derivative is discontinuous where a curve
/// leaves the domain.
fn mean_of(parts: usize, f: impl Fn(f64) -> f64) -> f64 {
    (0..parts).map(|i| f((i as f64 + 0.5) / parts as f64)).sum::<f64>() / parts as f64
}

fn differences(f: impl Fn(f64) -> f64) -> f64 {
    let h = 1e-4;
    (f(h) - f(-h)) / (2.0 * h)
}

fn sun(d: &mut Description, from: DVec3) {
    d.lights.push(Light::Directional {
        id: "sun".to_owned(),
        direction: -from,
        irradiance: DVec3::splat(IRRADIANCE),
        kappa: KAPPA,
    });
}

/// A method with this number of samples of sign changes, which do not depend on the motion.
fn warped(samples: usize, sign_changes: usize) -> WarpedArea {
    WarpedArea { sign_changes, ..exact_mean(samples) }
}

/// A sheet that fills the film and turns its other side to the camera along a curve in its middle.
#[test]
fn sides_that_turn_before_the_camera() {
    let camera = Camera::look_at(DVec3::new(0.0, 0.0, 3.0), DVec3::ZERO, DVec3::Y, 0.3);
    let sheet = Sheet::new(
        [[-2.0, -1.7, 0.4], [2.0, -1.7, -0.3], [0.0, 2.7, 0.1]],
        [[-2.0, 0.3, -0.8], [2.0, -0.1, 1.0], [0.1, 1.0, -0.05]],
    );
    let light = DVec3::new(0.2, 0.95, 0.1).normalize();
    let mut d = Description::new(camera.clone(), film(3, Filter::Box));
    d.integrator = Integrator { max_depth: Some(2), rr_depth: 100 };
    let white = d.add_material(Material::diffuse("white", DVec3::splat(ALBEDO)));
    d.add_shape("sheet", sheet.mesh(), white);
    sun(&mut d, light);
    let scene = Scene::new(d).expect("a scene");
    let turn = Turn { corners: DVec3::new(0.02, -0.03, 0.05), normals: DVec3::new(0.3, -0.8, 0.4) };
    let half = 0.15_f64.tan();
    // ∫ L du over 3 × 3 pixels.
    let image = |theta: f64| {
        let Sheet { corners: [a, b, c], normals } = sheet.turned(turn, theta);
        let seen = |x: f64, y: f64| {
            let way = camera.forward + half * ((2.0 * x - 1.0) * camera.right + (2.0 * y - 1.0) * camera.up);
            let plane = (b - a).cross(c - a);
            let p = camera.origin + way * (plane.dot(a - camera.origin) / plane.dot(way));
            let part = |q: DVec3, r: DVec3| (q - p).cross(r - p).dot(plane) / plane.length_squared();
            (mix([part(b, c), part(c, a), part(a, b)], normals).normalize(), -way.normalize())
        };
        let row = |y: f64| {
            let turns = |x: f64| {
                let (normal, viewer) = seen(x, y);
                normal.dot(viewer)
            };
            let lit = |x: f64| seen(x, y).0.dot(light);
            let radiance = |x: f64| {
                let (normal, viewer) = seen(x, y);
                reflected(normal, viewer, light)
            };
            cut(radiance, &[&turns, &lit])
        };
        9.0 * mean_of(2000, row)
    };
    let exact = 3.0 * differences(image);
    let still = 3.0 * image(0.0);
    println!("image {still}, derivative {exact}");
    let change = sheet.change(&scene, 0, turn);
    let case = Case { scene, change, exact, error: 3e-3 * exact.abs() };
    let mut power = power("space_curves::sides_that_turn_before_the_camera");
    case.accept(&mut power, "edge sampling", &edges(16, [128, 1, 1]));
    case.reject("edge sampling, nine tenths of its curves", &Less(edges(16, [128, 1, 1])));
    case.accept(&mut power, "warped area", &warped(16, 128));
    case.reject("warped area without sign changes", &warped(16, 0));
}

/// Edge sampling with 0.9 times its term on the film.
struct Less(volume3d::gradient::EdgeSampling);

impl super::Method for Less {
    fn run(&self, case: &Case, seed: u64) -> volume3d::gradient::GradientImage {
        let method = volume3d::gradient::EdgeSampling { seed, ..self.0.clone() };
        let none = volume3d::gradient::Progress::none();
        let mut found = method.forward_terms(&case.scene, &case.change, &none).expect("valid");
        let terms = found.terms.take().expect("asked for");
        for (pixel, curve) in found.gradient.pixels.iter_mut().zip(&terms.primary.pixels) {
            *pixel -= 0.1 * *curve;
        }
        found
    }
}

/// A wall lit only by a sheet that turns its other side to the wall along a curve.
#[test]
fn sides_that_turn_before_a_wall() {
    let eye = DVec3::new(0.3, 0.2, 0.6);
    let camera = Camera::look_at(eye, DVec3::ZERO, DVec3::Y, 0.6);
    let sheet = Sheet::new(
        [[-0.6, -0.5, 1.0], [0.0, 0.7, 0.9], [0.7, -0.4, 1.1]],
        [[-0.5, 0.2, -0.9], [0.2, 0.4, -0.5], [0.5, -0.2, 0.9]],
    );
    let light = DVec3::new(0.9, 0.2, -0.5).normalize();
    let mut d = Description::new(camera.clone(), film(1, Filter::Box));
    d.integrator = Integrator { max_depth: Some(3), rr_depth: 100 };
    let white = d.add_material(Material::diffuse("white", DVec3::splat(ALBEDO)));
    // Its shadow passes the sheet.
    let wall = Mesh::rectangle().transformed(&DAffine3::from_scale(DVec3::splat(0.4)));
    d.add_shape("wall", wall, white);
    d.add_shape("sheet", sheet.mesh(), white);
    sun(&mut d, light);
    let scene = Scene::new(d).expect("a scene");
    let wall_light = |y: DVec3, sheet: &Sheet| {
        let Sheet { corners, normals } = *sheet;
        let twice_area = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
        let at = |s: f64, t: f64| {
            let weights = [1.0 - s, s * (1.0 - t), s * t];
            let (x, n) = (mix(weights, corners), mix(weights, normals).normalize());
            let way = y - x;
            (x, n, way, n.dot(way))
        };
        let row = |s: f64| {
            let turns = |t: f64| at(s, t).3;
            let lit = |t: f64| at(s, t).1.dot(light);
            let value = |t: f64| {
                let (_, n, way, _) = at(s, t);
                let distance = way.length();
                let direction = way / distance;
                let cosines = direction.z.abs() * twice_area.dot(direction).abs() / (distance * distance);
                ALBEDO / PI * reflected(n, direction, light) * cosines * s
            };
            cut(value, &[&turns, &lit])
        };
        mean_of(300, row)
    };
    let half = 0.3_f64.tan();
    let over_pixel = |sheet: &Sheet| {
        let mut sum = 0.0;
        for (a, v) in rule(4) {
            for (b, w) in rule(4) {
                let way =
                    camera.forward + half * ((2.0 * a - 1.0) * camera.right + (2.0 * b - 1.0) * camera.up);
                sum += v * w * wall_light(eye - way * (eye.z / way.z), sheet);
            }
        }
        sum
    };
    // Rotation about the light's direction: lit points keep their radiance, and only the visible side
    // changes.
    let turn = Turn { corners: DVec3::ZERO, normals: 1.1 * light };
    let exact = 3.0 * differences(|theta| over_pixel(&sheet.turned(turn, theta)));
    println!("image {}, derivative {exact}", 3.0 * over_pixel(&sheet));
    let change = sheet.change(&scene, 1, turn);
    let case = Case { scene, change, exact, error: 2e-3 * exact.abs() };
    let mut power = after_a_bounce("space_curves::sides_that_turn_before_a_wall");
    case.accept(&mut power, "edge sampling", &edges(16, [1, 32_768, 1]));
    case.accept(&mut power, "warped area", &warped(16, 8192));
    case.reject("warped area without sign changes", &warped(16, 0));
}

/// The upper face of a cube with a sphere's normals, and a lamp next to it that the face's plane cuts in
/// half: light from below that plane is in the cube's own shadow, though the shading normals would reflect
/// it.
#[test]
fn horizons_of_a_face() {
    let camera = Camera::look_at(DVec3::new(0.7, 4.0, 0.2), DVec3::new(0.6, 1.0, 0.1), DVec3::NEG_Z, 0.05);
    let mut d = Description::new(camera.clone(), film(1, Filter::Box));
    d.integrator = Integrator { max_depth: Some(2), rr_depth: 100 };
    let white = d.add_material(Material::diffuse("white", DVec3::splat(ALBEDO)));
    let cube = Mesh::cube().smooth();
    d.add_shape("cube", cube, white);
    let half = 0.5;
    let lamp = [[3.0, 0.4, -half], [3.0, 0.4, half], [3.0, 1.6, half], [3.0, 1.6, -half]].map(DVec3::from);
    let mesh = Mesh::new(lamp.to_vec(), vec![[0, 1, 2], [0, 2, 3]]).expect("a mesh");
    assert!((lamp[1] - lamp[0]).cross(lamp[2] - lamp[0]).x < 0.0);
    d.add_emitter("lamp", mesh, DVec3::splat(20.0));
    let scene = Scene::new(d).expect("a scene");
    let axis = DVec3::new(0.1, 0.3, 1.0);
    let mut change = Tangent::still(&scene);
    change.rotate(&scene, 0, DVec3::ZERO, axis);
    let image = |theta: f64| {
        let turn = DQuat::from_scaled_axis(theta * axis);
        let up = turn * DVec3::Y;
        let over = |a: f64, b: f64| {
            let half = 0.025_f64.tan();
            let way = camera.forward + half * ((2.0 * a - 1.0) * camera.right + (2.0 * b - 1.0) * camera.up);
            let distance = (1.0 - up.dot(camera.origin)) / up.dot(way);
            let x = camera.origin + distance * way;
            let normal = turn * shading_normal(turn.inverse() * x);
            let above = above(&lamp, x, up);
            let world = World {
                surfaces: vec![Surface::emitter(above, DVec3::splat(20.0))],
                environment: DVec3::ZERO,
            };
            irradiance(&world, &Receiver::still(x, normal)).expect("a reference").value.x * ALBEDO / PI
        };
        let nodes = rule(6);
        nodes.iter().map(|(a, v)| nodes.iter().map(|(b, w)| v * w * over(*a, *b)).sum::<f64>()).sum::<f64>()
    };
    let exact = 3.0 * differences(image);
    let case = Case { scene, change, exact, error: 2e-3 * exact.abs() };
    let mut power = power("space_curves::horizons_of_a_face");
    case.accept(&mut power, "edge sampling", &edges(256, [1, 2048, 1]));
    case.accept(&mut power, "softened", &softened(1024, 0.4, [1, 2048, 0]));
    case.accept(&mut power, "mean over jumps", &exact_mean(1024));
}

/// The part of a polygon above a plane through x.
fn above(polygon: &[DVec3], x: DVec3, up: DVec3) -> Vec<DVec3> {
    let mut kept = vec![];
    for (i, &a) in polygon.iter().enumerate() {
        let b = polygon[(i + 1) % polygon.len()];
        let [f, g] = [a, b].map(|p| up.dot(p - x));
        if f >= 0.0 {
            kept.push(a);
        }
        if (f > 0.0) != (g > 0.0) {
            kept.push(a.lerp(b, f / (f - g)));
        }
    }
    kept
}

/// Shading normal at a point of the upper face of the cube [−1, 1]³: corner directions interpolated over the
/// face's triangles. As the interpolation is linear, it is the direction of the point itself.
fn shading_normal(x: DVec3) -> DVec3 {
    x.normalize()
}
