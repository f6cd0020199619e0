//! Slope bound of a cubic spline, from the Bézier form of its cells.
//!
//! In every cell each component of ∇φ is a polynomial, of degree 2 along its own axis and 3 along the others;
//! raised to degree 3 along all, the three have one Bézier form with vector coefficients. ∇φ is a convex
//! combination of its 64 control vectors (Farin 2002), and no longer than the longest of them. Differences of
//! nodes alone are a bound too, but at ridges oblique to the axes it is up to √3 times as large; they select
//! the cells for which control vectors are computed.

use rayon::prelude::*;

use super::place;

/// Number of nodes that affect a cell, along an axis.
const WIDTH: usize = 4;
/// Number of coefficients of a cell.
const COUNT: usize = WIDTH * WIDTH * WIDTH;

/// Conversion of the B-spline coefficients of an interval to the Bézier coefficients of the cubic.
const VALUES: [[f64; WIDTH]; WIDTH] = [
    [1.0 / 6.0, 4.0 / 6.0, 1.0 / 6.0, 0.0],
    [0.0, 4.0 / 6.0, 2.0 / 6.0, 0.0],
    [0.0, 2.0 / 6.0, 4.0 / 6.0, 0.0],
    [0.0, 1.0 / 6.0, 4.0 / 6.0, 1.0 / 6.0],
];

/// Conversion of the B-spline coefficients to the Bézier coefficients of the derivative, in units of a
/// spacing, raised to degree 3.
const SLOPES: [[f64; WIDTH]; WIDTH] = [
    [-0.5, 0.0, 0.5, 0.0],
    [-1.0 / 6.0, -4.0 / 6.0, 5.0 / 6.0, 0.0],
    [0.0, -5.0 / 6.0, 4.0 / 6.0, 1.0 / 6.0],
    [0.0, -0.5, 0.0, 0.5],
];

/// A sufficient bound: steps are then nearly as long as for a distance.
const ENOUGH: f64 = 1.1;

/// Cells processed together.
const TOGETHER: usize = 4096;

/// The longest control vector of all cells of a cubic spline with the `rough` bounds of its nodes, by layer,
/// or [`ENOUGH`] if that is longer. Cells are processed in decreasing order of their rough bounds, until no
/// remaining cell can have a longer one.
pub(super) fn slope(
    nodes: &[f64],
    size: [usize; 3],
    per_length: [f64; 3],
    rough: &(dyn Fn(usize) -> Vec<f64> + Sync),
) -> f64 {
    let cells = size.map(|n| n + 1);
    let slabs = cells[2].div_ceil(SLAB);
    let mut order: Vec<(f64, usize)> = (0..slabs)
        .into_par_iter()
        .flat_map_iter(|slab| steep(size, slab * SLAB..((slab + 1) * SLAB).min(cells[2]), rough))
        .collect();
    order.sort_unstable_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    let slope_of =
        |&(_, cell): &(f64, usize)| longest(&coefficients(nodes, size, place(cell, cells)), per_length);
    let mut found = ENOUGH;
    for cells in order.chunks(TOGETHER) {
        if cells[0].0 <= found {
            break;
        }
        found = cells.par_iter().map(slope_of).reduce(|| found, f64::max);
    }
    found
}

/// Layers of cells processed by one task.
const SLAB: usize = 16;

/// The cells of some layers with a bound above [`ENOUGH`] at one of their nodes, each with its largest bound.
/// Along each axis there is one more cell than nodes, as nodes are repeated beyond the border.
fn steep(
    [nx, ny, nz]: [usize; 3],
    layers: std::ops::Range<usize>,
    rough: &(dyn Fn(usize) -> Vec<f64> + Sync),
) -> Vec<(f64, usize)> {
    let around = |cell: usize, count: usize| cell.saturating_sub(2)..(cell + 2).min(count);
    // The bounds of a layer of nodes, if any of them is large.
    let of_layer = |k: usize| Some(rough(k)).filter(|bounds| bounds.iter().any(|bound| *bound > ENOUGH));
    let (mut found, mut known) = (vec![], std::collections::VecDeque::new());
    let mut next = around(layers.start, nz).start;
    for z in layers {
        let wanted = around(z, nz);
        while next < wanted.end {
            known.push_back((next, of_layer(next)));
            next += 1;
        }
        while known.front().is_some_and(|(k, _)| *k < wanted.start) {
            known.pop_front();
        }
        let mut large = known.iter().filter_map(|(_, bounds)| bounds.as_ref());
        let Some(first) = large.next() else { continue };
        let mut most = first.clone();
        large.for_each(|bounds| {
            most.iter_mut().zip(bounds).for_each(|(most, bound)| *most = most.max(*bound));
        });
        let mut row = vec![0.0_f64; nx];
        for y in 0..=ny {
            row.fill(0.0);
            for j in around(y, ny) {
                row.iter_mut().zip(&most[j * nx..]).for_each(|(row, bound)| *row = row.max(*bound));
            }
            for x in 0..=nx {
                let bound = row[around(x, nx)].iter().copied().fold(0.0, f64::max);
                if bound > ENOUGH {
                    found.push((bound, x + (nx + 1) * (y + (ny + 1) * z)));
                }
            }
        }
    }
    found
}

