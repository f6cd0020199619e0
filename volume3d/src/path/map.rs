//! Importance sampling of an environment map.

use std::f64::consts::{PI, TAU};

use glam::DVec3;

use crate::scene::{Scene, Texture};

/// Rec. 709 luminance.
pub(crate) fn luminance(c: DVec3) -> f64 {
    c.dot(DVec3::new(0.2126, 0.7152, 0.0722))
}

/// Weight of the density component that is constant within a patch. The other component is proportional to
/// the radiance and alone would give unbounded variance of derivatives by rotations and texels where a patch
/// is dark at one end: ∫ L′²/L diverges there, with this component only as its logarithm.
const EVEN: f64 = 1.0 / 16.0;

/// Sampler with a density of two components over patches between four neighbouring texel centres of a
/// bilinear lookup: the luminance itself, interpolated in the cosine of the polar angle instead of the angle,
/// and in each patch the luminance of its brightest texel.
#[derive(Clone, Debug)]
pub(super) struct MapSampler {
    width: usize,
    height: usize,
    /// Sum of both components, cumulative over rows of patches, and in each row over columns.
    rows: Vec<f64>,
    columns: Vec<f64>,
    /// ∫ over the sphere of the interpolated luminance, and of the brightest texels' luminance.
    light: f64,
    brightest: f64,
}

/// Luminance at the corners of a patch, `[row][column]`.
#[derive(Clone, Copy, Debug)]
struct Patch([[f64; 2]; 2]);

impl Patch {
    fn of(texture: &Texture, i: usize, j: usize) -> Self {
        let (width, below) = (texture.width, (j + 1).min(texture.height - 1));
        let texel = |i: usize, j: usize| luminance(texture.texels[j * width + i % width]).max(0.0);
        Self([j, below].map(|j| [texel(i, j), texel(i + 1, j)]))
    }

    fn mean(&self) -> f64 {
        0.25 * self.0.as_flattened().iter().sum::<f64>()
    }

    fn brightest(&self) -> f64 {
        self.0.as_flattened().iter().fold(0.0, |a, b| a.max(*b))
    }

    /// Luminance at both ends of the row at a fraction of the patch's height.
    fn row(&self, down: f64) -> [f64; 2] {
        let [above, below] = self.0;
        [0, 1].map(|c| above[c] * (1.0 - down) + below[c] * down)
    }

    fn at(&self, along: f64, down: f64) -> f64 {
        let [a, b] = self.row(down);
        a * (1.0 - along) + b * along
    }

    /// Samples a point with a density proportional to [`at`](Self::at).
    fn sample(&self, [a, b]: [f64; 2]) -> [f64; 2] {
        let [above, below] = self.0;
        let down = linear([above[0] + above[1], below[0] + below[1]], b);
        [linear(self.row(down), a), down]
    }
}

/// Samples x in [0, 1] with a density that is linear between two values.
fn linear([a, b]: [f64; 2], xi: f64) -> f64 {
    let root = (a * a + xi * (b * b - a * a)).max(0.0).sqrt();
    if a + root > 0.0 { (xi * (a + b) / (a + root)).min(1.0) } else { xi }
}

/// Cosine of the polar angle at the upper border of a row of patches.
fn edge(height: usize, j: usize) -> f64 {
    (PI * j as f64 / patch_rows(height) as f64).cos()
}

fn patch_rows(height: usize) -> usize {
    (height - 1).max(1)
}

impl MapSampler {
    pub(super) fn new(scene: &Scene, texture: usize) -> Self {
        let texture = &scene.description.textures[texture];
        let (width, height) = (texture.width, texture.height);
        let patches = || (0..patch_rows(height)).flat_map(|j| (0..width).map(move |i| (i, j)));
        let solid = |j| TAU / width as f64 * (edge(height, j) - edge(height, j + 1));
        let (mut light, mut brightest) = (0.0, 0.0);
        for (i, j) in patches() {
            let patch = Patch::of(texture, i, j);
            light += solid(j) * patch.mean();
            brightest += solid(j) * patch.brightest();
        }
        let mut sampler = Self { width, height, rows: vec![], columns: vec![], light, brightest };
        let (mut row, mut sum) = (0.0, 0.0);
        for (i, j) in patches() {
            let [own, even] = sampler.parts(&Patch::of(texture, i, j));
            row += solid(j) * (own + even);
            sampler.columns.push(row);
            if i + 1 == width {
                sum += row;
                sampler.rows.push(sum);
                row = 0.0;
            }
        }
        sampler
    }

    /// Mean luminance over the sphere.
    pub(super) fn mean(&self) -> f64 {
        self.light / (4.0 * PI)
    }

    /// Mean densities of both components in a patch; uniform for a black map.
    fn parts(&self, patch: &Patch) -> [f64; 2] {
        if self.light > 0.0 {
            [(1.0 - EVEN) * patch.mean() / self.light, EVEN * patch.brightest() / self.brightest]
        } else {
            [0.0, 1.0 / (4.0 * PI)]
        }
    }

    fn density_within(&self, patch: &Patch, [along, down]: [f64; 2]) -> f64 {
        let [_, even] = self.parts(patch);
        even + if self.light > 0.0 { (1.0 - EVEN) * patch.at(along, down) / self.light } else { 0.0 }
    }

    /// Samples a direction in the map's frame, with its density.
    pub(super) fn sample(&self, texture: &Texture, [choice, a, b]: [f64; 3]) -> (DVec3, f64) {
        let (j, choice) = choose(&self.rows, choice);
        let (i, a) = choose(&self.columns[j * self.width..(j + 1) * self.width], a);
        let patch = Patch::of(texture, i, j);
        let [own, even] = self.parts(&patch);
        let within @ [along, down] = if choice * (own + even) < own { patch.sample([a, b]) } else { [a, b] };
        let around = TAU * (i as f64 + 0.5 + along) / self.width as f64;
        let y = edge(self.height, j) * (1.0 - down) + edge(self.height, j + 1) * down;
        let r = (1.0 - y * y).max(0.0).sqrt();
        (DVec3::new(r * around.sin(), y, -r * around.cos()), self.density_within(&patch, within))
    }

    /// Probability density of [`sample`](Self::sample).
    pub(super) fn density(&self, texture: &Texture, direction: DVec3) -> f64 {
        let around = direction.x.atan2(-direction.z) / TAU * self.width as f64 - 0.5;
        let i = (around.floor().rem_euclid(self.width as f64) as usize).min(self.width - 1);
        let (y, rows) = (direction.y.clamp(-1.0, 1.0), patch_rows(self.height));
        let j = ((y.acos() / PI * rows as f64) as usize).min(rows - 1);
        let (above, below) = (edge(self.height, j), edge(self.height, j + 1));
        // Rounding of the angle may have selected the neighbouring patch.
        let down = ((above - y) / (above - below)).clamp(0.0, 1.0);
        self.density_within(&Patch::of(texture, i, j), [around - around.floor(), down])
    }
}

/// Samples an index by cumulative weights, and returns a number that is uniform again.
fn choose(cumulative: &[f64], xi: f64) -> (usize, f64) {
    let last = cumulative.len() - 1;
    let target = xi * cumulative[last];
    let i = cumulative.partition_point(|&c| c <= target).min(last);
    let before = if i > 0 { cumulative[i - 1] } else { 0.0 };
    // A selected weight is positive, up to rounding at the very end.
    let within = (target - before) / (cumulative[i] - before);
    (i, if within >= 0.0 { within.min(1.0) } else { 0.0 })
}

#[cfg(test)]
mod tests;
