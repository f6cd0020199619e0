use super::*;
use crate::random::stream;

const ALL: [Filter; 3] = [Filter::Box, Filter::Tent, Filter::Gaussian];

#[test]
fn unit_integral_and_consistent_gradient() {
    for filter in ALL {
        // The trapezoidal rule on a fine grid, and central differences.
        let n = 4000;
        let r = filter.radius();
        let h = 2.0 * r / f64::from(n);
        let mass: f64 = (0..n).map(|i| filter.profile(-r + (f64::from(i) + 0.5) * h) * h).sum();
        assert!((mass - 1.0).abs() < 1e-6, "{filter:?} {mass}");
        let (o, e) = (DVec2::new(0.31, -0.17), 1e-6);
        for axis in [DVec2::X, DVec2::Y] {
            let fd = (filter.value(o + e * axis) - filter.value(o - e * axis)) / (2.0 * e);
            assert!((fd - filter.gradient(o).dot(axis)).abs() < 1e-8, "{filter:?}");
        }
    }
}

#[test]
fn gaussian_constants() {
    assert_eq!(LOWERED.to_bits(), (-8.0_f64).exp().to_bits());
    assert!(Filter::Gaussian.profile(2.0 - 1e-12) < 1e-10, "continuous at the border");
}

#[test]
fn samples_have_the_means_of_the_filter() {
    for filter in ALL {
        let film = Film::placed(4, 4, filter, DVec2::new(5.0, -3.0), 0.25).unwrap();
        let mut rng = stream(1, &[]);
        let n = 200_000;
        let centre = film.centre(2, 1);
        let (mut sum, mut squares, mut gradient) = (0.0, 0.0, DVec2::ZERO);
        for _ in 0..n {
            let s = film.sample(centre, &mut rng);
            sum += s.value;
            squares += s.value * s.value;
            gradient += s.gradient * film.pixel();
        }
        let n = f64::from(n);
        let error = ((squares / n - (sum / n).powi(2)) / n).sqrt();
        assert!((sum / n - 1.0).abs() <= 6.0 * error + 1e-12, "{filter:?}");
        assert!((gradient / n).length() < 0.05, "{filter:?}");
    }
}

#[test]
fn bad_films_are_refused() {
    assert!(matches!(Film::new(0, 3, Filter::Box), Err(FilmError::Size { .. })));
    for pixel in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let film = Film::placed(1, 1, Filter::Box, DVec2::ZERO, pixel);
        assert!(matches!(film, Err(FilmError::Placement { .. })));
    }
}
