//! One side of a segment, cut into panels on which radiance is a polynomial of the parameter s.

use crate::quadrature::gauss_legendre;
use crate::transport::World;
use crate::transport::exact::critical::{Graded, critical_points, graded_points};

/// Nodes of a panel, and the quadrature's points on the part of it that is seen.
pub(super) const NODES: usize = 8;
/// The panels' length towards the ends of a segment shrinks by this factor: next to a corner
/// radiance is a power of the distance.
const GRADING: f64 = 0.2;
/// Towards the foot of a point that is near, by this one: radiance changes over the distance h of
/// that point, and a panel from h to qh has its singularity at a distance of only h.
const NEAR_GRADING: f64 = 3.0;
/// Of two breaks nearer than this part of the scale on which radiance changes there, one is left out:
/// several near points would each bring their own.
const CLOSEST: f64 = 0.25;
/// Breaks nearer than this, in parts of the segment, are left out: 4 digits are left of a parameter
/// between them.
const NARROWEST: f64 = 1e-12;

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
        let precise = |s: f64| Graded { s, scale: 0.0 };
        let mut wanted = vec![precise(0.5)];
        let ends = std::iter::successors(Some(GRADING), |end| Some(end * GRADING));
        for end in ends.take(levels) {
            wanted.extend([end, 1.0 - end].map(|s| Graded { s, scale: end }));
        }
        wanted.extend(critical_points(world, segment, sign, [0.0, 1.0]).into_iter().map(precise));
        let others = world.vertices().filter(|v| own.ends().iter().all(|end| end != v));
        wanted.extend(graded_points(own, others, [0.0, 1.0], NEAR_GRADING));
        let coarse = thinned(wanted);
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

/// The breaks from 0 to 1 without those that are too near to their predecessor. Those of scale 0 are
/// kinks, which stay.
fn thinned(mut wanted: Vec<Graded>) -> Vec<f64> {
    wanted.sort_unstable_by(|a, b| a.s.total_cmp(&b.s));
    let mut breaks: Vec<Graded> = vec![Graded { s: 0.0, scale: f64::INFINITY }];
    for next in wanted {
        let last = breaks[breaks.len() - 1];
        if next.s < NARROWEST || next.s > 1.0 - NARROWEST {
            continue;
        }
        if next.s - last.s > NARROWEST.max(CLOSEST * next.scale.min(last.scale)) {
            breaks.push(next);
        } else if next.scale < last.scale && breaks.len() > 1 {
            // The sharper one.
            breaks.pop();
            breaks.push(next);
        }
    }
    breaks.iter().map(|b| b.s).chain([1.0]).collect()
}
