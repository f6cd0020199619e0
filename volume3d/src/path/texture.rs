//! Textures, looked up in numbers.

use flatland::calculus::{Number, Rgb};

use super::calculus::Calculus;
use crate::scene::{Texture, Wrap};

/// The bilinear lookup of a texture at (s, t), t upwards, wrapped as told along each axis.
pub(crate) fn lookup<C: Calculus>(
    texture: &Texture,
    index: usize,
    wraps: [Wrap; 2],
    s: C::Number,
    t: C::Number,
    calculus: &C,
) -> Rgb<C::Number> {
    let half = C::Number::constant(0.5);
    let m = texture.to_uv;
    let offset = |x: f64| C::Number::constant(x);
    let u = s * m.matrix2.x_axis.x + t * m.matrix2.y_axis.x + offset(m.translation.x);
    let v = s * m.matrix2.x_axis.y + t * m.matrix2.y_axis.y + offset(m.translation.y);
    let (width, height) = (texture.width, texture.height);
    let x = u * width as f64 - half;
    let y = (C::Number::constant(1.0) - v) * height as f64 - half;
    let (i, j) = (x.value().floor(), y.value().floor());
    let (fx, fy) = (x - offset(i), y - offset(j));
    let texel = |di: f64, dj: f64| {
        let column = wrap(wraps[0], i + di, width);
        let row = wrap(wraps[1], j + dj, height);
        calculus.texel(index, row * width + column)
    };
    let (gx, gy) = (offset(1.0) - fx, offset(1.0) - fy);
    texel(0.0, 0.0) * (gx * gy)
        + texel(1.0, 0.0) * (fx * gy)
        + texel(0.0, 1.0) * (gx * fy)
        + texel(1.0, 1.0) * (fx * fy)
}

fn wrap(wrap: Wrap, index: f64, size: usize) -> usize {
    let n = size as f64;
    let index = match wrap {
        Wrap::Repeat => index.rem_euclid(n),
        Wrap::Mirror => {
            let around = index.rem_euclid(2.0 * n);
            if around < n { around } else { 2.0 * n - 1.0 - around }
        }
        Wrap::Clamp => index.clamp(0.0, n - 1.0),
    };
    // rem_euclid of a tiny negative number rounds to n itself.
    (index as usize).min(size - 1)
}
