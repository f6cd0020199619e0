//! Small scenes in which moving implicit surfaces and meshes occlude and shade one another.

use flatland::sdf::Sdf as _;
use flatland::sdf::shapes::{Ball, SmoothUnion};
use glam::{DAffine3, DQuat, DVec3};
use volume3d::geometry::Mesh;
use volume3d::gradient::{CameraTangent, Tangent};
use volume3d::scene::{
    Camera, Description, Environment, Film, Filter, Implicit, Integrator, Material, Scene,
};
use volume3d::sdf::analytic::{RoundedBox, Torus};
use volume3d::sdf::{Grid, Interpolation};

/// Pixels along a side of the film.
pub(crate) const SIDE: usize = 12;

const VELOCITY: DVec3 = DVec3::new(1.0, 0.3, 0.2);

/// A scene that changes.
pub(crate) struct Moving {
    pub(crate) name: &'static str,
    pub(crate) scene: Scene,
    pub(crate) change: Tangent,
    /// Factor on the number of samples: variances are large where silhouettes of different motions cross.
    pub(crate) effort: usize,
}

/// Paths of a given number of segments under a white sky.
fn under_the_sky(depth: usize) -> Description {
    let mut description = in_the_dark(depth);
    description.environment = Some(Environment::Constant { id: "sky".to_owned(), radiance: DVec3::ONE });
    description
}

fn in_the_dark(depth: usize) -> Description {
    let camera = Camera::look_at(DVec3::new(0.3, -5.0, 3.0), DVec3::new(0.0, 0.0, 0.8), DVec3::Z, 0.75);
    let film = Film {
        width: SIDE,
        height: SIDE,
        crop: None,
        sample_border: true,
        filter: Filter::Tent { radius: 1.0 },
    };
    let mut description = Description::new(camera, film);
    description.integrator = Integrator { max_depth: Some(depth), rr_depth: 10 };
    description.add_material(Material::diffuse("clay", DVec3::new(0.8, 0.6, 0.4)));
    description
}

fn placed(mesh: Mesh, at: DVec3, scale: f64, turn: DQuat) -> Mesh {
    mesh.transformed(&DAffine3::from_scale_rotation_translation(DVec3::splat(scale), turn, at))
}

fn with_floor(mut description: Description) -> Description {
    let floor = placed(Mesh::rectangle(), DVec3::ZERO, 3.0, DQuat::IDENTITY);
    description.add_shape("floor", floor, 0);
    description
}

fn with(mut description: Description, surfaces: impl IntoIterator<Item = Ball<DVec3>>) -> Description {
    for (number, surface) in surfaces.into_iter().enumerate() {
        description.add_implicit(&format!("ball {number}"), surface, 0);
    }
    description
}

fn ball(x: f64, y: f64, z: f64, radius: f64) -> Ball<DVec3> {
    Ball::new(DVec3::new(x, y, z), radius).expect("a ball")
}

fn moving(name: &'static str, description: Description, change: impl FnOnce(&Scene, &mut Tangent)) -> Moving {
    let scene = Scene::new(description).expect("a scene");
    let mut tangent = Tangent::still(&scene);
    change(&scene, &mut tangent);
    Moving { name, scene, change: tangent, effort: 1 }
}

/// The first surface moves.
fn translated(name: &'static str, description: Description) -> Moving {
    moving(name, description, |_, change| change.implicits[0].translation = VELOCITY)
}

fn with_surface(mut description: Description, surface: impl Implicit) -> Description {
    description.add_implicit("surface", surface, 0);
    description
}

/// A ball in front of the sky.
pub(crate) fn silhouette() -> Moving {
    translated("a ball before the sky", with(under_the_sky(1), [ball(0.1, 0.0, 0.9, 0.8)]))
}

/// A ball over a floor that it shades.
pub(crate) fn over_a_floor(depth: usize) -> Moving {
    let description = with(with_floor(under_the_sky(depth)), [ball(0.1, 0.0, 1.3, 0.8)]);
    translated(if depth > 2 { "a ball over a floor, bounces" } else { "a ball over a floor" }, description)
}

/// The shadow of a ball in the light of a square lamp.
pub(crate) fn under_a_lamp() -> Moving {
    let mut description = with(with_floor(in_the_dark(2)), [ball(0.1, 0.0, 1.3, 0.8)]);
    let down = DQuat::from_rotation_x(std::f64::consts::PI);
    let lamp = placed(Mesh::rectangle(), DVec3::new(0.5, 0.3, 4.0), 0.6, down);
    description.add_emitter("lamp", lamp, DVec3::splat(10.0));
    translated("a ball under a lamp", description)
}

/// One ball shades another; the nearer one moves.
pub(crate) fn two_balls() -> Moving {
    let balls = [ball(0.2, -0.3, 2.1, 0.45), ball(0.0, 0.0, 0.6, 0.8)];
    translated("two balls", with(under_the_sky(2), balls))
}

/// A moving cube shades a static ball.
pub(crate) fn mesh_over_a_ball() -> Moving {
    let mut description = with(under_the_sky(2), [ball(0.0, 0.0, 0.6, 0.8)]);
    let cube = placed(Mesh::cube(), DVec3::new(0.2, -0.3, 2.1), 0.35, DQuat::from_rotation_y(0.5));
    description.add_shape("cube", cube, 0);
    moving("a cube over a ball", description, |scene, change| change.translate(scene, 0, VELOCITY))
}

