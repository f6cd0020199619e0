//! Markers of an auxiliary ray: the points of its chain, and the curves on which normals turn away.

use flatland::calculus::{Dual, Number, Vec3};
use glam::{DMat2, DVec2, DVec3};

use super::along::Pair;
use super::walk::{Course, Hits, Point, Points};
use crate::path::Calculus;
use crate::scene::{Beyond, Hit, Light, Scene, Span, Surface};

/// A point or curve with a velocity over u, and a weight.
#[derive(Clone, Copy, Debug)]
pub(super) struct Marker {
    place: Place,
    kind: Kind,
    /// Distance over u to the end of its own surface, or to the curve, to first order.
    pub(super) distance: f64,
    /// How much rays converge: the least width of a beam there relative to one that was never focused. V is
    /// inverse to it.
    pub(super) convergence: f64,
}

/// The point of the ray that a marker belongs to.
#[derive(Clone, Copy, Debug)]
enum Place {
    Chain(usize),
    Occluder,
}

#[derive(Clone, Copy, Debug)]
enum Kind {
    /// A material point, or a point of a crossing. `inverse` maps a displacement across the ray, along two
    /// axes, to u.
    Material { axes: [DVec3; 2], inverse: DMat2, crossing: Option<(u32, f64)> },
    /// The curve G = 0 on which a normal turns away from a ray, with ∇G/|∇G|² over u.
    Turn { of: Turn, gradient: DVec2 },
}

/// A product of a normal and a ray whose sign matters.
#[derive(Clone, Copy, Debug)]
enum Turn {
    /// The shading normal, and the ray that arrives.
    Arriving,
    /// The geometric normal, and the ray that leaves.
    Leaving,
}

/// The place of a viewer, who may be infinitely far.
#[derive(Clone, Copy, Debug)]
enum Viewpoint {
    At(DVec3),
    Towards(DVec3),
}

impl Viewpoint {
    fn of_light(light: &Light) -> Self {
        match light {
            Light::Directional { direction, .. } => Self::Towards(-*direction),
            Light::Point { position, .. }
            | Light::Spot { position, .. }
            | Light::Projector { position, .. } => Self::At(*position),
        }
    }

    /// Positive in front of a triangle.
    fn side(self, scene: &Scene, triangle: u32) -> f64 {
        let [a, b, c] = scene.corners(triangle);
        let normal = (b - a).cross(c - a);
        match self {
            Self::At(place) => normal.dot(place - a),
            Self::Towards(direction) => normal.dot(direction),
        }
    }
}

/// All markers of a ray, except its escape; `reach` is the distance from which B = 1.
pub(super) fn markers(
    course: &Course<'_>,
    hits: &Hits,
    points: &Points<Pair>,
    reach: f64,
    found: &mut impl FnMut(Marker),
) {
    let light = course.through.light.map(|light| Viewpoint::of_light(&course.scene.lights()[light]));
    let mut way = 0.0;
    let start = points.chain.first().map(|first| spread(first.direction));
    let last = points.chain.len().checked_sub(1);
    for (k, (point, hit)) in points.chain.iter().zip(&hits.points).enumerate() {
        way += hit.distance;
        let seen = Seen { scene: course.scene, place: Place::Chain(k), point, hit, reach };
        // Its own shadow ends at a silhouette, too.
        let light = light.filter(|_| Some(k) == last && k == course.through.chain.len());
        let viewer = Viewpoint::At(point.origin.value());
        seen.material(&[(viewer, true)], light, way * start.unwrap_or(1.0), found);
        seen.turns(found);
    }
    if let (Some(point), Some(hit), Some(light)) = (&points.occluder, &hits.occluder, light) {
        let seen = Seen { scene: course.scene, place: Place::Occluder, point, hit, reach };
        // Where light grazes the surface, shadows move fast over it, and their weight is reduced as in a
        // focus.
        let narrower = match light {
            Viewpoint::At(light) => {
                let [z, x] = [point.at.position, point.origin].map(|p| p.value().distance(light));
                z / x
            }
            Viewpoint::Towards(_) => 1.0,
        };
        seen.material(&[(light, false)], None, narrower * way * start.unwrap_or(1.0), found);
    }
}

