//! Reflecting, touching and round surfaces, many triangles and many bounces: compared with closed forms where
//! there are any, otherwise with central differences with common random numbers.

use std::f64::consts::PI;

use flatland::plane;
use flatland::sdf::shapes::Ball;
use glam::{DAffine3, DQuat, DVec3};
use tests::comparison::Estimate;
use tests::effort::thorough;
use tests::space::constants::{furnace_room, furnace_up_to};
use tests::space::coverage::{self, CameraMotion, Motion, ProjectedScene};
use tests::space::scenes::{Moving, film, plate};
use volume3d::geometry::Mesh;
use volume3d::gradient::Tangent;
use volume3d::scene::{
    Bsdf, Camera, Description, Environment, Filter, Integrator, Material, Microfacets, Reflectance, Scene,
};

use super::row::{Right, Row};

const SIDE: usize = 6;

/// A scene without environment in front of a camera, with light reflected `bounces` times.
fn dark(from: DVec3, to: DVec3, field_of_view: f64, bounces: usize) -> Description {
    let camera = Camera::look_at(from, to, DVec3::Z, field_of_view);
    let mut d = Description::new(camera, film(SIDE, Filter::Tent { radius: 1.0 }));
    d.integrator = Integrator { max_depth: Some(bounces + 1), rr_depth: 100 };
    d
}

fn moving(d: Description, change: impl FnOnce(&Scene, &mut Tangent)) -> Result<Moving, String> {
    let scene = Scene::new(d).map_err(|error| error.to_string())?;
    let mut tangent = Tangent::still(&scene);
    change(&scene, &mut tangent);
    Ok(Moving { scene, change: tangent })
}

/// A square that grows over a metal floor of some roughness, visible only by reflection.
mod metal {
    use super::*;

    const EYE: DVec3 = DVec3::new(0.0, -2.0, 1.0);
    const FIELD_OF_VIEW: f64 = 0.5;
    const MIDDLE: DVec3 = DVec3::new(0.05, 1.3, 0.7);
    const HALF: f64 = 0.45;

    pub(super) fn scene(alpha: f64) -> Result<Moving, String> {
        let mut d = dark(EYE, DVec3::ZERO, FIELD_OF_VIEW, 1);
        let bsdf = Bsdf::RoughConductor {
            distribution: Microfacets::Beckmann,
            alpha,
            stretch: 1.0,
            eta: DVec3::ZERO,
            k: DVec3::ONE,
            specular_reflectance: Reflectance::Constant(DVec3::ONE),
        };
        let metal = d.add_material(Material::new("metal", bsdf, true));
        d.add_shape("floor", plate(DVec3::ZERO, DVec3::Z, 30.0), metal);
        d.add_emitter("square", plate(MIDDLE, DVec3::new(0.1, -1.0, -1.0), HALF), DVec3::ONE);
        moving(d, |scene, change| change.scale(scene, 1, MIDDLE, 1.0))
    }

    /// Image and derivative for an ideal mirror: they show the square mirrored below the floor.
    pub(super) fn mirrored() -> [f64; 2] {
        let below = |p: DVec3| DVec3::new(p.x, p.y, -p.z);
        let mesh = plate(MIDDLE, DVec3::new(0.1, -1.0, -1.0), HALF);
        let positions: Vec<DVec3> = mesh.positions().iter().map(|&p| below(p)).collect();
        let velocities = positions.iter().map(|&p| p - below(MIDDLE)).collect();
        let triangles: Vec<[usize; 3]> = mesh.triangles().iter().map(|t| t.map(|v| v as usize)).collect();
        let radiance = vec![DVec3::ONE; triangles.len()];
        let mesh = coverage::Mesh { positions, triangles, radiance, background: DVec3::ZERO };
        let Camera { origin, right, up, forward, field_of_view, .. } =
            Camera::look_at(EYE, DVec3::ZERO, DVec3::Z, FIELD_OF_VIEW);
        let eye = coverage::Camera { origin, right, up, forward, field_of_view, width: SIDE, height: SIDE };
        let motion = Motion { positions: velocities, camera: CameraMotion::default() };
        let scene = ProjectedScene::new(&mesh, &eye, &motion, plane::Filter::Tent).expect("a scene");
        [scene.image(), scene.derivative()]
            .map(|image| image.expect("a derivative").pixels().iter().map(|p| p.element_sum()).sum())
    }
}

