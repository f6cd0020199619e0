//! The scene: one shape rotates, one slides, one is at rest and hides parts of both.

use flatland::plane::{Attachment, Motion, Polygon, Scene, Shade, Shape};
use glam::{DMat2, DVec2, DVec3};

/// Pixels along each side of the film.
pub(super) const SIDE: usize = 48;
/// The centre of rotation of the pinwheel.
const HUB: DVec2 = DVec2::new(30.0, 18.5);

/// The scene and its motion with θ.
pub(super) struct Example {
    pub(super) scene: Scene,
    pub(super) motion: Motion,
    pub(super) velocities: Vec<DVec2>,
}

/// A board at rest, a sliding kite, a rotating pinwheel, and a bar at rest in front.
pub(super) fn example() -> anyhow::Result<Example> {
    let shapes = vec![
        Shape::new(ring(&[(4.3, 8.4), (42.7, 3.6), (45.1, 39.2), (6.6, 44.3)])?, board()),
        Shape::new(ring(&[(8.2, 25.3), (20.4, 19.1), (33.7, 33.2), (14.6, 40.4), (16.3, 31.2)])?, kite()),
        Shape::new(Polygon::simple(pinwheel())?, wheel()),
        Shape::new(ring(&[(25.2, 30.1), (43.8, 21.3), (46.1, 26.2), (27.6, 35.2)])?, bar()),
    ];
    let scene = Scene::new(DVec3::new(0.05, 0.065, 0.09), shapes)?;
    let motion = Motion::translate([1], DVec2::new(9.0, -3.5)).and(Motion::rotate([2], HUB));
    let velocities = motion.velocities(&scene)?;
    Ok(Example { scene, motion, velocities })
}

fn ring(points: &[(f64, f64)]) -> anyhow::Result<Polygon> {
    Ok(Polygon::simple(points.iter().map(|&(x, y)| DVec2::new(x, y)).collect::<Vec<_>>())?)
}

/// Four blades, each rising to its tip and falling back steeply.
fn pinwheel() -> Vec<DVec2> {
    (0..4)
        .flat_map(|blade| {
            let turn = std::f64::consts::FRAC_PI_2 * f64::from(blade) + 0.3;
            [(5.0, 0.0), (12.5, 0.5), (9.5, 0.85)]
                .map(|(radius, angle)| HUB + radius * DVec2::from_angle(turn + angle))
        })
        .collect()
}

/// Linear shade, fixed to the image plane.
fn board() -> Shade {
    let slopes = [DVec2::new(0.004, 0.002), DVec2::new(0.003, 0.005), DVec2::new(0.001, 0.006)];
    Shade::linear(DVec2::splat(24.0), DVec3::new(0.42, 0.46, 0.50), slopes, Attachment::Image)
}

/// Linear shade, carried by the material.
fn kite() -> Shade {
    let slopes = [DVec2::new(0.006, 0.0), DVec2::new(0.028, -0.012), DVec2::new(0.010, -0.008)];
    Shade::linear(DVec2::new(19.0, 30.0), DVec3::new(0.06, 0.34, 0.62), slopes, Attachment::Material)
}

/// Quadratic shade, carried by the material.
fn wheel() -> Shade {
    let (red, green, blue) = (0.0016, 0.0030, 0.0006);
    let bowl = |size: f64| DMat2::from_cols(DVec2::new(2.2, 0.8), DVec2::new(0.8, -0.9)) * size;
    let hessian = [bowl(red), bowl(green), bowl(blue)];
    let gradient = [DVec2::new(0.004, 0.0), DVec2::new(0.009, -0.004), DVec2::ZERO];
    Shade::quadratic(HUB, DVec3::new(0.82, 0.34, 0.05), gradient, hessian, Attachment::Material)
}

/// Constant shade.
fn bar() -> Shade {
    Shade::constant(DVec3::new(0.10, 0.12, 0.14))
}
