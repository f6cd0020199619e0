//! Drawing directions of an environment map.

use std::f64::consts::{PI, TAU};

use glam::DVec3;

use crate::scene::Scene;

/// Rec. 709.
pub(crate) fn luminance(c: DVec3) -> f64 {
    c.dot(DVec3::new(0.2126, 0.7152, 0.0722))
}

/// Directions with a density proportional to the luminance of the brightest of the texels that a bilinear
/// lookup there may mix, constant on cells between texel borders.
#[derive(Clone, Debug)]
pub(super) struct MapSampler {
    width: usize,
    height: usize,
    /// Cumulated over rows, and in each row over columns.
    rows: Vec<f64>,
    columns: Vec<f64>,
    /// The mean luminance over the sphere.
    pub(super) mean: f64,
}

impl MapSampler {
    pub(super) fn new(scene: &Scene, texture: usize) -> Self {
        let texture = &scene.description.textures[texture];
        let (width, height) = (texture.width, texture.height);
        let texel = |i: usize, j: usize| luminance(texture.texels[j * width + i]).max(0.0);
        let mut mean = 0.0;
        let (mut rows, mut columns) = (vec![], vec![]);
        let mut sum = 0.0;
        for j in 0..height {
            let (top, bottom) = (j.saturating_sub(1), (j + 1).min(height - 1));
            // Solid angle of a row's cells: the difference of cosines.
            let edge = |j: usize| (PI * j as f64 / height as f64).cos();
            let cell = TAU / width as f64 * (edge(j) - edge(j + 1));
            let mut row = 0.0;
            for i in 0..width {
                let around = [i + width - 1, i, i + 1].map(|i| i % width);
                let brightest =
                    around.iter().flat_map(|&i| [top, j, bottom].map(|j| texel(i, j))).fold(0.0, f64::max);
                mean += cell * texel(i, j) / (4.0 * PI);
                row += cell * brightest;
                columns.push(row);
            }
            sum += row;
            rows.push(sum);
        }
        if sum <= 0.0 {
            // Black: any density will do.
            rows = (1..=height).map(|j| j as f64).collect();
            columns = (0..height).flat_map(|_| (1..=width).map(|i| i as f64 / width as f64)).collect();
        }
        Self { width, height, rows, columns, mean }
    }

    fn whole(&self) -> f64 {
        self.rows[self.height - 1]
    }

    fn mass(cumulative: &[f64], i: usize) -> f64 {
        cumulative[i] - if i > 0 { cumulative[i - 1] } else { 0.0 }
    }

    fn density_of_cell(&self, i: usize, j: usize) -> f64 {
        let row = &self.columns[j * self.width..(j + 1) * self.width];
        let edge = |j: usize| (PI * j as f64 / self.height as f64).cos();
        let cell = TAU / self.width as f64 * (edge(j) - edge(j + 1));
        Self::mass(row, i) / (self.whole() * cell)
    }

    /// A direction in the map's frame, and its density.
    pub(super) fn sample(&self, [choice, a, b]: [f64; 3]) -> (DVec3, f64) {
        let j = self.rows.partition_point(|&c| c <= choice * self.whole()).min(self.height - 1);
        let row = &self.columns[j * self.width..(j + 1) * self.width];
        let target = a * row[self.width - 1];
        let i = row.partition_point(|&c| c <= target).min(self.width - 1);
        let within = ((target - if i > 0 { row[i - 1] } else { 0.0 }) / Self::mass(row, i)).clamp(0.0, 1.0);
        let edge = |j: usize| (PI * j as f64 / self.height as f64).cos();
        let y = edge(j) + b * (edge(j + 1) - edge(j));
        let around = TAU * (i as f64 + within) / self.width as f64;
        let r = (1.0 - y * y).max(0.0).sqrt();
        (DVec3::new(r * around.sin(), y, -r * around.cos()), self.density_of_cell(i, j))
    }

    /// The density of [`sample`](Self::sample).
    pub(super) fn density(&self, direction: DVec3) -> f64 {
        let around = direction.x.atan2(-direction.z).rem_euclid(TAU);
        let i = ((around / TAU * self.width as f64) as usize).min(self.width - 1);
        let j =
            ((direction.y.clamp(-1.0, 1.0).acos() / PI * self.height as f64) as usize).min(self.height - 1);
        self.density_of_cell(i, j)
    }
}
