//! One side of a segment, cut into panels on which radiance is a polynomial of the parameter s.

use crate::transport::World;
use crate::transport::exact::critical::{critical_points, graded_points};
use crate::transport::exact::quadrature::gauss_legendre;

/// Nodes of a panel, and the quadrature's points on the part of it that is seen.
pub(super) const NODES: usize = 8;
/// The panels' length towards the ends of a segment shrinks by this factor: next to a corner
/// radiance is a power of the distance.
const GRADING: f64 = 0.2;
/// Breaks nearer to another, in parts of the segment, are left out. The kink that is then inside a
/// panel costs its square times its strength.
const CLOSEST: f64 = 1e-4;

/// A side of a segment: true is the normal's.
pub(super) type Side = (usize, bool);

/// The panels of one side.
#[derive(Clone, Debug)]
pub(super) struct Panels {
    /// Their ends, from 0 to 1.
    pub(super) breaks: Vec<f64>,
    /// Where the first node's value is.
    pub(super) first: usize,
}

/// How fine the panels are.
#[derive(Clone, Copy, Debug)]
pub(super) struct Fineness {
    /// How many times panels shrink towards the ends of a segment.
    pub(super) levels: usize,
    /// Into how many parts every panel is then cut.
    pub(super) parts: usize,
}

/// Gauss–Legendre nodes on [0, 1] with their barycentric weights for interpolation.
#[derive(Clone, Debug)]
pub(super) struct Rule {
    pub(super) points: Vec<(f64, f64)>,
    barycentric: [f64; NODES],
}

impl Rule {
    pub(super) fn new() -> Self {
        let points = gauss_legendre(NODES);
        let mut barycentric = [1.0; NODES];
        for i in 0..NODES {
            for j in 0..NODES {
                if i != j {
                    barycentric[i] /= points[i].0 - points[j].0;
                }
            }
        }
        Self { points, barycentric }
    }

    /// The Lagrange polynomials at t ∈ [0, 1] and their slopes there.
    pub(super) fn basis(&self, t: f64) -> [(f64, f64); NODES] {
        // ℓ_i = b_i Π (t − t_j) over j < i and over j > i, each with its derivative.
        let times = |(value, slope): (f64, f64), node: f64| (value * (t - node), slope * (t - node) + value);
        let mut basis = [(0.0, 0.0); NODES];
        let mut below = (1.0, 0.0);
        for (entry, (node, _)) in basis.iter_mut().zip(&self.points) {
            *entry = below;
            below = times(below, *node);
        }
        let mut above = (1.0, 0.0);
        for (i, (node, _)) in self.points.iter().enumerate().rev() {
            let (value, slope) = basis[i];
            let scale = self.barycentric[i];
            basis[i] = (scale * value * above.0, scale * (slope * above.0 + value * above.1));
            above = times(above, *node);
        }
        basis
    }
}

impl Panels {
    /// Graded towards both ends, cut at the critical points, then evenly.
    pub(super) fn new(world: &World, (segment, side): Side, fineness: Fineness, first: usize) -> Self {
        let Fineness { levels, parts } = fineness;
        let own = &world.segments()[segment];
        let sign = if side { 1.0 } else { -1.0 };
        let mut wanted = vec![0.5];
        let ends = std::iter::successors(Some(GRADING), |end| Some(end * GRADING));
        // Deeper than the closest break there is nothing to grade.
        for end in ends.take(levels).take_while(|end| *end > CLOSEST) {
            wanted.extend([end, 1.0 - end]);
        }
        wanted.extend(critical_points(world, segment, sign, [0.0, 1.0]));
        let others = world.vertices().filter(|v| own.ends().iter().all(|end| end != v));
        wanted.extend(graded_points(own, others, [0.0, 1.0]));
        wanted.sort_unstable_by(f64::total_cmp);
        let mut coarse = vec![0.0];
        for s in wanted {
            if s - coarse[coarse.len() - 1] > CLOSEST && s < 1.0 - CLOSEST {
                coarse.push(s);
            }
        }
        coarse.push(1.0);
        let mut breaks = vec![0.0];
        for pair in coarse.windows(2) {
            let part = |k: usize| pair[0] + (pair[1] - pair[0]) * k as f64 / parts as f64;
            breaks.extend((1..parts).map(part).chain([pair[1]]));
        }
        Self { breaks, first }
    }

    /// The parameters of all nodes, in order.
    pub(super) fn nodes<'a>(&'a self, rule: &'a Rule) -> impl Iterator<Item = f64> + 'a {
        let of = |pair: &'a [f64]| rule.points.iter().map(move |(t, _)| pair[0] + t * (pair[1] - pair[0]));
        self.breaks.windows(2).flat_map(of)
    }
}
