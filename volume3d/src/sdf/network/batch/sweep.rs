//! Sweeps over a block of points: forward, back to the point, along a velocity, and back to the weights.
//!
//! Everything is `#[inline(always)]`, as in `product`.

use pulp::Simd;

use super::block::{Block, Sums};
use super::product::{BLOCK, Row};
use super::softplus::Softplus;
use super::weights::{Layer, Weights};

/// φ alone: z_k = W_k a_{k−1} + b_k, a_k = σ(z_k). Only two layers are stored.
#[inline(always)]
pub(super) fn values<S: Simd>(simd: S, weights: &Weights, block: &mut Block) -> Row {
    let softplus = Softplus::new(simd, weights.sharpness);
    let Block { features, values, .. } = block;
    let (inner, outer) = values.split_at_mut(1);
    let (inner, outer) = (&mut inner[0], &mut outer[0]);
    for (k, layer) in weights.hidden.iter().enumerate() {
        layer.forward.apply(simd, if k == 0 { features } else { inner }, &layer.bias, outer);
        for row in &mut outer[..layer.rows] {
            for z in S::as_mut_simd_f32s(row).0 {
                *z = softplus.value(simd, *z);
            }
        }
        std::mem::swap(inner, outer);
    }
    output(simd, weights, inner)
}

/// φ, storing all a_k and σ′.
#[inline(always)]
pub(super) fn forward<S: Simd>(simd: S, weights: &Weights, block: &mut Block) -> Row {
    let softplus = Softplus::new(simd, weights.sharpness);
    let Block { features, values, slopes, .. } = block;
    for (k, layer) in weights.hidden.iter().enumerate() {
        let (inner, outer) = values.split_at_mut(k);
        let outer = &mut outer[0];
        layer.forward.apply(simd, inner.last().unwrap_or(features), &layer.bias, outer);
        for (row, slope) in outer[..layer.rows].iter_mut().zip(&mut slopes[k]) {
            for (z, slope) in S::as_mut_simd_f32s(row).0.iter_mut().zip(S::as_mut_simd_f32s(slope).0) {
                [*z, *slope] = softplus.with_slope(simd, *z);
            }
        }
    }
    output(simd, weights, &values[weights.hidden.len() - 1])
}

/// w·a + b.
#[inline(always)]
fn output<S: Simd>(simd: S, weights: &Weights, a: &[Row]) -> Row {
    let mut value = [weights.last_bias; BLOCK];
    let sums = S::as_mut_simd_f32s(&mut value).0;
    for (&w, a) in weights.last.iter().zip(a) {
        let w = simd.splat_f32s(w);
        for (sum, &a) in sums.iter_mut().zip(S::as_simd_f32s(a).0) {
            *sum = simd.mul_add_e_f32s(w, a, *sum);
        }
    }
    value
}

/// ∇φ, after [`forward`]: backwards from u = w, with ż̄ = σ′u and u = Wᵀ ż̄.
#[inline(always)]
pub(super) fn gradient<S: Simd>(simd: S, weights: &Weights, block: &mut Block) -> [Row; 3] {
    let Block { feature_slopes, slopes, adjoint: [u, scaled], .. } = block;
    begin(u, &weights.last, &[1.0; BLOCK]);
    for (layer, slopes) in weights.hidden.iter().zip(slopes).rev() {
        scale::<S>(simd, slopes, u, &mut scaled[..layer.rows]);
        layer.backward.apply(simd, scaled, &[], u);
    }
    let mut gradient = [[0.0; BLOCK]; 3];
    for (j, (slope, u)) in feature_slopes.iter().zip(&*u).enumerate().take(weights.inputs) {
        for (sum, (slope, u)) in gradient[j % 3].iter_mut().zip(slope.iter().zip(u)) {
            *sum += slope * u;
        }
    }
    gradient
}

