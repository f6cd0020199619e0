//! Texture lookups over numbers.

use flatland::calculus::{Number, Rgb};

use super::calculus::Calculus;
use crate::scene::{Texture, Wrap};

/// Bilinear lookup of a texture at (s, t), t upwards, with a wrap mode for each axis.
pub(crate) fn lookup<C: Calculus>(
    texture: &Texture,
    index: usize,
    wraps: [Wrap; 2],
    s: C::Number,
    t: C::Number,
    calculus: &C,
) -> Rgb<C::Number> {
    let place = place(texture, s, t);
    let [[a, b], [c, d]] = place.corners(texture, wraps);
    let [[fx, fy], [gx, gy]] = place.weights();
    calculus.texel(index, a) * (gx * gy)
        + calculus.texel(index, b) * (fx * gy)
        + calculus.texel(index, c) * (gx * fy)
        + calculus.texel(index, d) * (fx * fy)
}

/// A point among texels: the column and row above and left of it, and the fractional offset.
struct Place<T> {
    cell: [f64; 2],
    beyond: [T; 2],
}

fn place<T: Number>(texture: &Texture, s: T, t: T) -> Place<T> {
    let half = T::constant(0.5);
    let m = texture.to_uv;
    let offset = |x: f64| T::constant(x);
    let u = s * m.matrix2.x_axis.x + t * m.matrix2.y_axis.x + offset(m.translation.x);
    let v = s * m.matrix2.x_axis.y + t * m.matrix2.y_axis.y + offset(m.translation.y);
    let x = u * texture.width as f64 - half;
    let y = (offset(1.0) - v) * texture.height as f64 - half;
    let (i, j) = (x.value().floor(), y.value().floor());
    Place { cell: [i, j], beyond: [x - offset(i), y - offset(j)] }
}

impl<T: Number> Place<T> {
    /// Indices of the four surrounding texels, row by row.
    fn corners(&self, texture: &Texture, wraps: [Wrap; 2]) -> [[usize; 2]; 2] {
        let [i, j] = self.cell;
        [0.0, 1.0].map(|dj| {
            let row = wrap(wraps[1], j + dj, texture.height);
            [0.0, 1.0].map(|di| row * texture.width + wrap(wraps[0], i + di, texture.width))
        })
    }

    /// Bilinear weights along each axis.
    fn weights(&self) -> [[T; 2]; 2] {
        let one = T::constant(1.0);
        [self.beyond, self.beyond.map(|f| one - f)]
    }
}

/// Rec. 709 luminance.
pub(crate) fn luminance<T: Number>(Rgb([r, g, b]): Rgb<T>) -> T {
    r * 0.2126 + g * 0.7152 + b * 0.0722
}

/// Gradient of a texture's luminance by (s, t), in the bilinear patch of the point.
pub(crate) fn slope<C: Calculus>(
    texture: &Texture,
    index: usize,
    s: C::Number,
    t: C::Number,
    calculus: &C,
) -> [C::Number; 2] {
    let place = place(texture, s, t);
    let [[a, b], [c, d]] =
        place.corners(texture, [texture.wrap; 2]).map(|row| row.map(|i| luminance(calculus.texel(index, i))));
    let [[fx, fy], [gx, gy]] = place.weights();
    let by_x = (b - a) * gy + (d - c) * fy;
    let by_y = (c - a) * gx + (d - b) * fx;
    let (u, v) = (by_x * texture.width as f64, by_y * -(texture.height as f64));
    let m = texture.to_uv.matrix2;
    [u * m.x_axis.x + v * m.x_axis.y, u * m.y_axis.x + v * m.y_axis.y]
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