/// A cube that grows upwards and sideways over a floor, with or without a gap, lit by an invisible lamp.
fn over_a_floor(gap: f64) -> Result<Moving, String> {
    let mut d = dark(DVec3::new(0.4, -3.0, 2.2), DVec3::new(0.0, 0.0, 0.2), 0.6, 1);
    let grey = d.add_material(Material::diffuse("grey", DVec3::splat(0.7)));
    d.add_shape("floor", plate(DVec3::ZERO, DVec3::Z, 4.0), grey);
    let foot = DVec3::new(0.05, 0.1, gap);
    let place = DAffine3::from_scale_rotation_translation(
        DVec3::splat(0.3),
        DQuat::from_rotation_z(0.4),
        foot + 0.3 * DVec3::Z,
    );
    d.add_shape("cube", Mesh::cube().transformed(&place), grey);
    d.add_emitter(
        "lamp",
        plate(DVec3::new(1.0, 0.5, 3.0), DVec3::new(-0.3, -0.1, -1.0), 0.5),
        DVec3::splat(9.0),
    );
    moving(d, |scene, change| change.scale(scene, 1, foot, 1.0))
}

/// The same for an implicit ball.
fn ball_over_a_floor(gap: f64) -> Result<Moving, String> {
    let mut d = dark(DVec3::new(0.4, -3.0, 2.2), DVec3::new(0.0, 0.0, 0.2), 0.6, 1);
    let grey = d.add_material(Material::diffuse("grey", DVec3::splat(0.7)));
    d.add_shape("floor", plate(DVec3::ZERO, DVec3::Z, 4.0), grey);
    d.add_implicit("ball", Ball::new(DVec3::new(0.05, 0.1, 0.35 + gap), 0.35).expect("a ball"), grey);
    d.add_emitter(
        "lamp",
        plate(DVec3::new(1.0, 0.5, 3.0), DVec3::new(-0.3, -0.1, -1.0), 0.5),
        DVec3::splat(9.0),
    );
    moving(d, |_, change| change.implicits[0].parameters = vec![0.0, 0.0, 1.0, 1.0])
}

/// A lamp that grows in a closed room with a block and many bounces.
fn room(bounces: usize) -> Result<Moving, String> {
    let mut d = dark(DVec3::new(0.2, -0.9, 0.1), DVec3::new(0.0, 0.4, -0.3), 1.0, bounces);
    d.film = film(3, Filter::Tent { radius: 1.0 });
    let white = d.add_material(Material::diffuse("white", DVec3::splat(0.7)));
    d.materials[white].two_sided = true;
    d.add_shape("room", Mesh::cube(), white);
    let middle = DVec3::new(0.1, 0.3, -0.55);
    let turn = DQuat::from_rotation_z(0.4);
    let place = DAffine3::from_scale_rotation_translation(DVec3::splat(0.25), turn, middle);
    d.add_shape("block", Mesh::cube().transformed(&place), white);
    let lamp = DVec3::new(0.1, 0.2, 0.8);
    d.add_emitter("lamp", plate(lamp, DVec3::NEG_Z, 0.3), DVec3::splat(3.0));
    moving(d, |scene, change| change.scale(scene, 2, lamp, 1.0))
}

