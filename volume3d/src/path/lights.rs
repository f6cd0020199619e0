//! Choosing a light, a direction to it, and what arrives from there.

use std::f64::consts::{PI, TAU};

use glam::DVec3;

use super::bsdf::Sampled;
use super::calculus::VisibilityDomain;
use crate::scene::{Environment, Light, Scene};

/// What next-event estimation can choose.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum LightId {
    /// The front of a shape.
    Shape(u32),
    /// A light without a surface.
    Light(u32),
    /// An environment map.
    Environment,
}

/// One light, with its part of the samples.
#[derive(Clone, Debug)]
struct Entry {
    id: LightId,
    probability: f64,
}

/// All lights that next-event estimation chooses from, roughly by power. A constant environment is not among
/// them: sampling reflection finds it as well.
#[derive(Clone, Debug, Default)]
pub(crate) struct Lights {
    entries: Vec<Entry>,
    /// For each shape its place in `entries`, or none.
    of_shape: Vec<Option<u32>>,
    /// The shapes that emit.
    areas: Vec<Area>,
    /// How directions of the environment's map are drawn, if it has one.
    map: Option<MapSampler>,
}

/// The triangles of an emitting shape.
#[derive(Clone, Debug)]
struct Area {
    shape: u32,
    first_triangle: u32,
    /// Cumulated areas.
    cumulative: Vec<f64>,
    centre: DVec3,
    radius: f64,
    border: Option<Border>,
}

/// The border of a flat emitter.
#[derive(Clone, Debug)]
struct Border {
    normal: DVec3,
    offset: f64,
    /// Ends, counter-clockwise, and the corner across from them.
    edges: Vec<[u32; 3]>,
    /// Cumulated lengths.
    cumulative: Vec<f64>,
}

/// A point on the border of a flat emitter.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BorderPoint {
    /// The ends of the edge, and the part of the way from the first to the second.
    pub(crate) ends: [u32; 2],
    pub(crate) along: f64,
    /// Points of the edge and a point inside.
    pub(crate) place: DVec3,
    pub(crate) edge: DVec3,
    pub(crate) inside: DVec3,
    /// The length of the whole border: 1/density.
    pub(crate) whole: f64,
}

/// A direction towards a light.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LightSample {
    pub(crate) id: LightId,
    pub(crate) sampled: Sampled,
    /// How far a shadow ray must be free, and which triangle it then reaches.
    pub(crate) distance: f64,
    pub(crate) triangle: Option<u32>,
    /// Whether the light is one direction or one point, with `density` the probability of its choice and
    /// nothing to warp.
    pub(crate) delta: bool,
}

impl Lights {
    pub(crate) fn new(scene: &Scene) -> Self {
        let mut lights = Self { of_shape: vec![None; scene.description.shapes.len()], ..Self::default() };
        let mut powers = vec![];
        for (s, shape) in scene.description.shapes.iter().enumerate() {
            let Some(radiance) = shape.radiance else { continue };
            let area = Area::new(scene, s);
            let whole = area.whole();
            if whole > 0.0 {
                lights.of_shape[s] = Some(lights.entries.len() as u32);
                lights.push(LightId::Shape(s as u32));
                powers.push(PI * whole * luminance(radiance));
                lights.areas.push(area);
            }
        }
        let (low, high) = scene.accelerator.bounds();
        let reach = if scene.triangles.is_empty() { 1.0 } else { 0.5 * (high - low).length() };
        for (i, light) in scene.description.lights.iter().enumerate() {
            lights.push(LightId::Light(i as u32));
            powers.push(match light {
                Light::Directional { irradiance, .. } => PI * reach * reach * luminance(*irradiance),
                Light::Point { intensity, .. } => 4.0 * PI * luminance(*intensity),
            });
        }
        if let Some(Environment::Map { texture, scale, .. }) = &scene.description.environment {
            let sampler = MapSampler::new(scene, *texture);
            lights.push(LightId::Environment);
            powers.push(4.0 * PI * PI * reach * reach * scale * sampler.mean);
            lights.map = Some(sampler);
        }
        lights.share(&powers);
        lights
    }