/// A moving ball, partly behind a cube.
pub(crate) fn behind_a_mesh() -> Moving {
    let mut description = with(under_the_sky(2), [ball(0.1, 0.6, 0.9, 0.8)]);
    let cube = placed(Mesh::cube(), DVec3::new(0.5, -1.2, 1.3), 0.35, DQuat::from_rotation_z(0.5));
    description.add_shape("cube", cube, 0);
    Moving { effort: 8, ..translated("a ball behind a cube", description) }
}

/// A moving block in front of a ball with another motion, over a floor and under a lamp: each occludes and
/// shades the other.
pub(crate) fn block_beside_a_ball() -> Moving {
    let mut description = with(with_floor(in_the_dark(2)), [ball(0.5, 0.4, 0.9, 0.6)]);
    let block = placed(Mesh::cube(), DVec3::new(-0.1, -0.7, 1.2), 0.35, DQuat::from_rotation_z(0.5));
    description.add_shape("block", block, 0);
    let down = DQuat::from_rotation_x(std::f64::consts::PI);
    let lamp = placed(Mesh::rectangle(), DVec3::new(-0.6, -0.5, 4.0), 0.6, down);
    description.add_emitter("lamp", lamp, DVec3::splat(10.0));
    let scene = moving("a block before a ball", description, |scene, change| {
        change.translate(scene, 1, VELOCITY);
        change.implicits[0].translation = DVec3::new(0.4, -0.2, 0.5);
    });
    Moving { effort: 2, ..scene }
}

/// A surface that shades itself, and whose parameters change.
pub(crate) fn union() -> Moving {
    let union = SmoothUnion::new(ball(0.0, 0.0, 0.5, 0.8), ball(0.5, -0.4, 1.7, 0.5), 0.3).expect("a union");
    moving("a union, itself its receiver", with_surface(under_the_sky(2), union), |_, change| {
        let parameters = &mut change.implicits[0].parameters;
        (parameters[4], parameters[6]) = (1.0, 0.4);
    })
}

/// A ring that moves and rotates, with its own shadow in its hole.
pub(crate) fn ring() -> Moving {
    let ring = Torus::new(DVec3::new(0.0, 0.0, 0.8), 0.9, 0.35).expect("a ring");
    moving("a ring", with_surface(under_the_sky(2), ring), |_, change| {
        change.implicits[0].translation = VELOCITY;
        change.implicits[0].rotation = DVec3::new(0.3, 0.5, 0.1);
    })
}

/// A rounded box over a floor.
pub(crate) fn rounded_box() -> Moving {
    let shape = RoundedBox::new(DVec3::new(0.1, 0.0, 1.0), DVec3::new(0.9, 0.6, 0.5), 0.25).expect("a box");
    let description = with_surface(with_floor(under_the_sky(2)), shape);
    Moving { effort: 4, ..translated("a rounded box over a floor", description) }
}

/// A grid over a floor, whose node values change.
pub(crate) fn grid() -> Moving {
    sampled("a grid over a floor", Interpolation::Cubic, with_floor(under_the_sky(2)))
}

/// The same in front of the sky, with an interpolation whose ∇φ is discontinuous between cells.
pub(crate) fn kinked_grid() -> Moving {
    sampled("a trilinear grid before the sky", Interpolation::Trilinear, under_the_sky(1))
}

fn sampled(name: &'static str, interpolation: Interpolation, description: Description) -> Moving {
    let shape = ball(0.1, 0.0, 1.3, 0.8);
    let corners = (DVec3::new(-1.1, -1.2, 0.1), DVec3::new(1.3, 1.2, 2.5));
    let grid = Grid::sampled(interpolation, corners, 32, |x| shape.jet(x).value).expect("a grid");
    // Translation to the right, and growth.
    let rate = |i: usize| -1.5 * shape.jet(grid.position(i)).gradient.x - 0.2;
    let rates: Vec<f64> = (0..grid.nodes().len()).map(rate).collect();
    moving(name, with_surface(description, grid), |_, change| change.implicits[0].parameters = rates)
}

/// A ball that shades itself, a floor and a moving ring, in any unit of length.
pub(crate) fn in_units(unit: f64) -> Moving {
    let mut description = with_floor(under_the_sky(3));
    description.shapes[0].mesh =
        placed(description.shapes[0].mesh.clone(), DVec3::ZERO, unit, DQuat::IDENTITY);
    description.camera.origin *= unit;
    description.tracer.far *= unit;
    description.add_implicit("ball", ball(0.1, 0.3, 1.3, 0.8), 0);
    description.add_implicit("ring", Torus::new(DVec3::new(0.0, -0.4, 0.8), 0.9, 0.2).expect("a ring"), 0);
    description.implicits.iter_mut().for_each(|shape| shape.placement.scale = unit);
    moving("units", description, |_, change| {
        change.implicits[1].translation = VELOCITY * unit;
        change.implicits[1].rotation = DVec3::new(0.3, 0.5, 0.1);
    })
}

/// The camera moves, rotates and zooms.
pub(crate) fn camera() -> Moving {
    let description = with(with_floor(under_the_sky(2)), [ball(0.1, 0.0, 1.3, 0.8)]);
    moving("a camera that moves", description, |_, change| {
        change.camera = CameraTangent {
            translation: DVec3::new(0.5, 0.2, 0.3),
            rotation: DVec3::new(0.1, 0.2, 0.15),
            field_of_view: 0.2,
        };
    })
}
