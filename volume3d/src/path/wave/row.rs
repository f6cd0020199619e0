//! Eight path vertices in SIMD lanes.
//!
//! All numbers have the bits of the scalar [`SurfacePoint`](crate::path::SurfacePoint) and
//! [`Shading`](crate::path::Shading): the same operations in the same order, vectorised by the compiler.

use std::f64::consts::FRAC_1_PI;

use glam::DVec3;

use crate::geometry::Sheaf;
use crate::lanes::{Lanes, Task, WIDTH};
use crate::path::bsdf::diffuse;

/// Rows of lanes in a wave.
pub(super) const ROWS: usize = Sheaf::MOST / WIDTH;

/// One number per lane.
pub(super) type Numbers = [f64; WIDTH];

/// One vector per lane, by coordinate.
#[derive(Clone, Copy, Debug)]
pub(super) struct Vectors(pub(super) [Numbers; 3]);

impl Vectors {
    pub(super) const ZERO: Self = Self([[0.0; WIDTH]; 3]);

    #[inline(always)]
    pub(super) fn at(&self, lane: usize) -> [f64; 3] {
        [self.0[0][lane], self.0[1][lane], self.0[2][lane]]
    }

    #[inline(always)]
    pub(super) fn set(&mut self, lane: usize, v: [f64; 3]) {
        (self.0[0][lane], self.0[1][lane], self.0[2][lane]) = (v[0], v[1], v[2]);
    }

    #[inline(always)]
    pub(super) fn of(&self, lane: usize) -> DVec3 {
        DVec3::from_array(self.at(lane))
    }
}

#[inline(always)]
fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[inline(always)]
fn difference(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

#[inline(always)]
fn scaled(a: [f64; 3], factor: f64) -> [f64; 3] {
    [a[0] * factor, a[1] * factor, a[2] * factor]
}

/// Bit mask of the lanes whose numbers pass a test.
#[inline(always)]
pub(super) fn lanes_where(numbers: &Numbers, test: impl Fn(f64) -> bool) -> u32 {
    numbers.iter().enumerate().fold(0, |mask, (lane, &x)| mask | u32::from(test(x)) << lane)
}

/// Hits of rays on triangles.
#[derive(Clone, Copy, Debug)]
pub(super) struct Arrival {
    /// A corner of each triangle, and its area vector.
    pub(super) corner: Vectors,
    pub(super) cross: Vectors,
    /// Unit normals of fronts.
    pub(super) own: Vectors,
    pub(super) reflectance: Vectors,
    /// Whether backs reflect too, as 1 or 0.
    pub(super) two_sided: Numbers,
}

impl Arrival {
    pub(super) const EMPTY: Self = Self {
        corner: Vectors::ZERO,
        cross: Vectors::ZERO,
        own: Vectors::ZERO,
        reflectance: Vectors::ZERO,
        two_sided: [0.0; WIDTH],
    };
}

/// Light samples of the lanes: points of emitting shapes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Lamps {
    pub(super) point: Vectors,
    pub(super) normal: Vectors,
    pub(super) radiance: Vectors,
    /// Probability of each point's shape, and its total area.
    pub(super) probability: Numbers,
    pub(super) area: Numbers,
}

impl Lamps {
    /// Placeholder: lights that are invisible from everywhere.
    pub(super) const NONE: Self = Self {
        point: Vectors::ZERO,
        normal: Vectors::ZERO,
        radiance: Vectors::ZERO,
        probability: [1.0; WIDTH],
        area: [1.0; WIDTH],
    };
}

/// Shading of eight vertices.
pub(super) struct Shade<'a> {
    pub(super) origin: &'a Vectors,
    pub(super) direction: &'a Vectors,
    pub(super) throughput: &'a Vectors,
    pub(super) arrival: &'a Arrival,
    pub(super) lamps: &'a Lamps,
    /// Sampled directions, about z.
    pub(super) local: &'a Vectors,
    pub(super) vertices: &'a mut Vertices,
}

/// Eight vertices. Undefined quantities have arbitrary values.
#[derive(Clone, Copy, Debug)]
pub(super) struct Vertices {
    pub(super) position: Vectors,
    /// Normals on the viewer's side.
    pub(super) normal: Vectors,
    /// 1 if the vertex reflects, else 0; NaN if the position is not finite.
    pub(super) reflects: Numbers,
    /// Direction to the light, distance, 1 if it may be visible, and its reflected light if it is.
    pub(super) towards: Vectors,
    pub(super) distance: Numbers,
    pub(super) may_see: Numbers,
    pub(super) lit: Vectors,
    /// Sampled direction, its density, 1 if valid, and the throughput after it.
    pub(super) sampled: Vectors,
    pub(super) density: Numbers,
    pub(super) goes_on: Numbers,
    pub(super) throughput: Vectors,
}

impl Vertices {
    pub(super) const EMPTY: Self = Self {
        position: Vectors::ZERO,
        normal: Vectors::ZERO,
        reflects: [0.0; WIDTH],
        towards: Vectors::ZERO,
        distance: [0.0; WIDTH],
        may_see: [0.0; WIDTH],
        lit: Vectors::ZERO,
        sampled: Vectors::ZERO,
        density: [0.0; WIDTH],
        goes_on: [0.0; WIDTH],
        throughput: Vectors::ZERO,
    };
}

impl Task for Shade<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(mut self, _: L) {
        self.meet();
        self.see_lamp();
        self.scatter();
    }
}

