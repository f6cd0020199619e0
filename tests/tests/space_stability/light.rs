//! Light on a ground past a moving plate, compared with Lambert's formula on clipped polygons and, for lamps
//! so small that they act as points, with the motion of the edges of the shadow.

use std::f64::consts::PI;

use flatland::plane::{Film, Filter};
use glam::{DVec2, DVec3};
use tests::comparison::Estimate;
use tests::effort::thorough;
use tests::space::coverage::{Camera, CameraMotion};
use tests::space::direct::DirectScene;
use tests::space::irradiance::{Ground, Surface, World};
use tests::space::scenes;

use super::row::{Right, Row};

const ALBEDO: f64 = 0.8;
const SIDE: usize = 4;
/// The middle of the lamp.
const LAMP: DVec3 = DVec3::new(0.2, 1.0, 2.0);

/// A lamp above a ground, and a plate below it.
#[derive(Clone)]
struct Light {
    /// Size of the lamp, in units of about half a metre.
    lamp: f64,
    /// Position of the plate between the ground, at 0, and the lamp, at 1.
    plate: Option<f64>,
    /// Whether the lamp moves instead of the plate.
    lamp_moves: bool,
    scale: f64,
    offset: DVec3,
    camera: DVec3,
    field_of_view: f64,
}

const BASE: Light = Light {
    lamp: 1.0,
    plate: Some(0.5),
    lamp_moves: false,
    scale: 1.0,
    offset: DVec3::ZERO,
    camera: DVec3::new(0.0, -1.5, 1.5),
    field_of_view: 0.4,
};

impl Light {
    fn camera(&self) -> Camera {
        let forward = (-self.camera).normalize();
        let right = DVec3::X;
        let up = right.cross(forward);
        let field_of_view = self.field_of_view;
        Camera { origin: self.camera, right, up, forward, field_of_view, width: SIDE, height: SIDE }
    }

    /// The lamp, facing down.
    fn lamp(&self) -> Surface {
        let half = DVec2::new(0.3, 0.25) * self.lamp;
        let corners = [(-1.0, -1.0), (-1.0, 1.0), (1.0, 1.0), (1.0, -1.0)];
        let corners = corners.map(|(x, y)| LAMP + DVec3::new(half.x * x, half.y * y, 0.0));
        let radiance = DVec3::splat(20.0 / self.lamp.powi(2));
        let mut lamp = Surface::emitter(corners.to_vec(), radiance);
        if self.lamp_moves {
            lamp.velocities.fill(DVec3::new(0.4, -0.8, -0.5));
        }
        lamp
    }

    /// A plate whose shadow covers part of the view, and part of the lamp where it is close to the lamp.
    fn plate(&self) -> Option<Surface> {
        let at = self.plate?;
        // On the line from the ground's middle to the lamp's.
        let middle = at * LAMP;
        // Seen from the ground it is as large as the lamp or the view, whichever is closer.
        let (x, y) = (0.5 * at + 0.4 * (1.0 - at), 0.45 * at + 0.4 * (1.0 - at));
        let corners = [(-1.0, -0.9), (0.13, -0.8), (0.17, 0.85), (-1.05, 0.8)];
        let corners = corners.map(|(a, b)| middle + DVec3::new(x * a, y * b, 0.0));
        let mut plate = Surface::occluder(corners.to_vec());
        if !self.lamp_moves {
            let moved = |p: &DVec3| 0.5 * (*p - middle) + DVec3::new(0.4, 0.1, 0.0);
            plate.velocities = plate.vertices.iter().map(moved).collect();
        }
        Some(plate)
    }

    fn scene(&self) -> DirectScene {
        let to = |p: DVec3| self.offset + self.scale * p;
        let mut surfaces: Vec<Surface> = self.plate().into_iter().chain([self.lamp()]).collect();
        for surface in &mut surfaces {
            surface.vertices.iter_mut().for_each(|p| *p = to(*p));
            surface.velocities.iter_mut().for_each(|v| *v *= self.scale);
        }
        let corners = [DVec3::new(-9.0, -5.0, 0.0), DVec3::new(9.0, -5.0, 0.0), DVec3::new(0.0, 9.0, 0.0)];
        let ground = Ground { corners: corners.map(to), velocities: [DVec3::ZERO; 3] };
        let mut camera = self.camera();
        camera.origin = to(camera.origin);
        DirectScene {
            world: World { surfaces, environment: DVec3::ZERO },
            ground,
            albedo: DVec3::splat(ALBEDO),
            camera,
            camera_motion: CameraMotion::default(),
            filter: Filter::Tent,
        }
    }