    fn push(&mut self, id: LightId) {
        self.entries.push(Entry { id, probability: 0.0 });
    }

    /// Half by power, half evenly: a weak light may be all that a place sees.
    fn share(&mut self, powers: &[f64]) {
        let (sum, n) = (powers.iter().sum::<f64>(), powers.len() as f64);
        for (entry, power) in self.entries.iter_mut().zip(powers) {
            let by_power = if sum > 0.0 { power / sum } else { 1.0 / n };
            entry.probability = 0.5 * by_power + 0.5 / n;
        }
    }

    fn area(&self, shape: u32) -> Option<&Area> {
        self.areas.iter().find(|a| a.shape == shape)
    }

    /// A direction from x towards some light; `None` if there is no light, or it shows x its back.
    pub(crate) fn sample(&self, scene: &Scene, x: DVec3, [choice, a, b]: [f64; 3]) -> Option<LightSample> {
        let mut rest = choice;
        let last = self.entries.len().checked_sub(1)?;
        let mut chosen = last;
        for (i, entry) in self.entries.iter().enumerate() {
            if rest < entry.probability || i == last {
                chosen = i;
                break;
            }
            rest -= entry.probability;
        }
        let Entry { id, probability } = self.entries[chosen];
        // What is left of the choice is uniform again.
        let again = (rest / probability).clamp(0.0, 1.0 - f64::EPSILON);
        let towards = |direction, density: f64, distance, delta| LightSample {
            id,
            sampled: Sampled { direction, density: density * probability },
            distance,
            triangle: None,
            delta,
        };
        match id {
            LightId::Shape(shape) => {
                let area = self.area(shape)?;
                let y = area.sample(scene, [again, a, b]);
                let way = y.point - x;
                let squared = way.length_squared();
                let distance = squared.sqrt();
                let direction = way / distance;
                let cosine = -direction.dot(y.normal);
                if cosine.is_nan() || cosine <= 0.0 {
                    return None;
                }
                let density = squared / (cosine * area.whole());
                let towards = LightSample {
                    triangle: Some(y.triangle),
                    ..towards(direction, density, distance, false)
                };
                Some(towards).filter(|_| density.is_finite())
            }
            LightId::Light(light) => match &scene.description.lights[light as usize] {
                Light::Point { position, .. } => {
                    let way = *position - x;
                    let direction = way.try_normalize()?;
                    Some(towards(direction, 1.0, way.length(), true))
                }
                Light::Directional { direction, kappa, .. } if kappa.is_infinite() => {
                    Some(towards(-*direction, 1.0, f64::INFINITY, true))
                }
                Light::Directional { direction, kappa, .. } => {
                    let (way, density) = von_mises_fisher(-*direction, *kappa, [a, b]);
                    Some(towards(way, density, f64::INFINITY, false))
                }
            },
            LightId::Environment => {
                let Some(Environment::Map { to_world, .. }) = &scene.description.environment else {
                    return None;
                };
                let (way, density) = self.map.as_ref()?.sample([again, a, b]);
                Some(towards(*to_world * way, density, f64::INFINITY, false))
            }
        }
    }

    /// The density of [`sample`](Self::sample) for a direction from x that reaches a triangle of an emitting
    /// shape at the given distance.
    pub(crate) fn density_of_triangle(
        &self,
        scene: &Scene,
        shape: u32,
        triangle: u32,
        direction: DVec3,
        distance: f64,
    ) -> f64 {
        let Some(entry) = self.of_shape[shape as usize] else { return 0.0 };
        let Some(area) = self.area(shape) else { return 0.0 };
        let cosine = -direction.dot(face_normal(scene, triangle));
        self.entries[entry as usize].probability * distance * distance / (cosine.abs() * area.whole())
    }

