//! Tests of the closed forms against quadrature and differences, at all scales and in all degenerate
//! positions.

use glam::DVec2;

use super::{Jump, JumpMean};
use crate::random::{Stream, open01, stream};
use crate::warp::{Field, Line, LinearField as _, Stencil, assert_transposed};

fn point(rng: &mut Stream) -> DVec2 {
    DVec2::new(2.0 * open01(rng) - 1.0, 2.0 * open01(rng) - 1.0)
}

/// ∫ ḃ K db and ∫ K db by the midpoint rule, in x = s sinh t where 1/(s² + x²) is smooth.
fn by_quadrature(
    u: DVec2,
    [a, b]: [DVec2; 2],
    [v, w]: [DVec2; 2],
    [reach, softness]: [f64; 2],
) -> (DVec2, f64) {
    let length = (b - a).length();
    let along = (b - a) / length;
    let (first, s) = ((a - u).dot(along), (a - u).perp_dot(along).hypot(softness));
    let [low, high] = [first, first + length].map(|x| (x / s).asinh());
    let steps = 200_000;
    let (mut sum, mut whole) = (DVec2::ZERO, 0.0);
    for i in 0..steps {
        let t = low + (high - low) * (f64::from(i) + 0.5) / f64::from(steps);
        let x = s * t.sinh();
        let kernel = (2.0 / (s * s + x * x) - 2.0 / (reach * reach)).max(0.0);
        let mass = kernel * s * t.cosh() * (high - low) / f64::from(steps);
        whole += mass;
        sum += mass * v.lerp(w, (x - first) / length);
    }
    (sum, whole)
}

/// V and ∇·V of segments whose ends have velocities.
fn of(u: DVec2, segments: &[([DVec2; 2], [DVec2; 2])], reach: f64) -> Field<DVec2> {
    softened(u, segments, [reach, 0.0])
}

fn softened(u: DVec2, segments: &[([DVec2; 2], [DVec2; 2])], [reach, softness]: [f64; 2]) -> Field<DVec2> {
    let jumps = segments.iter().map(|&(place, moved_by)| Jump { place, moved_by, softness });
    JumpMean { reach }.of_segments(u, jumps).field(|v| *v)
}

#[test]
fn a_mean_over_segments_is_the_quotient_of_its_integrals() {
    let mut rng = stream(1, &[]);
    let (mut worst, mut met) = (0.0_f64, 0);
    for _ in 0..60 {
        let segments: Vec<_> = (0..2)
            .map(|_| ([point(&mut rng), point(&mut rng)], [point(&mut rng), point(&mut rng)]))
            .collect();
        let (u, reach) = (point(&mut rng), 0.2 + open01(&mut rng));
        let sizes = [reach, if open01(&mut rng) < 0.5 { 0.0 } else { 0.5 * reach * open01(&mut rng) }];
        let (mut sum, mut whole) = (DVec2::ZERO, std::f64::consts::TAU / reach);
        for (ends, velocities) in &segments {
            let (v, k) = by_quadrature(u, *ends, *velocities, sizes);
            sum += v;
            whole += k;
        }
        let found = softened(u, &segments, sizes).value;
        met += usize::from(found != DVec2::ZERO);
        worst = worst.max((found - sum / whole).length());
    }
    println!("{met} means, off by at most {worst:.1e}");
    assert!(met > 40 && worst < 1e-8, "{met} {worst:e}");
}

#[test]
fn divergences_are_those_of_differences_at_all_scales() {
    let mut worst = 0.0_f64;
    for scale in [1e-120, 1e-6, 1.0, 1e6, 1e120] {
        let mut rng = stream(2, &[]);
        for _ in 0..400 {
            let segments: Vec<_> = (0..3)
                .map(|_| {
                    (
                        [point(&mut rng), point(&mut rng)].map(|p| scale * p),
                        [point(&mut rng), point(&mut rng)],
                    )
                })
                .collect();
            let (u, reach) = (scale * point(&mut rng), scale * (0.3 + open01(&mut rng)));
            let h = 1e-6 * scale;
            let sizes = [reach, if open01(&mut rng) < 0.5 { 0.0 } else { 0.3 * reach }];
            let at = |d: DVec2| softened(u + h * d, &segments, sizes).value;
            let slopes = [DVec2::X, DVec2::Y].map(|e| (at(e) - at(-e)).dot(e) / (2.0 * h));
            let found = softened(u, &segments, sizes).divergence;
            // Third derivatives are large near an edge: h must resolve the field.
            let size = scale * found.abs() + 1.0;
            worst = worst.max(scale * (found - slopes[0] - slopes[1]).abs() / (size * size * size));
        }
    }
    println!("∇·V off by at most {worst:.1e}");
    assert!(worst < 1e-7, "{worst:e}");
}

