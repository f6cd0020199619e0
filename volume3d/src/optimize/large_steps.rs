//! Laplacian-preconditioned steps for mesh vertices (Nicolet, Jacobson and Jakob 2021).

use faer::linalg::solvers::Solve;
use faer::sparse::linalg::solvers::{Llt, SymbolicLlt};
use faer::sparse::{SparseColMat, Triplet};
use faer::{Mat, Side};

use crate::geometry::{Edges, Mesh};

/// Large steps for the vertices of a mesh (Nicolet, Jacobson and Jakob 2021).
///
/// Image gradients are large on few visible vertices, above all at silhouettes, and noise on the others, and
/// steps along them crumple a mesh. With L the combinatorial Laplacian of the mesh, (L x)ᵢ = Σ over
/// neighbours j of i of xᵢ − xⱼ, the method descends in other unknowns,
///
/// ```text
/// u = M x,   M = I + λ L,
/// ```
///
/// whose gradient is M⁻¹ ∂L/∂x, as x = M⁻¹ u and M is symmetric. A step Δu moves the vertices by Δx = M⁻¹ Δu,
/// and u itself is never needed: it stays M x throughout. With [`Adam`](super::Adam) choosing Δu, one step is
///
/// ```
/// # use volume3d::{geometry::Mesh, optimize::{Adam, LargeSteps}};
/// # let (mesh, mut x, gradient) = (Mesh::cube(), vec![0.0; 24], vec![1.0; 24]);
/// let (large_steps, mut adam) = (LargeSteps::new(&mesh, 19.0)?, Adam::new(0.01).uniform());
/// let step = large_steps.solve(&adam.step(&large_steps.solve(&gradient)));
/// x.iter_mut().zip(step).for_each(|(x, s)| *x += s);
/// # Ok::<(), volume3d::optimize::LargeStepsError>(())
/// ```
///
/// for the numbers of one `SHAPE.vertex_positions`; other parameters take separate steps. The shared v of
/// [`uniform`](super::Adam::uniform) matters: a separate step size for each number would undo the smoothing.
/// The minimum of the loss does not change, because M is invertible; the path to it does, and a fit that ends
/// early is smooth.
///
/// # Which λ
/// On a regular mesh with edges of length h, L is −1.5 h² times the Laplacian of the surface, and M⁻¹ spreads
/// the change of one vertex over about √(1.5 λ) edges: 5 for the authors' λ = 19, which is a good start, and
/// 12 for 100, where gradients are noisy or the initial shape is far from the target. Less than 5 leaves
/// noise in the mesh. A mesh whose edges are half as long needs four times the λ for the same smoothness in
/// space. Detail converges last, so lower λ, or refine the mesh, as the fit converges; a new λ changes the
/// unknowns, and [`Adam::restart`](super::Adam::restart) discards the moments of the old ones. The authors'
/// other form, (1 − α) I + α L, is (1 − α) M with λ = α/(1 − α), such as 19 for α = 0.95, and takes steps
/// that are 1/(1 − α) times as long at the same rate.
///
/// # Which rate
/// Adam's rate applies to u, which M⁻¹ reduces strongly where neighbours pull opposite ways: it must be
/// larger than the desired movement of the vertices. From a sphere to a bunny of diagonal 2 in 160 steps,
/// rates of 0.1 to 0.3 that fell tenfold worked; 0.03 was slow, and 1 diverged. As gradients shrink during so
/// short a fit, [`Adam::beta2`](super::Adam::beta2) = 0.95 was more accurate than 0.999, which averages over
/// the first gradients until the end.
///
/// # What it costs
/// M is factored once, by the sparse Cholesky decomposition of `faer` after a fill-reducing permutation, and
/// solved for every step. On one core of a shared machine, spheres took:
///
/// | vertices | to factor | to solve | memory |
/// |---|---|---|---|
/// | 2,562 | 0.006 s | 0.0002 s | 2 MiB |
/// | 40,962 | 0.07 s | 0.008 s | 47 MiB |
/// | 163,842 | 0.44 s | 0.04 s | 211 MiB |
///
/// # Topology
/// Neighbours are those of [`Mesh::positions`], where vertices that a file duplicated for normals or texture
/// coordinates are merged: such seams do not tear. Vertices at nearly equal positions are distinct, and tear
/// as they do in the image. Isolated vertices, and a component as a whole, move freely: M leaves constant
/// vectors unchanged.
#[derive(Clone, Debug)]
pub struct LargeSteps {
    factor: Llt<usize, f64>,
    vertices: usize,
}

