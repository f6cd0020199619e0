//! Worlds whose pixels and derivatives are known by an argument, without computing them.

use flatland::plane::Filter;
use flatland::transport::{Camera, CameraTangent, Film, Gloss, Material, Shape, Tangent, World};
use glam::DVec2;

use super::worlds::{Case, Kind, Knobs};

/// A world with the known value of every pixel.
#[derive(Clone, Debug)]
pub struct Constant {
    /// The world.
    pub case: Case,
    /// The value of every pixel, if known.
    pub value: Option<f64>,
    /// The derivative of every pixel.
    pub derivative: f64,
}

fn p(x: f64, y: f64) -> DVec2 {
    DVec2::new(x, y)
}

/// All constants for some filters, with light scattered at most `bounces` times.
pub fn constants(filters: &[Filter], bounces: usize) -> Vec<Constant> {
    let mut all = vec![];
    for &filter in filters {
        all.extend(furnaces(filter, bounces));
        all.extend(alone_under_a_sky(filter, bounces));
        all.push(sliding_under_itself(filter));
        all.push(turning_in_the_furnace(filter));
        all.extend(moved_as_one(filter));
    }
    all
}

fn constant(
    world: &World,
    camera: Camera,
    change: Tangent,
    label: String,
    value: Option<f64>,
    derivative: f64,
) -> Constant {
    Constant { case: Case { world: world.clone(), camera, change, label }, value, derivative }
}

fn camera(position: DVec2, angle: f64, field_of_view: f64, filter: Filter) -> Camera {
    Camera { position, angle, field_of_view, film: Film { pixels: 5, filter } }
}

/// Σ xᵏ for k from 0 to n, and its derivative by x.
fn geometric(x: f64, n: usize) -> [f64; 2] {
    (0..=n).fold([0.0, 0.0], |[sum, slope], k| {
        let k = i32::try_from(k).expect("few bounces");
        [sum + x.powi(k), slope + if k == 0 { 0.0 } else { f64::from(k) * x.powi(k - 1) }]
    })
}

/// Inside a closed diffuse room of reflectance ρ that emits L everywhere, with objects of the same material
/// in it, the radiance is L Σ ρᵏ in every direction; motion does not change it, and its derivatives with
/// respect to ρ and L follow from the formula.
fn furnaces(filter: Filter, bounces: usize) -> Vec<Constant> {
    let (emission, reflectance) = (1.7, 0.6);
    let material = Material::diffuse(reflectance).with_emission(emission);
    let room = Shape::closed([p(-1.1, -0.9), p(1.2, -1.0), p(1.0, 0.9), p(-0.9, 1.1)], material);
    let block = Shape::closed([p(0.3, -0.2), p(0.7, -0.1), p(0.4, 0.3)], material);
    let world = World::new(0.0, vec![room, block]).expect("a world");
    let camera = camera(p(-0.4, 0.1), 0.1, 1.0, filter);
    let [sum, slope] = geometric(reflectance, bounces);
    let mut by_material = Tangent::none(&world);
    for m in &mut by_material.materials {
        (m.reflectance, m.emission) = (0.3, -0.8);
    }
    let eye = CameraTangent { position: p(0.4, -1.0), angle: 0.3, field_of_view: 0.5 };
    [
        ("a block moves", Tangent::translate(&world, [1], p(0.7, 0.4)), 0.0),
        ("a block turns", Tangent::rotate(&world, [1], p(0.5, 0.0)), 0.0),
        ("the walls move", Tangent::scale(&world, [0], p(0.1, 0.0)), 0.0),
        ("the camera moves", Tangent::of_camera(&world, eye), 0.0),
        ("the material changes", by_material, 0.3 * emission * slope - 0.8 * sum),
    ]
    .map(|(what, change, derivative)| {
        let label = format!("furnace, {what}, {filter:?}");
        constant(&world, camera, change, label, Some(emission * sum), derivative)
    })
    .into()
}

