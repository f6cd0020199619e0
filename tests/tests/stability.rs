//! Numerical stability at the extremes: a table of `RESULTS.md` that this test fills.
//!
//! `UPDATE_RESULTS=1 cargo test --release -p tests --test stability` writes it; otherwise the test checks
//! every row against its bound, and that the table has the same rows.

use flatland::estimator::{Construction, GradientImage, Method, WarpedArea};
use flatland::plane::exact::Arrangement;
use flatland::plane::fields::scene_stencil;
use flatland::plane::{Attachment, Film, Filter, Image, Motion, Polygon, Scene, Shade, Shape};
use flatland::random::stream;
use flatland::warp::{Debias, LinearField as _, Warp};
use glam::{DVec2, DVec3};
use tests::oracle;
use tests::results::{self, power_of_ten};
use tests::scenes::Case;

/// The extreme; the edge integral compared with the oracle; the divergence with the edge integral; warped
/// area.
type Row = [String; 4];

fn polygon(points: &[(f64, f64)], scale: f64, offset: DVec2) -> Polygon {
    let place = |&(x, y): &(f64, f64)| offset + scale * DVec2::new(x, y);
    Polygon::simple(points.iter().map(place).collect::<Vec<_>>()).expect("simple")
}

/// Two polygons that move differently. Coordinates are multiples of 1/64, so that scaling by powers of 2 and
/// moving by integers is exact, and only the engine loses digits.
fn pair(scale: f64, offset: DVec2) -> Case {
    let quad = polygon(&[(2.3125, 2.125), (5.875, 2.6875), (5.4375, 5.625), (2.0625, 4.875)], scale, offset);
    let triangle = polygon(&[(4.3125, 1.125), (7.1875, 4.1875), (3.6875, 3.90625)], scale, offset);
    let slope = [DVec2::new(0.1, 0.05), DVec2::new(-0.1, 0.1), DVec2::ZERO].map(|g| g / scale);
    let shade = Shade::linear(offset, DVec3::new(0.3, 0.8, 0.5), slope, Attachment::Material);
    let shapes =
        vec![Shape::new(quad, shade), Shape::new(triangle, Shade::constant(DVec3::new(0.1, 0.7, 0.9)))];
    let scene = Scene::new(DVec3::splat(0.2), shapes).expect("a scene");
    let motion = Motion::rotate([0], offset + scale * DVec2::splat(4.0))
        .and(Motion::translate([1], scale * DVec2::new(0.5, 0.75)));
    let film = Film::placed(6, 5, Filter::Tent, offset + scale * DVec2::ONE, scale).expect("a film");
    Case { scene, motion, film, label: format!("pair × {scale} + {offset}") }
}

/// The exact engine compared with the oracle and with itself, and warped area with the exact engine; `held`
/// requires it to find the whole derivative, for scenes without features far below the spacing of samples.
fn row(extreme: impl Into<String>, case: Case, method: &WarpedArea, held: bool) -> Row {
    let velocities = case.velocities();
    let oracle = oracle::image(&case.scene, &velocities, &case.film);
    let arrangement = Arrangement::new(&case.scene, &case.film).expect("an arrangement");
    let interior = arrangement.interior(&case.film, &velocities).expect("velocities fit");
    let boundary = arrangement.boundary(&case.film, &velocities).expect("differentiable");
    let divergence = arrangement.divergence(&case.film, &arrangement.oracle(&velocities));
    let size = oracle.iter().map(|o| o.absolute).fold(0.0, f64::max);
    let total = boundary.zip(&interior, |b, i| b + i);
    let edge = total.pixels().iter().zip(&oracle).map(|(t, o)| (*t - o.derivative).abs().max_element());
    let edge = edge.fold(0.0, f64::max) / size;
    let apart = boundary.zip(&divergence, |b, d| (b - d).abs());
    let apart = apart.pixels().iter().map(|p| p.max_element()).fold(0.0, f64::max) / size;
    let sampled = method.forward(&case.scene, &case.motion, &case.film).expect("valid");
    let (found, error) = found(&total, &sampled);
    assert!(!held || (found - 1.0).abs() < 5.0 * error && error < 0.1, "{found} ± {error}");
    [extreme.into(), power_of_ten(edge), power_of_ten(apart), percent(found, error)]
}

/// The fraction of the exact derivative that the samples find, by regression over all pixels and channels,
/// with its standard error. Channels share their samples: in the worst case their errors add.
fn found(exact: &Image, sampled: &GradientImage) -> (f64, f64) {
    assert!(sampled.non_finite.is_empty());
    let squares = exact.dot(exact);
    let errors = exact.zip(&sampled.standard_error, |x, e| (x * e).abs());
    let variance: f64 = errors.pixels().iter().map(|p| p.element_sum().powi(2)).sum();
    (exact.dot(&sampled.mean) / squares, variance.sqrt() / squares)
}

fn percent(found: f64, error: f64) -> String {
    assert!(found.is_finite() && error.is_finite());
    format!("finds {:.0}% ± {:.0}% of it", 100.0 * found, 100.0 * error)
}

fn method() -> WarpedArea {
    WarpedArea { samples: 4000, seed: 4, ..WarpedArea::default() }
}

/// A half-plane that moves with velocity 1 along x, up to x = 1.
fn half_plane(size: f64) -> Scene {
    let corners = [(1.0 - size, -size), (1.0, -size), (1.0, size), (1.0 - size, size)];
    let shape = Shape::new(polygon(&corners, 1.0, DVec2::ZERO), Shade::constant(DVec3::ONE));
    Scene::new(DVec3::ZERO, vec![shape]).expect("a scene")
}