/// A point of a ray.
struct Seen<'a> {
    scene: &'a Scene,
    place: Place,
    point: &'a Point<Pair>,
    hit: &'a Hit,
    reach: f64,
}

impl Seen<'_> {
    /// The material point, and crossings near it. Creases count for the viewers marked so; silhouettes for
    /// them and the light.
    fn material(
        &self,
        viewers: &[(Viewpoint, bool)],
        light: Option<Viewpoint>,
        unfocused: f64,
        found: &mut impl FnMut(Marker),
    ) {
        let Self { scene, place, point, hit, .. } = *self;
        let x = point.at.position;
        let direction = point.direction.value();
        let (s, t) = direction.any_orthonormal_pair();
        let across = |axis: DVec3| {
            let d = Vec3::constant(axis).dot(x);
            DVec2::from(d.tangent)
        };
        let (first, second) = (across(s), across(t));
        // Rows are the axes, columns the coordinates of u.
        let matrix = DMat2::from_cols(DVec2::new(first.x, second.x), DVec2::new(first.y, second.y));
        let determinant = matrix.determinant();
        if determinant == 0.0 || !determinant.is_finite() {
            return;
        }
        let inverse = matrix.inverse();
        let convergence = (least_singular(matrix) / unfocused).min(1.0);
        let axes = [s, t];
        let mut distance = self.to_silhouette();
        if let (Surface::Triangle(triangle), Some(weights)) = (hit.surface, point.at.coordinates()) {
            for (k, beyond) in scene.adjacency.beyond(triangle).into_iter().enumerate() {
                let turns = |other: u32, viewer: Viewpoint| {
                    viewer.side(scene, triangle) * viewer.side(scene, other) <= 0.0
                };
                let counts = match beyond {
                    Beyond::Border => true,
                    Beyond::Crease(other) => {
                        viewers.iter().any(|&(v, creases)| creases || turns(other, v))
                            || light.is_some_and(|light| turns(other, light))
                    }
                    Beyond::Smooth(other) => {
                        viewers.iter().any(|&(v, _)| turns(other, v))
                            || light.is_some_and(|light| turns(other, light))
                    }
                };
                if counts {
                    distance = distance.min(over_u(weights[(k + 2) % 3]));
                }
            }
            for &index in scene.crossings().of(triangle) {
                let [p, q] = Span::Crossing(index).ends(scene);
                let (from, along) = (x.value() - p, q - p);
                let rest = (from.dot(along) / along.length_squared()).clamp(0.0, 1.0);
                let offset = from - rest * along;
                let aside = (inverse * DVec2::new(s.dot(offset), t.dot(offset))).length();
                distance = distance.min(aside);
                if aside < self.reach {
                    let kind = Kind::Material { axes, inverse, crossing: Some((index, rest)) };
                    found(Marker { place, kind, distance: aside, convergence });
                }
            }
        }
        found(Marker {
            place,
            kind: Kind::Material { axes, inverse, crossing: None },
            distance,
            convergence,
        });
    }

    /// Distance to the silhouette of a smooth surface, to first order: with G = n·ω ~ √s at a distance s from
    /// it, G/|∇G| = 2s.
    fn to_silhouette(&self) -> f64 {
        self.point
            .shading_normal
            .map_or(f64::INFINITY, |normal| 0.5 * over_u(normal.dot(self.point.direction)))
    }

    /// Curves on which an interpolated normal turns away from the ray that arrives, or the ray that leaves
    /// turns below the face.
    fn turns(&self, found: &mut impl FnMut(Marker)) {
        let mut add = |of: Turn, product: Pair| {
            let (distance, gradient) = (over_u(product), DVec2::from(product.tangent));
            if distance < self.reach {
                let gradient = gradient / gradient.length_squared();
                let kind = Kind::Turn { of, gradient };
                found(Marker { place: self.place, kind, distance, convergence: 1.0 });
            }
        };
        let Surface::Triangle(_) = self.hit.surface else { return };
        let Some(normal) = self.point.shading_normal else { return };
        add(Turn::Arriving, normal.dot(self.point.direction));
        if let (Some(onwards), Some(normal)) = (self.point.onwards, self.point.at.face_normal()) {
            add(Turn::Leaving, normal.dot(onwards));
        }
    }
}

