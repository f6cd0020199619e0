//! Angle-weighted vertex normals, their tangent and its transpose.

use glam::DVec3;
use rayon::prelude::*;

/// Corners of a triangle with computed normals.
#[derive(Clone, Copy, Debug)]
struct Corners {
    positions: [u32; 3],
    normals: [u32; 3],
}

/// Dependence of computed normals on positions: n = normalise(Σ α_c n_c) over the corners c at a vertex, with
/// α_c the angle of the corner and n_c the normal of its face (Thürmer and Wüthrich 1998).
///
/// If the sum is 0, so is the normal, and the face's own normal is used for shading.
#[derive(Clone, Debug, Default)]
pub(crate) struct VertexNormals {
    triangles: Vec<Corners>,
    /// Ranges of computed normals.
    ranges: Vec<(u32, u32)>,
    /// Corners that contribute to each of them: those from `first[i]` to `first[i + 1]`, encoded as three
    /// times the triangle plus the corner.
    first: Vec<u32>,
    corners: Vec<u32>,
}

impl VertexNormals {
    pub(crate) fn add(
        &mut self,
        positions: &[[u32; 3]],
        normals: &[[u32; 3]],
        first_position: u32,
        first_normal: u32,
        count: usize,
    ) {
        self.ranges.push((first_normal, first_normal + count as u32));
        let before = self.triangles.len();
        self.triangles.extend(positions.iter().zip(normals).map(|(p, n)| Corners {
            positions: p.map(|i| i + first_position),
            normals: n.map(|i| i + first_normal),
        }));
        let mut counts = vec![0; count + 1];
        for n in normals.as_flattened() {
            counts[*n as usize + 1] += 1;
        }
        let start = self.corners.len() as u32;
        counts[0] = start;
        (0..count).for_each(|i| counts[i + 1] += counts[i]);
        self.corners.resize(3 * self.triangles.len(), 0);
        let mut next = counts.clone();
        for (corner, n) in (3 * before as u32..).zip(normals.as_flattened()) {
            let place = &mut next[*n as usize];
            self.corners[*place as usize] = corner;
            *place += 1;
        }
        self.first.pop();
        self.first.extend(counts);
    }

