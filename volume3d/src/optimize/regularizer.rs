//! Regularizers of meshes.

use glam::DVec3;

use crate::geometry::{Edges, Mesh};

/// Regularisation term of a mesh, independent of the images.
///
/// Each is a function of the vertices, with a gradient by them; both are exact. A term biases the fit: choose
/// the least weight that keeps noise from the mesh, and let it fall to 0 as the fit converges.
///
/// With E the edges, p the vertices and n the unit normals of triangles:
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Regularizer {
    /// The mean over vertices of |(L p)_i|², with (L p)_i = p_i − the mean of the neighbours of i (Taubin
    /// 1995): prefers smooth surfaces, and shrinks them. In squares of scene units.
    Laplacian,
    /// The mean over edges of (|e|/ℓ − 1)², with ℓ the mean length of all edges: prefers edges alike, so that
    /// none collapse. It does not depend on the scale.
    EdgeLength,
    /// The mean over edges between two triangles of 1 − n₁·n₂: prefers flat surfaces with few folds. It does
    /// not depend on the scale. Triangles of zero area have no normal and do not count.
    NormalConsistency,
}

impl Regularizer {
    /// The term's value for a mesh, and its derivative by every vertex.
    #[must_use]
    pub fn of(self, mesh: &Mesh) -> (f64, Vec<DVec3>) {
        let (positions, triangles) = (mesh.positions(), mesh.triangles());
        let edges = Edges::of(triangles.iter().copied());
        match self {
            Self::Laplacian => laplacian(positions, &ends(&edges)),
            Self::EdgeLength => edge_length(positions, &ends(&edges)),
            Self::NormalConsistency => normal_consistency(positions, triangles, &edges),
        }
    }
}

/// Both ends of every edge, once.
fn ends(edges: &Edges) -> Vec<[usize; 2]> {
    edges.ends().map(|ends| ends.map(|i| i as usize)).collect()
}

fn laplacian(positions: &[DVec3], edges: &[[usize; 2]]) -> (f64, Vec<DVec3>) {
    let mut degrees = vec![0.0_f64; positions.len()];
    let mut sums = vec![DVec3::ZERO; positions.len()];
    for &[a, b] in edges {
        for (i, j) in [(a, b), (b, a)] {
            degrees[i] += 1.0;
            sums[i] += positions[j];
        }
    }
    let alone = |i: usize| degrees[i] == 0.0;
    let differences: Vec<DVec3> = (0..positions.len())
        .map(|i| if alone(i) { DVec3::ZERO } else { positions[i] - sums[i] / degrees[i] })
        .collect();
    let scale = 1.0 / positions.len().max(1) as f64;
    let value = scale * differences.iter().map(|d| d.length_squared()).sum::<f64>();
    let mut gradient: Vec<DVec3> = differences.iter().map(|d| 2.0 * scale * *d).collect();
    for &[a, b] in edges {
        for (i, j) in [(a, b), (b, a)] {
            gradient[j] -= 2.0 * scale * differences[i] / degrees[i];
        }
    }
    (value, gradient)
}

fn edge_length(positions: &[DVec3], edges: &[[usize; 2]]) -> (f64, Vec<DVec3>) {
    let mut gradient = vec![DVec3::ZERO; positions.len()];
    let lengths: Vec<f64> = edges.iter().map(|&[a, b]| positions[a].distance(positions[b])).collect();
    let count = edges.len().max(1) as f64;
    let mean = lengths.iter().sum::<f64>() / count;
    if mean == 0.0 {
        return (0.0, gradient);
    }
    let deviation = |length: f64| length / mean - 1.0;
    let value = lengths.iter().map(|&l| deviation(l).powi(2)).sum::<f64>() / count;
    // By each length directly, and by all lengths through their mean.
    let by_mean = lengths.iter().map(|&l| -2.0 * deviation(l) * l / (mean * mean)).sum::<f64>() / count;
    for (&[a, b], &length) in edges.iter().zip(&lengths).filter(|(_, length)| **length > 0.0) {
        let by_length = (2.0 * deviation(length) / mean + by_mean) / count;
        let along = (positions[b] - positions[a]) / length;
        gradient[a] -= by_length * along;
        gradient[b] += by_length * along;
    }
    (value, gradient)
}

