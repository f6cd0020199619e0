//! Films with pixels of equal angle.

use std::f64::consts::TAU;

/// The pixel filter over angles, with ∫h = 1.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum AngularFilter {
    /// One pixel wide, discontinuous at the pixel's static ends.
    Box,
    /// Two pixels wide, continuous.
    #[default]
    Tent,
}

/// A row of pixels over an interval of angles. Pixel i is centred at `first` + (i + ½) `pixel`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AngularFilm {
    first: f64,
    pixel: f64,
    count: usize,
    filter: AngularFilter,
}

/// Invalid parameters of a film.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum AngularFilmError {
    /// The interval is not finite, not increasing, or wider than the circle.
    #[error("angles from {first} to {last} are not an interval of at most 2π")]
    Interval {
        /// Its first angle.
        first: f64,
        /// Its last.
        last: f64,
    },
    /// The filter of a pixel overlaps itself around the circle.
    #[error("the support of a pixel's filter is {support} radians wide, more than 2π")]
    Support {
        /// Its width, in radians.
        support: f64,
    },
    /// No pixels.
    #[error("at least one pixel is needed")]
    NoPixels,
}

impl AngularFilm {
    /// `count` pixels from the angle `first` to `last`, in radians.
    ///
    /// # Errors
    /// If there are no pixels, the interval is invalid or the support of a pixel is wider than the circle.
    pub fn new(first: f64, last: f64, count: usize, filter: AngularFilter) -> Result<Self, AngularFilmError> {
        if count == 0 {
            return Err(AngularFilmError::NoPixels);
        }
        let width = last - first;
        if !(first.is_finite() && width > 0.0 && width <= TAU) {
            return Err(AngularFilmError::Interval { first, last });
        }
        let film = Self { first, pixel: width / count as f64, count, filter };
        let support = 2.0 * film.radius();
        if support <= TAU { Ok(film) } else { Err(AngularFilmError::Support { support }) }
    }

    /// Number of pixels.
    #[must_use]
    pub fn count(&self) -> usize {
        self.count
    }

    /// The width of a pixel, in radians.
    #[must_use]
    pub fn pixel(&self) -> f64 {
        self.pixel
    }

    /// The filter.
    #[must_use]
    pub fn filter(&self) -> AngularFilter {
        self.filter
    }

    /// Centre of a pixel.
    #[must_use]
    pub fn centre(&self, pixel: usize) -> f64 {
        self.first + (pixel as f64 + 0.5) * self.pixel
    }

    /// Half the width of the filter's support.
    #[must_use]
    pub fn radius(&self) -> f64 {
        match self.filter {
            AngularFilter::Box => 0.5 * self.pixel,
            AngularFilter::Tent => self.pixel,
        }
    }

    /// h at an angle from the pixel's centre, in radians⁻¹.
    #[must_use]
    pub fn value(&self, offset: f64) -> f64 {
        let relative = offset.abs() / self.pixel;
        match self.filter {
            AngularFilter::Box if relative <= 0.5 => 1.0 / self.pixel,
            AngularFilter::Box => 0.0,
            AngularFilter::Tent => (1.0 - relative).max(0.0) / self.pixel,
        }
    }

    /// h′.
    #[must_use]
    pub fn slope(&self, offset: f64) -> f64 {
        match self.filter {
            AngularFilter::Tent if offset.abs() < self.pixel => -offset.signum() / (self.pixel * self.pixel),
            _ => 0.0,
        }
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;

    #[test]
    fn bad_films_are_refused() {
        let film = |last, count, filter| AngularFilm::new(-PI, last, count, filter);
        assert!(film(PI, 1, AngularFilter::Box).is_ok() && film(PI, 2, AngularFilter::Tent).is_ok());
        assert_eq!(film(PI, 1, AngularFilter::Tent), Err(AngularFilmError::Support { support: 2.0 * TAU }));
        assert_eq!(film(PI, 0, AngularFilter::Box), Err(AngularFilmError::NoPixels));
        assert!(matches!(film(4.0, 9, AngularFilter::Box), Err(AngularFilmError::Interval { .. })));
    }
}
