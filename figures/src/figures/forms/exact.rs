//! Exact terms of both theorems, without sampling.

use flatland::plane::exact::{Arrangement, OracleField};
use flatland::plane::{Film, Filter, Scene};
use glam::DVec2;

use super::super::common::channel;
use super::scene::{Example, SIDE};

/// The channel shown: green.
pub(super) const SHOWN: usize = 1;
/// θ for central differences: small enough for their bias, large enough for rounding.
pub(super) const STEP: f64 = 1e-5;

/// Terms of one derivative, per pixel, in the channel shown.
pub(super) struct Terms {
    pub(super) interior: Vec<f64>,
    pub(super) edge: Vec<f64>,
    pub(super) area: Vec<f64>,
    /// The flux of f V through the pixel's own edge, if the filter is discontinuous there; it is part of
    /// `area`.
    pub(super) flux: Vec<f64>,
    pub(super) total: Vec<f64>,
}

/// All terms for one filter.
pub(super) fn terms(example: &Example, arrangement: &Arrangement<'_>, film: &Film) -> anyhow::Result<Terms> {
    let oracle = arrangement.oracle(&example.velocities);
    let interior = channel(&arrangement.interior(film, &example.velocities)?, SHOWN);
    let edge = channel(&arrangement.boundary(film, &example.velocities)?, SHOWN);
    let area = channel(&arrangement.divergence(film, &oracle), SHOWN);
    let flux = match film.filter() {
        Filter::Box => pixel_edge_flux(&example.scene, arrangement, &oracle),
        Filter::Tent | Filter::Gaussian => vec![0.0; area.len()],
    };
    let total = sum(&interior, &edge);
    Ok(Terms { interior, edge, area, flux, total })
}

/// (I(θ + ε) − I(θ − ε))/2ε, from exact images.
pub(super) fn central_difference(example: &Example, film: &Film) -> anyhow::Result<Vec<f64>> {
    let image = |theta: f64| -> anyhow::Result<Vec<f64>> {
        let scene = example.motion.displace(&example.scene, theta)?;
        Ok(channel(&Arrangement::new(&scene, film)?.primal(film), SHOWN))
    };
    let (after, before) = (image(STEP)?, image(-STEP)?);
    Ok(after.iter().zip(&before).map(|(a, b)| (a - b) / (2.0 * STEP)).collect())
}

pub(super) fn sum(a: &[f64], b: &[f64]) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| a + b).collect()
}

pub(super) fn difference(a: &[f64], b: &[f64]) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| a - b).collect()
}

/// ∮ f (V·n) dl over the edge of every pixel. Neighbours share a side, with opposite signs.
fn pixel_edge_flux(scene: &Scene, arrangement: &Arrangement<'_>, oracle: &OracleField<'_>) -> Vec<f64> {
    let faces: Vec<[DVec2; 3]> = arrangement.faces().map(|(corners, _)| corners).collect();
    let mut flux = vec![0.0; SIDE * SIDE];
    for line in 0..=SIDE {
        for along in 0..SIDE {
            let (l, a) = (line as f64, along as f64);
            let upright = side_flux(scene, oracle, &faces, DVec2::new(l, a), DVec2::Y, DVec2::X);
            let level = side_flux(scene, oracle, &faces, DVec2::new(a, l), DVec2::X, DVec2::Y);
            if line > 0 {
                flux[along * SIDE + line - 1] += upright;
                flux[(line - 1) * SIDE + along] += level;
            }
            if line < SIDE {
                flux[along * SIDE + line] -= upright;
                flux[line * SIDE + along] -= level;
            }
        }
    }
    flux
}

/// ∫ f (V·n) dl over a side of unit length. Between crossings with the triangulation f V is cubic, so
/// two Gauss–Legendre points are exact.
fn side_flux(
    scene: &Scene,
    oracle: &OracleField<'_>,
    faces: &[[DVec2; 3]],
    start: DVec2,
    along: DVec2,
    normal: DVec2,
) -> f64 {
    let mut stops: Vec<f64> = faces.iter().flat_map(|face| crossings(face, start, along)).collect();
    stops.extend([0.0, 1.0]);
    stops.sort_by(f64::total_cmp);
    let gauss = 0.5 / 3.0_f64.sqrt();
    stops
        .windows(2)
        .map(|piece| {
            let (middle, length) = (0.5 * (piece[0] + piece[1]), piece[1] - piece[0]);
            let value = |t: f64| {
                let u = start + t * along;
                scene.value(scene.hit(u).as_ref(), u)[SHOWN] * oracle.at(u).value.dot(normal)
            };
            0.5 * length * (value(middle - gauss * length) + value(middle + gauss * length))
        })
        .sum()
}

/// Crossings of a triangle's sides with a segment of unit length, as positions in (0, 1) on it.
fn crossings(face: &[DVec2; 3], start: DVec2, along: DVec2) -> impl Iterator<Item = f64> {
    let face = *face;
    (0..3).filter_map(move |k| {
        let (p, q) = (face[k] - start, face[(k + 1) % 3] - start);
        let (above, below) = (along.perp_dot(p), along.perp_dot(q));
        let t = (p + (q - p) * (above / (above - below))).dot(along);
        (above * below < 0.0 && t > 0.0 && t < 1.0).then_some(t)
    })
}