impl Marker {
    /// V of the marker over u, as numbers of value 0, from the points of its ray over numbers.
    pub(super) fn velocity<C: Calculus>(
        &self,
        scene: &Scene,
        calculus: &C,
        hits: &Hits,
        points: &Points<C::Number>,
    ) -> Option<[C::Number; 2]> {
        let (point, hit) = match self.place {
            Place::Chain(k) => (points.chain.get(k)?, hits.points.get(k)?),
            Place::Occluder => (points.occluder.as_ref()?, hits.occluder.as_ref()?),
        };
        let [x, y] = match self.kind {
            Kind::Material { axes, inverse, crossing } => {
                let still = match crossing {
                    Some((index, along)) => {
                        Span::Crossing(index).point(scene, along, |i| calculus.position(i))
                    }
                    None => material(scene, calculus, hit, point),
                };
                let moved = |axis: DVec3| {
                    let axis = Vec3::constant(axis);
                    (axis.dot(point.at.position) - axis.dot(still)).chain(0.0, -1.0)
                };
                let [a, b] = axes.map(moved);
                let [p, q] = [inverse.x_axis, inverse.y_axis];
                [a * p.x + b * q.x, a * p.y + b * q.y]
            }
            Kind::Turn { of, gradient } => {
                let product = match of {
                    Turn::Arriving => point.shading_normal?.dot(point.direction),
                    Turn::Leaving => point.at.face_normal()?.dot(point.onwards?),
                };
                let rate = product.chain(0.0, -1.0);
                [rate * gradient.x, rate * gradient.y]
            }
        };
        Some([x, y])
    }
}

/// The point that stays on its surface where it is: of a triangle, a material point; of an implicit surface,
/// the point that follows the level set along its normal.
fn material<C: Calculus>(
    scene: &Scene,
    calculus: &C,
    hit: &Hit,
    point: &Point<C::Number>,
) -> Vec3<C::Number> {
    match hit.surface {
        Surface::Triangle(triangle) => {
            let corners = scene.triangles[triangle as usize].positions.map(|i| calculus.position(i));
            let weights = hit.coordinates.map(C::Number::constant);
            corners[0] * weights[0] + corners[1] * weights[1] + corners[2] * weights[2]
        }
        Surface::Implicit(implicit) => {
            let x = point.at.position.value();
            let normal = scene.normal_of(hit.surface, x);
            calculus.level_set(implicit, Vec3::constant(x), normal).0
        }
    }
}

/// Distance over u to the zero of a number, to first order.
fn over_u(number: Pair) -> f64 {
    number.value.abs() / DVec2::from(number.tangent).length()
}

/// Least width of a beam of rays at `point`, across `direction`, per unit of u.
fn least_width(point: Vec3<Pair>, direction: Vec3<Pair>) -> f64 {
    let (s, t) = direction.value().any_orthonormal_pair();
    let [a, b] = [s, t].map(|axis| DVec2::from(Vec3::constant(axis).dot(point).tangent));
    least_singular(DMat2::from_cols(a, b))
}

/// Least rate of a direction over u.
fn spread(direction: Vec3<Dual<2>>) -> f64 {
    least_width(direction, direction)
}

/// Least singular value.
fn least_singular(matrix: DMat2) -> f64 {
    let [a, b] = [matrix.x_axis, matrix.y_axis];
    let (sum, determinant) = (a.length_squared() + b.length_squared(), matrix.determinant());
    let largest = 0.5 * (sum + (sum * sum - 4.0 * determinant * determinant).max(0.0).sqrt());
    determinant.abs() / largest.sqrt()
}
