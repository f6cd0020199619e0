//! Crossings: the curves along which surfaces pass through one another (Theory 9).
//!
//! Radiance is discontinuous there as at an edge, but no mesh edge marks the place. Every pair of crossing
//! triangles has a segment of the line in which their planes meet. With unit normals n₁, n₂, ñ_i the vectors
//! in their plane for which ñ_i·n_j = δ_ij, and e along the line, a point of it has the velocity
//!
//! > a = Σ_i (ñ_i n_iᵀ + ½ e eᵀ) Σ_k b_ik ẋ_ik,
//!
//! linear in the velocities of the six corners with barycentric coordinates b_ik, which are affine along the
//! segment, and so is a. It stays in both planes, and along the line it is the mean of both materials'
//! velocities. For nearly parallel planes a is large, as is the true velocity; it does not depend on the
//! position of the triangles' edges.
//!
//! Crossings are found by a query of the hierarchy against itself, on demand and again after vertices have
//! moved; only the segments are stored.

use flatland::calculus::{Number, Vec3};
use glam::DVec3;

use super::adjacency::Adjacency;
use super::edge_contact::EdgeContact;
use super::face_contact::FaceContact;
use super::triangle::{Tables, Triangle, barycentric};
use crate::geometry::{Accelerator, End, Meeting, in_contact, meeting, parts, within};

/// A segment along which two triangles cross.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Crossing {
    pub(crate) triangles: [u32; 2],
    pub(crate) places: [DVec3; 2],
    /// Barycentric coordinates of both ends in each triangle.
    weights: [[[f64; 3]; 2]; 2],
    normals: [DVec3; 2],
    /// ñ.
    duals: [DVec3; 2],
    /// e.
    along: DVec3,
    /// The triangle that continues the first one, if the crossing is their common edge: one of them is in
    /// front of the second triangle and one behind it.
    pub(crate) continued: Option<u32>,
}

/// All crossings of a scene.
#[derive(Clone, Debug, Default)]
pub(crate) struct Crossings {
    all: Vec<Crossing>,
    /// Crossings of each triangle: those from `first[t]` to `first[t + 1]`; empty if there are none.
    first: Vec<u32>,
    of_triangle: Vec<u32>,
    /// Pairs of coplanar triangles that overlap.
    overlaps: Vec<[u32; 2]>,
    contacts: Vec<EdgeContact>,
    standing: Vec<FaceContact>,
}

/// Relation of a pair of triangles.
#[expect(clippy::large_enum_variant, reason = "nearly all are crossings, and they live briefly")]
enum Found {
    Crossing(Crossing),
    Overlap([u32; 2]),
    Contact(EdgeContact),
    Standing(FaceContact),
}

impl Crossings {
    /// Builds all crossings by a query of the hierarchy against itself.
    pub(super) fn build(tables: Tables<'_>, adjacency: &Adjacency, accelerator: &Accelerator) -> Self {
        let corners: Vec<[u32; 3]> = tables.triangles.iter().map(|t| t.positions).collect();
        let mut found = accelerator.each_pair(tables.positions, &corners, tables.origin, |s, t, found| {
            found.extend(Found::of(tables, adjacency, s, t));
            found.extend(EdgeContact::of(tables, adjacency, [s, t]).into_iter().map(Found::Contact));
            found.extend(FaceContact::of(tables, adjacency, [s, t]).into_iter().map(Found::Standing));
        });
        let key = |f: &Found| match f {
            Found::Crossing(c) => c.triangles,
            Found::Overlap(pair) => *pair,
            Found::Contact(c) => c.triangles,
            Found::Standing(c) => c.triangles,
        };
        found.sort_by_key(key);
        let mut crossings = Self::default();
        for one in found {
            match one {
                Found::Crossing(crossing) => crossings.all.push(crossing),
                Found::Overlap(pair) => crossings.overlaps.push(pair),
                Found::Contact(contact) => crossings.contacts.push(contact),
                Found::Standing(contact) => crossings.standing.push(contact),
            }
        }
        crossings.index(tables.triangles.len());
        crossings
    }

