//! Smoothed slope of the surface.

use glam::DVec3;

use super::Slopes;
use super::project::Foot;
use crate::sdf::Grid;

/// Lattice spacing, in cells.
const PITCH: f64 = 8.0;

/// Divisors of the nodes.
pub(super) enum MeanSlopes {
    /// One mean for all.
    Overall(f64),
    Local(Lattice),
}

impl MeanSlopes {
    /// The divisors, and the overall mean. `None` without feet.
    pub(super) fn new(grid: &Grid, slopes: Slopes, feet: &[Option<Foot>]) -> Option<(Self, f64)> {
        let count = feet.iter().flatten().count();
        let overall = feet.iter().flatten().map(|foot| foot.slope).sum::<f64>() / count as f64;
        let means = || match slopes {
            Slopes::Overall => Self::Overall(overall),
            Slopes::Local => Self::Local(Lattice::new(grid, overall, feet)),
        };
        (count > 0).then(|| (means(), overall))
    }

    pub(super) fn at(&self, x: DVec3) -> f64 {
        match self {
            Self::Overall(mean) => *mean,
            Self::Local(lattice) => lattice.at(x),
        }
    }
}

/// Means over 8 cells in all directions, on a lattice with linear interpolation.
pub(super) struct Lattice {
    low: DVec3,
    pitch: DVec3,
    size: [usize; 3],
    means: Vec<f64>,
}

impl Lattice {
    /// Points without a foot nearby have the overall mean.
    fn new(grid: &Grid, overall: f64, feet: &[Option<Foot>]) -> Self {
        let size = grid.size().map(|n| (n as f64 / PITCH).ceil() as usize + 1);
        let pitch = PITCH * grid.spacing();
        let mut lattice = Self { low: grid.low(), pitch, size, means: vec![] };
        let mut sums = vec![[0.0; 2]; size.iter().product()];
        for foot in feet.iter().flatten() {
            for (at, weight) in lattice.weights(foot.point) {
                sums[at][0] += weight * foot.slope;
                sums[at][1] += weight;
            }
        }
        let mean = |[sum, weight]: [f64; 2]| if weight > 0.0 { sum / weight } else { overall };
        lattice.means = sums.into_iter().map(mean).collect();
        lattice
    }

    fn at(&self, x: DVec3) -> f64 {
        self.weights(x).iter().map(|&(at, weight)| weight * self.means[at]).sum()
    }

    /// The eight lattice points around x, with their weights.
    fn weights(&self, x: DVec3) -> [(usize, f64); 8] {
        let most = DVec3::from_array(self.size.map(|n| (n - 1) as f64));
        let local = ((x - self.low) / self.pitch).clamp(DVec3::ZERO, most);
        // The size is at least 2.
        let cell = local.floor().min(most - 1.0);
        let s = local - cell;
        std::array::from_fn(|corner| {
            let bits = [corner & 1, corner >> 1 & 1, corner >> 2];
            let weight = (0..3).map(|axis| if bits[axis] == 1 { s[axis] } else { 1.0 - s[axis] }).product();
            let [i, j, k]: [usize; 3] = std::array::from_fn(|axis| cell[axis] as usize + bits[axis]);
            (i + self.size[0] * (j + self.size[1] * k), weight)
        })
    }
}
