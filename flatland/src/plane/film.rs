//! Film: a grid of square pixels, each with a reconstruction filter of unit integral.

use glam::{DVec2, DVec3};
use rand::Rng;

use crate::calculus::{Dual, Number};
use crate::random::open01;

/// A pixel filter h, separable, of unit integral; lengths below are in pixels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Filter {
    /// 1 on the pixel, 0 elsewhere: discontinuous on the static pixel edge, which every area estimator must
    /// account for (the explicit pixel-edge integral of Bangaru et al. 2022).
    Box,
    /// (1 − |x|)(1 − |y|) on radius 1: continuous.
    #[default]
    Tent,
    /// A Gaussian of σ = ½ pixel, lowered so that it reaches 0 continuously at radius 2 and
    /// rescaled to unit integral, as in Mitsuba 3.
    Gaussian,
}

/// σ of [`Filter::Gaussian`] in pixels.
const SIGMA: f64 = 0.5;
/// exp(−2²/(2 σ²)), by which the Gaussian is lowered to reach 0 at radius 2.
const LOWERED: f64 = 3.354_626_279_025_118_5e-4;
/// ∫ over [−2, 2] of exp(−x²/(2σ²)) − [`LOWERED`]: σ √(2π) erf(2√2) − 4 · [`LOWERED`].
const GAUSSIAN_MASS: f64 = 1.251_892_898_773_618_4;

impl Filter {
    /// Half the width of the filter's support, in pixels.
    #[must_use]
    pub fn radius(self) -> f64 {
        match self {
            Self::Box => 0.5,
            Self::Tent => 1.0,
            Self::Gaussian => 2.0,
        }
    }

    /// Smooth cells of the support, per axis, as (first, last) in pixels from the centre: on each the filter
    /// is a polynomial, or for the Gaussian short enough for Gauss–Legendre quadrature with 8 points to be
    /// exact to rounding.
    pub(crate) fn intervals(self) -> &'static [(f64, f64)] {
        match self {
            Self::Box => &[(-0.5, 0.5)],
            Self::Tent => &[(-1.0, 0.0), (0.0, 1.0)],
            Self::Gaussian => &[
                (-2.0, -1.5),
                (-1.5, -1.0),
                (-1.0, -0.5),
                (-0.5, 0.0),
                (0.0, 0.5),
                (0.5, 1.0),
                (1.0, 1.5),
                (1.5, 2.0),
            ],
        }
    }

    /// h along one axis, at an offset from the pixel centre, in 1/pixel.
    pub(crate) fn profile(self, x: f64) -> f64 {
        match self {
            Self::Box => f64::from(u8::from(x.abs() <= 0.5)),
            Self::Tent => (1.0 - x.abs()).max(0.0),
            Self::Gaussian if x.abs() >= 2.0 => 0.0,
            Self::Gaussian => ((-0.5 * (x / SIGMA).powi(2)).exp() - LOWERED) / GAUSSIAN_MASS,
        }
    }

    /// dh/dx along one axis, in 1/pixel².
    pub(crate) fn profile_slope(self, x: f64) -> f64 {
        match self {
            Self::Box => 0.0,
            Self::Tent if x.abs() > 1.0 => 0.0,
            Self::Tent => -1.0_f64.copysign(x),
            Self::Gaussian if x.abs() >= 2.0 => 0.0,
            Self::Gaussian => -x / (SIGMA * SIGMA) * (-0.5 * (x / SIGMA).powi(2)).exp() / GAUSSIAN_MASS,
        }
    }

    fn profile_dual(self, x: Dual<1>) -> Dual<1> {
        match self {
            Self::Tent if x.value.abs() < 1.0 => Dual::constant(1.0) - x.abs(),
            Self::Gaussian if x.value.abs() < 2.0 => {
                let bell = (x * x * (-0.5 / (SIGMA * SIGMA))).exp();
                (bell - Dual::constant(LOWERED)) * (1.0 / GAUSSIAN_MASS)
            }
            Self::Box | Self::Tent | Self::Gaussian => Dual::constant(self.profile(x.value)),
        }
    }

    /// h at an offset from the pixel centre, in 1/pixel².
    #[must_use]
    pub fn value(self, offset: DVec2) -> f64 {
        self.profile(offset.x) * self.profile(offset.y)
    }

    /// ∇h at an offset from the pixel centre, in 1/pixel³.
    #[must_use]
    pub fn gradient(self, offset: DVec2) -> DVec2 {
        DVec2::new(
            self.profile_slope(offset.x) * self.profile(offset.y),
            self.profile(offset.x) * self.profile_slope(offset.y),
        )
    }

    /// An offset with its density.
    fn sample(self, rng: &mut impl Rng) -> (DVec2, f64) {
        let (x, px) = self.profile_sample(rng);
        let (y, py) = self.profile_sample(rng);
        (DVec2::new(x, y), px * py)
    }

    /// An offset along one axis with its density. The density is bounded away from 0 wherever ∇h is nonzero:
    /// a sample drawn from h itself would give ∇h/h infinite variance at the border.
    pub(crate) fn profile_sample(self, rng: &mut impl Rng) -> (f64, f64) {
        match self {
            Self::Box => (open01(rng) - 0.5, 1.0),
            Self::Tent => (2.0 * open01(rng) - 1.0, 0.5),
            Self::Gaussian => loop {
                // Box–Muller, one axis, redrawn outside the support.
                let x =
                    SIGMA * (-2.0 * open01(rng).ln()).sqrt() * (std::f64::consts::TAU * open01(rng)).cos();
                if x.abs() < 2.0 {
                    break (x, (-0.5 * (x / SIGMA).powi(2)).exp() / (GAUSSIAN_MASS + 4.0 * LOWERED));
                }
            },
        }
    }
}