/// A closed room whose walls emit 1 and reflect a fraction a; the derivative by that fraction is Σ j aʲ⁻¹,
/// everywhere.
fn furnace(name: &str, bounces: usize) -> Row {
    const ALBEDO: f64 = 0.8;
    let mut d = dark(DVec3::new(0.2, 0.1, 0.3), DVec3::new(1.0, 0.4, 0.2), 1.2, bounces);
    d.film = film(2, Filter::Tent { radius: 1.0 });
    let grey = d.add_material(Material::diffuse("grey", DVec3::splat(ALBEDO)));
    let room = furnace_room(DVec3::splat(-2.0), DVec3::splat(2.0), 1.0);
    let triangles = room.triangles.iter().map(|t| t.map(|v| v as u32)).collect();
    let shape = d.add_shape("room", Mesh::new(room.positions, triangles).expect("a mesh"), grey);
    d.shapes[shape].radiance = Some(DVec3::ONE);
    let moving = moving(d, |_, change| change.reflectance[0] = DVec3::ONE);
    let rate: f64 = (1..=bounces as i32).map(|j| f64::from(j) * ALBEDO.powi(j - 1)).sum();
    let [image, rate] = [furnace_up_to(ALBEDO, 1.0, bounces as i32), rate].map(|v| Estimate::exact(12.0 * v));
    Row::new(name, moving, Some(image), rate, Right::ALL)
}

/// A black ball that grows in front of a white sky.
#[derive(Clone, Copy)]
struct Sky {
    scale: f64,
    offset: DVec3,
}

const SKY: Sky = Sky { scale: 1.0, offset: DVec3::ZERO };
const DISTANCE: f64 = 3.0;
const RADIUS: f64 = 0.7;
const FIELD_OF_VIEW: f64 = 0.9;

impl Sky {
    fn description(self) -> Description {
        let mut d = dark(self.offset + self.scale * DISTANCE * DVec3::X, self.offset, FIELD_OF_VIEW, 0);
        // `look_at` subtracts two positions, which loses digits far from the origin.
        let near = Camera::look_at(DISTANCE * DVec3::X, DVec3::ZERO, DVec3::Z, FIELD_OF_VIEW);
        d.camera = Camera { origin: d.camera.origin, ..near };
        d.environment = Some(Environment::Constant { id: "sky".to_owned(), radiance: DVec3::ONE });
        d.add_material(Material::diffuse("black", DVec3::ZERO));
        d
    }

    fn implicit(self) -> Result<Moving, String> {
        let mut d = self.description();
        d.add_implicit("ball", Ball::new(self.offset, self.scale * RADIUS).map_err(|e| e.to_string())?, 0);
        moving(d, |_, change| change.implicits[0].parameters = vec![0.0, 0.0, 0.0, self.scale * RADIUS])
    }

    fn mesh(self, rings: u32) -> Result<Moving, String> {
        let mut d = self.description();
        let place = DAffine3::from_scale_rotation_translation(
            DVec3::splat(self.scale * RADIUS),
            DQuat::from_rotation_x(0.3),
            self.offset,
        );
        d.add_shape("ball", ball(rings).transformed(&place), 0);
        moving(d, |scene, change| change.scale(scene, 0, self.offset, 1.0))
    }

    /// The ball's outline on the film is a circle.
    fn row(self, name: impl Into<String>, moving: Result<Moving, String>, right: Right) -> Row {
        let pixels = 0.5 * SIDE as f64 / (0.5 * FIELD_OF_VIEW).tan();
        let square = DISTANCE.powi(2) - RADIUS.powi(2);
        let outline = pixels * RADIUS / square.sqrt();
        let rate = pixels * RADIUS * DISTANCE.powi(2) / square.powf(1.5);
        let image = Estimate::exact(3.0 * ((SIDE * SIDE) as f64 - PI * outline.powi(2)));
        let derivative = Estimate::exact(-3.0 * 2.0 * PI * outline * rate);
        Row::new(name, moving, Some(image), derivative, right)
    }
}