    /// The densities of [`sample`](Self::sample) for a direction that leaves the scene, by the light they
    /// belong to.
    pub(crate) fn density_of_escape(&self, scene: &Scene, id: LightId, direction: DVec3) -> f64 {
        let Some(entry) = self.entries.iter().find(|e| e.id == id) else { return 0.0 };
        entry.probability
            * match id {
                LightId::Shape(_) => 0.0,
                LightId::Light(light) => match &scene.description.lights[light as usize] {
                    Light::Directional { direction: along, kappa, .. } if kappa.is_finite() => {
                        lobe(-*along, *kappa, direction)
                    }
                    _ => 0.0,
                },
                LightId::Environment => match (&scene.description.environment, &self.map) {
                    (Some(Environment::Map { to_world, .. }), Some(map)) => {
                        map.density(to_world.transpose() * direction)
                    }
                    _ => 0.0,
                },
            }
    }

    /// What hides an emitter: if it is flat, what lies before its plane, else everything.
    pub(crate) fn domain(&self, shape: u32) -> VisibilityDomain {
        match self.area(shape).and_then(|a| a.border.as_ref()) {
            Some(border) => {
                VisibilityDomain::BeforePlane { normal: border.normal, offset: border.offset, shape }
            }
            None => VisibilityDomain::Radiance,
        }
    }

    /// A point on the border of a flat emitter, uniform in length; nothing for others.
    pub(crate) fn border_point(&self, scene: &Scene, shape: u32, xi: f64) -> Option<BorderPoint> {
        self.area(shape)?.border.as_ref()?.point(scene, xi)
    }

    /// The probability with which next-event estimation chooses a light.
    pub(crate) fn probability(&self, id: LightId) -> f64 {
        self.entries.iter().find(|e| e.id == id).map_or(0.0, |e| e.probability)
    }

    /// Spheres around all lights; `None` if some are infinitely far away.
    pub(crate) fn spheres(&self) -> Option<Vec<(DVec3, f64)>> {
        let near = |e: &Entry| matches!(e.id, LightId::Shape(_));
        self.entries.iter().all(near).then(|| self.areas.iter().map(|a| (a.centre, a.radius)).collect())
    }

    /// The half angle of the cone in which a shape is seen from x; π from within its bounding sphere.
    pub(crate) fn half_angle(&self, shape: u32, x: DVec3) -> f64 {
        let Some(area) = self.area(shape) else { return PI };
        let distance = area.centre.distance(x);
        if distance <= area.radius { PI } else { (area.radius / distance).asin() }
    }
}

/// The front of a triangle at one of its points.
struct Spot {
    triangle: u32,
    point: DVec3,
    normal: DVec3,
}

impl Area {
    fn new(scene: &Scene, shape: usize) -> Self {
        let [first, end] = [scene.first_triangle[shape], scene.first_triangle[shape + 1]];
        let mut sum = 0.0;
        let mut cumulative = vec![];
        let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for triangle in &scene.triangles[first as usize..end as usize] {
            let [a, b, c] = triangle.positions.map(|i| scene.positions[i as usize]);
            sum += 0.5 * (b - a).cross(c - a).length();
            cumulative.push(sum);
            for p in [a, b, c] {
                (low, high) = (low.min(p), high.max(p));
            }
        }
        Self {
            shape: shape as u32,
            first_triangle: first,
            cumulative,
            centre: 0.5 * (low + high),
            radius: 0.5 * (high - low).length(),
            border: Border::new(scene, first as usize..end as usize),
        }
    }

    fn whole(&self) -> f64 {
        self.cumulative.last().copied().unwrap_or(0.0)
    }

    /// A point, uniform in area.
    fn sample(&self, scene: &Scene, [choice, a, b]: [f64; 3]) -> Spot {
        let target = choice * self.whole();
        let i = self.cumulative.partition_point(|&c| c <= target).min(self.cumulative.len() - 1);
        let triangle = self.first_triangle + i as u32;
        let [p, q, r] = scene.triangles[triangle as usize].positions.map(|i| scene.positions[i as usize]);
        let root = a.sqrt();
        Spot {
            triangle,
            point: p + (q - p) * (root * (1.0 - b)) + (r - p) * (root * b),
            normal: face_normal(scene, triangle),
        }
    }
}