/// Why large steps cannot be set up.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum LargeStepsError {
    /// λ is out of its range.
    #[error(
        "the lambda of large steps is {lambda}, but must be between 0 and {greatest:.1e} for this mesh; 19 is usual"
    )]
    Lambda {
        /// λ.
        lambda: f64,
        /// Upper limit, beyond which rounding would change the sixth digit of a step.
        greatest: f64,
    },
    /// The Cholesky factor does not fit into memory.
    #[error(
        "the Cholesky factor for the large steps of {vertices} vertices does not fit into memory; fit a coarser mesh"
    )]
    Memory {
        /// The number of vertices of the mesh.
        vertices: usize,
    },
}

/// Largest condition number of M that is accepted: rounding then changes a solution by about 10⁻⁶ of itself.
const CONDITION: f64 = 1e10;

impl LargeSteps {
    /// Factors I + λ L for the topology of a mesh; the vertex positions do not matter.
    ///
    /// # Errors
    /// - [`LargeStepsError::Lambda`] if λ is negative, not finite, or so large that I would be lost to
    ///   rounding beside λ L.
    /// - [`LargeStepsError::Memory`] if the factor does not fit into memory.
    pub fn new(mesh: &Mesh, lambda: f64) -> Result<Self, LargeStepsError> {
        let vertices = mesh.positions().len();
        let edges = Edges::of(mesh.triangles().iter().copied());
        let mut degrees = vec![0_u32; vertices];
        let mut entries = Vec::with_capacity(4 * vertices);
        for [low, high] in edges.ends().map(|ends| ends.map(|i| i as usize)) {
            degrees[low] += 1;
            degrees[high] += 1;
            entries.push(Triplet::new(high, low, -lambda));
        }
        // By Gershgorin, the eigenvalues of M are between 1 and 1 + 2 λ times the greatest degree.
        let degree = degrees.iter().max().map_or(0.0, |&d| f64::from(d));
        let greatest = (CONDITION / (2.0 * degree)).min(f64::MAX);
        if !(0.0..=greatest).contains(&lambda) {
            return Err(LargeStepsError::Lambda { lambda, greatest });
        }
        entries.extend((0..vertices).map(|i| Triplet::new(i, i, 1.0 + lambda * f64::from(degrees[i]))));
        // M is positive definite and well conditioned, and its indices are in range: only memory can fail.
        let memory = LargeStepsError::Memory { vertices };
        let lower = SparseColMat::<usize, f64>::try_new_from_triplets(vertices, vertices, &entries)
            .map_err(|_| memory.clone())?;
        let symbolic = SymbolicLlt::try_new(lower.symbolic(), Side::Lower).map_err(|_| memory.clone())?;
        let factor = Llt::try_new_with_symbolic(symbolic, lower.as_ref(), Side::Lower).map_err(|_| memory)?;
        Ok(Self { factor, vertices })
    }

    /// The number of vertices of the mesh.
    pub(crate) fn vertices(&self) -> usize {
        self.vertices
    }

    /// M⁻¹ times a vector of the mesh's vertices, x, y and z of each in turn; each coordinate separately.
    ///
    /// The result is bit-identical for any number of threads.
    ///
    /// # Panics
    /// If its length is not three times the number of [`positions`](Mesh::positions).
    #[must_use]
    pub fn solve(&self, vector: &[f64]) -> Vec<f64> {
        assert_eq!(vector.len(), 3 * self.vertices, "three numbers for each vertex of the mesh");
        let mut columns = Mat::from_fn(self.vertices, 3, |i, axis| vector[3 * i + axis]);
        self.factor.solve_in_place(columns.as_mut());
        (0..vector.len()).map(|k| columns[(k / 3, k % 3)]).collect()
    }
}

#[cfg(test)]
mod tests {
    use flatland::random::{open01, stream};
    use glam::{DVec2, DVec3};

    use super::super::{Adam, Regularizer};
    use super::*;
    use crate::geometry::Attribute;