    /// Image and derivative, summed over pixels and channels, before scaling and displacement.
    fn exact(&self) -> [Estimate; 2] {
        let plain = Self { scale: 1.0, offset: DVec3::ZERO, ..self.clone() };
        let pixels = plain.scene().image(3e-3).expect("an image");
        let mut sums = [Estimate::default(); 2];
        for pixel in pixels {
            sums[0].mean += pixel.value.element_sum();
            sums[0].standard_error += 3.0 * pixel.value_error;
            sums[1].mean += pixel.derivative.element_sum();
            sums[1].standard_error += 3.0 * pixel.derivative_error;
        }
        sums
    }

    fn row(&self, name: impl Into<String>, right: Right) -> Row {
        self.row_beside(name, self.exact(), right)
    }

    fn row_beside(&self, name: impl Into<String>, [image, derivative]: [Estimate; 2], right: Right) -> Row {
        Row::new(name, Ok(scenes::direct(&self.scene())), Some(image), derivative, right)
    }

    /// The same for a small lamp: the mean over its points, by Gauss' rule of degree 5.
    fn row_of_points(&self, name: impl Into<String>, right: Right) -> Row {
        let half = 0.5 * (self.lamp().vertices[2] - self.lamp().vertices[0]);
        let nodes =
            || [(-0.6_f64.sqrt(), 5.0 / 18.0), (0.0, 8.0 / 18.0), (0.6_f64.sqrt(), 5.0 / 18.0)].into_iter();
        let all = nodes().flat_map(|(x, a)| nodes().map(move |(y, b)| (DVec3::new(x, y, 0.0), a * b)));
        let derivative = all.map(|(at, weight)| weight * self.edge_of_shadow(LAMP + half * at)).sum();
        let derivative = Estimate::exact(derivative);
        Row::new(name, Ok(scenes::direct(&self.scene())), None, derivative, right)
    }

    /// Lamps in a square grid, together of the power of one.
    fn row_of_many(&self, name: impl Into<String>, side: usize, right: Right) -> Row {
        let step = 1.0 / side as f64;
        let place = |i: usize| DVec3::new((i % side) as f64 + 0.37, (i / side) as f64 + 0.41, 0.0);
        let places = (0..side * side).map(|i| LAMP + place(i) * step - DVec3::new(0.5, 0.5, 0.0));
        let small = Self { lamp: 0.2 * step, ..self.clone() };
        let mut scene = small.scene();
        let lamp = scene.world.surfaces.pop().expect("a lamp");
        let mut derivative = 0.0;
        for place in places {
            let mut lamp = lamp.clone();
            lamp.vertices.iter_mut().for_each(|p| *p += place - LAMP);
            lamp.radiance *= step * step;
            scene.world.surfaces.push(lamp);
            derivative += step * step * small.edge_of_shadow(place);
        }
        Row::new(name, Ok(scenes::direct(&scene)), None, Estimate::exact(derivative), right)
    }

    /// The derivative of the sum of all pixels and channels for a point light of one unit of radiance times
    /// area: minus the light that the edges of the plate's shadow sweep over. A point p of the plate has its
    /// shadow at P(p), on the line from the lamp.
    fn edge_of_shadow(&self, lamp: DVec3) -> f64 {
        const NODES: usize = 400;
        let Some(plate) = self.plate() else { return 0.0 };
        let (camera, film) = (self.camera(), Film::new(SIDE, SIDE, Filter::Tent).expect("a film"));
        let corners = plate.vertices.len();
        let mut sum = 0.0;
        for k in 0..corners {
            let [a, b] = [plate.vertices[k], plate.vertices[(k + 1) % corners]];
            let [va, vb] = [plate.velocities[k], plate.velocities[(k + 1) % corners]];
            for i in 0..NODES {
                let s = (i as f64 + 0.5) / NODES as f64;
                let (p, v) = (a.lerp(b, s), va.lerp(vb, s));
                let from = p - lamp;
                let stretch = -lamp.z / from.z;
                // dP along a displacement of p.
                let shifted = |d: DVec3| stretch * (d - from * (d.z / from.z));
                let (at, along, rate) = (lamp + stretch * from, shifted(b - a), shifted(v));
                // The shadow is to the left of its edge if the edge runs counterclockwise, as the plate's
                // does.
                let swept = rate.x * along.y - rate.y * along.x;
                let to = lamp - at;
                let light = to.z * to.z / to.length_squared().powi(2) * ALBEDO / PI;
                sum -= swept / NODES as f64 * light * weight(&camera, &film, at);
            }
        }
        3.0 * 20.0 * 4.0 * 0.3 * 0.25 * sum
    }
}