    fn computed(&self) -> impl Iterator<Item = usize> + '_ {
        self.ranges.iter().flat_map(|&(a, b)| a as usize..b as usize)
    }

    /// Fills in the computed normals.
    pub(crate) fn compute(&self, positions: &[DVec3], normals: &mut [DVec3]) {
        self.each(normals, |corners| self.sum(positions, corners).normalize_or_zero());
    }

    /// Σ α_c n_c for every computed normal.
    fn sums(&self, positions: &[DVec3], sums: &mut [DVec3]) {
        self.each(sums, |corners| self.sum(positions, corners));
    }

    /// Sets each computed normal to a function of its corners.
    fn each(&self, normals: &mut [DVec3], f: impl Fn(&[u32]) -> DVec3 + Sync) {
        let mut first = &self.first[..];
        for &(a, b) in &self.ranges {
            let (from, to) = (first, &first[1..]);
            let range = normals[a as usize..b as usize].par_iter_mut().with_min_len(512);
            range.enumerate().for_each(|(i, n)| *n = f(&self.corners[from[i] as usize..to[i] as usize]));
            first = &first[(b - a) as usize..];
        }
    }

    fn sum(&self, positions: &[DVec3], corners: &[u32]) -> DVec3 {
        let weighted = |&corner: &u32| {
            let triangle = &self.triangles[corner as usize / 3];
            let face = Face::new(triangle.positions.map(|i| positions[i as usize]));
            face.map_or(DVec3::ZERO, |face| face.angle(corner as usize % 3) * face.normal)
        };
        corners.iter().map(weighted).sum()
    }

    /// Rates of the computed normals, from those of the positions.
    pub(crate) fn tangent(&self, positions: &[DVec3], rates: &[DVec3], normals: &mut [DVec3]) {
        let mut sums = vec![DVec3::ZERO; normals.len()];
        self.sums(positions, &mut sums);
        let mut sum_rates = vec![DVec3::ZERO; normals.len()];
        for t in &self.triangles {
            let rate = t.positions.map(|i| rates[i as usize]);
            if rate == [DVec3::ZERO; 3] {
                continue;
            }
            if let Some(face) = Face::new(t.positions.map(|i| positions[i as usize])) {
                let (normal_rate, angle_rates) = face.tangent(rate);
                for k in 0..3 {
                    sum_rates[t.normals[k] as usize] +=
                        angle_rates[k] * face.normal + face.angle(k) * normal_rate;
                }
            }
        }
        for i in self.computed() {
            normals[i] = normalized_tangent(sums[i], sum_rates[i]);
        }
    }

    /// Transpose of [`tangent`](Self::tangent): adds to the positions' covectors.
    pub(crate) fn transpose(&self, positions: &[DVec3], normals: &[DVec3], covectors: &mut [DVec3]) {
        let mut sums = vec![DVec3::ZERO; normals.len()];
        self.sums(positions, &mut sums);
        // The Jacobian of normalisation is symmetric, its own transpose.
        let sum_covectors: Vec<DVec3> =
            sums.iter().zip(normals).map(|(&s, &c)| normalized_tangent(s, c)).collect();
        for t in &self.triangles {
            let covector = t.normals.map(|i| sum_covectors[i as usize]);
            if covector == [DVec3::ZERO; 3] {
                continue;
            }
            if let Some(face) = Face::new(t.positions.map(|i| positions[i as usize])) {
                let by_normal: DVec3 = (0..3).map(|k| face.angle(k) * covector[k]).sum();
                let by_angle = covector.map(|c| c.dot(face.normal));
                for (i, c) in t.positions.into_iter().zip(face.transpose(by_normal, by_angle)) {
                    covectors[i as usize] += c;
                }
            }
        }
    }
}

/// Derivative of normalise(s) along ṡ.
fn normalized_tangent(s: DVec3, rate: DVec3) -> DVec3 {
    let length = s.length();
    if length > 0.0 {
        let n = s / length;
        (rate - n * n.dot(rate)) / length
    } else {
        DVec3::ZERO
    }
}

/// Normal and angles of a triangle.
struct Face {
    /// p_{k+1} − p_k.
    edges: [DVec3; 3],
    /// e₀ × e₁, unnormalised: twice the area.
    cross: DVec3,
    normal: DVec3,
}

impl Face {
    fn new(p: [DVec3; 3]) -> Option<Self> {
        let edges = [p[1] - p[0], p[2] - p[1], p[0] - p[2]];
        let cross = edges[0].cross(edges[1]);
        let normal = cross.try_normalize()?;
        Some(Self { edges, cross, normal })
    }

    /// α_k.
    fn angle(&self, k: usize) -> f64 {
        // Two edges of a triangle span twice its area.
        let (a, b) = (self.edges[k], -self.edges[(k + 2) % 3]);
        self.cross.length().atan2(a.dot(b))
    }

    /// ∂α_k/∂a and ∂α_k/∂b for the two edges a = e_k, b = −e_{k+2} that leave corner k: rotating an edge by
    /// an angle φ in the plane moves its end by φ|edge| orthogonally.
    fn angle_covectors(&self, k: usize) -> [DVec3; 2] {
        let (a, b) = (self.edges[k], -self.edges[(k + 2) % 3]);
        [-self.normal.cross(a) / a.length_squared(), self.normal.cross(b) / b.length_squared()]
    }

    fn tangent(&self, rates: [DVec3; 3]) -> (DVec3, [f64; 3]) {
        let edge_rates = [rates[1] - rates[0], rates[2] - rates[1], rates[0] - rates[2]];
        let cross_rate = edge_rates[0].cross(self.edges[1]) + self.edges[0].cross(edge_rates[1]);
        let angles = std::array::from_fn(|k| {
            let [by_a, by_b] = self.angle_covectors(k);
            by_a.dot(edge_rates[k]) - by_b.dot(edge_rates[(k + 2) % 3])
        });
        (normalized_tangent(self.cross, cross_rate), angles)
    }