    /// The unit sphere, from a cube each of whose faces is a grid of `n` × `n` squares with vertices of its
    /// own, as in files with texture coordinates.
    fn sphere(n: u32) -> Mesh {
        let (mut positions, mut triangles) = (vec![], vec![]);
        for (axis, side) in (0..3).flat_map(|axis| [(axis, -1.0), (axis, 1.0)]) {
            let first = positions.len() as u32;
            for k in 0..(n + 1) * (n + 1) {
                let at = |k: u32| 2.0 * f64::from(k) / f64::from(n) - 1.0;
                let mut p = [0.0; 3];
                (p[axis], p[(axis + 1) % 3], p[(axis + 2) % 3]) = (side, at(k % (n + 1)), at(k / (n + 1)));
                positions.push(DVec3::from_array(p).normalize());
            }
            for k in (0..n * n).map(|k| first + (k / n) * (n + 1) + k % n) {
                triangles.extend([[k, k + 1, k + n + 2], [k, k + n + 2, k + n + 1]]);
            }
        }
        let count = positions.len();
        let corners = Attribute { values: vec![DVec2::ZERO; count], triangles: triangles.clone() };
        Mesh::new(positions, triangles).unwrap().with_uvs(corners).unwrap()
    }

    /// Two components, an isolated vertex, an edge of three triangles and a triangle without area.
    fn awkward() -> Mesh {
        let mut positions = Mesh::cube().positions().to_vec();
        positions.extend((0..7).map(|i| DVec3::new(9.0, f64::from(i), f64::from(i * i))));
        let mut triangles = Mesh::cube().triangles().to_vec();
        triangles.extend([[9, 10, 11], [9, 10, 12], [10, 9, 13], [13, 14, 14]]);
        Mesh::new(positions, triangles).unwrap()
    }

    fn random(mesh: &Mesh, seed: u64) -> Vec<f64> {
        let mut rng = stream(seed, &[]);
        (0..3 * mesh.positions().len()).map(|_| open01(&mut rng) - 0.5).collect()
    }

    /// M x, by the neighbours of each vertex.
    fn multiply(mesh: &Mesh, lambda: f64, x: &[f64]) -> Vec<f64> {
        let mut neighbours = vec![std::collections::BTreeSet::new(); mesh.positions().len()];
        for t in mesh.triangles() {
            for (a, b) in t.iter().flat_map(|a| t.map(|b| (*a as usize, b as usize))).filter(|(a, b)| a != b)
            {
                neighbours[a].insert(b);
            }
        }
        let laplacian = |k: usize| neighbours[k / 3].iter().map(|j| x[k] - x[3 * j + k % 3]).sum::<f64>();
        (0..x.len()).map(|k| x[k] + lambda * laplacian(k)).collect()
    }

    fn distance(a: &[f64], b: &[f64]) -> f64 {
        a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
    }

    #[test]
    fn solutions_are_those_of_the_definition() {
        for (mesh, lambda) in [(sphere(8), 19.0), (awkward(), 19.0), (awkward(), 0.3), (sphere(3), 100.0)] {
            let large_steps = LargeSteps::new(&mesh, lambda).unwrap();
            let (a, b) = (random(&mesh, 1), random(&mesh, 2));
            let (by_a, by_b) = (large_steps.solve(&a), large_steps.solve(&b));
            assert!(distance(&multiply(&mesh, lambda, &by_a), &a) < 1e-12);
            // M is symmetric.
            let dot = |x: &[f64], y: &[f64]| x.iter().zip(y).map(|(x, y)| x * y).sum::<f64>();
            assert!((dot(&by_a, &b) - dot(&a, &by_b)).abs() < 1e-12);
            // Constant vectors are unchanged.
            let constant: Vec<f64> = (0..a.len()).map(|k| [0.3, -2.0, 7.0][k % 3]).collect();
            assert!(distance(&large_steps.solve(&constant), &constant) < 1e-12);
        }
    }

    #[test]
    fn nothing_spreads_from_component_to_component() {
        let mesh = awkward();
        let mut x = vec![0.0; 3 * mesh.positions().len()];
        (x[0], x[24]) = (1.0, 1.0);
        let solution = LargeSteps::new(&mesh, 5.0).unwrap().solve(&x);
        // The cube is vertices 0 to 7; vertex 8 is isolated.
        assert!(solution[..24].iter().step_by(3).all(|x| *x > 0.0 && *x < 0.5));
        assert_eq!(solution[24], 1.0);
        assert!(solution[27..].iter().all(|x| *x == 0.0));
    }

