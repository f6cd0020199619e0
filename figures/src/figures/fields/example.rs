//! The example scene: a rotating pentagon behind a sliding triangle, over a background at rest.

use flatland::plane::exact::Arrangement;
use flatland::plane::{Film, Filter, Motion, Polygon, Scene, Shade, Shape};
use glam::{DVec2, DVec3};

/// Extent of the shown part of the plane, from the origin.
pub(super) const EXTENT: DVec2 = DVec2::new(4.0, 3.25);
/// The kernel's width κ^{−1/2}, also the side of the cells of the rotation method.
pub(super) const WIDTH: f64 = 0.25;
/// Centre of the rotating pentagon.
const CENTRE: DVec2 = DVec2::new(1.6, 1.62);

/// A scene and the velocity of its vertices.
pub(super) struct Example {
    pub(super) scene: Scene,
    pub(super) velocities: Vec<DVec2>,
    pub(super) film: Film,
}

impl Example {
    pub(super) fn new() -> anyhow::Result<Self> {
        let pentagon = (0..5).map(|k| {
            let angle = 0.35 + std::f64::consts::TAU * f64::from(k) / 5.0;
            CENTRE + 1.2 * DVec2::from_angle(angle)
        });
        let triangle = [(2.15, 0.75), (3.55, 1.75), (2.0, 2.55)].map(|(x, y)| DVec2::new(x, y));
        let shapes = vec![
            Shape::new(Polygon::simple(pentagon.collect::<Vec<_>>())?, Shade::constant(DVec3::splat(0.4))),
            Shape::new(Polygon::simple(triangle)?, Shade::constant(DVec3::splat(0.8))),
        ];
        let scene = Scene::new(DVec3::ZERO, shapes)?;
        let motion = Motion::rotate([0], CENTRE).and(Motion::translate([1], DVec2::new(0.9, -0.35)));
        let velocities = motion.velocities(&scene)?;
        let film = Film::new(4, 4, Filter::Box)?;
        Ok(Self { scene, velocities, film })
    }

    /// The points on visible silhouettes, about `spacing` apart.
    pub(super) fn sites(&self, arrangement: &Arrangement<'_>, spacing: f64) -> Vec<Site> {
        let mut sites = vec![];
        for ([p, q], [left, right]) in arrangement.silhouettes() {
            let along = (q - p).normalize();
            // The discontinuity lies on the edge of the upper shape: it is the occluder.
            let inward = if left > right { along.perp() } else { -along.perp() };
            let count = ((q - p).length() / spacing).ceil();
            for k in 0..count as u32 {
                let at = p.lerp(q, (f64::from(k) + 0.5) / count);
                let hit = self.scene.hit(at + 1e-9 * inward);
                let velocity = hit.map_or(DVec2::ZERO, |hit| hit.velocity(&self.velocities));
                let half = 0.5 * (q - p) / count;
                sites.push(Site { at, outward: -inward, velocity, half });
            }
        }
        sites
    }
}

/// Columns and rows of the cells of the rotation method.
pub(super) fn grid() -> [usize; 2] {
    (EXTENT / WIDTH).round().to_array().map(|count| count as usize)
}

/// Indices and middles of the cells, row by row.
pub(super) fn cells() -> impl Iterator<Item = ([usize; 2], DVec2)> {
    let [columns, rows] = grid();
    (0..columns * rows).map(move |i| {
        let cell = [i % columns, i / columns];
        (cell, (DVec2::from(cell.map(|place| place as f64)) + 0.5) * WIDTH)
    })
}

/// A point of a visible silhouette.
#[derive(Clone, Copy, Debug)]
pub(super) struct Site {
    pub(super) at: DVec2,
    /// The unit normal, away from the occluder.
    pub(super) outward: DVec2,
    /// The boundary velocity v.
    pub(super) velocity: DVec2,
    /// Vector from the point to the end of the piece of silhouette that it represents.
    pub(super) half: DVec2,
}