/// Degenerate positions: next to a segment, on it, on its line beyond an end, and at the end. Values are
/// finite, and correct where a limit exists.
#[test]
fn degenerate_places_are_exact() {
    let segment = [([DVec2::ZERO, DVec2::X], [DVec2::new(0.3, 1.0), DVec2::new(-0.7, 2.0)])];
    for t in [0.1, 0.5, 0.9] {
        for height in [0.0, 1e-300, 1e-20, -1e-12] {
            let f = of(DVec2::new(t, height), &segment, 0.4);
            let v = segment[0].1[0].lerp(segment[0].1[1], t);
            assert!((f.value - v).length() < 1e-10, "{t} {height}: {f:?}");
            assert!(f.divergence.is_finite(), "{t} {height}: {f:?}");
        }
    }
    // Seen end-on, the limit of the values next to the line.
    for x in [1.0 + 1e-3, 1.1, 1.39, -0.2] {
        let [on, beside] = [0.0, 1e-7].map(|y| of(DVec2::new(x, y), &segment, 0.4));
        let scale = 1.0 + beside.divergence.abs();
        assert!((on.value - beside.value).length() < 1e-5, "{x}: {on:?} {beside:?}");
        assert!((on.divergence - beside.divergence).abs() < 1e-2 * scale, "{x}: {on:?} {beside:?}");
    }
    let none = of(DVec2::new(1.5, 0.0), &segment, 0.4);
    assert_eq!((none.value, none.divergence), (DVec2::ZERO, 0.0));
    let none = of(DVec2::new(0.1, 0.2), &[([DVec2::X; 2], [DVec2::Y; 2])], 0.4);
    assert_eq!((none.value, none.divergence), (DVec2::ZERO, 0.0), "a segment without length");
    let end = of(DVec2::X, &segment, 0.4);
    assert!(end.value.is_finite() && end.divergence.is_finite());
}

/// On the line of a segment, far from it: the closed form and its series agree where the code switches
/// between them.
#[test]
fn far_along_the_line_digits_are_kept() {
    let segment = [([DVec2::ZERO, DVec2::X], [DVec2::Y, DVec2::new(0.5, -1.0)])];
    let at = |height: f64| of(DVec2::new(3.0, height), &segment, 10.0).divergence;
    let reference = at(1e-3);
    for height in [1e-5, 1e-9, 1e-12, 1e-15] {
        assert!((at(height) - reference).abs() < 1e-3 * reference.abs(), "{height}: {}", at(height));
    }
    let meet = 2.0 * super::segment::SERIES.sqrt();
    let [below, above] = [1.0 - 1e-9, 1.0 + 1e-9].map(|f| at(f * meet));
    assert!((below - above).abs() < 1e-8 * above.abs(), "{below} {above}");
}

/// ∇·V tends to that edge's slope as u approaches an edge, without loss of digits.
#[test]
fn the_divergence_does_not_lose_its_digits_near_an_edge() {
    let corners = [DVec2::new(1.0, 0.3), DVec2::new(-1.2, 0.8), DVec2::new(0.4, -2.0)];
    let v = [DVec2::new(1.0, 0.3), DVec2::new(0.9, -0.5), DVec2::new(0.2, 0.7)];
    let sides = [0, 1, 2].map(|i| ([corners[i], corners[(i + 1) % 3]], [v[i], v[(i + 1) % 3]]));
    let middle = corners[0].lerp(corners[1], 0.4);
    let inward = (corners[2] - middle).normalize();
    let at = |distance: f64| of(middle + distance * inward, &sides, 1.5).divergence;
    let reference = at(1e-8);
    for (distance, tolerance) in [(1e-9, 1e-5), (1e-11, 1e-4), (1e-13, 1e-2)] {
        let found = at(distance);
        assert!((found - reference).abs() < tolerance * reference.abs(), "{distance}: {found} {reference}");
    }
}

#[test]
fn cutting_an_edge_changes_nothing() {
    let mut rng = stream(3, &[]);
    for _ in 0..200 {
        let (a, b, u) = (point(&mut rng), point(&mut rng), point(&mut rng));
        let (v, w) = (point(&mut rng), point(&mut rng));
        let t = open01(&mut rng);
        let (middle, between) = (a.lerp(b, t), v.lerp(w, t));
        let whole = of(u, &[([a, b], [v, w])], 0.8);
        let cut = of(u, &[([a, middle], [v, between]), ([middle, b], [between, w])], 0.8);
        assert!((whole.value - cut.value).length() < 1e-9, "{whole:?} {cut:?}");
        assert!((whole.divergence - cut.divergence).abs() < 1e-6 * (1.0 + cut.divergence.abs()));
    }
}

/// V and dV/du of points with velocities.
fn on_line(u: f64, points: &[(f64, f64)], reach: f64) -> Field<f64> {
    softened_on_line(u, points, [reach, 0.0])
}

fn softened_on_line(u: f64, points: &[(f64, f64)], [reach, softness]: [f64; 2]) -> Field<f64> {
    let jumps = points.iter().map(|&(b, moved_by)| Jump { place: b - u, moved_by, softness });
    let stencil: Stencil<Line, f64> = JumpMean { reach }.of_points(jumps);
    stencil.field(|v| *v)
}

