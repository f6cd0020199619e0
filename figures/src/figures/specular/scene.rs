//! An object above a glossy floor, seen by reflection.

use std::f64::consts::TAU;

use flatland::plane::Filter;
use flatland::transport::exact::Exact;
use flatland::transport::{Camera, Film, Material, Shape, Tangent, Terms, World};
use glam::DVec2;

/// Pixels of the film.
pub(super) const PIXELS: usize = 8;
/// Index of the object among the shapes.
pub(super) const OBJECT: usize = 1;
/// Its middle and its radius.
pub(super) const CENTRE: DVec2 = DVec2::new(1.3, 0.95);
const RADIUS: f64 = 0.42;
/// Its corners.
pub(super) const CORNERS: usize = 6;
/// Accuracy of the exact derivative, far below all noise.
const TOLERANCE: f64 = 1e-8;

/// The bright part of the scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Lighting {
    /// The whole environment: no emitter can be sampled, and paths follow the lobe.
    Sky,
    /// The object: paths sample it as an emitter as well.
    Object,
}

impl Lighting {
    pub(super) const ALL: [Self; 2] = [Self::Sky, Self::Object];

    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Sky => "dark object, bright sky",
            Self::Object => "luminous object, dark sky",
        }
    }
}

/// A world with its camera and motion.
pub(super) struct Scene {
    pub(super) world: World,
    pub(super) camera: Camera,
    pub(super) change: Tangent,
    /// dI/dθ of every pixel.
    pub(super) exact: Vec<f64>,
}

impl Scene {
    /// A lobe of half width `width`; every side of the hexagon is cut into `parts` segments, which changes
    /// neither image nor derivative.
    pub(super) fn new(width: f64, parts: usize, lighting: Lighting) -> anyhow::Result<Self> {
        let camera = camera();
        let coarse = world(width, 1, lighting)?;
        let exact = Exact { tolerance: TOLERANCE, ..Exact::default() };
        let exact = exact.gradient(&coarse, &camera, &motion(&coarse))?;
        let exact = exact.pixels.into_iter().map(Terms::total).collect();
        let world = world(width, parts, lighting)?;
        let change = motion(&world);
        Ok(Self { world, camera, change, exact })
    }
}

fn world(width: f64, parts: usize, lighting: Lighting) -> anyhow::Result<World> {
    let ends = [DVec2::new(-3.0, 0.0), DVec2::new(3.5, 0.0)];
    let floor = Shape::open(ends, Material::glossy(1.0, width));
    let (environment, emission) = match lighting {
        Lighting::Sky => (1.0, 0.0),
        Lighting::Object => (0.0, 1.0),
    };
    Ok(World::new(environment, vec![floor, Shape::closed(outline(parts), Material::emitter(emission))])?)
}

fn outline(parts: usize) -> Vec<DVec2> {
    let corner = |i: usize| CENTRE + RADIUS * DVec2::from_angle(0.2 + TAU * i as f64 / CORNERS as f64);
    let side = |i: usize| (0..parts).map(move |k| corner(i).lerp(corner(i + 1), k as f64 / parts as f64));
    (0..CORNERS).flat_map(side).collect()
}

fn camera() -> Camera {
    let film = Film { pixels: PIXELS, filter: Filter::Tent };
    Camera { position: DVec2::new(-1.6, 1.1), angle: -0.58, field_of_view: 0.5, film }
}

/// The object moves and turns.
fn motion(world: &World) -> Tangent {
    let turn = Tangent::rotate(world, [OBJECT], CENTRE);
    Tangent::translate(world, [OBJECT], DVec2::new(1.0, 0.3)).and(&turn)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_lightings_have_opposite_derivatives() {
        for width in [0.2, 1e-3] {
            let [sky, object] = Lighting::ALL.map(|l| Scene::new(width, 3, l).expect("a scene"));
            let largest = sky.exact.iter().fold(0.0_f64, |largest, e| largest.max(e.abs()));
            assert!(sky.exact.iter().zip(&object.exact).all(|(a, b)| (a + b).abs() < 1e-6 * largest));
        }
    }
}