/// Invalid parameters of a film.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum FilmError {
    /// Width or height is 0, or their product exceeds the index range.
    #[error("film of {width} × {height} pixels")]
    Size {
        /// Number of columns.
        width: usize,
        /// Rows.
        height: usize,
    },
    /// The pixel size is not a positive finite number, or the corner is not finite.
    #[error("film with corner ({}, {}) and pixel size {pixel}: both must be finite, the size positive", corner.x, corner.y)]
    Placement {
        /// The corner of pixel (0, 0) with the smallest coordinates.
        corner: DVec2,
        /// The side of a pixel.
        pixel: f64,
    },
}

/// A grid of `width` × `height` square pixels over the image plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Film {
    width: usize,
    height: usize,
    corner: DVec2,
    pixel: f64,
    filter: Filter,
}

impl Film {
    /// Pixels of unit side, with the corner of pixel (0, 0) at the origin.
    ///
    /// # Errors
    /// [`FilmError::Size`] for an empty film.
    pub fn new(width: usize, height: usize, filter: Filter) -> Result<Self, FilmError> {
        Self::placed(width, height, filter, DVec2::ZERO, 1.0)
    }

    /// Pixels of side `pixel`, with the smallest corner of pixel (0, 0) at `corner`.
    ///
    /// # Errors
    /// [`FilmError::Size`] for an empty film, [`FilmError::Placement`] for a corner or size that is
    /// not finite or not positive.
    pub fn placed(
        width: usize,
        height: usize,
        filter: Filter,
        corner: DVec2,
        pixel: f64,
    ) -> Result<Self, FilmError> {
        let count = width.checked_mul(height).filter(|&n| n > 0 && n <= u32::MAX as usize);
        if count.is_none() {
            return Err(FilmError::Size { width, height });
        }
        if !(corner.is_finite() && pixel.is_normal() && pixel > 0.0) {
            return Err(FilmError::Placement { corner, pixel });
        }
        Ok(Self { width, height, corner, pixel, filter })
    }

    /// Number of columns.
    #[must_use]
    pub fn width(&self) -> usize {
        self.width
    }

    /// Rows.
    #[must_use]
    pub fn height(&self) -> usize {
        self.height
    }

    /// The side of a pixel, in the scene's unit of length.
    #[must_use]
    pub fn pixel(&self) -> f64 {
        self.pixel
    }