/// Where discontinuities of different velocities cross, and in gaps between them, ∇·V of the exact mean is
/// unbounded. For the softened mean it is bounded by C |v|/ε, with C from this scan of 10⁵ positions around a
/// crossing and a gap of any width.
#[test]
fn softened_divergences_are_bounded() {
    let (mut rng, reach) = (stream(21, &[]), 1.2);
    let moving = [DVec2::X, DVec2::Y, -DVec2::X, -DVec2::Y];
    for softness in [0.02, 0.1, 0.4] {
        let (mut largest, mut exact, mut line) = (0.0_f64, 0.0_f64, 0.0_f64);
        for _ in 0..30_000 {
            let gap = 10_f64.powf(-12.0 * open01(&mut rng));
            let across = [DVec2::new(0.0, -1.0), DVec2::new(0.0, 1.0)];
            let beside = across.map(|p| p + gap * DVec2::X);
            let crossing = [DVec2::new(-1.0, 0.1), DVec2::new(1.0, 0.1)];
            let velocities = [0, 1, 2].map(|i| [moving[i]; 2]);
            let segments = [(across, velocities[0]), (beside, velocities[1]), (crossing, velocities[2])];
            let u = DVec2::new(gap * open01(&mut rng), 0.1 + gap * (open01(&mut rng) - 0.5));
            largest = largest.max(softened(u, &segments, [reach, softness]).divergence.abs());
            exact = exact.max(of(u, &segments, reach).divergence.abs());
            let points = [(0.0, 1.0), (gap, -1.0)];
            line = line.max(softened_on_line(u.x, &points, [reach, softness]).divergence.abs());
        }
        println!(
            "ε = {softness}: |∇·V| ε ≤ {:.2} in the plane, {:.2} on the line",
            softness * largest,
            softness * line
        );
        assert!(softness * largest < 2.0 && softness * line < 2.0 && exact > 1e8, "{largest} {line} {exact}");
    }
}

#[test]
fn scatter_is_the_transpose_of_field() {
    let mut rng = stream(4, &[]);
    for _ in 0..50 {
        let segments: Vec<_> = (0..3)
            .map(|i: i32| Jump {
                place: [point(&mut rng), point(&mut rng)],
                moved_by: [point(&mut rng), point(&mut rng)],
                softness: 0.1 * f64::from(i),
            })
            .collect();
        let plane = JumpMean { reach: 0.9 }.of_segments(point(&mut rng), segments);
        assert_transposed(&plane, (DVec2::new(0.3, -1.2), 0.7), |v| *v, DVec2::dot);
        let points = [0.0, 0.1, 0.2].map(|softness| Jump {
            place: point(&mut rng).x,
            moved_by: point(&mut rng).y,
            softness,
        });
        let line = JumpMean { reach: 0.9 }.of_points(points);
        assert_transposed(&line, (0.3, 0.7), |v| *v, |a, b| a * b);
    }
}

#[test]
fn a_reach_must_be_positive_and_finite() {
    assert_eq!(JumpMean { reach: 1.2 }.check(), Ok(()));
    for reach in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(JumpMean { reach }.check().is_err(), "{reach}");
    }
}

#[test]
fn one_point_makes_a_tent() {
    for u in [-0.3, 0.0, 0.1, 0.5, 0.7] {
        let f = on_line(u, &[(0.2, 3.0)], 0.4);
        let s = (u - 0.2_f64).abs();
        assert!((f.value - 3.0 * (1.0 - s / 0.4).max(0.0)).abs() < 1e-14, "{u}: {f:?}");
        let slope = if s < 0.4 { (0.2 - u).signum() * 3.0 / 0.4 } else { 0.0 };
        assert!((f.divergence - slope).abs() < 1e-12, "{u}: {f:?}");
    }
}

#[test]
fn means_over_points_have_their_slopes_and_their_limits() {
    let points = [(0.2, 3.0), (0.45, -1.0), (0.9, 0.5), (7.0, 2.0)];
    for scale in [1e-150, 1.0, 1e150] {
        let scaled = points.map(|(b, v)| (scale * b, v));
        for u in [-0.1, 0.3, 0.31, 0.6, 1.2] {
            let h = 1e-6 * scale;
            let at = |d: f64| on_line(scale * u + d, &scaled, 0.5 * scale);
            let slope = (at(h).value - at(-h).value) / (2.0 * h);
            let found = at(0.0).divergence;
            assert!(
                scale * (slope - found).abs() < 1e-7 * (1.0 + scale * found.abs()),
                "{u}: {slope} {found}"
            );
        }
        for (b, v) in scaled {
            let f = on_line(b, &scaled, 0.5 * scale);
            assert!((f.value - v).abs() < 1e-12 && f.divergence.is_finite(), "{b}: {f:?}");
        }
    }
}
