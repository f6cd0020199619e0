//! Sums of z aᵀ over the points of blocks, for gradients by weights.
//!
//! A lane is a column of the weights. Everything is `#[inline(always)]`, as in `product`.

use pulp::Simd;

use super::product::{BLOCK, Row, TALL, WIDE};

/// Rows and columns of a tile of sums, which stays in registers.
const TILE: (usize, usize) = (TALL, 16);

/// Sixteen columns of two blocks, point by point.
type Strip = [[f32; TILE.1]; 2 * BLOCK];

/// Σ z aᵀ + Σ ż ȧᵀ over points, in tiles, row by row.
#[derive(Clone, Debug)]
pub(super) struct OuterSum {
    tiles: Vec<[[f32; TILE.1]; TILE.0]>,
    strips: Vec<Strip>,
    rows: usize,
    columns: usize,
}

impl OuterSum {
    pub(super) fn new(rows: usize, columns: usize) -> Self {
        let across = columns.div_ceil(TILE.1);
        let tiles = vec![[[0.0; TILE.1]; TILE.0]; rows.div_ceil(TILE.0) * across];
        Self { tiles, strips: vec![[[0.0; TILE.1]; 2 * BLOCK]; across], rows, columns }
    }

    pub(super) fn clear(&mut self) {
        self.tiles.fill([[0.0; TILE.1]; TILE.0]);
    }

    /// Adds the points of a block. Rows of `z` are padded to multiples of six.
    #[inline(always)]
    pub(super) fn add<S: Simd>(&mut self, simd: S, z: [&[Row]; 2], a: [&[Row]; 2]) {
        const { assert!(TILE.1.is_multiple_of(S::F32_LANES), "a strip is some registers") };
        for (half, a) in a.into_iter().enumerate() {
            for (strip, a) in self.strips.iter_mut().zip(a[..self.columns].chunks(TILE.1)) {
                for (column, a) in a.iter().enumerate() {
                    for (place, &a) in strip[half * BLOCK..].iter_mut().zip(a) {
                        place[column] = a;
                    }
                }
            }
        }
        let rows = z[0].as_chunks().0.iter().zip(z[1].as_chunks().0);
        for (tiles, (z, moving)) in self.tiles.chunks_exact_mut(self.strips.len()).zip(rows) {
            for (tile, strip) in tiles.iter_mut().zip(&self.strips) {
                add_tile(simd, tile, [z, moving], strip);
            }
        }
    }

    /// The sums, row by row.
    pub(super) fn entries(&self) -> impl Iterator<Item = f32> + '_ {
        let across = self.strips.len();
        (0..self.rows).flat_map(move |i| {
            (0..self.columns)
                .map(move |j| self.tiles[i / TILE.0 * across + j / TILE.1][i % TILE.0][j % TILE.1])
        })
    }
}

/// Sums of one tile over both blocks, with as many sums in registers as in `product`.
#[inline(always)]
fn add_tile<S: Simd>(simd: S, tile: &mut [[f32; TILE.1]; TILE.0], z: [&[Row; TILE.0]; 2], strip: &Strip) {
    let mut first = 0;
    while first + WIDE <= TILE.1 / S::F32_LANES {
        let mut sums = [[simd.splat_f32s(0.0); WIDE]; TILE.0];
        for (sums, row) in sums.iter_mut().zip(&*tile) {
            sums.copy_from_slice(&S::as_simd_f32s(row).0[first..first + WIDE]);
        }
        for (z, strip) in z.into_iter().zip(strip.as_chunks::<BLOCK>().0) {
            for p in 0..BLOCK {
                let a = &S::as_simd_f32s(&strip[p]).0[first..first + WIDE];
                for i in 0..TILE.0 {
                    let z = simd.splat_f32s(z[i][p]);
                    for c in 0..WIDE {
                        sums[i][c] = simd.mul_add_e_f32s(z, a[c], sums[i][c]);
                    }
                }
            }
        }
        for (sums, row) in sums.iter().zip(&mut *tile) {
            S::as_mut_simd_f32s(row).0[first..first + WIDE].copy_from_slice(sums);
        }
        first += WIDE;
    }
}
