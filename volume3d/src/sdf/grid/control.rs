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

/// A sufficient bound, for which steps are nearly those of a distance.
const ENOUGH: f64 = 1.1;

/// Cells processed together.
const TOGETHER: usize = 4096;

/// The longest control vector of all cells of a cubic spline, given the `rough` bounds of its nodes, or
/// [`ENOUGH`] if that is longer. Cells are processed in order of decreasing rough bound, until no other one
/// could have a longer vector.
pub(super) fn slope(nodes: &[f64], size: [usize; 3], per_length: [f64; 3], rough: &[f64]) -> f64 {
    let (largest, cells) = spread(rough, size);
    let mut order: Vec<(f64, usize)> =
        largest.into_iter().zip(0..).filter(|(bound, _)| *bound > ENOUGH).collect();
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

/// The greatest value among the nodes of each cell; one more cell than nodes along each axis, as nodes are
/// repeated beyond the border.
fn spread(values: &[f64], mut size: [usize; 3]) -> (Vec<f64>, [usize; 3]) {
    let mut values = values.to_vec();
    for axis in 0..3 {
        let step: usize = size[..axis].iter().product();
        let count = size[axis];
        let layers = values.chunks_exact(step * count);
        let spread = layers.flat_map(|layer| {
            (0..=count).flat_map(move |cell| {
                let nodes = cell.saturating_sub(2)..=(cell + 1).min(count - 1);
                (0..step).map(move |i| nodes.clone().map(|n| layer[n * step + i]).fold(0.0, f64::max))
            })
        });
        values = spread.collect();
        size[axis] += 1;
    }
    (values, size)
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