/// Adds the gradient of Σ c φ + q·∇φ by all weights, after [`forward`]; the formulas are those of
/// [`Network`](super::super::Network)'s `add_parameter_gradient`. As σ″ = β σ′(1 − σ′), σ″ż is β(1 − σ′) ȧ.
#[inline(always)]
pub(super) fn reverse<S: Simd>(
    simd: S,
    weights: &Weights,
    block: &mut Block,
    (c, q): (&Row, &[Row; 3]),
    sums: &mut Sums,
) {
    along(simd, weights, block, q);
    let Block { features, values, slopes, tangents, adjoint: [u, z_moving], bent: [v, z], .. } = block;
    begin(u, &weights.last, &[1.0; BLOCK]);
    begin(v, &weights.last, c);
    let last = weights.hidden.len() - 1;
    for ((sum, a), tangent) in sums.last.iter_mut().zip(&values[last]).zip(&tangents[last + 1]) {
        *sum += total(simd, c, a) + total(simd, &[1.0; BLOCK], tangent);
    }
    sums.last_bias += total(simd, c, &[1.0; BLOCK]);
    for (k, layer) in weights.hidden.iter().enumerate().rev() {
        scale(simd, &slopes[k], u, &mut z_moving[..layer.rows]);
        turn(simd, weights.sharpness, layer, [&slopes[k], &tangents[k + 1], u, v], z);
        let inner = k.checked_sub(1).map_or(&*features, |k| &values[k]);
        sums.weights[k].add(simd, [z, z_moving], [inner, &tangents[k]]);
        for (sum, z) in sums.biases[k].iter_mut().zip(&*z) {
            *sum += total(simd, z, &[1.0; BLOCK]);
        }
        if k > 0 {
            layer.backward.apply(simd, z, &[], v);
            layer.backward.apply(simd, z_moving, &[], u);
        }
    }
}

/// Forward from ȧ_{−1} = Jγ q: ȧ_k = σ′ W_k ȧ_{k−1}.
#[inline(always)]
fn along<S: Simd>(simd: S, weights: &Weights, block: &mut Block, q: &[Row; 3]) {
    let Block { feature_slopes, slopes, tangents, .. } = block;
    for (j, (tangent, slope)) in tangents[0].iter_mut().zip(&*feature_slopes).enumerate() {
        for (tangent, (slope, q)) in tangent.iter_mut().zip(slope.iter().zip(&q[j % 3])) {
            *tangent = slope * q;
        }
    }
    for (k, layer) in weights.hidden.iter().enumerate() {
        let (inner, outer) = tangents.split_at_mut(k + 1);
        let outer = &mut outer[0];
        layer.forward.apply(simd, &inner[k], &[], outer);
        for (row, slope) in outer[..layer.rows].iter_mut().zip(&slopes[k]) {
            for (z, &slope) in S::as_mut_simd_f32s(row).0.iter_mut().zip(S::as_simd_f32s(slope).0) {
                *z = simd.mul_f32s(*z, slope);
            }
        }
    }
}

/// w times one number per point.
#[inline(always)]
fn begin(rows: &mut [Row], w: &[f32], factors: &Row) {
    for (row, w) in rows.iter_mut().zip(w) {
        for (place, factor) in row.iter_mut().zip(factors) {
            *place = w * factor;
        }
    }
}

/// σ′u.
#[inline(always)]
fn scale<S: Simd>(simd: S, slopes: &[Row], u: &[Row], scaled: &mut [Row]) {
    for ((scaled, slope), u) in scaled.iter_mut().zip(slopes).zip(u) {
        let (slope, u) = (S::as_simd_f32s(slope).0, S::as_simd_f32s(u).0);
        for ((scaled, &slope), &u) in S::as_mut_simd_f32s(scaled).0.iter_mut().zip(slope).zip(u) {
            *scaled = simd.mul_f32s(slope, u);
        }
    }
}

/// z̄ = σ′v + β(1 − σ′) ȧ u.
#[inline(always)]
fn turn<S: Simd>(
    simd: S,
    sharpness: f32,
    layer: &Layer,
    [slopes, tangents, u, v]: [&[Row]; 4],
    z: &mut [Row],
) {
    let (one, sharpness) = (simd.splat_f32s(1.0), simd.splat_f32s(sharpness));
    for i in 0..layer.rows {
        let [slope, tangent, u, v] = [slopes, tangents, u, v].map(|rows| S::as_simd_f32s(&rows[i]).0);
        for (p, z) in S::as_mut_simd_f32s(&mut z[i]).0.iter_mut().enumerate() {
            let left = simd.mul_f32s(sharpness, simd.sub_f32s(one, slope[p]));
            let bent = simd.mul_f32s(simd.mul_f32s(left, tangent[p]), u[p]);
            *z = simd.mul_add_e_f32s(slope[p], v[p], bent);
        }
    }
}

/// Σ x y over the points.
#[inline(always)]
fn total<S: Simd>(simd: S, x: &Row, y: &Row) -> f32 {
    let mut sum = simd.splat_f32s(0.0);
    for (&x, &y) in S::as_simd_f32s(x).0.iter().zip(S::as_simd_f32s(y).0) {
        sum = simd.mul_add_e_f32s(x, y, sum);
    }
    simd.reduce_sum_f32s(sum)
}