    fn transpose(&self, by_normal: DVec3, by_angle: [f64; 3]) -> [DVec3; 3] {
        let by_cross = normalized_tangent(self.cross, by_normal);
        // c·(ė₀ × e₁) = ė₀·(e₁ × c) and c·(e₀ × ė₁) = ė₁·(c × e₀).
        let mut by_edges = [self.edges[1].cross(by_cross), by_cross.cross(self.edges[0]), DVec3::ZERO];
        for k in 0..3 {
            let [by_a, by_b] = self.angle_covectors(k);
            by_edges[k] += by_angle[k] * by_a;
            by_edges[(k + 2) % 3] -= by_angle[k] * by_b;
        }
        std::array::from_fn(|k| by_edges[(k + 2) % 3] - by_edges[k])
    }
}

#[cfg(test)]
mod tests {
    use flatland::random::{open01, stream};

    use super::*;

    /// A tetrahedron, and a triangle of zero area on it.
    fn mesh() -> (Vec<DVec3>, VertexNormals) {
        let positions = vec![
            DVec3::new(0.1, 0.0, -0.2),
            DVec3::new(1.2, 0.1, 0.0),
            DVec3::new(0.2, 0.9, 0.1),
            DVec3::new(0.3, 0.2, 1.1),
        ];
        let triangles = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2], [0, 0, 1]];
        let mut normals = VertexNormals::default();
        normals.add(&triangles, &triangles, 0, 0, 4);
        (positions, normals)
    }

    fn random(seed: u64) -> Vec<DVec3> {
        let mut rng = stream(seed, &[]);
        (0..4).map(|_| DVec3::from_array(std::array::from_fn(|_| open01(&mut rng) - 0.5))).collect()
    }

    #[test]
    fn the_tangent_is_that_of_central_differences() {
        let (positions, normals) = mesh();
        let rates = random(1);
        let at = |h: f64| {
            let moved: Vec<DVec3> = positions.iter().zip(&rates).map(|(p, r)| p + h * r).collect();
            let mut n = vec![DVec3::ZERO; 4];
            normals.compute(&moved, &mut n);
            n
        };
        let mut tangent = vec![DVec3::ZERO; 4];
        normals.tangent(&positions, &rates, &mut tangent);
        let (plus, minus) = (at(1e-6), at(-1e-6));
        for i in 0..4 {
            assert!(((plus[i] - minus[i]) / 2e-6 - tangent[i]).length() < 1e-8, "{i}");
        }
    }

    #[test]
    fn the_transpose_is_the_transpose() {
        let (positions, normals) = mesh();
        let (rates, covectors) = (random(1), random(2));
        let mut tangent = vec![DVec3::ZERO; 4];
        normals.tangent(&positions, &rates, &mut tangent);
        let mut pulled = vec![DVec3::ZERO; 4];
        normals.transpose(&positions, &covectors, &mut pulled);
        let forward: f64 = tangent.iter().zip(&covectors).map(|(a, b)| a.dot(*b)).sum();
        let reverse: f64 = pulled.iter().zip(&rates).map(|(a, b)| a.dot(*b)).sum();
        assert!((forward - reverse).abs() < 1e-14);
    }

    #[test]
    fn a_symmetric_corner_points_along_its_axis() {
        let positions = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z];
        let triangles = [[0, 1, 2], [0, 2, 3], [0, 3, 1]];
        let mut normals = VertexNormals::default();
        normals.add(&triangles, &triangles, 0, 0, 4);
        let mut n = vec![DVec3::ZERO; 4];
        normals.compute(&positions, &mut n);
        assert!((n[0] - DVec3::ONE.normalize()).length() < 1e-15);
    }
}
