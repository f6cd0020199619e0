//! Films with pixels of equal angle.

use std::f64::consts::TAU;

use crate::plane::Filter;

/// A row of pixels over an interval of angles. Pixel i is centred at `first` + (i + ½) `pixel`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AngularFilm {
    first: f64,
    pixel: f64,
    count: usize,
    filter: Filter,
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
    pub fn new(first: f64, last: f64, count: usize, filter: Filter) -> Result<Self, AngularFilmError> {
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
    pub fn filter(&self) -> Filter {
        self.filter
    }

    /// Centre of a pixel.
    #[must_use]
    pub fn centre(&self, pixel: usize) -> f64 {
        self.first + (pixel as f64 + 0.5) * self.pixel
    }

    /// Half the width of the filter's support, in radians.
    #[must_use]
    pub fn radius(&self) -> f64 {
        self.filter.radius() * self.pixel
    }

    /// h at an angle from the pixel's centre, in radians⁻¹; ∫ h = 1.
    #[must_use]
    pub fn value(&self, offset: f64) -> f64 {
        self.filter.profile(offset / self.pixel) / self.pixel
    }

    /// h′, in radians⁻².
    #[must_use]
    pub fn slope(&self, offset: f64) -> f64 {
        self.filter.profile_slope(offset / self.pixel) / (self.pixel * self.pixel)
    }

    /// The ends of the parts of a pixel's support on which its filter is smooth, in order.
    pub(super) fn cuts(&self, pixel_centre: f64) -> impl Iterator<Item = f64> {
        let cells = self.filter.intervals();
        let ends = cells.iter().map(|(first, _)| *first).chain([self.filter.radius()]);
        let pixel = self.pixel;
        ends.map(move |end| pixel_centre + end * pixel)
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;

    #[test]
    fn bad_films_are_refused() {
        let film = |last, count, filter| AngularFilm::new(-PI, last, count, filter);
        assert!(film(PI, 1, Filter::Box).is_ok() && film(PI, 2, Filter::Tent).is_ok());
        assert_eq!(film(PI, 1, Filter::Tent), Err(AngularFilmError::Support { support: 2.0 * TAU }));
        assert_eq!(film(PI, 0, Filter::Box), Err(AngularFilmError::NoPixels));
        assert!(matches!(film(4.0, 9, Filter::Box), Err(AngularFilmError::Interval { .. })));
    }
}
