//! The eikonal equation away from the surface.

use glam::DVec3;

/// Solution of |∇u| = 1 at all nodes, upwind from those with a value: Gauss–Seidel sweeps in the eight orders
/// of the axes' directions (Zhao 2005), over the nodes of which a neighbour changed since they were visited
/// (Bak, McLaughlin and Renzi 2010), until none is left. Changes below 10⁻⁹ of a cell are ignored.
pub(super) fn sweep(known: &[Option<f64>], size: [usize; 3], spacing: DVec3) -> Vec<f64> {
    let mut front = Front::new(known, size, spacing);
    while front.open.contains(&true) {
        for order in 0..8 {
            front.sweep(order);
        }
    }
    front.inner().map(|index| front.u[index]).collect()
}

/// The nodes, padded by one layer on all sides where u is infinite.
struct Front {
    size: [usize; 3],
    /// Index strides along each axis.
    steps: [usize; 3],
    /// 1/h² along each axis.
    weights: [f64; 3],
    enough: f64,
    u: Vec<f64>,
    /// Whether u is given, or the node is padding.
    fixed: Vec<bool>,
    /// Whether a neighbour changed since the last visit.
    open: Vec<bool>,
}

impl Front {
    fn new(known: &[Option<f64>], size: [usize; 3], spacing: DVec3) -> Self {
        let [nx, ny, nz] = size.map(|n| n + 2);
        let count = nx * ny * nz;
        let mut front = Self {
            size,
            steps: [1, nx, nx * ny],
            weights: (spacing * spacing).recip().to_array(),
            enough: 1e-9 * spacing.min_element(),
            u: vec![f64::INFINITY; count],
            fixed: vec![true; count],
            open: vec![false; count],
        };
        let inner: Vec<usize> = front.inner().collect();
        for (&index, known) in inner.iter().zip(known) {
            front.fixed[index] = known.is_some();
            front.u[index] = known.unwrap_or(f64::INFINITY);
        }
        for (&index, _) in inner.iter().zip(known).filter(|(_, known)| known.is_some()) {
            front.open_around(index);
        }
        front
    }

    fn number(&self, i: usize, j: usize, k: usize) -> usize {
        (i + 1) + (j + 1) * self.steps[1] + (k + 1) * self.steps[2]
    }

    /// Indices of all nodes except padding, in order.
    fn inner(&self) -> impl Iterator<Item = usize> + use<> {
        let ([nx, ny, nz], [_, row, layer]) = (self.size, self.steps);
        (1..=nz).flat_map(move |k| (1..=ny).flat_map(move |j| (1..=nx).map(move |i| i + j * row + k * layer)))
    }

    /// Visits the open nodes once; the bits of `order` select the axes traversed backwards.
    fn sweep(&mut self, order: usize) {
        let size = self.size;
        let place =
            |axis: usize, step: usize| if order >> axis & 1 == 0 { step } else { size[axis] - 1 - step };
        for k in 0..size[2] {
            for j in 0..size[1] {
                let row = self.number(0, place(1, j), place(2, k));
                for i in 0..size[0] {
                    let index = row + place(0, i);
                    if std::mem::take(&mut self.open[index]) {
                        self.visit(index);
                    }
                }
            }
        }
    }

    fn visit(&mut self, index: usize) {
        let least = self.steps.map(|step| self.u[index - step].min(self.u[index + step]));
        let new = upwind(least, self.weights);
        if self.u[index] - new > self.enough {
            self.u[index] = new;
            self.open_around(index);
        }
    }

    /// Opens the neighbours that may decrease because of a node.
    fn open_around(&mut self, index: usize) {
        for step in self.steps {
            for other in [index - step, index + step] {
                self.open[other] |= !self.fixed[other] && self.u[other] > self.u[index];
            }
        }
    }
}

/// The u with Σ w_i (u − a_i)₊² = 1, w_i = 1/h_i².
fn upwind(a: [f64; 3], weights: [f64; 3]) -> f64 {
    let mut pairs: [(f64, f64); 3] = std::array::from_fn(|axis| (a[axis], weights[axis]));
    for (i, j) in [(0, 1), (1, 2), (0, 1)] {
        if pairs[i].0 > pairs[j].0 {
            pairs.swap(i, j);
        }
    }
    // Relative to the least, of which there is one.
    let least = pairs[0].0;
    let (mut total, mut first, mut second) = (pairs[0].1, 0.0, 0.0);
    let mut u = total.sqrt().recip();
    for (a, weight) in pairs.into_iter().skip(1) {
        let a = a - least;
        if u <= a {
            break;
        }
        (total, first, second) = (total + weight, first + weight * a, second + weight * a * a);
        // Negative only by rounding, as u is above a.
        let discriminant = first * first - total * (second - 1.0);
        u = (first + discriminant.max(0.0).sqrt()) / total;
    }
    least + u
}