impl Shade<'_> {
    /// Computes positions, and normals on the viewer's side.
    #[inline(always)]
    fn meet(&mut self) {
        // Copies, so that the compiler can rule out aliasing.
        let (origins, directions) = (*self.origin, *self.direction);
        let Arrival { corner, cross, own, two_sided, .. } = *self.arrival;
        let (mut positions, mut normals) = (Vectors::ZERO, Vectors::ZERO);
        let mut reflects = [0.0; WIDTH];
        for lane in 0..WIDTH {
            let (origin, direction) = (origins.at(lane), directions.at(lane));
            let (cross, own) = (cross.at(lane), own.at(lane));
            let distance = dot(cross, difference(corner.at(lane), origin)) / dot(cross, direction);
            let way = scaled(direction, distance);
            let position = [origin[0] + way[0], origin[1] + way[1], origin[2] + way[2]];
            positions.set(lane, position);
            let viewer = [-direction[0], -direction[1], -direction[2]];
            let cosine = dot(own, viewer);
            let turned = [-own[0], -own[1], -own[2]];
            let behind = cosine < 0.0;
            let normal = [
                if behind { turned[0] } else { own[0] },
                if behind { turned[1] } else { own[1] },
                if behind { turned[2] } else { own[2] },
            ];
            normals.set(lane, normal);
            let dark = (cosine == 0.0) | (behind & (two_sided[lane] == 0.0));
            let finite = 0.0 * (position[0] + position[1] + position[2]);
            reflects[lane] = finite + if dark { 0.0 } else { 1.0 };
        }
        (self.vertices.position, self.vertices.normal) = (positions, normals);
        self.vertices.reflects = reflects;
    }

    /// Computes directions towards the light, and its reflected light.
    #[inline(always)]
    fn see_lamp(&mut self) {
        let Lamps { point: points, normal: fronts, radiance: radiances, probability, area } = *self.lamps;
        let (positions, normals) = (self.vertices.position, self.vertices.normal);
        let (reflectances, throughputs) = (self.arrival.reflectance, *self.throughput);
        let (mut ways, mut lit) = (Vectors::ZERO, Vectors::ZERO);
        let (mut distances, mut may_see) = ([0.0; WIDTH], [0.0; WIDTH]);
        for lane in 0..WIDTH {
            let normal = normals.at(lane);
            let way = difference(points.at(lane), positions.at(lane));
            let squared = dot(way, way);
            let distance = squared.sqrt();
            let towards = [way[0] / distance, way[1] / distance, way[2] / distance];
            let facing = -dot(towards, fronts.at(lane));
            let alone = squared / (facing * area[lane]);
            let cosine = dot(normal, towards);
            let density = alone * probability[lane];
            let weight = density / (density + diffuse::density(cosine)) / density;
            let sees = (facing > 0.0) & (alone < f64::INFINITY) & (cosine > 0.0);
            ways.set(lane, towards);
            distances[lane] = distance;
            may_see[lane] = if sees { 1.0 } else { 0.0 };
            let reflected = scaled(reflectances.at(lane), cosine * FRAC_1_PI);
            let reflected = scaled(reflected, weight);
            let (throughput, radiance) = (throughputs.at(lane), radiances.at(lane));
            let radiance = [
                throughput[0] * (reflected[0] * radiance[0]),
                throughput[1] * (reflected[1] * radiance[1]),
                throughput[2] * (reflected[2] * radiance[2]),
            ];
            lit.set(lane, radiance);
        }
        (self.vertices.towards, self.vertices.lit) = (ways, lit);
        (self.vertices.distance, self.vertices.may_see) = (distances, may_see);
    }

    /// Computes sampled directions, and the throughput after them.
    #[inline(always)]
    fn scatter(&mut self) {
        let (normals, locals) = (self.vertices.normal, *self.local);
        let (reflectances, throughputs) = (self.arrival.reflectance, *self.throughput);
        let (mut directions, mut behind) = (Vectors::ZERO, Vectors::ZERO);
        let (mut densities, mut goes_on) = ([0.0; WIDTH], [0.0; WIDTH]);
        for lane in 0..WIDTH {
            let ([x, y, z], local) = (normals.at(lane), locals.of(lane));
            // As in `DVec3::any_orthonormal_pair`.
            let sign = 1.0_f64.copysign(z);
            let a = -1.0 / (sign + z);
            let b = x * y * a;
            let first = [1.0 + sign * x * x * a, sign * b, -sign * x];
            let second = [b, sign + y * y * a, -y];
            let sampled = [
                local.x * first[0] + local.y * second[0] + local.z * x,
                local.x * first[1] + local.y * second[1] + local.z * y,
                local.x * first[2] + local.y * second[2] + local.z * z,
            ];
            let cosine = dot([x, y, z], sampled);
            let density = diffuse::density(cosine);
            directions.set(lane, sampled);
            densities[lane] = density;
            let good = (cosine > 0.0) & (density > 0.0) & (density < f64::INFINITY);
            goes_on[lane] = if good { 1.0 } else { 0.0 };
            let reflected = scaled(reflectances.at(lane), cosine * FRAC_1_PI);
            let reflected = scaled(reflected, 1.0 / density);
            let throughput = throughputs.at(lane);
            let throughput =
                [throughput[0] * reflected[0], throughput[1] * reflected[1], throughput[2] * reflected[2]];
            behind.set(lane, throughput);
        }
        (self.vertices.sampled, self.vertices.throughput) = (directions, behind);
        (self.vertices.density, self.vertices.goes_on) = (densities, goes_on);
    }
}