/// The unit ball of 4 · rings² triangles, except at the poles.
fn ball(rings: u32) -> Mesh {
    let around = 2 * rings;
    let mut positions = vec![DVec3::Z, DVec3::NEG_Z];
    for i in 1..rings {
        let (sin, cos) = (PI * f64::from(i) / f64::from(rings)).sin_cos();
        for j in 0..around {
            let (y, x) = (2.0 * PI * f64::from(j) / f64::from(around)).sin_cos();
            positions.push(DVec3::new(sin * x, sin * y, cos));
        }
    }
    let at = |i: u32, j: u32| 2 + (i - 1) * around + j % around;
    let mut triangles = vec![];
    for j in 0..around {
        triangles.push([0, at(1, j), at(1, j + 1)]);
        triangles.push([1, at(rings - 1, j + 1), at(rings - 1, j)]);
        for i in 1..rings - 1 {
            triangles.push([at(i, j), at(i + 1, j), at(i + 1, j + 1)]);
            triangles.push([at(i, j), at(i + 1, j + 1), at(i, j + 1)]);
        }
    }
    Mesh::new(positions, triangles).expect("a mesh")
}

/// References by differences of 65,536 samples a pixel; `references_by_differences_hold` measures them again,
/// with fewer.
mod measured {
    pub(super) const METAL: [(f64, f64); 2] = [(11.729, 0.040), (44.99, 0.27)];
    pub(super) const CUBE: [(f64, f64); 6] = [
        (-3.606, 0.034),
        (-3.320, 0.033),
        (-3.315, 0.033),
        (-3.314, 0.033),
        (-3.314, 0.033),
        (-3.314, 0.033),
    ];
    pub(super) const BALL: [(f64, f64); 3] = [(-8.661, 0.048), (-8.203, 0.043), (-8.201, 0.043)];
    pub(super) const ROOM: (f64, f64) = (5.933, 0.006);
}

pub(crate) fn rows() -> Vec<Row> {
    let mut rows = vec![];
    // Edge sampling refuses implicit surfaces.
    let implicit = Right { edges: false, ..Right::ALL };
    for (alpha, reference) in [1.0, 0.1].into_iter().zip(measured::METAL) {
        let name = format!("a square in metal of roughness {alpha:e}");
        rows.push(Row::differences(name, metal::scene(alpha), 0.01, reference, Right::ALL));
    }
    let [image, derivative] = metal::mirrored().map(Estimate::exact);
    for alpha in [1e-2, 1e-3, 1e-4, 1e-6] {
        let name = format!("a square in metal of roughness {alpha:e}");
        rows.push(Row::new(name, metal::scene(alpha), Some(image), derivative, Right::NONE));
    }
    for (gap, reference) in [1e-1, 1e-3, 1e-5, 1e-7, 1e-9, 0.0].into_iter().zip(measured::CUBE) {
        let name = if gap > 0.0 {
            format!("a cube {gap:e} above a floor that it shades")
        } else {
            "a cube on a floor that it shades".to_owned()
        };
        rows.push(Row::differences(name, over_a_floor(gap), 0.02, reference, Right::ALL));
    }
    for (gap, reference) in [1e-1, 1e-4, 1e-7].into_iter().zip(measured::BALL) {
        let name = format!("an implicit ball {gap:e} above a floor that it shades");
        rows.push(Row::differences(name, ball_over_a_floor(gap), 0.02, reference, implicit));
    }
    let room = Row::differences("64 bounces in a closed room", room(64), 0.02, measured::ROOM, Right::ALL);
    rows.push(Row { samples: 16, ..room });
    rows.push(Row { samples: 16, ..furnace("64 bounces in a furnace, by its albedo", 64) });
    if thorough() {
        let million = SKY.row("a ball of a million triangles that grows", SKY.mesh(500), Right::ALL);
        rows.push(Row { runs: 0.4, ..million });
    }
    rows.push(SKY.row("an implicit ball that grows, nothing extreme", SKY.implicit(), implicit));
    for scale in [1e-9, 1e-3, 1e3, 1e9] {
        let scaled = Sky { scale, ..SKY };
        rows.push(scaled.row(format!("the implicit ball, scaled by {scale:e}"), scaled.implicit(), implicit));
    }
    for distance in [1e3, 1e6, 1e9] {
        let moved = Sky { offset: DVec3::new(distance, -0.3 * distance, 0.7 * distance), ..SKY };
        let name = format!("the implicit ball, {distance:e} sizes from the origin");
        rows.push(moved.row(name, moved.implicit(), implicit));
    }
    rows
}