    fn index(&mut self, triangles: usize) {
        if self.all.is_empty() {
            return;
        }
        let mut sides: Vec<(u32, u32)> =
            (0..).zip(&self.all).flat_map(|(i, c)| c.triangles.map(|t| (t, i))).collect();
        sides.sort_unstable();
        self.first = vec![0; triangles + 1];
        for (t, _) in &sides {
            self.first[*t as usize + 1] += 1;
        }
        for t in 0..triangles {
            self.first[t + 1] += self.first[t];
        }
        self.of_triangle = sides.into_iter().map(|(_, i)| i).collect();
    }

    pub(crate) fn all(&self) -> &[Crossing] {
        &self.all
    }

    /// Pairs of coplanar triangles that overlap.
    pub(crate) fn overlaps(&self) -> &[[u32; 2]] {
        &self.overlaps
    }

    /// Edges that coincide along a stretch.
    pub(super) fn contacts(&self) -> &[EdgeContact] {
        &self.contacts
    }

    /// Edges that lie on faces.
    pub(super) fn standing(&self) -> &[FaceContact] {
        &self.standing
    }

    pub(crate) fn get(&self, index: u32) -> &Crossing {
        &self.all[index as usize]
    }

    /// Indices of a triangle's crossings.
    pub(crate) fn of(&self, triangle: u32) -> &[u32] {
        match self.first.get(triangle as usize..triangle as usize + 2) {
            Some([from, to]) => &self.of_triangle[*from as usize..*to as usize],
            _ => &[],
        }
    }
}

impl Found {
    fn of(tables: Tables<'_>, adjacency: &Adjacency, s: u32, t: u32) -> Option<Self> {
        let pair = [s, t];
        let corners = pair.map(|t| tables.corners(t));
        if shares_edge(pair.map(|t| &tables.triangles[t as usize])) {
            // Neighbours meet in their edge, unless one overlaps the other.
            return (is_folded(&corners) && meeting(&corners) == Meeting::Overlap)
                .then_some(Self::Overlap(pair));
        }
        // Two adjoining shapes are coplanar up to the rounding of their transforms. How this rounding makes
        // them intersect is noise.
        let [own, other] = pair.map(|t| tables.triangles[t as usize].shape);
        if own != other && in_contact(&corners, tables.origin) {
            return Some(Self::Overlap(pair));
        }
        match meeting(&corners) {
            Meeting::Apart => None,
            Meeting::Overlap => (own == other).then_some(Self::Overlap(pair)),
            Meeting::Through(ends) => Crossing::new(pair, &corners, ends, None).map(Self::Crossing),
            Meeting::Along { which, edge } => {
                let other = adjacency.continued(pair[which], edge)?;
                passes_along((other, tables.corners(other)), pair, &corners, which, edge)
            }
        }
    }
}

fn shares_edge([s, t]: [&Triangle; 2]) -> bool {
    s.positions.iter().filter(|i| t.positions.contains(i)).count() >= 2
}

/// Whether neighbours may be coplanar with one folded onto the other.
fn is_folded(corners: &[[DVec3; 3]; 2]) -> bool {
    let [m, n] = corners.map(|[a, b, c]| (b - a).cross(c - a).normalize_or_zero());
    m.cross(n).length() < 1e-6
}

/// Whether surfaces cross along an edge of one triangle that lies in the other: the triangle that continues
/// the first one beyond its edge must be on the other side. Either of the two finds the crossing, and the one
/// with the lower index reports it. Both tests are exact: a neighbour with corners on the other triangle ends
/// in its border, and rounding must not carry it over.
fn passes_along(
    (other, beyond): (u32, [DVec3; 3]),
    pair: [u32; 2],
    corners: &[[DVec3; 3]; 2],
    which: usize,
    edge: usize,
) -> Option<Found> {
    let (own, plane) = (pair[which], corners[1 - which]);
    let [p, q] = [corners[which][edge], corners[which][(edge + 1) % 3]];
    let third = |corners: [DVec3; 3]| corners.into_iter().find(|x| *x != p && *x != q);
    let sides = [third(corners[which])?, third(beyond)?];
    if own > other || !parts(&plane, sides) {
        return None;
    }
    let [low, high] = within([p, q], &plane)?;
    let end = |along: f64| End { which: 0, edge, along };
    let ordered = [own, pair[1 - which]];
    let corners = [corners[which], plane];
    Crossing::new(ordered, &corners, [end(low), end(high)], Some(other)).map(Found::Crossing)
}

