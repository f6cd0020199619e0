//! Products of weights with a block of points, one point per lane.
//!
//! Code is generated for an instruction set only where it is inlined into `Simd::vectorize`; everything here
//! is therefore `#[inline(always)]`.

use pulp::Simd;

/// Points of a block: four registers of eight. Two would suffice for the arithmetic, but load weights twice
/// as often.
pub(super) const BLOCK: usize = 32;

/// One number per point of a block.
pub(super) type Row = [f32; BLOCK];

/// Rows of weights multiplied together. With two registers of points, twelve sums stay in registers, and
/// three of sixteen remain for a weight and the points.
pub(super) const TALL: usize = 6;

/// Registers of points, or of columns, multiplied together.
pub(super) const WIDE: usize = 2;

/// A matrix in panels of six rows, with the six numbers of a column contiguous; the last rows are padded by
/// 0.
#[derive(Clone, Debug)]
pub(super) struct Panels {
    panels: Vec<[f32; TALL]>,
    columns: usize,
}

impl Panels {
    /// A matrix from its entries.
    pub(super) fn new(rows: usize, columns: usize, entry: impl Fn(usize, usize) -> f32) -> Self {
        let six = |first: usize, column| {
            std::array::from_fn(|i| if first + i < rows { entry(first + i, column) } else { 0.0 })
        };
        let panels = (0..rows).step_by(TALL).flat_map(|first| (0..columns).map(move |j| (first, j)));
        Self { panels: panels.map(|(first, j)| six(first, j)).collect(), columns }
    }

    /// y = W x + b, with b = 0 if it is empty. `y` has room for the padded rows.
    #[inline(always)]
    pub(super) fn apply<S: Simd>(&self, simd: S, x: &[Row], bias: &[f32], y: &mut [Row]) {
        let panels = self.panels.chunks_exact(self.columns);
        for (k, (panel, y)) in panels.zip(y.chunks_exact_mut(TALL)).enumerate() {
            let mut begin = [0.0; TALL];
            for (i, begin) in begin.iter_mut().enumerate() {
                *begin = bias.get(TALL * k + i).copied().unwrap_or(0.0);
            }
            tile(simd, panel, &x[..self.columns], begin, y);
        }
    }
}

/// Six rows of W x + b.
#[inline(always)]
fn tile<S: Simd>(simd: S, panel: &[[f32; TALL]], x: &[Row], begin: [f32; TALL], y: &mut [Row]) {
    const { assert!(BLOCK.is_multiple_of(WIDE * S::F32_LANES), "a block is some registers") };
    let mut first = 0;
    while first < BLOCK / S::F32_LANES {
        let mut sums = [[simd.splat_f32s(0.0); WIDE]; TALL];
        for i in 0..TALL {
            sums[i] = [simd.splat_f32s(begin[i]); WIDE];
        }
        for (weights, x) in panel.iter().zip(x) {
            let x = &S::as_simd_f32s(x).0[first..first + WIDE];
            for i in 0..TALL {
                let weight = simd.splat_f32s(weights[i]);
                for c in 0..WIDE {
                    sums[i][c] = simd.mul_add_e_f32s(weight, x[c], sums[i][c]);
                }
            }
        }
        for (y, sums) in y.iter_mut().zip(&sums) {
            S::as_mut_simd_f32s(y).0[first..first + WIDE].copy_from_slice(sums);
        }
        first += WIDE;
    }
}
