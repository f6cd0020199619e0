//! The mean over all markers of all auxiliary rays.

use flatland::calculus::{Number, Vec3};
use flatland::warp::{Bundle, ChainHit, Domain, Vector as _, Warp};

use super::along::{AlongRays, Pair};
use super::markers::markers;
use super::walk::Course;

use crate::path::Calculus;

/// Auxiliary directions of a field, and how they are weighed.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Kernel<'w> {
    pub(crate) warp: &'w Warp,
    pub(crate) kappa: f64,
}

/// A warp as numbers of value 0.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Combined<T, const N: usize> {
    pub(crate) value: [T; N],
    pub(crate) divergence: T,
}

impl<T: Copy, const N: usize> Combined<T, N> {
    /// With a function of each of its rates.
    pub(crate) fn map(self, f: impl Fn(T) -> T) -> Self {
        Self { value: self.value.map(&f), divergence: f(self.divergence) }
    }
}

/// A ray's start along u, and in moving numbers, with the two tangents of u.
type Start<T, V> = (Ray<Pair>, Ray<T>, [V; 2]);
type Ray<T> = (Vec3<T>, Vec3<T>);

/// The field at the bundle's point; `None` if nothing moves. Returned is also the number of rays.
pub(super) fn combine<C: Calculus, D: Domain, const N: usize>(
    calculus: &C,
    course: &Course<'_>,
    starts: impl Iterator<Item = Start<C::Number, D::Vector>>,
    (bundle, at): (&Bundle<D>, D::Vector),
    kernel: Kernel<'_>,
) -> (Option<Combined<C::Number, N>>, u64)
where
    D::Vector: Into<[f64; N]>,
{
    let scene = course.scene;
    let reach = kernel.warp.reach(kernel.kappa);
    let still = AlongRays { scene };
    let (mut hits, mut rays) = (vec![], 0);
    for (along, moving, tangents) in starts {
        let (found, points) = course.trace(&still, along);
        rays += (found.points.len() + 1) as u64;
        let moved = course.repeat(calculus, moving, &found);
        let mut of_ray = vec![];
        markers(course, &found, &points, reach, &mut |marker| {
            let velocity = marker.velocity(scene, calculus, &found, &moved);
            let hit = velocity.map(|velocity| (velocity, tangents));
            let (distance, convergence) = (marker.distance, marker.convergence);
            of_ray.push(ChainHit { hit, distance, convergence });
        });
        // The background rests. A point in the focus of all rays has no marker, and counts as background.
        if found.escapes || of_ray.is_empty() {
            of_ray.push(ChainHit { hit: None, distance: reach, convergence: 1.0 });
        }
        hits.push(of_ray);
    }
    let zero = C::Number::constant(0.0);
    let (mut value, mut divergence, mut moves) = ([zero; N], zero, false);
    let stencil = kernel.warp.chain_stencil(bundle, kernel.kappa, hits);
    for term in stencil.terms() {
        let Some((velocity, tangents)) = term.hit else { continue };
        for (rate, tangent) in velocity.into_iter().zip(tangents) {
            if rate.is_still() {
                continue;
            }
            moves = true;
            let weighted: [f64; N] = (D::project(at, tangent) * term.weight).into();
            for (sum, weight) in value.iter_mut().zip(weighted) {
                *sum = *sum + rate * weight;
            }
            divergence = divergence + rate * term.divergence.dot(tangent);
        }
    }
    (moves.then_some(Combined { value, divergence }), rays)
}
