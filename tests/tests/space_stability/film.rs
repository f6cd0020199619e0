//! Film terms: flat shapes of constant radiance, compared with the plane's exact arrangement.

use flatland::plane::Filter;
use glam::DVec3;
use tests::space::coverage::{Camera, CameraMotion, Mesh, Motion, ProjectedScene};
use tests::space::scenes;
use tests::space::worlds::CoverageCase;

use super::row::{Right, Row};

/// Position on the film, from −1 to 1 across it, distance, and velocity on the film.
type Corner = (f64, f64, f64, [f64; 2]);

/// A square and its camera.
#[derive(Clone)]
struct Film {
    /// Triangles with their radiance, the nearest first.
    triangles: Vec<([Corner; 3], f64)>,
    field_of_view: f64,
    scale: f64,
    offset: DVec3,
    side: usize,
}

/// A square, cut off by the film's border, that grows and rotates in front of a static one.
fn base() -> Film {
    let grown =
        |x: f64, y: f64, depth: f64| (x, y, depth, [0.5 * (x - 0.4) - 0.3 * y, 0.5 * y + 0.3 * (x - 0.4)]);
    let still = |x: f64, y: f64| (x, y, 2.0, [0.0; 2]);
    let near =
        [grown(-0.31, -0.52, 1.0), grown(1.27, -0.43, 1.1), grown(1.13, 0.49, 1.1), grown(-0.42, 0.38, 1.0)];
    let far = [still(-0.71, -0.13), still(0.37, -0.21), still(0.42, 0.74), still(-0.63, 0.69)];
    let halves =
        |c: [Corner; 4], radiance: f64| [([c[0], c[1], c[2]], radiance), ([c[0], c[2], c[3]], radiance)];
    let triangles = [halves(near, 1.0), halves(far, 0.4)].concat();
    Film { triangles, field_of_view: 0.8, scale: 1.0, offset: DVec3::ZERO, side: 6 }
}

impl Film {
    fn case(&self) -> CoverageCase {
        let half = (0.5 * self.field_of_view).tan();
        let place = |x: f64, y: f64, depth: f64| DVec3::new(half * x, half * y, -1.0) * depth;
        let (mut positions, mut velocities, mut triangles, mut radiance) = (vec![], vec![], vec![], vec![]);
        for (corners, of_it) in &self.triangles {
            let mut triangle = [0; 3];
            for (index, &(x, y, depth, [dx, dy])) in triangle.iter_mut().zip(corners) {
                let at = self.offset + self.scale * place(x, y, depth);
                *index = positions.iter().position(|p| *p == at).unwrap_or_else(|| {
                    positions.push(at);
                    velocities.push(self.scale * (place(dx, dy, depth) + DVec3::Z * depth));
                    positions.len() - 1
                });
            }
            triangles.push(triangle);
            radiance.push(DVec3::splat(*of_it));
        }
        let mesh = Mesh { positions, triangles, radiance, background: DVec3::ZERO };
        let camera = Camera {
            origin: self.offset,
            right: DVec3::X,
            up: DVec3::Y,
            forward: DVec3::NEG_Z,
            field_of_view: self.field_of_view,
            width: self.side,
            height: self.side,
        };
        let motion = Motion { positions: velocities, camera: CameraMotion::default() };
        CoverageCase { mesh, camera, motion, filter: Filter::Tent, label: String::new() }
    }

    /// The table row; its exact numbers are those of the scene before scaling and displacement.
    fn row(&self, name: impl Into<String>, right: Right) -> Row {
        let plain = Self { scale: 1.0, offset: DVec3::ZERO, ..self.clone() }.case();
        let exact =
            ProjectedScene::new(&plain.mesh, &plain.camera, &plain.motion, plain.filter).expect("a scene");
        let total =
            |image: flatland::plane::Image| image.pixels().iter().map(|p| p.element_sum()).sum::<f64>();
        let [image, derivative] =
            [exact.image(), exact.derivative()].map(|i| total(i.expect("a derivative")));
        Row::exact(name, scenes::coverage(&self.case(), None), image, derivative, right)
    }
}

/// A triangle of a given aspect that widens, so that its derivative does not vanish with its width.
fn sliver(aspect: f64) -> Film {
    let half = 0.7 / aspect;
    let corner = |x: f64, y: f64, dy: f64| (x, y, 1.0, [0.0, dy]);
    let triangle = [corner(-0.7, 0.05 - half, -0.4), corner(0.73, 0.11, 0.0), corner(-0.7, 0.05 + half, 0.4)];
    Film { triangles: vec![(triangle, 1.0)], ..base() }
}

/// Two squares separated by a gap in depth; the nearer one grows, and their radiances differ.
fn gap(gap: f64) -> Film {
    let mut film = base();
    for (corners, radiance) in &mut film.triangles {
        let depth = if *radiance == 1.0 { 1.0 - gap } else { 1.0 };
        corners.iter_mut().for_each(|corner| corner.2 = depth);
    }
    film
}

pub(crate) fn rows() -> Vec<Row> {
    let mut rows = vec![base().row("a square that grows, nothing extreme", Right::ALL)];
    for scale in [1e-9, 1e-3, 1e3, 1e9] {
        rows.push(Film { scale, ..base() }.row(format!("the square, scaled by {scale:e}"), Right::ALL));
    }
    for distance in [1e3, 1e6, 1e9] {
        let offset = DVec3::new(distance, -0.3 * distance, 0.7 * distance);
        rows.push(
            Film { offset, ..base() }
                .row(format!("the square, {distance:e} sizes from the origin"), Right::ALL),
        );
    }
    for degrees in [1e-3, 1.0, 170.0, 179.9] {
        let field_of_view = f64::to_radians(degrees);
        rows.push(
            Film { field_of_view, ..base() }
                .row(format!("the square, a field of view of {degrees}°"), Right::ALL),
        );
    }
    for distance in [1e-3, 1e-6] {
        let mut film = base();
        for (corners, radiance) in &mut film.triangles {
            if *radiance == 1.0 {
                corners.iter_mut().for_each(|corner| corner.2 *= distance);
            }
        }
        rows.push(film.row(format!("the square, {distance:e} before the camera"), Right::ALL));
    }
    for width in [1e-1, 1e-3, 1e-5, 1e-7, 1e-9] {
        rows.push(
            gap(width).row(format!("the square, a gap of {width:e} before one that rests"), Right::ALL),
        );
    }
    for aspect in [1e3, 1e6, 1e9] {
        // It is thinner than the spacing of the samples. The stated errors of the first three cover 17 of 30
        // runs, and a part of the last one is thinner than the distance of rays from an edge.
        let right = Right { image: false, edges: aspect > 1e4 && aspect < 1e8, ..Right::NONE };
        rows.push(sliver(aspect).row(format!("a sliver of aspect {aspect:e} that widens"), right));
    }
    let one = Film { side: 1, ..base() }.row("the square, one pixel and one sample", Right::ALL);
    rows.push(Row { samples: 1, runs: 30.0, ..one });
    rows
}
