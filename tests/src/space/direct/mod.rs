//! Pixels of a diffuse ground in direct light, and their derivatives, by quadrature over the film.
//!
//! Where one plane fills a pixel, I = ∫ h(u) ρ/π E(x(u; θ), θ) du, with x where the ray through u meets the
//! plane. E is continuous in u where no surface touches the ground, so that dI/dθ = ∫ h ρ/π dE/dθ du at fixed
//! u, with no boundary term. [`irradiance`](super::irradiance::irradiance) gives both integrands exactly. The
//! value has kinks and the derivative bounded discontinuities, where the ground enters a penumbra or the
//! plane of a surface, so the integral is not exact: it is refined where two rules differ most, and their
//! difference is the stated error.

mod sunk;

use std::collections::BinaryHeap;

use anyhow::{Context as _, Result};
use flatland::plane::{Film, Filter};
use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::coverage::{Camera, CameraMotion};
use super::irradiance::{Ground, Receiver, World, unchecked};
use crate::quadrature::rule;

/// Minimum number of squares that a pixel is cut into.
const FIRST_SQUARES: usize = 16;
/// Maximum number of squares that a pixel is cut into.
const SQUARES: usize = 2000;

/// A diffuse ground, its lighting, and a camera for which it fills all visible pixels.
#[derive(Clone, Debug)]
pub struct DirectScene {
    /// Emitters and occluders above the ground, all outside the camera's view.
    pub world: World,
    /// The ground, of which only the plane matters.
    pub ground: Ground,
    /// The ground's reflectance.
    pub albedo: DVec3,
    /// The camera.
    pub camera: Camera,
    /// The camera's motion.
    pub camera_motion: CameraMotion,
    /// The pixel filter.
    pub filter: Filter,
}

/// A pixel and its derivative.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Pixel {
    /// I = ∫ h L du.
    pub value: DVec3,
    /// dI/dθ.
    pub derivative: DVec3,
    /// Difference between two rules for the value, summed over the pixel's squares: an estimate of its error,
    /// conservative except where light reaches so small a part of the pixel that no node of either rule is
    /// lit.
    pub value_error: f64,
    /// The same difference for the derivative.
    pub derivative_error: f64,
}

impl DirectScene {
    /// The scene at θ, at rest.
    pub fn displaced(&self, theta: f64) -> Self {
        Self {
            world: self.world.displaced(theta),
            ground: self.ground.displaced(theta),
            camera: self.camera.displaced(&self.camera_motion, theta),
            camera_motion: CameraMotion::default(),
            ..self.clone()
        }
    }

    /// All pixels, row by row, each to `tolerance` times the larger of ∫ h L du and |∫ h dL/dθ du|, or as
    /// accurately as 2000 squares a pixel allow.
    ///
    /// # Errors
    /// If there is no camera, no film, no world, or some point of the film does not show the ground.
    pub fn image(&self, tolerance: f64) -> Result<Vec<Pixel>> {
        self.camera.check(&self.camera_motion)?;
        let (width, height) = (self.camera.width, self.camera.height);
        let film = Film::new(width, height, self.filter)?;
        self.world.check()?;
        let pixel = |i: usize| self.pixel(&film, [i % width, i / width], tolerance);
        (0..width * height).into_par_iter().map(pixel).collect()
    }

    fn pixel(&self, film: &Film, [x, y]: [usize; 2], tolerance: f64) -> Result<Pixel> {
        let centre = film.centre(x, y);
        let integrand = |u: DVec2| Ok(self.radiance(u)?.scaled(film.filter_value(centre, u)));
        let mut squares = BinaryHeap::new();
        let mut parts: Vec<_> = film.cells(x, y).map(|cell| [cell.min, cell.max]).collect();
        while parts.len() < FIRST_SQUARES {
            parts = parts.into_iter().flat_map(|[min, max]| quarters(min, max)).collect();
        }
        for [min, max] in parts {
            squares.push(Square::new(&integrand, min, max)?);
        }
        let allowed = tolerance * squares.iter().map(|s| s.magnitude).sum::<f64>();
        let mut pixel = Pixel::default();
        pixel.add(&integrand, squares, allowed, SQUARES)?;
        Ok(pixel)
    }