impl Border {
    /// Of triangles that all lie in one plane, face the same way, and do not overlap in more than edges.
    fn new(scene: &Scene, triangles: std::ops::Range<usize>) -> Option<Self> {
        let first = triangles.start as u32;
        let normal = face_normal(scene, first);
        let corner = scene.positions[scene.triangles[triangles.start].positions[0] as usize];
        let offset = normal.dot(corner);
        let mut sides = std::collections::BTreeMap::<[u32; 2], Vec<[u32; 3]>>::new();
        for t in triangles {
            let corners = scene.triangles[t].positions;
            let height = |i: u32| {
                let p = scene.positions[i as usize];
                (normal.dot(p) - offset).abs() > FLAT * (p - corner).length().max(corner.length())
            };
            if corners.into_iter().any(height) || (face_normal(scene, t as u32) - normal).length() > FLAT {
                return None;
            }
            for k in 0..3 {
                let [a, b, c] = [corners[k], corners[(k + 1) % 3], corners[(k + 2) % 3]];
                sides.entry([a.min(b), a.max(b)]).or_default().push([a, b, c]);
            }
        }
        let (mut edges, mut cumulative, mut sum) = (vec![], vec![], 0.0);
        for side in sides.into_values() {
            match side.as_slice() {
                &[[a, b, c]] => {
                    sum += scene.positions[a as usize].distance(scene.positions[b as usize]);
                    edges.push([a, b, c]);
                    cumulative.push(sum);
                }
                [_, _] => {}
                _ => return None,
            }
        }
        Some(Self { normal, offset, edges, cumulative })
    }

    fn point(&self, scene: &Scene, xi: f64) -> Option<BorderPoint> {
        let whole = *self.cumulative.last()?;
        let target = xi * whole;
        let i = self.cumulative.partition_point(|&c| c <= target).min(self.edges.len() - 1);
        let [a, b, c] = self.edges[i];
        let [p, q, inside] = [a, b, c].map(|k| scene.positions[k as usize]);
        let along = 1.0 - (self.cumulative[i] - target) / p.distance(q);
        let edge = (q - p).try_normalize()?;
        Some(BorderPoint { ends: [a, b], along, place: p + along * (q - p), edge, inside, whole })
    }
}

/// How far, relatively, corners of a flat emitter may be from its plane.
const FLAT: f64 = 1e-12;

fn face_normal(scene: &Scene, triangle: u32) -> DVec3 {
    let [a, b, c] = scene.triangles[triangle as usize].positions.map(|i| scene.positions[i as usize]);
    (b - a).cross(c - a).normalize_or_zero()
}

/// κ e^{−κ(1 − ω·ω₀)}/(2π(1 − e^{−2κ})).
pub(crate) fn lobe(axis: DVec3, kappa: f64, direction: DVec3) -> f64 {
    let versine = 0.5 * (direction - axis).length_squared();
    kappa * (-kappa * versine).exp() / (-TAU * (-2.0 * kappa).exp_m1())
}

fn von_mises_fisher(axis: DVec3, kappa: f64, [a, b]: [f64; 2]) -> (DVec3, f64) {
    let versine = (-(a * (-2.0 * kappa).exp_m1()).ln_1p() / kappa).min(2.0);
    let (s, t) = axis.any_orthonormal_pair();
    let (sin, cos) = (TAU * b).sin_cos();
    let direction = axis - versine * axis + (versine * (2.0 - versine)).sqrt() * (cos * s + sin * t);
    (direction, lobe(axis, kappa, direction))
}

/// Rec. 709.
pub(crate) fn luminance(c: DVec3) -> f64 {
    c.dot(DVec3::new(0.2126, 0.7152, 0.0722))
}