/// Nodes of a cell, x fastest.
fn coefficients(nodes: &[f64], size: [usize; 3], cell: [usize; 3]) -> [f64; COUNT] {
    std::array::from_fn(|index| {
        let offset = place(index, [WIDTH; 3]);
        let [x, y, z] =
            std::array::from_fn(|axis| (cell[axis] + offset[axis]).saturating_sub(2).min(size[axis] - 1));
        nodes[x + size[0] * (y + size[1] * z)]
    })
}

/// The length of the longest control vector.
fn longest(nodes: &[f64; COUNT], per_length: [f64; 3]) -> f64 {
    let (value, slope) = (along::<1>(nodes, &VALUES), along::<1>(nodes, &SLOPES));
    let [still, across] = [&VALUES, &SLOPES].map(|basis| along::<WIDTH>(&value, basis));
    let partials = [
        along::<16>(&along::<WIDTH>(&slope, &VALUES), &VALUES),
        along::<16>(&across, &VALUES),
        along::<16>(&still, &SLOPES),
    ];
    let square = |i: usize| (0..3).map(|axis| (partials[axis][i] * per_length[axis]).powi(2)).sum::<f64>();
    (0..COUNT).map(square).fold(0.0, f64::max).sqrt()
}

/// Change of basis along the axis on which neighbours are `STEP` numbers apart.
fn along<const STEP: usize>(numbers: &[f64; COUNT], basis: &[[f64; WIDTH]; WIDTH]) -> [f64; COUNT] {
    let mut found = [0.0; COUNT];
    for (to, from) in found.chunks_exact_mut(WIDTH * STEP).zip(numbers.chunks_exact(WIDTH * STEP)) {
        for (row, weights) in to.chunks_exact_mut(STEP).zip(basis) {
            for (i, number) in row.iter_mut().enumerate() {
                let [a, b, c, d] = *weights;
                *number = a * from[i] + b * from[STEP + i] + c * from[2 * STEP + i] + d * from[3 * STEP + i];
            }
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use flatland::random::{open01, stream};

    use super::*;

    /// Layer by layer, the same cells and bounds as from all nodes of every cell.
    #[test]
    fn steep_cells_are_those_of_all_nodes() {
        let mut rng = stream(11, &[]);
        for size in [[5, 4, 40], [2, 3, 2], [7, 2, 17]] {
            let count: usize = size.iter().product();
            let bounds: Vec<f64> = (0..count)
                .map(|_| if open01(&mut rng) < 0.02 { 1.0 + open01(&mut rng) } else { 1.0 })
                .collect();
            let layer = size[0] * size[1];
            let rough = |k: usize| bounds[k * layer..(k + 1) * layer].to_vec();
            let cells = size.map(|n| n + 1);
            let mut expected = vec![];
            for cell in 0..cells.iter().product() {
                let at = place(cell, cells);
                let nodes = |axis: usize| at[axis].saturating_sub(2)..(at[axis] + 2).min(size[axis]);
                let all = nodes(2).flat_map(|z| nodes(1).flat_map(move |y| nodes(0).map(move |x| (x, y, z))));
                let most = all.map(|(x, y, z)| bounds[x + size[0] * y + layer * z]).fold(0.0, f64::max);
                expected.extend((most > ENOUGH).then_some((most, cell)));
            }
            let slabs = [0..3, 3..cells[2].min(19), cells[2].min(19)..cells[2]];
            let found: Vec<_> = slabs.into_iter().flat_map(|slab| steep(size, slab, &rough)).collect();
            assert_eq!(found, expected, "{size:?}");
            assert!(size[2] < 10 || !expected.is_empty());
        }
    }
}