    /// The smallest corner of pixel (0, 0).
    #[must_use]
    pub fn corner(&self) -> DVec2 {
        self.corner
    }

    /// The pixel filter.
    #[must_use]
    pub fn filter(&self) -> Filter {
        self.filter
    }

    /// The film with another filter.
    #[must_use]
    pub fn with_filter(self, filter: Filter) -> Self {
        Self { filter, ..self }
    }

    /// The centre of pixel (x, y).
    #[must_use]
    #[expect(clippy::cast_precision_loss, reason = "film coordinates are below 2³²")]
    pub fn centre(&self, x: usize, y: usize) -> DVec2 {
        self.corner + self.pixel * DVec2::new(x as f64 + 0.5, y as f64 + 0.5)
    }

    /// h_p(u) of the pixel centred at `centre`, per unit area.
    #[must_use]
    pub fn filter_value(&self, centre: DVec2, u: DVec2) -> f64 {
        self.filter.value((u - centre) / self.pixel) / (self.pixel * self.pixel)
    }

    /// Width of a pixel's border: several hundred times the rounding of positions on it.
    ///
    /// A box filter is discontinuous there: an edge on a border that moves to one side changes one pixel, and
    /// one that moves to the other side changes the other. Sampling methods give both pixels the mean of the
    /// two one-sided derivatives, which is the derivative for a border displaced randomly within this width.
    pub(crate) fn border(&self) -> f64 {
        let size = self.pixel * DVec2::new(f64::from(self.width as u32), f64::from(self.height as u32));
        let numbers = self.corner.abs().max((self.corner + size).abs()).max_element();
        1024.0 * f64::EPSILON * numbers.max(self.pixel)
    }

    /// h_p(u) for a point of an edge, per unit area; on the border of box pixels it is shared between them.
    pub(crate) fn filter_share(&self, centre: DVec2, u: DVec2) -> f64 {
        if self.filter != Filter::Box {
            return self.filter_value(centre, u);
        }
        let inside = 0.5 * self.pixel - (u - centre).abs();
        let part = (inside / self.border()).map(|x| (0.5 * x + 0.5).clamp(0.0, 1.0));
        part.x * part.y / (self.pixel * self.pixel)
    }

    /// ∇h_p(u) of the pixel centred at `centre`, per unit volume.
    #[must_use]
    pub fn filter_gradient(&self, centre: DVec2, u: DVec2) -> DVec2 {
        self.filter.gradient((u - centre) / self.pixel) / (self.pixel * self.pixel) / self.pixel
    }

    /// h_p along a path, per unit area.
    pub(crate) fn filter_value_dual(&self, centre: DVec2, [x, y]: [Dual<1>; 2]) -> Dual<1> {
        let offset = |x: Dual<1>, centre: f64| (x - Dual::constant(centre)) * (1.0 / self.pixel);
        let h = self.filter.profile_dual(offset(x, centre.x)) * self.filter.profile_dual(offset(y, centre.y));
        h * (1.0 / (self.pixel * self.pixel))
    }

    /// The smallest and largest corner of the support of the filter of the pixel at `centre`.
    #[must_use]
    pub fn support(&self, centre: DVec2) -> (DVec2, DVec2) {
        let r = DVec2::splat(self.filter.radius() * self.pixel);
        (centre - r, centre + r)
    }

    /// The smallest and largest corner of the union of all pixels' supports.
    #[must_use]
    pub fn extent(&self) -> (DVec2, DVec2) {
        let first = self.support(self.centre(0, 0)).0;
        (first, self.support(self.centre(self.width - 1, self.height - 1)).1)
    }

    /// The cells of the support of pixel (x, y) on which its filter is smooth. Neighbouring pixels compute
    /// common sides from the same expression, so these have the same bits.
    #[expect(clippy::cast_precision_loss, reason = "film coordinates are below 2³²")]
    pub fn cells(&self, x: usize, y: usize) -> impl Iterator<Item = FilterCell> + use<> {
        let (corner, pixel, intervals) = (self.corner, self.pixel, self.filter.intervals());
        let middle = DVec2::new(x as f64 + 0.5, y as f64 + 0.5);
        let place = move |offset: DVec2| corner + pixel * (middle + offset);
        intervals.iter().flat_map(move |&(y0, y1)| {
            intervals.iter().map(move |&(x0, x1)| FilterCell {
                min: place(DVec2::new(x0, y0)),
                max: place(DVec2::new(x1, y1)),
            })
        })
    }