fn normal_consistency(positions: &[DVec3], triangles: &[[u32; 3]], edges: &Edges) -> (f64, Vec<DVec3>) {
    let corners = |t: u32| triangles[t as usize].map(|i| positions[i as usize]);
    let cross = |t: u32| {
        let [a, b, c] = corners(t);
        (b - a).cross(c - a)
    };
    let mut gradient = vec![DVec3::ZERO; positions.len()];
    let (mut value, mut count) = (0.0, 0_u32);
    for sides in edges.iter() {
        let [first, second] = sides else { continue };
        let pair = [first.triangle, second.triangle];
        let crosses = pair.map(cross);
        let [Some(m), Some(n)] = crosses.map(DVec3::try_normalize) else { continue };
        // Two triangles that traverse their edge in the same sense face opposite ways.
        let sign = if first.ascending == second.ascending { -1.0 } else { 1.0 };
        value += 1.0 - sign * m.dot(n);
        count += 1;
        for (t, own, other, whole) in [(pair[0], m, n, crosses[0]), (pair[1], n, m, crosses[1])] {
            // d(n·m) = (m − n (n·m))·dc/|c|, and c = (b − a) × (c − a).
            let by_cross = -sign * (other - own * own.dot(other)) / whole.length();
            let ([a, b, c], indices) = (corners(t), triangles[t as usize].map(|i| i as usize));
            let (by_b, by_c) = ((c - a).cross(by_cross), by_cross.cross(b - a));
            gradient[indices[0]] -= by_b + by_c;
            gradient[indices[1]] += by_b;
            gradient[indices[2]] += by_c;
        }
    }
    let scale = 1.0 / f64::from(count.max(1));
    gradient.iter_mut().for_each(|g| *g *= scale);
    (scale * value, gradient)
}

#[cfg(test)]
mod tests {
    use flatland::random::{open01, stream};

    use super::*;

    const ALL: [Regularizer; 3] =
        [Regularizer::Laplacian, Regularizer::EdgeLength, Regularizer::NormalConsistency];

    /// A bent cube, an isolated vertex, and a triangle without area.
    fn mesh() -> Mesh {
        let mut rng = stream(71, &[]);
        let mut random = || DVec3::from_array(std::array::from_fn(|_| open01(&mut rng) - 0.5));
        let mut positions: Vec<DVec3> = Mesh::cube().positions().iter().map(|p| *p + random()).collect();
        positions.push(random());
        let mut triangles = Mesh::cube().triangles().to_vec();
        triangles.push([0, 1, 1]);
        Mesh::new(positions, triangles).unwrap()
    }

    #[test]
    fn gradients_are_those_of_central_differences() {
        let mesh = mesh();
        for term in ALL {
            let (value, gradient) = term.of(&mesh);
            assert!(value > 0.0);
            for i in 0..mesh.positions().len() {
                for axis in 0..3 {
                    let at = |h: f64| {
                        let mut moved = mesh.positions().to_vec();
                        moved[i][axis] += h;
                        term.of(&mesh.clone().with_positions(moved).unwrap()).0
                    };
                    let difference = (at(1e-5) - at(-1e-5)) / 2e-5;
                    assert!(
                        (difference - gradient[i][axis]).abs() < 1e-9,
                        "{term:?} {i} {axis}: {difference}"
                    );
                }
            }
        }
    }

    #[test]
    fn what_is_preferred_has_no_gradient_and_scales_are_as_stated() {
        let cube = Mesh::cube();
        let by = |size: f64| glam::DAffine3::from_scale(DVec3::splat(size));
        for (term, power) in ALL.into_iter().zip([2, 0, 0]) {
            let (one, ten) = (term.of(&cube).0, term.of(&cube.clone().transformed(&by(10.0))).0);
            assert!((ten / one - 10.0_f64.powi(power)).abs() < 1e-12, "{term:?}");
            // Invariance under translation.
            let total: DVec3 = term.of(&cube).1.into_iter().sum();
            assert!(total.length() < 1e-14, "{term:?}");
        }
        let flat = Mesh::rectangle();
        assert!(Regularizer::NormalConsistency.of(&flat).0.abs() < 1e-15);
        let nothing = Mesh::new(vec![], vec![]).unwrap();
        assert!(ALL.iter().all(|term| term.of(&nothing) == (0.0, vec![])));
    }
}