/// Directions with a density proportional to the luminance of the brightest of the texels that a bilinear
/// lookup there may mix, constant on cells between texel borders.
#[derive(Clone, Debug)]
struct MapSampler {
    width: usize,
    height: usize,
    /// Cumulated over rows, and in each row over columns.
    rows: Vec<f64>,
    columns: Vec<f64>,
    /// The mean luminance over the sphere.
    mean: f64,
}

impl MapSampler {
    fn new(scene: &Scene, texture: usize) -> Self {
        let texture = &scene.description.textures[texture];
        let (width, height) = (texture.width, texture.height);
        let texel = |i: usize, j: usize| luminance(texture.texels[j * width + i]).max(0.0);
        let mut mean = 0.0;
        let (mut rows, mut columns) = (vec![], vec![]);
        let mut sum = 0.0;
        for j in 0..height {
            let (top, bottom) = (j.saturating_sub(1), (j + 1).min(height - 1));
            // Solid angle of a row's cells: the difference of cosines.
            let edge = |j: usize| (PI * j as f64 / height as f64).cos();
            let cell = TAU / width as f64 * (edge(j) - edge(j + 1));
            let mut row = 0.0;
            for i in 0..width {
                let around = [i + width - 1, i, i + 1].map(|i| i % width);
                let brightest =
                    around.iter().flat_map(|&i| [top, j, bottom].map(|j| texel(i, j))).fold(0.0, f64::max);
                mean += cell * texel(i, j) / (4.0 * PI);
                row += cell * brightest;
                columns.push(row);
            }
            sum += row;
            rows.push(sum);
        }
        if sum <= 0.0 {
            // Black: any density will do.
            rows = (1..=height).map(|j| j as f64).collect();
            columns = (0..height).flat_map(|_| (1..=width).map(|i| i as f64 / width as f64)).collect();
        }
        Self { width, height, rows, columns, mean }
    }

    fn whole(&self) -> f64 {
        self.rows[self.height - 1]
    }

    fn mass(cumulative: &[f64], i: usize) -> f64 {
        cumulative[i] - if i > 0 { cumulative[i - 1] } else { 0.0 }
    }

    fn density_of_cell(&self, i: usize, j: usize) -> f64 {
        let row = &self.columns[j * self.width..(j + 1) * self.width];
        let edge = |j: usize| (PI * j as f64 / self.height as f64).cos();
        let cell = TAU / self.width as f64 * (edge(j) - edge(j + 1));
        Self::mass(row, i) / (self.whole() * cell)
    }

    fn sample(&self, [choice, a, b]: [f64; 3]) -> (DVec3, f64) {
        let j = self.rows.partition_point(|&c| c <= choice * self.whole()).min(self.height - 1);
        let row = &self.columns[j * self.width..(j + 1) * self.width];
        let target = a * row[self.width - 1];
        let i = row.partition_point(|&c| c <= target).min(self.width - 1);
        let within = ((target - if i > 0 { row[i - 1] } else { 0.0 }) / Self::mass(row, i)).clamp(0.0, 1.0);
        let edge = |j: usize| (PI * j as f64 / self.height as f64).cos();
        let y = edge(j) + b * (edge(j + 1) - edge(j));
        let around = TAU * (i as f64 + within) / self.width as f64;
        let r = (1.0 - y * y).max(0.0).sqrt();
        (DVec3::new(r * around.sin(), y, -r * around.cos()), self.density_of_cell(i, j))
    }

    fn density(&self, direction: DVec3) -> f64 {
        let around = direction.x.atan2(-direction.z).rem_euclid(TAU);
        let i = ((around / TAU * self.width as f64) as usize).min(self.width - 1);
        let j =
            ((direction.y.clamp(-1.0, 1.0).acos() / PI * self.height as f64) as usize).min(self.height - 1);
        self.density_of_cell(i, j)
    }
}