/// The sum of all pixels' filters at the image of a ground point, times the ratio of film area to ground
/// area.
fn weight(camera: &Camera, film: &Film, at: DVec3) -> f64 {
    let (d, scale) = (at - camera.origin, 0.5 * SIDE as f64 / (0.5 * camera.field_of_view).tan());
    let z = d.dot(camera.forward);
    let u = DVec2::new(d.dot(camera.right), -d.dot(camera.up)) * scale / z + 0.5 * SIDE as f64;
    let pixels = (0..SIDE * SIDE).map(|i| film.filter_value(film.centre(i % SIDE, i / SIDE), u));
    pixels.sum::<f64>() * scale * scale * d.z.abs() / z.powi(3)
}

pub(crate) fn rows() -> Vec<Row> {
    let exact = BASE.exact();
    let mut rows = vec![BASE.row_beside("a shadow that moves, nothing extreme", exact, Right::ALL)];
    for scale in [1e-9, 1e-3, 1e3, 1e9] {
        rows.push(Light { scale, ..BASE }.row_beside(
            format!("the shadow, scaled by {scale:e}"),
            exact,
            Right::ALL,
        ));
    }
    for distance in [1e3, 1e6, 1e9] {
        let offset = DVec3::new(distance, -0.3 * distance, 0.7 * distance);
        rows.push(Light { offset, ..BASE }.row_beside(
            format!("the shadow, {distance:e} sizes from the origin"),
            exact,
            Right::ALL,
        ));
    }
    for gap in [1e-1, 1e-3, 1e-5, 1e-7, 1e-9] {
        let near = Light { plate: Some(1.0 - 0.5 * gap), ..BASE };
        let row = near.row(format!("the shadow of a plate {gap:e} before the lamp"), Right::ALL);
        rows.push(Row { samples: 4 * row.samples, ..row });
    }
    for lamp in [6.0, 2.0] {
        rows.push(
            Light { lamp, ..BASE }
                .row(format!("the shadow in the light of a lamp of size {:e}", 0.5 * lamp), Right::ALL),
        );
    }
    for lamp in [2e-1, 2e-2, 2e-3, 2e-6] {
        let name = format!("the shadow in the light of a lamp of size {:e}", 0.5 * lamp);
        rows.push(Light { lamp, ..BASE }.row_of_points(name, Right { warped: false, ..Right::ALL }));
    }
    for lamp in [6.0, 2.0, 2e-1, 2e-3, 2e-6] {
        let moves = Light { lamp, plate: None, lamp_moves: true, ..BASE };
        rows.push(moves.row(
            format!("a lamp of size {:e} that moves", 0.5 * lamp),
            if lamp > 1.0 { Right::ALL } else { Right::NONE },
        ));
    }
    if thorough() {
        // From any point, a hundredth of all lamps are partly occluded: samples of the area rarely find them.
        let right = Right { edges: true, ..Right::NONE };
        let many = BASE.row_of_many("the shadow in the light of 10,000 lamps", 100, right);
        rows.push(Row { samples: 16, ..many });
    }
    for distance in [1e-3, 1e-6] {
        let camera = BASE.camera * distance;
        rows.push(Light { camera, ..BASE }.row(
            format!("the shadow, seen from {distance:e} above it"),
            Right { auto: true, warped: true, ..Right::NONE },
        ));
    }
    rows
}