impl Crossing {
    /// `None` if the planes, or the ends, coincide up to rounding.
    fn new(
        triangles: [u32; 2],
        corners: &[[DVec3; 3]; 2],
        ends: [End; 2],
        continued: Option<u32>,
    ) -> Option<Self> {
        let places = ends.map(|e| e.place(corners));
        let weights = std::array::from_fn(|k| {
            std::array::from_fn(|i| {
                let End { which, edge, along } = ends[k];
                if which == i {
                    let mut weights = [0.0; 3];
                    (weights[edge], weights[(edge + 1) % 3]) = (1.0 - along, along);
                    weights
                } else {
                    barycentric(&corners[i], places[k])
                }
            })
        });
        let normals = corners.map(|[a, b, c]| (b - a).cross(c - a).normalize_or_zero());
        let along = normals[0].cross(normals[1]);
        let squared = along.length_squared();
        let cosine = normals[0].dot(normals[1]);
        let duals =
            [(normals[0] - cosine * normals[1]) / squared, (normals[1] - cosine * normals[0]) / squared];
        let along = along / squared.sqrt();
        let good = places[0] != places[1] && along.is_finite() && duals.iter().all(|d| d.is_finite());
        good.then_some(Self { triangles, places, weights, normals, duals, along, continued })
    }

    /// Shapes of both triangles, the lower first.
    pub(crate) fn shapes(&self, triangles: &[Triangle]) -> [u32; 2] {
        let [s, t] = self.triangles.map(|t| triangles[t as usize].shape);
        [s.min(t), s.max(t)]
    }

    /// Barycentric coordinates in one of the triangles at a position along the segment.
    fn weights(&self, which: usize, along: f64) -> [f64; 3] {
        let [a, b] = self.weights.map(|end| end[which]);
        std::array::from_fn(|k| (1.0 - along) * a[k] + along * b[k])
    }

    /// Velocity of one of its points, from those of all positions.
    pub(crate) fn velocity(&self, triangles: &[Triangle], along: f64, velocities: &[DVec3]) -> DVec3 {
        let mut sum = DVec3::ZERO;
        for which in 0..2 {
            let corners = triangles[self.triangles[which] as usize].positions;
            let weights = self.weights(which, along);
            let material: DVec3 = (0..3).map(|k| weights[k] * velocities[corners[k] as usize]).sum();
            sum += self.duals[which] * self.normals[which].dot(material);
            sum += 0.5 * self.along * self.along.dot(material);
        }
        sum
    }

    /// Transpose of [`velocity`](Self::velocity): hands each position its part of a covector.
    pub(crate) fn scatter(
        &self,
        triangles: &[Triangle],
        along: f64,
        covector: DVec3,
        mut add: impl FnMut(u32, DVec3),
    ) {
        for which in 0..2 {
            let corners = triangles[self.triangles[which] as usize].positions;
            let weights = self.weights(which, along);
            let material = self.normals[which] * self.duals[which].dot(covector)
                + 0.5 * self.along * self.along.dot(covector);
            for k in 0..3 {
                add(corners[k], weights[k] * material);
            }
        }
    }

    /// One of its points, whose derivative is the velocity.
    pub(super) fn point<T: Number>(
        &self,
        tables: Tables<'_>,
        along: f64,
        position: impl Fn(u32) -> Vec3<T>,
    ) -> Vec3<T> {
        let constant = |x: f64| T::constant(x);
        let place = self.places[0] + along * (self.places[1] - self.places[0]);
        let mut point = Vec3::constant(place);
        for which in 0..2 {
            let corners = tables.triangles[self.triangles[which] as usize].positions;
            let weights = self.weights(which, along);
            let mut material = Vec3::constant(DVec3::ZERO);
            for k in 0..3 {
                let still = Vec3::constant(tables.positions[corners[k] as usize]);
                material = material + (position(corners[k]) - still) * constant(weights[k]);
            }
            let across = Vec3::constant(self.normals[which]).dot(material);
            let along = Vec3::constant(self.along).dot(material) * constant(0.5);
            point = point + Vec3::constant(self.duals[which]) * across + Vec3::constant(self.along) * along;
        }
        point
    }
}

#[cfg(test)]
mod tests;