/// A convex polygon that fills the view, alone under a sky of radiance E: each of its points sees exactly
/// half a circle of sky and reflects ρE, from wherever it is seen and however it moves.
fn alone_under_a_sky(filter: Filter, bounces: usize) -> Vec<Constant> {
    let (sky, reflectance) = (1.3, 0.8);
    let corners = [p(-40.0, -3.0), p(0.5, -0.9), p(60.0, -4.0), p(0.0, -30.0)];
    let ground = Shape::closed(corners, Material::diffuse(reflectance));
    let world = World::new(sky, vec![ground]).expect("a world");
    let camera = camera(p(0.2, 1.0), -1.4, 0.7, filter);
    let reflected = if bounces == 0 { 0.0 } else { 1.0 };
    let mut by_sky = Tangent { environment: 0.7, ..Tangent::none(&world) };
    by_sky.materials[0].reflectance = 0.2;
    [
        ("it moves", Tangent::translate(&world, [0], p(0.7, 0.4)), 0.0),
        ("it turns", Tangent::rotate(&world, [0], p(0.5, 0.0)), 0.0),
        ("the sky brightens", by_sky, (0.7 * reflectance + 0.2 * sky) * reflected),
    ]
    .map(|(what, change, derivative)| {
        let label = format!("under a sky, {what}, {filter:?}");
        constant(&world, camera, change, label, Some(sky * reflectance * reflected), derivative)
    })
    .into()
}

/// A line that slides along itself below a light, its ends out of view: no surface point is at rest and
/// nothing visible changes.
fn sliding_under_itself(filter: Filter) -> Constant {
    let gloss = Some(Gloss { strength: 0.4, width: 0.2 });
    let material = Material { reflectance: 0.5, gloss, emission: 0.1 };
    let line = Shape::open([p(-30.0, -16.0), p(40.0, 19.0)], material);
    let light = Shape::open([p(-2.0, 3.0), p(-0.5, 3.5)], Material::emitter(2.0));
    let world = World::new(0.3, vec![line, light]).expect("a world");
    let camera = camera(p(0.2, 2.0), -1.4, 0.7, filter);
    let change = Tangent::translate(&world, [0], p(2.0, 1.0));
    constant(&world, camera, change, format!("sliding under itself, {filter:?}"), None, 0.0)
}

/// A many-sided disc that turns about its centre, in front of an indistinguishable background.
fn turning_in_the_furnace(filter: Filter) -> Constant {
    let corner = |i: u32| 0.5 * DVec2::from_angle(std::f64::consts::TAU * f64::from(i) / 24.0);
    let disc = Shape::closed((0..24).map(corner), Material::emitter(1.3));
    let world = World::new(1.3, vec![disc]).expect("a world");
    let camera = camera(p(-1.4, 0.2), -0.1, 1.2, filter);
    let change = Tangent::rotate(&world, [0], DVec2::ZERO);
    constant(&world, camera, change, format!("a disc that turns, {filter:?}"), Some(1.3), 0.0)
}

/// Random worlds that are translated, turned or scaled together with their camera.
fn moved_as_one(filter: Filter) -> Vec<Constant> {
    let knobs = |seed, kind| Knobs { filter, shapes: 1, pixels: 4, ..Knobs::random(seed, kind) };
    let mut all = vec![];
    for (seed, kind) in [(1, Kind::Shadows), (2, Kind::Glossy), (3, Kind::Glowing), (4, Kind::Room)] {
        let Case { world, camera, label, .. } = knobs(seed, kind).build();
        let (every, centre) = (0..world.shapes().len(), p(0.3, 0.8));
        let (arm, none) = (camera.position - centre, CameraTangent::default());
        let direction = p(0.8, -0.5);
        let eye = |camera: CameraTangent| Tangent::of_camera(&world, camera);
        let changes = [
            Tangent::translate(&world, every.clone(), direction)
                .and(&eye(CameraTangent { position: direction, ..none })),
            Tangent::rotate(&world, every.clone(), centre).and(&eye(CameraTangent {
                position: arm.perp(),
                angle: 1.0,
                ..none
            })),
            Tangent::scale(&world, every, centre).and(&eye(CameraTangent { position: arm, ..none })),
        ];
        for (what, change) in ["translated", "turned", "scaled"].into_iter().zip(changes) {
            all.push(constant(&world, camera, change, format!("{what} as one: {label}"), None, 0.0));
        }
    }
    all
}
