//! Fields over a film, beside the difference images that they should reproduce.

use anyhow::Result;
use flatland::random::stream;
use flatland::sdf::fields::BangaruField;
use flatland::sdf::{Sdf, View};
use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::outputs::HALF;
use super::shapes::Subject;
use super::study::{Method, tracer, vicini};

/// Displacement of the shape to each side for the difference of two pictures.
const STEP: f64 = 0.01;
/// Rays a pixel along each axis.
const RAYS: usize = 4;
/// Number of estimates averaged for the field of auxiliary rays.
const REPEATS: u64 = 32;
/// Direction of the light.
const LIGHT: DVec3 = DVec3::new(-0.5, -0.6, -0.62);

/// Square pictures, row by row.
pub(super) struct Maps {
    pub(super) side: usize,
    pub(super) picture: Vec<f64>,
    /// The difference of pictures of a white shape over its displacement.
    pub(super) difference: Vec<f64>,
    /// V to the right, of each field.
    pub(super) fields: Vec<(&'static str, Vec<f64>)>,
}

impl Maps {
    pub(super) fn new(subject: &Subject, side: usize) -> Result<Self> {
        let around = subject.around(STEP)?;
        let covered = |omega| around.each_ref().map(|sdf| f64::from(u8::from(hit(&**sdf, omega).is_some())));
        let difference = over(side, RAYS, |omega| {
            let [before, after] = covered(omega);
            (after - before) / (2.0 * STEP)
        });
        let picture = over(side, RAYS, |omega| {
            let lit = |n: DVec3| 0.15 + 0.85 * n.dot(LIGHT.normalize()).max(0.0);
            hit(&*subject.sdf, omega).map_or(0.0, |normal| lit(normal.normalize()))
        });
        let to_the_right = |method: Method, repeats: u64| {
            over(side, 1, |omega| {
                let one =
                    |i| method.field(subject, tracer(), omega, &mut stream(i, &[])).map_or(0.0, |(v, _)| v.x);
                (0..repeats).map(one).sum::<f64>() / repeats as f64
            })
        };
        let fields = [
            (Method::Vicini(vicini()), 1),
            (Method::Bangaru(BangaruField::default()), 1),
            (Method::Auxiliary, REPEATS),
        ];
        let fields = fields.map(|(method, repeats)| (method.name(), to_the_right(method, repeats))).to_vec();
        Ok(Self { side, picture, difference, fields })
    }
}

/// ∇φ where a ray hits.
fn hit(sdf: &dyn Sdf<DVec3>, omega: DVec3) -> Option<DVec3> {
    let view = View { sdf, eye: DVec3::ZERO, start: 0.0, tracer: tracer() };
    view.trace(omega).hit().map(|hit| hit.jet.gradient)
}

/// The mean over the rays of each pixel.
fn over(side: usize, rays: usize, value: impl Fn(DVec3) -> f64 + Sync) -> Vec<f64> {
    let fine = side * rays;
    let at = |i: usize| HALF * (2.0 * (i as f64 + 0.5) / fine as f64 - 1.0);
    let pixel = |index: usize| {
        let corner = [index % side * rays, index / side * rays];
        let all = (0..rays * rays).map(|k| DVec2::new(at(corner[0] + k % rays), at(corner[1] + k / rays)));
        all.map(|u| value(u.extend(1.0).normalize())).sum::<f64>() / (rays * rays) as f64
    };
    (0..side * side).into_par_iter().map(pixel).collect()
}
