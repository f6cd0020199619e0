//! Worst-case assertions over many cases.

use rayon::prelude::*;

/// Hostile numbers, for which references must return finite results or refuse.
pub(crate) const HOSTILE: [f64; 12] =
    [f64::NAN, f64::INFINITY, -1e300, 1e300, 1e-300, 5e-324, 0.0, -0.0, 1.0, -1.0, 1e-9, 3.0];

/// Asserts that a figure is below a limit in all cases, each of which gives its figure and its label; NaN is
/// not below.
pub(crate) fn assert_below<T: Send>(
    limit: f64,
    cases: impl IntoIterator<Item = T>,
    figure: impl Fn(T) -> (f64, String) + Sync,
) {
    let cases: Vec<T> = cases.into_iter().collect();
    let figures = cases.into_par_iter().map(|case| {
        let (figure, label) = figure(case);
        (if figure.is_nan() { f64::INFINITY } else { figure }, label)
    });
    let (worst, label) =
        figures.reduce(|| (f64::NEG_INFINITY, String::new()), |a, b| if b.0 > a.0 { b } else { a });
    println!("worst: {worst:.3e} of {limit:e}, {label}");
    assert!(worst.is_finite() && worst < limit, "{worst:e} of {limit:e}, {label}");
}