    /// Whether a coordinate equals the coordinate of a pixel edge of the film exactly.
    pub(crate) fn is_pixel_edge(&self, axis: usize, coordinate: f64) -> bool {
        let index = ((coordinate - self.corner[axis]) / self.pixel).round();
        coordinate == self.corner[axis] + self.pixel * index
    }

    /// Draws u in the support of the pixel at `centre`.
    pub fn sample(&self, centre: DVec2, rng: &mut impl Rng) -> PixelSample {
        let (offset, density) = self.filter.sample(rng);
        let area = self.pixel * self.pixel;
        PixelSample {
            u: centre + self.pixel * offset,
            value: self.filter.value(offset) / density,
            gradient: self.filter.gradient(offset) / (density * self.pixel),
            density: density / area,
        }
    }
}

/// A point sampled for a pixel, with the filter value already divided by the density.
#[derive(Clone, Copy, Debug)]
pub struct PixelSample {
    /// The point.
    pub u: DVec2,
    /// h(u)/p(u): mean 1.
    pub value: f64,
    /// ∇h(u)/p(u), per unit length: mean 0.
    pub gradient: DVec2,
    /// p(u), per unit area.
    pub density: f64,
}

/// An axis-aligned rectangle on which a pixel's filter is smooth.
#[derive(Clone, Copy, Debug)]
pub struct FilterCell {
    /// The smallest corner.
    pub min: DVec2,
    /// The largest corner.
    pub max: DVec2,
}

/// An RGB image of doubles, row 0 first.
#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    width: usize,
    pixels: Vec<DVec3>,
}

impl Image {
    /// A black image.
    #[must_use]
    pub fn zero(film: &Film) -> Self {
        Self { width: film.width, pixels: vec![DVec3::ZERO; film.width * film.height] }
    }

    /// One value per pixel, row by row.
    ///
    /// # Panics
    /// If `pixels` does not have one value per pixel of `film`.
    #[must_use]
    pub fn from_pixels(film: &Film, pixels: Vec<DVec3>) -> Self {
        assert_eq!(pixels.len(), film.width * film.height, "one value per pixel");
        Self { width: film.width, pixels }
    }

    /// Number of columns.
    #[must_use]
    pub fn width(&self) -> usize {
        self.width
    }

    /// Rows.
    #[must_use]
    pub fn height(&self) -> usize {
        self.pixels.len() / self.width
    }

    /// The value of pixel (x, y).
    ///
    /// # Panics
    /// If (x, y) lies outside the image.
    #[must_use]
    pub fn pixel(&self, x: usize, y: usize) -> DVec3 {
        assert!(x < self.width, "column {x} of {}", self.width);
        self.pixels[y * self.width + x]
    }

    /// All pixels, row by row.
    #[must_use]
    pub fn pixels(&self) -> &[DVec3] {
        &self.pixels
    }

    /// The inner product Σ over pixels and channels of self · other.
    #[must_use]
    pub fn dot(&self, other: &Self) -> f64 {
        self.pixels.iter().zip(&other.pixels).map(|(a, b)| a.dot(*b)).sum()
    }

    /// f applied to each pair of pixels.
    ///
    /// # Panics
    /// If the images differ in size.
    #[must_use]
    pub fn zip(&self, other: &Self, f: impl Fn(DVec3, DVec3) -> DVec3) -> Self {
        assert_eq!((self.width, self.pixels.len()), (other.width, other.pixels.len()), "image sizes");
        let pixels = self.pixels.iter().zip(&other.pixels).map(|(&a, &b)| f(a, b)).collect();
        Self { width: self.width, pixels }
    }
}

#[cfg(test)]
mod tests;
