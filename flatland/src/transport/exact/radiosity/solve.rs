//! Linear system of infinitely many bounces, (I − K) x = b, by GMRES (Saad and Schultz 1986).
//!
//! Summing bounces takes about 1/(1 − ρ) of them for each digit. A Krylov space captures the few eigenvalues
//! of K near 1, one for each closed room, and the rest of the spectrum decays.

use rayon::prelude::*;

use super::gather::Row;
use crate::calculus::Dual;

/// Residual, relative to the solution, that counts as rounding.
const CONVERGED: f64 = 1e-15;
/// Number of vectors before a restart from the residual.
const MOST_VECTORS: usize = 60;
/// Largest number of restarts; each cycle gains digits until rounding stops it.
const MOST_CYCLES: usize = 20;
/// Residual, relative to the solution, that is accepted when cycles gain no more: the rounding of sums over
/// thousands of nodes.
const ACCEPTED: f64 = 1e-12;

/// A solution and the largest entry of its residual, values and slopes.
pub(super) struct Solved {
    pub(super) values: Vec<Dual<1>>,
    pub(super) residual: Dual<1>,
}

/// x = b + K x and its derivative, ẋ = ḃ + K̇ x + K ẋ; or the remaining residual.
pub(super) fn solve(rows: &[Row], direct: &[Dual<1>]) -> Result<Solved, f64> {
    let source: Vec<f64> = direct.iter().map(|b| b.value).collect();
    let (value, first) = gmres(rows, &source)?;
    let carried = product(rows, &value, |weight| weight.slope());
    let source: Vec<f64> = direct.iter().zip(carried).map(|(b, c)| b.slope() + c).collect();
    let (slope, second) = gmres(rows, &source)?;
    let values = value.into_iter().zip(slope).map(|(value, slope)| Dual::new(value, [slope])).collect();
    Ok(Solved { values, residual: Dual::new(first, [second]) })
}

/// K x with one component (value or slope) of K's entries.
fn product(rows: &[Row], x: &[f64], part: impl Fn(&Dual<1>) -> f64 + Sync) -> Vec<f64> {
    rows.par_iter().map(|row| row.iter().map(|(i, weight)| part(weight) * x[*i]).sum()).collect()
}

fn gmres(rows: &[Row], source: &[f64]) -> Result<(Vec<f64>, f64), f64> {
    let mut x = vec![0.0; source.len()];
    let mut residual = source.to_vec();
    let mut left = largest(&residual);
    for _ in 0..MOST_CYCLES {
        if left <= CONVERGED * largest(&x) {
            break;
        }
        let correction = cycle(rows, &residual);
        let tried: Vec<f64> = x.iter().zip(correction).map(|(x, c)| x + c).collect();
        let carried = product(rows, &tried, |weight| weight.value);
        let next: Vec<f64> = (0..tried.len()).map(|i| source[i] + carried[i] - tried[i]).collect();
        let now = largest(&next);
        // NaN must not continue either.
        if now.is_nan() || now >= left {
            break;
        }
        (x, residual, left) = (tried, next, now);
    }
    if left <= ACCEPTED * largest(&x) { Ok((x, left)) } else { Err(left) }
}

/// The element y of the Krylov space of r with the least ‖r − (I − K) y‖.
fn cycle(rows: &[Row], r: &[f64]) -> Vec<f64> {
    let length = norm(r);
    let mut basis = vec![scaled(r, 1.0 / length)];
    // The columns of the triangular factor, the rotations that made it, and the rotated source.
    let mut triangle: Vec<Vec<f64>> = vec![];
    let mut rotations: Vec<(f64, f64)> = vec![];
    let mut rotated = vec![length];
    for k in 0..MOST_VECTORS.min(r.len()) {
        let carried = product(rows, &basis[k], |weight| weight.value);
        let mut next: Vec<f64> = basis[k].iter().zip(carried).map(|(v, c)| v - c).collect();
        let mut column: Vec<f64> = vec![];
        for vector in &basis {
            let along = dot(vector, &next);
            next.iter_mut().zip(vector).for_each(|(n, v)| *n -= along * v);
            column.push(along);
        }
        let height = norm(&next);
        for (i, &(cos, sin)) in rotations.iter().enumerate() {
            let (above, below) = (column[i], column[i + 1]);
            (column[i], column[i + 1]) = (cos * above + sin * below, cos * below - sin * above);
        }
        let diagonal = f64::hypot(column[k], height);
        if diagonal == 0.0 {
            break;
        }
        let (cos, sin) = (column[k] / diagonal, height / diagonal);
        column[k] = diagonal;
        triangle.push(column);
        rotations.push((cos, sin));
        let last = rotated[k];
        rotated[k] = cos * last;
        rotated.push(-sin * last);
        if sin * last.abs() <= f64::EPSILON * length {
            break;
        }
        basis.push(scaled(&next, 1.0 / height));
    }
    combined(&basis, &triangle, &rotated, r.len())
}

/// Σ c_i v_i with the triangular system's solution c.
fn combined(basis: &[Vec<f64>], triangle: &[Vec<f64>], rotated: &[f64], size: usize) -> Vec<f64> {
    let mut c = rotated[..triangle.len()].to_vec();
    for (k, column) in triangle.iter().enumerate().rev() {
        c[k] /= column[k];
        let known = c[k];
        c[..k].iter_mut().zip(column).for_each(|(c, entry)| *c -= entry * known);
    }
    let mut sum = vec![0.0; size];
    for (factor, vector) in c.iter().zip(basis) {
        sum.iter_mut().zip(vector).for_each(|(s, v)| *s += factor * v);
    }
    sum
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn norm(a: &[f64]) -> f64 {
    dot(a, a).sqrt()
}

fn scaled(a: &[f64], factor: f64) -> Vec<f64> {
    a.iter().map(|x| factor * x).collect()
}

fn largest(a: &[f64]) -> f64 {
    a.iter().fold(0.0, |m, x| x.abs().max(m))
}
