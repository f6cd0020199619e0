//! Sums of samples over a film, with the variance of their mean.

use super::film::FilmPlane;

/// What the samples of one row of cells add to the rows of pixels they reach: the mean of K quantities and the
/// variance of each mean.
#[derive(Clone, Debug)]
pub(crate) struct Strip<const K: usize> {
    columns: usize,
    /// The first row of pixels, which may lie outside the image.
    first_row: isize,
    mean: Vec<[f64; K]>,
    variance: Vec<[f64; K]>,
}

/// The samples of one cell, for the pixels around it.
#[derive(Clone, Debug)]
pub(crate) struct Cell<const K: usize> {
    /// Pixels along one side of the neighbourhood.
    side: usize,
    sum: Vec<[f64; K]>,
    squares: Vec<[f64; K]>,
    sample: Vec<[f64; K]>,
}

impl<const K: usize> Cell<K> {
    pub(crate) fn new(film: &FilmPlane) -> Self {
        let side = 2 * film.reach + 1;
        let empty = vec![[0.0; K]; side * side];
        Self { side, sum: empty.clone(), squares: empty.clone(), sample: empty }
    }

    /// Adds quantities to the sample under way, for the pixel at (i, j) of the neighbourhood.
    pub(crate) fn add(&mut self, i: usize, j: usize, quantities: &[f64; K]) {
        let sample = &mut self.sample[j * self.side + i];
        for k in 0..K {
            sample[k] += quantities[k];
        }
    }

    /// Ends the sample under way.
    pub(crate) fn next_sample(&mut self) {
        for ((sample, sum), squares) in self.sample.iter_mut().zip(&mut self.sum).zip(&mut self.squares) {
            for k in 0..K {
                sum[k] += sample[k];
                squares[k] += sample[k] * sample[k];
            }
            *sample = [0.0; K];
        }
    }
}

impl<const K: usize> Strip<K> {
    /// For the row `j` of cells, counted with the filter's reach.
    pub(crate) fn new(film: &FilmPlane, j: usize) -> Self {
        let rows = 2 * film.reach + 1;
        let empty = vec![[0.0; K]; rows * film.columns];
        Self {
            columns: film.columns,
            first_row: j as isize - 2 * film.reach as isize,
            mean: empty.clone(),
            variance: empty,
        }
    }

    /// Adds a cell of n samples, the `i`-th of its row counted with the filter's reach, and empties it.
    pub(crate) fn absorb(&mut self, i: usize, cell: &mut Cell<K>, n: usize) {
        let reach = cell.side / 2;
        let samples = n as f64;
        for row in 0..cell.side {
            for column in 0..cell.side {
                let from = row * cell.side + column;
                let (sum, squares) = (cell.sum[from], cell.squares[from]);
                cell.sum[from] = [0.0; K];
                cell.squares[from] = [0.0; K];
                let Some(x) = (i + column).checked_sub(2 * reach).filter(|&x| x < self.columns) else {
                    continue;
                };
                let at = row * self.columns + x;
                for k in 0..K {
                    let mean = sum[k] / samples;
                    self.mean[at][k] += mean;
                    if n > 1 {
                        let spread = (squares[k] / samples - mean * mean).max(0.0);
                        self.variance[at][k] += spread / (samples - 1.0);
                    }
                }
            }
        }
    }
}

/// The whole image.
#[derive(Clone, Debug)]
pub(crate) struct Sheet<const K: usize> {
    pub(crate) mean: Vec<[f64; K]>,
    pub(crate) variance: Vec<[f64; K]>,
}

impl<const K: usize> Sheet<K> {
    pub(crate) fn new(film: &FilmPlane) -> Self {
        let empty = vec![[0.0; K]; film.columns * film.rows];
        Self { mean: empty.clone(), variance: empty }
    }

    /// Adds a strip. The order of strips decides the last bits.
    pub(crate) fn absorb(&mut self, strip: &Strip<K>) {
        let columns = strip.columns;
        let rows = self.mean.len() / columns;
        for (r, (mean, variance)) in
            strip.mean.chunks(columns).zip(strip.variance.chunks(columns)).enumerate()
        {
            let Ok(row) = usize::try_from(strip.first_row + r as isize) else { continue };
            if row >= rows {
                continue;
            }
            for x in 0..columns {
                for k in 0..K {
                    self.mean[row * columns + x][k] += mean[x][k];
                    self.variance[row * columns + x][k] += variance[x][k];
                }
            }
        }
    }
}
