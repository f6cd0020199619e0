//! Integrals over directions: pixels of a film, or the irradiance of a receiver.

use std::f64::consts::{PI, TAU};

use flatland::warp::Domain as _;
use glam::{DVec2, DVec3};
use volume3d::Sphere;

/// Pixels along a side of the film.
const SIDE: usize = 4;
/// Half the film's width at the distance 1.
const HALF: f64 = 0.6;
/// Reach of a pixel's filter.
const REACH: f64 = 0.25;

/// Integrals ∫ h L dω with weights h that vanish at the ends of their support.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Outputs {
    /// Pixels of a pinhole camera that looks along z: a filter over dA = dω/cos³.
    Film,
    /// h = (n·ω)₊/π.
    Irradiance(DVec3),
}

/// h and ∇_ω h.
pub(crate) type Weight = (f64, DVec3);

impl Outputs {
    pub(crate) fn count(self) -> usize {
        match self {
            Self::Film => SIDE * SIDE,
            Self::Irradiance(_) => 1,
        }
    }

    /// The weights of all integrals in a direction.
    pub(crate) fn weights(self, omega: DVec3) -> Vec<Weight> {
        match self {
            Self::Film => {
                let u = DVec2::new(omega.x, omega.y) / omega.z;
                let jacobian = omega.z.powi(-3);
                let tangent = |v: DVec3| Sphere::project(omega, v);
                let of_jacobian = tangent(DVec3::Z) * (-3.0 / omega.z);
                let of_u =
                    [DVec3::X, DVec3::Y].map(|e| tangent(e - DVec3::Z * (e.dot(omega) / omega.z)) / omega.z);
                let pixel = |p: usize| {
                    let at = DVec2::new((p % SIDE) as f64 + 0.5, (p / SIDE) as f64 + 0.5);
                    let offset = u - (at * (2.0 * HALF / SIDE as f64) - HALF);
                    let [(a, da), (b, db)] = [filter(offset.x), filter(offset.y)];
                    let h = a * b * jacobian;
                    (h, (of_u[0] * (da * b) + of_u[1] * (a * db)) * jacobian + of_jacobian * h)
                };
                (0..SIDE * SIDE).map(pixel).collect()
            }
            Self::Irradiance(normal) => {
                let cosine = normal.dot(omega);
                let inside = cosine > 0.0;
                vec![if inside {
                    (cosine / PI, Sphere::project(omega, normal) / PI)
                } else {
                    (0.0, DVec3::ZERO)
                }]
            }
        }
    }

    /// A direction, and the reciprocal of its density.
    pub(crate) fn draw(self, [a, b]: [f64; 2]) -> (DVec3, f64) {
        match self {
            Self::Film => {
                let half = HALF + REACH;
                let omega = DVec3::new((2.0 * a - 1.0) * half, (2.0 * b - 1.0) * half, 1.0).normalize();
                (omega, 4.0 * half * half * omega.z.powi(3))
            }
            Self::Irradiance(normal) => {
                let (s, t) = normal.any_orthonormal_pair();
                let (sin, cos) = (TAU * b).sin_cos();
                (normal * a + (s * cos + t * sin) * (1.0 - a * a).sqrt(), TAU)
            }
        }
    }
}

/// (1 − x²/r²)² and its derivative, which is continuous.
fn filter(x: f64) -> (f64, f64) {
    let inside = 1.0 - (x / REACH).powi(2);
    if inside <= 0.0 { (0.0, 0.0) } else { (inside * inside, -4.0 * inside * x / (REACH * REACH)) }
}
