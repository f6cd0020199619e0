//! Panels: the pieces of a segment's side on which radiance is a polynomial of the parameter s.

use crate::quadrature::gauss_legendre;
use crate::transport::World;
use crate::transport::exact::critical::{Graded, critical_points, graded_points};

/// Nodes of a panel, and quadrature points on its visible part.
pub(super) const NODES: usize = 8;
/// Factor by which panels shrink towards the ends of a segment: near a corner radiance is a power of the
/// distance.
const GRADING: f64 = 0.2;
/// Factor towards the foot of a near point: radiance changes over the distance h of that point, and a panel
/// from h to qh has its singularity at a distance of only h.
const NEAR_GRADING: f64 = 3.0;
/// Distance of two breaks, relative to the scale on which radiance changes there, below which one is omitted:
/// several near points would each add their own.
const CLOSEST: f64 = 0.25;
/// Distance of breaks, relative to the segment, below which one is omitted: parameters between them have 4
/// digits left.
const NARROWEST: f64 = 1e-12;

/// A side of a segment: true for the side of the normal.
pub(super) type Side = (usize, bool);

/// The panels of one side.
#[derive(Clone, Debug)]
pub(super) struct Panels {
    /// Their ends, from 0 to 1.
    pub(super) breaks: Vec<f64>,
    /// Index of the first node's value.
    pub(super) first: usize,
}

/// Fineness of the panels.
#[derive(Clone, Copy, Debug)]
pub(super) struct Fineness {
    /// Number of gradings towards the ends of a segment.
    pub(super) levels: usize,
    /// Number of parts into which every panel is then cut.
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
    /// Panels graded towards both ends, cut at the critical points, then evenly.
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

/// The breaks from 0 to 1 without those too near to their predecessor. Breaks of scale 0 are kinks, which are
/// kept.
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
