//! Integrals over directions: pixels of a film, or the irradiance of a receiver.

use std::f64::consts::{PI, TAU};

use flatland::warp::Domain as _;
use glam::{DVec2, DVec3};
use volume3d::Sphere;

/// Pixels along a side of the film.
const SIDE: usize = 4;
/// Half the film's width at the distance 1.
pub(super) const HALF: f64 = 0.6;
/// Radius of a pixel's filter.
const REACH: f64 = 0.25;
/// The receiver's normal.
const FACING: DVec3 = DVec3::new(0.2, 0.1, 1.0);

/// Integrals ∫ h L dω with weights h that vanish continuously at the ends of their support.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Outputs {
    /// Smooth filters over a film at z = 1.
    Film,
    /// (n·ω)₊/π.
    Irradiance,
}

impl Outputs {
    pub(super) const ALL: [Self; 2] = [Self::Film, Self::Irradiance];

    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Film => "film",
            Self::Irradiance => "irradiance",
        }
    }

    /// h and ∇h of every integral that is not zero in a direction, with its number.
    pub(super) fn weights(self, omega: DVec3) -> Vec<(usize, f64, DVec3)> {
        match self {
            Self::Film => film(omega),
            Self::Irradiance => {
                let normal = FACING.normalize();
                let cosine = normal.dot(omega);
                let weight = (0, cosine / PI, Sphere::project(omega, normal) / PI);
                if cosine > 0.0 { vec![weight] } else { vec![] }
            }
        }
    }

    pub(super) fn count(self) -> usize {
        match self {
            Self::Film => SIDE * SIDE,
            Self::Irradiance => 1,
        }
    }

    /// A direction from two uniform numbers, and the reciprocal of its density.
    pub(super) fn draw(self, [a, b]: [f64; 2]) -> (DVec3, f64) {
        match self {
            Self::Film => {
                let half = HALF + REACH;
                let omega = DVec3::new((2.0 * a - 1.0) * half, (2.0 * b - 1.0) * half, 1.0).normalize();
                (omega, 4.0 * half * half * omega.z.powi(3))
            }
            Self::Irradiance => {
                let normal = FACING.normalize();
                let (s, t) = normal.any_orthonormal_pair();
                let (sin, cos) = (TAU * b).sin_cos();
                (normal * a + (s * cos + t * sin) * (1.0 - a * a).sqrt(), TAU)
            }
        }
    }
}

/// Filters (1 − x²/r²)²(1 − y²/r²)² over the area dA = dω/cos³ of the film.
fn film(omega: DVec3) -> Vec<(usize, f64, DVec3)> {
    let at = DVec2::new(omega.x, omega.y) / omega.z;
    let area = omega.z.powi(-3);
    let of_area = Sphere::project(omega, DVec3::Z) * (-3.0 / omega.z);
    let slide =
        [DVec3::X, DVec3::Y].map(|e| Sphere::project(omega, e - DVec3::Z * e.dot(omega) / omega.z) / omega.z);
    let centre = |i: usize| (i as f64 + 0.5) * (2.0 * HALF / SIDE as f64) - HALF;
    let along = |x: f64| (0..SIDE).map(move |i| (i, filter(x - centre(i)))).filter(|(_, (f, _))| *f > 0.0);
    let mut found = vec![];
    for (j, (b, db)) in along(at.y) {
        for (i, (a, da)) in along(at.x) {
            let h = a * b * area;
            found.push((j * SIDE + i, h, (slide[0] * (da * b) + slide[1] * (a * db)) * area + of_area * h));
        }
    }
    found
}

fn filter(x: f64) -> (f64, f64) {
    let inside = 1.0 - (x / REACH).powi(2);
    if inside <= 0.0 { (0.0, 0.0) } else { (inside * inside, -4.0 * inside * x / (REACH * REACH)) }
}
