//! Chain rule from covectors at points to the parameters of an implicit surface.

use flatland::sdf::{Jet, Sdf as _};
use glam::DVec3;
use rayon::prelude::*;

use crate::scene::ImplicitShape;

/// Maximum number of parts that are summed in parallel, and of the numbers of all of their sums.
const PARTS: usize = 8;
const NUMBERS: usize = 1 << 22;

/// Σ c ∂φ(x)/∂θ over points x with their covectors (c, 0), bit-identical for any number of threads.
pub(super) fn by_parameters(shape: &ImplicitShape, taps: &[(DVec3, Jet<DVec3>)]) -> Vec<f64> {
    if let Some(baked) = shape.surface.network() {
        let points: Vec<DVec3> = taps.iter().map(|&(x, _)| shape.local(x)).collect();
        let scale = shape.placement.scale;
        let covectors: Vec<f64> = taps.iter().map(|(_, covector)| scale * covector.value).collect();
        return baked.network_gradient(&points, &covectors);
    }
    let count = shape.parameter_count();
    let parts = (NUMBERS / count.max(1)).clamp(1, PARTS);
    let size = taps.len().div_ceil(parts).max(1);
    let part = |taps: &[(DVec3, Jet<DVec3>)]| {
        let mut sum = vec![0.0; count];
        taps.iter().for_each(|&(x, covector)| shape.add_parameter_gradient(x, covector, &mut sum));
        sum
    };
    let sums: Vec<Vec<f64>> = taps.par_chunks(size).map(part).collect();
    let mut total = vec![0.0; count];
    for sum in sums {
        total.iter_mut().zip(sum).for_each(|(total, part)| *total += part);
    }
    shape.surface.pull_back(total)
}