    #[test]
    fn without_lambda_nothing_changes() {
        for mesh in
            [awkward(), Mesh::new(vec![], vec![]).unwrap(), Mesh::new(vec![DVec3::X], vec![]).unwrap()]
        {
            let x = random(&mesh, 3);
            assert_eq!(LargeSteps::new(&mesh, 0.0).unwrap().solve(&x), x);
        }
    }

    #[test]
    fn lambda_out_of_range_is_refused() {
        let mesh = awkward();
        for lambda in [-1.0, f64::NAN, f64::INFINITY, 1e12] {
            let error = LargeSteps::new(&mesh, lambda).unwrap_err();
            assert!(matches!(error, LargeStepsError::Lambda { .. }), "{error}");
            assert!(error.to_string().starts_with(&format!("the lambda of large steps is {lambda}, but")));
        }
        // At the limit solutions are as accurate as promised.
        let Err(LargeStepsError::Lambda { greatest, .. }) = LargeSteps::new(&mesh, 1e12) else { panic!() };
        let constant = vec![1.0; 3 * mesh.positions().len()];
        let solution = LargeSteps::new(&mesh, greatest).unwrap().solve(&constant);
        assert!(distance(&solution, &constant) < 1e-6);
    }

    #[test]
    fn seams_do_not_tear() {
        let mesh = sphere(6);
        // 6 · 7² vertices were given, at 6 · 6² + 2 places.
        assert_eq!((mesh.sources().len(), mesh.positions().len()), (294, 218));
        let step = LargeSteps::new(&mesh, 19.0).unwrap().solve(&random(&mesh, 4));
        let moved = mesh.positions().iter().zip(step.as_chunks::<3>().0).map(|(p, s)| *p + DVec3::from(*s));
        let moved = mesh.clone().with_positions(moved.collect()).unwrap();
        let edges = Edges::of(moved.triangles().iter().copied());
        assert!(edges.iter().all(|sides| sides.len() == 2));
    }

    /// Distance and roughness of a sphere of radius 1 that is drawn to radius 1.5 by noisy gradients, each of
    /// which covers one vertex in five.
    fn fit(adam: Adam, large_steps: Option<&LargeSteps>) -> (f64, f64) {
        const STEPS: u64 = 300;
        let (mut mesh, rate, mut adam) = (sphere(12), adam.rate, adam);
        for step in 0..STEPS {
            adam.rate = rate * (1.0 - step as f64 / STEPS as f64);
            let mut rng = stream(5, &[step]);
            let mut gradient = vec![];
            for p in mesh.positions() {
                let noise = DVec3::from_array(std::array::from_fn(|_| open01(&mut rng) - 0.5));
                let seen = f64::from(open01(&mut rng) < 0.2);
                gradient.extend((seen * (*p - 1.5 * p.normalize() + noise)).to_array());
            }
            let step = match large_steps {
                None => adam.step(&gradient),
                Some(l) => l.solve(&adam.step(&l.solve(&gradient))),
            };
            let moved =
                mesh.positions().iter().zip(step.as_chunks::<3>().0).map(|(p, s)| *p + DVec3::from(*s));
            mesh = mesh.clone().with_positions(moved.collect()).unwrap();
        }
        let count = mesh.positions().len() as f64;
        let distance = mesh.positions().iter().map(|p| (p.length() - 1.5).abs()).sum::<f64>() / count;
        (distance, Regularizer::NormalConsistency.of(&mesh).0)
    }

    #[test]
    fn noisy_gradients_fit_a_smooth_sphere() {
        let perfect = Regularizer::NormalConsistency.of(&sphere(12)).0;
        let large_steps = LargeSteps::new(&sphere(12), 19.0).unwrap();
        let (distance, roughness) = fit(Adam::new(0.02).uniform(), Some(&large_steps));
        assert!(distance < 0.02 && roughness < 2.0 * perfect, "{distance} {roughness} {perfect}");
        // Without large steps, at any rate, the sphere ends farther away and crumpled.
        for rate in [0.003, 0.01, 0.03] {
            let (distance, roughness) = fit(Adam::new(rate), None);
            assert!(distance > 0.03 && roughness > 10.0 * perfect, "{rate}: {distance} {roughness}");
        }
    }
}
