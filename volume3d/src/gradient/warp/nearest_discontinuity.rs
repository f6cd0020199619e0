//! Angle from a hit to the nearest discontinuity, from which boundary functions of auxiliary rays are
//! computed.

use flatland::sdf::Sdf as _;
use flatland::sdf::fields::SilhouetteDistance;
use glam::DVec3;

use crate::path::VisibilityDomain;
use crate::scene::{Beyond, Hit, Scene, Span, Surface};

/// The nearest discontinuity to a hit.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Nearest {
    /// Lower estimate of the angle to it.
    pub(crate) angle: f64,
    /// Index of the crossing and position along it, if the discontinuity is one.
    pub(crate) crossing: Option<(u32, f64)>,
}

/// Lower estimate of the angle, seen from `origin`, between a hit and the nearest discontinuity; zero at
/// every discontinuity that bounds the hit surface.
///
/// For edges of the hit triangle it is the angle to their great circles. The silhouette of a smooth surface
/// beyond the triangle is estimated from the cosine c = |n·ω| as that of a sphere with the surface's smallest
/// radius of curvature r: r c²/(2 t); for an implicit surface r is its radius of curvature along the ray.
/// Crossings of meshes are tested one by one.
pub(crate) fn nearest_discontinuity(
    scene: &Scene,
    hit: &Hit,
    origin: DVec3,
    direction: DVec3,
    domain: VisibilityDomain,
) -> Nearest {
    let triangle = match hit.surface {
        Surface::Triangle(triangle) => triangle,
        Surface::Implicit(implicit) => {
            let shape = &scene.implicits()[implicit as usize];
            let there = shape.second_order(origin + hit.distance * direction);
            let hessian = || there.hessian * direction;
            let distance = SilhouetteDistance::Curvature;
            let angle = distance.of(hit.distance, direction, there.jet.gradient, hessian);
            return Nearest { angle, crossing: None };
        }
    };
    let p = scene.corners(triangle).map(|p| p - origin);
    let normal = (p[1] - p[0]).cross(p[2] - p[0]);
    let facing = normal.dot(p[0]);
    let radius = scene.radius(triangle);
    let mut nearest = f64::INFINITY;
    if radius.is_finite() {
        let cosine_squared = normal.dot(direction).powi(2) / normal.length_squared();
        nearest = 0.5 * radius * cosine_squared / hit.distance;
    }
    for (k, beyond) in scene.adjacency.beyond(triangle).into_iter().enumerate() {
        let counts = match beyond {
            Beyond::Border => true,
            Beyond::Crease(_) if domain == VisibilityDomain::Radiance => true,
            Beyond::Crease(other) | Beyond::Smooth(other) => facing * facing_of(scene, other, origin) <= 0.0,
        };
        if counts {
            let plane = p[k].cross(p[(k + 1) % 3]);
            nearest = nearest.min((plane.dot(direction) / plane.length()).abs());
        }
    }
    let mut found = Nearest { angle: nearest, crossing: None };
    for &index in scene.crossings().of(triangle) {
        let crossing = scene.crossings().get(index);
        if domain.has(scene, Span::Crossing(index)) {
            let (angle, along) = angle_to(crossing.places.map(|p| p - origin), direction, found.angle);
            if angle < found.angle {
                found = Nearest { angle, crossing: Some((index, along)) };
            }
        }
    }
    found
}

/// Angle (lower estimate by sine or chord) between a direction and a segment seen from the origin, and the
/// nearest point's position along the segment; or any value of at least `limit`.
fn angle_to([p, q]: [DVec3; 2], direction: DVec3, limit: f64) -> (f64, f64) {
    let pole = p.cross(q).normalize_or_zero();
    let height = pole.dot(direction);
    if height.abs() >= limit {
        return (f64::INFINITY, 0.0);
    }
    let [after, before] = [pole.dot(p.cross(direction)), pole.dot(direction.cross(q))];
    if after > 0.0 && before > 0.0 {
        return (height.abs(), after / (after + before));
    }
    let [a, b] = [p, q].map(|end| end.normalize_or_zero().distance(direction));
    if a < b { (a, 0.0) } else { (b, 1.0) }
}

/// Signed side of a point: positive behind the triangle, negative in front.
fn facing_of(scene: &Scene, triangle: u32, origin: DVec3) -> f64 {
    let [a, b, c] = scene.corners(triangle);
    (b - a).cross(c - a).dot(a - origin)
}