/// The largest relative difference of (V, ∇·V/√κ) from κ = 1, at the same distances in kernel widths
/// and with the same random numbers: exactly 0 in exact arithmetic.
fn scale_invariance(kappa: f64) -> f64 {
    let mut worst = 0.0_f64;
    let warp = Warp { debias: Debias::Consistent { rays: 16 }, ..Warp::default() };
    for seed in 0..200 {
        let field = |kappa: f64| {
            let width = kappa.sqrt().recip();
            let scene = half_plane(100.0 * width);
            let u = DVec2::new(1.0 + width * (seed as f64 / 100.0 - 1.005), 0.0);
            let stencil = scene_stencil(&scene, &warp, kappa, u, &mut stream(seed, &[]));
            let field = stencil.field(|hit| if hit.is_some() { DVec2::X } else { DVec2::ZERO });
            (field.value.x, field.divergence * width)
        };
        let ((v, d), (w, e)) = (field(1.0), field(kappa));
        assert!(w.is_finite() && e.is_finite());
        worst = worst.max((v - w).abs()).max((d - e).abs() / (1.0 + d.abs()));
    }
    worst
}

/// Error of V near a boundary, at a distance from it, with many rays.
fn boundary_error(distance: f64) -> f64 {
    let scene = half_plane(100.0);
    let warp = Warp { debias: Debias::Consistent { rays: 1 << 14 }, ..Warp::default() };
    let error = |side: f64| {
        let u = DVec2::new(1.0 + side * distance, 0.0);
        let stencil = scene_stencil(&scene, &warp, 44.0, u, &mut stream(1, &[]));
        let field = stencil.field(|hit| if hit.is_some() { DVec2::X } else { DVec2::ZERO });
        assert!(field.value.is_finite() && field.divergence.is_finite());
        (field.value.x - 1.0).abs()
    };
    error(1.0).max(error(-1.0))
}

fn rows() -> Vec<Row> {
    let mut rows = vec![];
    for exponent in [-30, 0, 30] {
        let scale = 2.0_f64.powi(exponent);
        rows.push(row(
            format!("scene and film scaled by 2^{exponent} ≈ {scale:.0e}"),
            pair(scale, DVec2::ZERO),
            &method(),
            true,
        ));
    }
    for offset in [1e3, 1e6, 1e9] {
        let at = DVec2::new(offset, -offset);
        rows.push(row(format!("{offset:.0e} pixels away from the origin"), pair(1.0, at), &method(), true));
    }
    for kappa in [1.0, 100.0, 1e4] {
        let samples = if kappa > 1e3 { 40_000 } else { 4000 };
        let construction = Construction::Auxiliary { warp: Warp::default(), kappa };
        let method = WarpedArea { construction, samples, ..method() };
        rows.push(row(format!("κ = {kappa:.0e} per square pixel"), pair(1.0, DVec2::ZERO), &method, true));
    }
    for kappa in [1e6, 1e9, 1e12] {
        let extreme = format!("κ = {kappa:.0e}, V and ∇·V against κ = 1 scaled");
        rows.push([extreme, "–".into(), "–".into(), power_of_ten(scale_invariance(kappa))]);
    }
    for aspect in [1e3, 1e6, 1e9] {
        let half = 2.0 / aspect;
        let needle = polygon(&[(1.5, 2.5 - half), (5.5, 2.9), (1.5, 2.5 + half)], 1.0, DVec2::ZERO);
        let shape = Shape::new(needle, Shade::constant(DVec3::ONE));
        let scene = Scene::new(DVec3::ZERO, vec![shape]).expect("a scene");
        // It widens, so that the derivative of its image does not vanish with its width.
        let motion = Motion::vertex(0, 2, DVec2::Y);
        let film = Film::new(7, 5, Filter::Tent).expect("a film");
        let case = Case { scene, motion, film, label: format!("aspect {aspect}") };
        rows.push(row(format!("a sliver of aspect {aspect:.0e} that widens"), case, &method(), false));
    }
    for gap in [1e-6, 1e-9, 1e-12, 1e-15] {
        let right =
            polygon(&[(3.4375, 1.25), (6.25, 1.25), (6.25, 3.75), (3.4375, 3.75)], 1.0, DVec2::X * gap);
        let left = polygon(&[(1.25, 1.5), (3.4375, 1.5), (3.4375, 3.5), (1.25, 3.5)], 1.0, DVec2::ZERO);
        let shapes = [left, right].map(|p| Shape::new(p, Shade::constant(DVec3::new(0.9, 0.4, 0.2))));
        let scene = Scene::new(DVec3::ZERO, shapes.to_vec()).expect("a scene");
        let motion = Motion::translate([0], DVec2::new(-0.5, 0.25));
        let film = Film::new(7, 5, Filter::Tent).expect("a film");
        let case = Case { scene, motion, film, label: format!("gap {gap}") };
        rows.push(row(format!("edges {gap:.0e} apart that part"), case, &method(), false));
    }
    for distance in [1e-3, 1e-9, 1e-15] {
        let extreme = format!("u within {distance:.0e} of a boundary: V against v, 2^14 rays");
        rows.push([extreme, "–".into(), "–".into(), power_of_ten(boundary_error(distance))]);
    }
    let one = Warp { debias: Debias::Multilevel { rays: 1, first: 0.6, ratio: 0.4 }, ..Warp::default() };
    rows.push(row(
        "one auxiliary ray, debiased",
        pair(1.0, DVec2::ZERO),
        &WarpedArea { construction: one.into(), samples: 16_000, ..method() },
        true,
    ));
    rows
}

#[test]
fn the_table_shows_what_is_measured_at_the_extremes() {
    let header =
        ["extreme", "edge integral against the oracle", "divergence against edge integral", "warped area"];
    results::table("stability table", header, rows());
}