    /// L and dL/dθ at a point of the film.
    fn radiance(&self, u: DVec2) -> Result<Sample> {
        let ray = self.camera.ray(&self.camera_motion, u);
        let light = Receiver::on_ray(&ray, &self.ground).and_then(|x| unchecked(&self.world, &x));
        let light = light.with_context(|| format!("at the film's point {u}"))?;
        let outgoing = light.outgoing(self.albedo);
        Ok(Sample { value: outgoing.value, derivative: outgoing.derivative })
    }
}

/// A value and its derivative, at a point or integrated.
#[derive(Clone, Copy, Debug, Default)]
struct Sample {
    value: DVec3,
    derivative: DVec3,
}

impl Sample {
    fn scaled(self, factor: f64) -> Self {
        Self { value: factor * self.value, derivative: factor * self.derivative }
    }

    fn plus(self, other: Self) -> Self {
        Self { value: self.value + other.value, derivative: self.derivative + other.derivative }
    }

    /// The largest component of either.
    fn magnitudes(self) -> [f64; 2] {
        [self.value, self.derivative].map(|v| v.abs().max_element())
    }
}

impl Pixel {
    /// Adds an integral over squares, repeatedly quartering the one where two rules differ most, until the
    /// difference meets the tolerance or the maximum number of squares is reached.
    fn add(
        &mut self,
        integrand: &impl Fn(DVec2) -> Result<Sample>,
        mut squares: BinaryHeap<Square>,
        allowed: f64,
        most: usize,
    ) -> Result<()> {
        let mut error: f64 = squares.iter().map(Square::error).sum();
        while error > allowed && squares.len() < most {
            let Some(worst) = squares.pop() else { break };
            error -= worst.error();
            for [min, max] in quarters(worst.min, worst.max) {
                let square = Square::new(integrand, min, max)?;
                error += square.error();
                squares.push(square);
            }
        }
        // Summed in an order that does not depend on ties in the heap.
        for square in squares.into_sorted_vec() {
            self.value += square.fine.value;
            self.derivative += square.fine.derivative;
            self.value_error += square.errors[0];
            self.derivative_error += square.errors[1];
        }
        Ok(())
    }
}

/// A part of a pixel, integrated by two rules.
struct Square {
    min: DVec2,
    max: DVec2,
    /// The sum over the quarters.
    fine: Sample,
    /// The largest component of `fine`.
    magnitude: f64,
    /// Difference between that and the rule on the whole square.
    errors: [f64; 2],
}

impl Square {
    fn new(integrand: &impl Fn(DVec2) -> Result<Sample>, min: DVec2, max: DVec2) -> Result<Self> {
        let coarse = gauss(integrand, min, max)?;
        let mut fine = Sample::default();
        for [min, max] in quarters(min, max) {
            fine = fine.plus(gauss(integrand, min, max)?);
        }
        let errors = fine.plus(coarse.scaled(-1.0)).magnitudes();
        let [value, derivative] = fine.magnitudes();
        Ok(Self { min, max, fine, magnitude: value.max(derivative), errors })
    }

    fn error(&self) -> f64 {
        self.errors[0].max(self.errors[1])
    }

    /// Sort key: by error, then by position.
    fn key(&self) -> [f64; 3] {
        [self.error(), self.min.x, self.min.y]
    }
}

impl Ord for Square {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        let pairs = self.key().into_iter().zip(other.key());
        pairs.fold(std::cmp::Ordering::Equal, |order, (a, b)| order.then(a.total_cmp(&b)))
    }
}

impl PartialOrd for Square {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Square {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other).is_eq()
    }
}

impl Eq for Square {}

fn quarters(min: DVec2, max: DVec2) -> [[DVec2; 2]; 4] {
    let half = 0.5 * (max - min);
    [DVec2::ZERO, DVec2::X, DVec2::Y, DVec2::ONE].map(|corner| {
        let start = min + corner * half;
        [start, start + half]
    })
}

/// The rule of degree 5 in both directions.
fn gauss(integrand: &impl Fn(DVec2) -> Result<Sample>, min: DVec2, max: DVec2) -> Result<Sample> {
    let size = max - min;
    let mut sum = Sample::default();
    for (s, ws) in rule(3) {
        for (t, wt) in rule(3) {
            let value = integrand(min + size * DVec2::new(*s, *t))?;
            sum = sum.plus(value.scaled(ws * wt * size.x * size.y));
        }
    }
    Ok(sum)
}

#[cfg(test)]
mod tests;
