//! Two worlds, their motion, and the reference derivative of every estimate.

use flatland::plane::Filter;
use flatland::transport::exact::{Exact, Radiosity};
use flatland::transport::{Camera, Film, Material, Paths, Shape, Tangent, Terms, World};
use glam::DVec2;

use crate::figures::common::dot;

/// Pixels of the film.
pub(super) const PIXELS: usize = 6;
/// The moving shape.
pub(super) const OCCLUDER: usize = 2;
/// Accuracy of the exact derivative, far below all noise.
const TOLERANCE: f64 = 1e-8;

/// A world with its camera, motion, and derivative.
pub(super) struct Setting {
    pub(super) name: &'static str,
    pub(super) world: World,
    pub(super) camera: Camera,
    pub(super) change: Tangent,
    pub(super) paths: Paths,
    /// dI/dθ of every pixel.
    pub(super) reference: Vec<f64>,
    /// The reference's own estimate of its error, relative.
    pub(super) uncertainty: f64,
    /// Source of the reference.
    pub(super) source: &'static str,
    /// Two corners of the drawn part of the world.
    pub(super) window: [DVec2; 2],
}

fn p(x: f64, y: f64) -> DVec2 {
    DVec2::new(x, y)
}

fn camera(position: DVec2, angle: f64) -> Camera {
    let film = Film { pixels: PIXELS, filter: Filter::Tent };
    Camera { position, angle, field_of_view: 0.8, film }
}

/// The errors' root of the sum of squares over the values'.
fn relative(errors: &[f64], values: &[f64]) -> f64 {
    dot(errors, errors).sqrt() / dot(values, values).sqrt()
}

/// The occluder moves and turns.
fn motion(world: &World, centre: DVec2) -> Tangent {
    let turn = Tangent::rotate(world, [OCCLUDER], centre);
    Tangent::translate(world, [OCCLUDER], p(1.0, 0.3)).and(&turn)
}

impl Setting {
    /// A triangle's shadow on a diffuse floor under a lamp and a faint sky.
    pub(super) fn shadow() -> anyhow::Result<Self> {
        let floor = Shape::open([p(-3.0, 0.0), p(3.0, 0.0)], Material::diffuse(0.8));
        let lamp = Shape::open([p(-0.8, 2.4), p(0.0, 2.5)], Material::emitter(3.0));
        let corners = [p(-0.35, 1.0), p(0.45, 1.1), p(0.1, 1.35)];
        let occluder = Shape::closed(corners, Material::diffuse(0.0));
        let world = World::new(0.1, vec![floor, lamp, occluder])?;
        let camera = camera(p(2.2, 1.6), -2.57);
        let change = motion(&world, p(0.0, 1.1));
        let exact = Exact { bounces: 1, tolerance: TOLERANCE }.gradient(&world, &camera, &change)?;
        let reference: Vec<f64> = exact.pixels.into_iter().map(Terms::total).collect();
        Ok(Self {
            name: "shadow, 1 bounce",
            paths: Paths { bounces: 1, ..Paths::default() },
            uncertainty: relative(&exact.errors, &reference),
            source: "closed forms and quadrature",
            window: [p(-1.3, -0.2), p(2.4, 2.6)],
            world,
            camera,
            change,
            reference,
        })
    }

    /// A triangle in a diffuse room, by direct light and light reflected once.
    pub(super) fn room() -> anyhow::Result<Self> {
        let walls = [p(2.2, 2.0), p(2.0, 0.0), p(-2.0, 0.0), p(-2.0, 2.4), p(2.2, 2.4), p(2.2, 2.05)];
        let room = Shape::open(walls, Material::diffuse(0.75));
        let lamp = Shape::open([p(-1.2, 1.9), p(-0.5, 2.0)], Material::emitter(3.0));
        let corners = [p(0.1, 0.8), p(0.7, 1.0), p(0.4, 1.4)];
        let occluder = Shape::closed(corners, Material::diffuse(0.4));
        let world = World::new(0.0, vec![room, lamp, occluder])?;
        let camera = camera(p(1.6, 1.7), -2.4);
        let change = motion(&world, p(0.4, 1.1));
        let radiosity = Radiosity { bounces: Some(2), parts: 1, tolerance: TOLERANCE };
        let [_, exact] = radiosity.gradient(&world, &camera, &change)?;
        Ok(Self {
            name: "room, 2 bounces",
            paths: Paths { bounces: 2, ..Paths::default() },
            uncertainty: relative(&exact.errors, &exact.pixels),
            source: "radiosity, differentiated",
            window: [p(-2.1, -0.1), p(2.3, 2.5)],
            world,
            camera,
            change,
            reference: exact.pixels,
        })
    }
}
