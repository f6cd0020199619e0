//! Matrix–vector products in double precision.
//!
//! Independent sums fill the registers, which the compiler finds where they are inlined into
//! [`Instructions::run`](crate::lanes::Instructions::run). Nothing is fused, and the order is fixed: results
//! have the same bits on all machines.

use crate::lanes::{Instructions, Lanes, Task};

/// Numbers of a row multiplied at a time.
const WIDE: usize = 8;

/// Rows summed in parallel.
const TALL: usize = 4;

/// Columns summed in parallel.
const COLUMNS: usize = 32;

/// W, row by row.
#[derive(Clone, Copy)]
pub(super) struct Matrix<'w> {
    pub(super) entries: &'w [f64],
    pub(super) columns: usize,
    /// Instruction set of the machine.
    pub(super) instructions: Instructions,
}

impl Matrix<'_> {
    /// Adds W x to one number per row.
    pub(super) fn add(self, x: &[f64], y: &mut [f64]) {
        self.instructions.run(Add { matrix: self, x: &x[..self.columns], y });
    }

    /// W x.
    pub(super) fn times(self, x: &[f64]) -> Vec<f64> {
        let mut y = vec![0.0; self.entries.len() / self.columns];
        self.add(x, &mut y);
        y
    }

    /// Wᵀ y.
    pub(super) fn transpose_times(self, y: &[f64]) -> Vec<f64> {
        let mut x = vec![0.0; self.columns];
        self.instructions.run(Transpose { matrix: self, y, x: &mut x });
        x
    }
}

struct Add<'a> {
    matrix: Matrix<'a>,
    x: &'a [f64],
    y: &'a mut [f64],
}

impl Task for Add<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self, _: L) {
        let Self { matrix: Matrix { entries, columns, .. }, x, y } = self;
        let (wide, rest) = x.as_chunks::<WIDE>();
        for (rows, y) in entries.chunks(TALL * columns).zip(y.chunks_mut(TALL)) {
            let mut sums = [[0.0; WIDE]; TALL];
            if y.len() == TALL {
                let [a, b, c, d] =
                    [0, 1, 2, 3].map(|i| rows[i * columns..(i + 1) * columns].as_chunks::<WIDE>().0);
                for ((((x, a), b), c), d) in wide.iter().zip(a).zip(b).zip(c).zip(d) {
                    for l in 0..WIDE {
                        sums[0][l] += a[l] * x[l];
                        sums[1][l] += b[l] * x[l];
                        sums[2][l] += c[l] * x[l];
                        sums[3][l] += d[l] * x[l];
                    }
                }
            } else {
                for (sums, row) in sums.iter_mut().zip(rows.chunks(columns)) {
                    for (x, row) in wide.iter().zip(row.as_chunks::<WIDE>().0) {
                        for l in 0..WIDE {
                            sums[l] += row[l] * x[l];
                        }
                    }
                }
            }
            for ((y, s), row) in y.iter_mut().zip(&sums).zip(rows.chunks(columns)) {
                let mut sum = ((s[0] + s[4]) + (s[2] + s[6])) + ((s[1] + s[5]) + (s[3] + s[7]));
                for (w, x) in row[WIDE * wide.len()..].iter().zip(rest) {
                    sum += w * x;
                }
                *y += sum;
            }
        }
    }
}

struct Transpose<'a> {
    matrix: Matrix<'a>,
    y: &'a [f64],
    x: &'a mut [f64],
}

impl Task for Transpose<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self, _: L) {
        let Self { matrix: Matrix { entries, columns, .. }, y, x } = self;
        let (wide, rest) = x.as_chunks_mut::<COLUMNS>();
        let after = COLUMNS * wide.len();
        for (k, x) in wide.iter_mut().enumerate() {
            let mut sums = [0.0; COLUMNS];
            for (row, y) in entries.chunks_exact(columns).zip(y) {
                let row = &row[COLUMNS * k..COLUMNS * (k + 1)];
                for l in 0..COLUMNS {
                    sums[l] += row[l] * y;
                }
            }
            *x = sums;
        }
        for (row, y) in entries.chunks_exact(columns).zip(y) {
            for (x, w) in rest.iter_mut().zip(&row[after..]) {
                *x += w * y;
            }
        }
    }
}
